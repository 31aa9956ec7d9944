//! Flux where light is even.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{ERROR_DRIVEN, Image, PER_PASS, PER_PIXEL, sppm};
use crate::{
    law::{Effort, Finding, Law},
    math::{Ray, Rgb, rng::Stream, warp},
    stats::Moments,
    validation::{
        rooms::series,
        setup::{ALBEDO, GLASS, RADIANCE, Setup, room},
    },
};

/// This law.
pub const LAWS: &[Law] = &[Law {
    name: "progressive/flux",
    claim: "In a closed box that shines with E and reflects ρ each single pass, whatever its radius, shows E / (1 - ρ), and up to a greatest depth \
            E (1 + ρ + ...): on the walls, in a mirror, in rough metal and through glass, by every kernel, with a radius for each pixel, by its finds or its error, and for each pass, with light \
            straight from lights found by connections and in photons.",
    source: "geometric series; an estimate by a normed kernel is without bias where light is even, whatever its radius",
    check: furnace,
}];

/// Of the first pass, where the edges of the box are 3.4 m.
const RADIUS: f64 = 0.4;
const PHOTONS: u32 = 1500;
/// Passes that are looked at.
const PASSES: [u32; 4] = [0, 1, 5, 50];
/// The schedule, how light straight from lights is found, the kernel, and the greatest depth.
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

/// What is seen: where it is, how far around, what it is made of, and what it reflects.
struct Thing {
    name: &'static str,
    centre: DVec3,
    /// The least cosine to the normal; None for what has no front.
    least_cos: Option<f64>,
    bsdf: &'static str,
    reflectance: Rgb,
}

/// So small that the light of the box stays even but for a millionth.
const SIZE: f64 = 0.001;

/// Metal of this roughness sends nothing below its horizon at these angles.
const THINGS: [Thing; 3] = [
    Thing {
        name: "in a mirror",
        centre: DVec3::new(0.3, -0.4, 0.2),
        least_cos: Some(0.4),
        bsdf: r#"<bsdf type="conductor"><rgb name="specular_reflectance" value="0.9, 0.6, 0.3"/></bsdf>"#,
        reflectance: Rgb::new(0.9, 0.6, 0.3),
    },
    Thing {
        name: "in rough metal",
        centre: DVec3::new(-0.5, 0.3, -0.6),
        least_cos: Some(0.4),
        bsdf: r#"<bsdf type="metal"><rgb name="reflectance" value="0.5, 0.7, 0.9"/><float name="roughness" value="0.35"/></bsdf>"#,
        reflectance: Rgb::new(0.5, 0.7, 0.9),
    },
    Thing {
        name: "through glass",
        centre: DVec3::new(0.7, 0.8, -0.1),
        least_cos: None,
        bsdf: GLASS,
        reflectance: Rgb::ONE,
    },
];
/// Pixels for the wall and for each thing.
const PIXELS: usize = 24;

fn setup((schedule, direct, kernel, max_depth): Case) -> Setup {
    let integrator = sppm(&format!(
        "integer photon_count={PHOTONS}, float initial_radius={RADIUS}, float alpha=0.6, string direct={direct}, string \
         kernel={kernel}, string radius_schedule={schedule}, integer max_depth={max_depth}"
    ));
    let things = THINGS.map(|thing| {
        let (shape, DVec3 { x, y, z }) = (if thing.least_cos.is_some() { "disk" } else { "sphere" }, thing.centre);
        format!(
            r#"<shape type="{shape}"><transform name="to_world"><scale value="{SIZE}"/><translate x="{x}" y="{y}" z="{z}"/></transform>
               {}</shape>"#,
            thing.bsdf
        )
    });
    let pixels = (PIXELS * (THINGS.len() + 1)) as u32;
    Setup::of_pixels(&integrator, pixels, &(room("cube", RADIANCE, ALBEDO) + &things.concat()))
}

/// The ray of a pixel, of those of the wall first.
fn ray(pixel: usize) -> Ray {
    let mut stream = Stream::at(&[73, pixel as u64]);
    let u = DVec2::new(stream.next_1d(), stream.next_1d());
    let Some(thing) = (pixel / PIXELS).checked_sub(1).map(|which| &THINGS[which]) else {
        return Ray::new(DVec3::new(0.1, 0.2, -0.3), warp::square_to_sphere(u));
    };
    let aside = 0.6 * SIZE * warp::square_to_disc(DVec2::new(stream.next_1d(), stream.next_1d()));
    let from = match thing.least_cos {
        Some(least) => {
            let cos = least + (1.0 - least) * u.x;
            (DVec2::from_angle(TAU * u.y) * (1.0 - cos * cos).sqrt()).extend(cos)
        }
        None => warp::square_to_sphere(u),
    };
    Ray::new(thing.centre + aside.extend(0.0) + 0.05 * from, -from)
}

/// By pass, then by what is seen: the mean over pixels and channels of the radiance over what it should be.
type Ratios = [[f64; THINGS.len() + 1]; PASSES.len()];

fn furnace(effort: Effort) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (which, case) in CASES.into_iter().enumerate() {
        let setup = setup(case);
        let found: Vec<Ratios> = (0..effort.samples(24))
            .into_par_iter()
            .map(|number| ratios(&mut Image::new(&setup, 74 + which as u64, u64::from(number)), case))
            .collect();
        let (schedule, direct, kernel, max_depth) = case;
        let depth = if max_depth < 0 { String::new() } else { format!(", depth {max_depth}") };
        // How deep paths within glass are is a matter of chance.
        let seen = THINGS.iter().filter(|thing| max_depth < 0 || thing.least_cos.is_some()).map(|thing| thing.name);
        for (at, pass) in PASSES.into_iter().enumerate() {
            for (which, name) in ["on the walls"].into_iter().chain(seen.clone()).enumerate() {
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
    // A thing takes a segment.
    let truth = [0, 1].map(|segments| series(RADIANCE, ALBEDO, (max_depth >= 0).then_some(max_depth - segments)));
    // Without a memory a pass needs none before it.
    let all = (0..=PASSES[PASSES.len() - 1]).filter(|pass| schedule != PER_PASS || PASSES.contains(pass));
    for pass in all {
        image.pass(pass);
        let at = PASSES.iter().position(|known| *known == pass);
        for pixel in 0..PIXELS * (THINGS.len() + 1) {
            let radiance = image.radiance(pixel, &ray(pixel), pass);
            let which = pixel / PIXELS;
            let expected = if which == 0 { truth[0] } else { truth[1] * THINGS[which - 1].reflectance };
            if let Some(at) = at {
                ratios[at][which] += (radiance / expected).element_sum() / (3 * PIXELS) as f64;
            }
        }
    }
    ratios
}
