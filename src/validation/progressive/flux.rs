//! Progressive photon mapping under uniform light.

use glam::DVec3;
use rayon::prelude::*;

use super::{ERROR_DRIVEN, Image, PER_PASS, PER_PIXEL, sppm};
use crate::{
    law::{Check, Effort, Finding, Law},
    math::Rgb,
    render::Renderer,
    stats::Moments,
    validation::{
        rooms::series,
        setup::{ALBEDO, GLASS, PixelCentres, RADIANCE, renderer, room, triple},
    },
};

/// The law of uniform light.
pub const LAWS: &[Law] = &[Law {
    name: "progressive/flux",
    claim: "In a closed box whose walls emit the radiance E and have the albedo ρ, every single pass has the mean radiance E / (1 - ρ), or \
            E (1 + ρ + ...) up to a max_depth, whatever its radius. This holds on the walls, in a mirror, in rough metal and through \
            glass; for each kernel; for each radius schedule (per pass, per pixel, error-driven); and with direct light traced or from \
            the map.",
    source: "geometric series; an estimate with a normalized kernel is unbiased under uniform light, whatever its radius",
    check: Check::Analytic(furnace),
}];

/// The radius of the first pass. The box has edges of length 3.4.
const RADIUS: f64 = 0.4;
const PHOTONS: u32 = 1500;
/// The passes that are tested.
const PASSES: [u32; 4] = [0, 1, 5, LAST];
const LAST: u32 = 50;
/// The values of `radius_schedule`, `direct`, `kernel` and `max_depth`.
type Case = (&'static str, &'static str, &'static str, i32);
const CASES: [Case; 9] = [
    (PER_PIXEL, "map", "constant", -1),
    (PER_PIXEL, "traced", "epanechnikov", -1),
    (PER_PIXEL, "map", "cone", 4),
    (ERROR_DRIVEN, "map", "epanechnikov", -1),
    (PER_PASS, "map", "epanechnikov", -1),
    (PER_PASS, "traced", "constant", -1),
    (PER_PASS, "traced", "cone", -1),
    (PER_PASS, "map", "constant", 3),
    (PER_PASS, "traced", "epanechnikov", 4),
];

/// The object that fills a quarter of the film.
struct Object {
    name: &'static str,
    shape: &'static str,
    bsdf: &'static str,
    reflectance: Rgb,
}

/// Metal of this roughness reflects nothing below its horizon at these angles.
const OBJECTS: [Object; 3] = [
    Object {
        name: "in a mirror",
        shape: "rectangle",
        bsdf: r#"<bsdf type="conductor"><rgb name="specular_reflectance" value="0.9, 0.6, 0.3"/></bsdf>"#,
        reflectance: Rgb::new(0.9, 0.6, 0.3),
    },
    Object {
        name: "in rough metal",
        shape: "rectangle",
        bsdf: r#"<bsdf type="metal"><rgb name="reflectance" value="0.5, 0.7, 0.9"/><float name="roughness" value="0.35"/></bsdf>"#,
        reflectance: Rgb::new(0.5, 0.7, 0.9),
    },
    Object { name: "through glass", shape: "cube", bsdf: GLASS, reflectance: Rgb::ONE },
];

/// The distance of the objects from the camera. At this distance an object that fills its quarter is so small that it
/// changes the box's uniform light by about a millionth.
const DISTANCE: f64 = 0.01;
/// The film's width in pixels.
const COLUMNS: usize = 12;
/// The film's height in pixels.
const ROWS: usize = 8;
const POSITION: DVec3 = DVec3::new(0.1, 0.2, -0.3);
const TARGET: DVec3 = DVec3::new(0.9, -0.5, 0.4);

/// The quarter of the film that contains a pixel. The last quarter shows the wall.
fn quarter(pixel: usize) -> usize {
    2 * usize::from(pixel / COLUMNS >= ROWS / 2) + usize::from(pixel % COLUMNS >= COLUMNS / 2)
}

fn scene((schedule, direct, kernel, max_depth): Case) -> Renderer {
    let integrator = sppm(&format!(
        "integer photon_count={PHOTONS}, float initial_radius={RADIUS}, float alpha=0.6, string direct={direct}, string \
         kernel={kernel}, string radius_schedule={schedule}, integer max_depth={max_depth}"
    ));
    let half_height = ROWS as f64 / COLUMNS as f64;
    let objects = OBJECTS.iter().enumerate().map(|(quarter, object)| {
        // The camera's x axis points left, its y axis up. Gaps keep rays that leave the glass sideways from hitting
        // other objects.
        let (x, y) = ([0.5, -0.5][quarter % 2], [0.5, -0.5][quarter / 2] * half_height);
        format!(
            r#"<shape type="{}"><transform name="to_world"><scale x="0.49" y="{}" z="0.01"/><rotate x="1" angle="180"/>
               <translate x="{x}" y="{y}" z="{}"/><scale value="{DISTANCE}"/>
               <lookat origin="{}" target="{}" up="0, 0, 1"/></transform>{}</shape>"#,
            object.shape,
            0.49 * half_height,
            if object.shape == "cube" { 1.01 } else { 1.0 },
            triple(POSITION),
            triple(TARGET),
            object.bsdf
        )
    });
    let scene = room("cube", RADIANCE, ALBEDO) + &objects.collect::<String>();
    let camera =
        PixelCentres { position: POSITION, target: TARGET, fov: 90.0, columns: COLUMNS as u32, rows: ROWS as u32 };
    renderer(&integrator, &camera.xml(), &scene)
}

/// By pass, then by quarter: the mean over pixels and channels of the radiance over its expectation.
type Ratios = [[f64; OBJECTS.len() + 1]; PASSES.len()];

fn furnace(effort: Effort) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (which, case) in CASES.into_iter().enumerate() {
        let renderer = scene(case);
        let found: Vec<Ratios> = (0..effort.samples(24))
            .into_par_iter()
            .map(|number| ratios(&mut Image::new(&renderer, LAST + 1, 74 + which as u64, u64::from(number)), case))
            .collect();
        let (schedule, direct, kernel, max_depth) = case;
        let depth = if max_depth < 0 { String::new() } else { format!(", depth {max_depth}") };
        // Path depth inside glass is random, so glass has no expectation at a finite max_depth.
        let names = OBJECTS.iter().filter(|object| max_depth < 0 || object.shape != "cube").map(|object| object.name);
        for (at, pass) in PASSES.into_iter().enumerate() {
            for (name, which) in names.clone().zip(0..).chain([("on the walls", OBJECTS.len())]) {
                let moments: Moments = found.iter().map(|ratios| ratios[at][which]).collect();
                let subject = format!("{schedule}, {direct}, {kernel}{depth}, pass {pass}, {name}");
                findings.push(Finding::mean(subject, &moments, 1.0));
            }
        }
    }
    findings
}

fn ratios(image: &mut Image<'_>, (schedule, _, _, max_depth): Case) -> Ratios {
    let mut ratios = Ratios::default();
    // Scattering at an object adds 1 to the path depth.
    let truth = [0, 1].map(|depth| series(RADIANCE, ALBEDO, (max_depth >= 0).then_some(max_depth - depth)));
    // With a radius per pass the integrator has no state, so other passes are skipped.
    let all = (0..=LAST).filter(|pass| schedule != PER_PASS || PASSES.contains(pass));
    for pass in all {
        image.go_to(pass);
        let radiances = image.pass();
        let Some(at) = PASSES.iter().position(|known| *known == pass) else { continue };
        for (pixel, radiance) in radiances.into_iter().enumerate() {
            let which = quarter(pixel);
            let expected = OBJECTS.get(which).map_or(truth[0], |object| truth[1] * object.reflectance);
            ratios[at][which] += (radiance / expected).element_sum() / (3.0 * (COLUMNS * ROWS / 4) as f64);
        }
    }
    ratios
}
