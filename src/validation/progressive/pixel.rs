//! The radius of each pixel, inferred from the radiance that the pixel shows.

use std::f64::consts::PI;

use glam::DVec3;

use super::{Image, PER_PIXEL, sppm};
use crate::{
    law::{Check, Effort, Finding, Law},
    render::Renderer,
    validation::setup::{PixelCentres, renderer},
};

/// The law of a pixel's radius.
pub const LAWS: &[Law] = &[Law {
    name: "progressive/pixel",
    claim: "The radiance of each pixel corresponds to an integer number of photons on its own side of a thin wall. Each photon contributes \
            φ ρ / π over the area of the pixel's disc. The radius shrinks by this number alone, also after the render is resumed from \
            the saved integrator state.",
    source: "L π / ρ = n φ / π R² solved for n; Hachisuka and Jensen 2009, eq. (3) and (4), step by step",
    check: Check::Analytic(pixels),
}];

const ALPHA: f64 = 0.6;
const RADIUS: f64 = 0.23;
const ALBEDO: f64 = 0.7;
const PHOTONS: u32 = 4000;
const PASSES: u32 = 12;
/// Intensities of the lights in front of the wall and behind it.
const INTENSITIES: [f64; 2] = [3.0, 2.0];
/// The number of pixels on each side of the wall.
const PIXELS: usize = 12;

/// A renderer with an oblique camera on one side of the wall. Its pixels view points at increasing distances from the
/// lights.
fn side(side: f64) -> Renderer {
    let integrator = sppm(&format!(
        "integer photon_count={PHOTONS}, float initial_radius={RADIUS}, float alpha={ALPHA}, string direct=map, integer \
         max_depth=2, string kernel=constant, string radius_schedule={PER_PIXEL}"
    ));
    let light = |z: f64, intensity: f64| {
        format!(
            r#"<emitter type="point"><point name="position" x="0.1" y="-0.2" z="{z}"/><rgb name="intensity" value="{intensity}"/></emitter>"#
        )
    };
    let wall = format!(
        r#"<shape type="rectangle"><transform name="to_world"><scale value="30"/></transform><bsdf type="twosided">
           <bsdf type="diffuse"><rgb name="reflectance" value="{ALBEDO}"/></bsdf></bsdf></shape>"#
    );
    let scene = light(0.9, INTENSITIES[0]) + &light(-0.7, INTENSITIES[1]) + &wall;
    let target = DVec3::new(1.5, 0.05, 0.0);
    let position = target + DVec3::new(0.0, -0.45, 1.2) * side;
    let camera = PixelCentres { position, target, fov: 94.0, columns: PIXELS as u32, rows: 1 };
    renderer(&integrator, &camera.xml(), &scene)
}

fn pixels(_: Effort) -> Vec<Finding> {
    let [mut shrunk, mut fraction, mut error] = [0.0_f64; 3];
    for renderer in [side(1.0), side(-1.0)] {
        let found = of_side(&renderer);
        shrunk += found[0];
        fraction = fraction.max(found[1]);
        error = error.max(found[2]);
    }
    vec![
        Finding::value("pixels that found photons", shrunk, 2.0 * PIXELS as f64, 0.0),
        // Powers and squared distances are stored in f32: each of a few hundred photons has an error of 6e-8.
        Finding::error("distance of photon counts from integers", fraction, 1e-4),
        Finding::error("squared radii", error, 1e-12),
    ]
}

/// The number of pixels that found photons, the largest distance of a photon count from an integer, and the largest
/// relative error of a squared radius.
fn of_side(renderer: &Renderer) -> [f64; 3] {
    let power = 4.0 * PI * (INTENSITIES[0] + INTENSITIES[1]) / f64::from(PHOTONS);
    let mut image = Image::new(renderer, PASSES, 71, 0);
    // Each pixel's squared radius relative to the first pass, and its accumulated photon count.
    let mut pixels = [(1.0, 0.0); PIXELS];
    let [mut fraction, mut error] = [0.0_f64; 2];
    for pass in 0..PASSES {
        if pass == PASSES / 2 {
            image.resume();
        }
        for ((squared, kept), radiance) in pixels.iter_mut().zip(image.pass()) {
            let count = radiance.y * PI / ALBEDO * PI * RADIUS * RADIUS * *squared / power;
            let found = count.round();
            fraction = fraction.max((count - found).abs());
            if found > 0.0 {
                let shrink = (*kept + ALPHA * found) / (*kept + found);
                (*squared, *kept) = (*squared * shrink, *kept + ALPHA * found);
            }
        }
        for (squared, (expected, _)) in image.squares().iter().zip(pixels) {
            error = error.max((squared / expected - 1.0).abs());
        }
    }
    let shrunk = pixels.iter().filter(|(squared, _)| *squared < 1.0).count();
    [shrunk as f64, fraction, error]
}
