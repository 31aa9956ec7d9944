//! Flux where light is even.

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

/// This law.
pub const LAWS: &[Law] = &[Law {
    name: "progressive/flux",
    claim: "In a closed box that shines with E and reflects ρ each single pass, whatever its radius, shows E / (1 - ρ), and up to a greatest depth \
            E (1 + ρ + ...): on the walls, in a mirror, in rough metal and through glass, by every kernel, with a radius for each pixel, by its finds or its error, and for each pass, with light \
            straight from lights found by connections and in photons.",
    source: "geometric series; an estimate by a normed kernel is without bias where light is even, whatever its radius",
    check: Check::Analytic(furnace),
}];

/// Of the first pass, where the edges of the box are 3.4 m.
const RADIUS: f64 = 0.4;
const PHOTONS: u32 = 1500;
/// Passes that are looked at.
const PASSES: [u32; 4] = [0, 1, 5, LAST];
const LAST: u32 = 50;
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

/// What is seen in a quarter of the film: what it is made of, and what it reflects.
struct Thing {
    name: &'static str,
    shape: &'static str,
    bsdf: &'static str,
    reflectance: Rgb,
}

/// Metal of this roughness sends nothing below its horizon at these angles.
const THINGS: [Thing; 3] = [
    Thing {
        name: "in a mirror",
        shape: "rectangle",
        bsdf: r#"<bsdf type="conductor"><rgb name="specular_reflectance" value="0.9, 0.6, 0.3"/></bsdf>"#,
        reflectance: Rgb::new(0.9, 0.6, 0.3),
    },
    Thing {
        name: "in rough metal",
        shape: "rectangle",
        bsdf: r#"<bsdf type="metal"><rgb name="reflectance" value="0.5, 0.7, 0.9"/><float name="roughness" value="0.35"/></bsdf>"#,
        reflectance: Rgb::new(0.5, 0.7, 0.9),
    },
    Thing { name: "through glass", shape: "cube", bsdf: GLASS, reflectance: Rgb::ONE },
];

/// Where the things are, from the eye: so near that each fills its quarter and is so small that the light of the box
/// stays even but for a millionth.
const DISTANCE: f64 = 0.01;
/// Of the film.
const COLUMNS: usize = 12;
const ROWS: usize = 8;
const EYE: DVec3 = DVec3::new(0.1, 0.2, -0.3);
const TARGET: DVec3 = DVec3::new(0.9, -0.5, 0.4);

/// The quarter of the film that a pixel is in: the wall's is the last.
fn quarter(pixel: usize) -> usize {
    2 * usize::from(pixel / COLUMNS >= ROWS / 2) + usize::from(pixel % COLUMNS >= COLUMNS / 2)
}

fn scene((schedule, direct, kernel, max_depth): Case) -> Renderer {
    let integrator = sppm(&format!(
        "integer photon_count={PHOTONS}, float initial_radius={RADIUS}, float alpha=0.6, string direct={direct}, string \
         kernel={kernel}, string radius_schedule={schedule}, integer max_depth={max_depth}"
    ));
    let half_height = ROWS as f64 / COLUMNS as f64;
    let things = THINGS.iter().enumerate().map(|(quarter, thing)| {
        // Of the camera's axes x is to the left and y upwards. A gap keeps what leaves the glass beside it from the others.
        let (x, y) = ([0.5, -0.5][quarter % 2], [0.5, -0.5][quarter / 2] * half_height);
        format!(
            r#"<shape type="{}"><transform name="to_world"><scale x="0.49" y="{}" z="0.01"/><rotate x="1" angle="180"/>
               <translate x="{x}" y="{y}" z="{}"/><scale value="{DISTANCE}"/>
               <lookat origin="{}" target="{}" up="0, 0, 1"/></transform>{}</shape>"#,
            thing.shape,
            0.49 * half_height,
            if thing.shape == "cube" { 1.01 } else { 1.0 },
            triple(EYE),
            triple(TARGET),
            thing.bsdf
        )
    });
    let scene = room("cube", RADIANCE, ALBEDO) + &things.collect::<String>();
    let camera = PixelCentres { eye: EYE, target: TARGET, fov: 90.0, columns: COLUMNS as u32, rows: ROWS as u32 };
    renderer(&integrator, &camera.xml(), &scene)
}

/// By pass, then by what is seen: the mean over pixels and channels of the radiance over what it should be.
type Ratios = [[f64; THINGS.len() + 1]; PASSES.len()];

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
        // How deep paths within glass are is a matter of chance.
        let seen = THINGS.iter().filter(|thing| max_depth < 0 || thing.shape != "cube").map(|thing| thing.name);
        for (at, pass) in PASSES.into_iter().enumerate() {
            for (name, which) in seen.clone().zip(0..).chain([("on the walls", THINGS.len())]) {
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
    let all = (0..=LAST).filter(|pass| schedule != PER_PASS || PASSES.contains(pass));
    for pass in all {
        image.go_to(pass);
        let shown = image.pass();
        let Some(at) = PASSES.iter().position(|known| *known == pass) else { continue };
        for (pixel, radiance) in shown.into_iter().enumerate() {
            let which = quarter(pixel);
            let expected = THINGS.get(which).map_or(truth[0], |thing| truth[1] * thing.reflectance);
            ratios[at][which] += (radiance / expected).element_sum() / (3.0 * (COLUMNS * ROWS / 4) as f64);
        }
    }
    ratios
}
