//! Direct light reflected by rough metal.

use glam::DVec3;

use super::{Image, PER_PASS, sppm};
use crate::{
    law::{Check, Effort, Finding, Law},
    math::Rgb,
    render::Renderer,
    stats::Moments,
    validation::setup::{CHANNELS, PixelCentres, RADIANCE, area, renderer},
};

/// The law of a light reflected by rough metal.
pub const LAWS: &[Law] = &[Law {
    name: "progressive/glossy",
    claim: "Rough metal of reflectance R reflects a spherical light of radiance L, centred in the mirror direction, with the radiance \
            R L (1 - μ κ^(3/2) / r³), for three sizes of the light. This holds with emitter and BSDF sampling combined, and with BSDF \
            sampling alone.",
    source: "the fraction of a lobe of roughness r inside a cone of cosine μ, with κ = r² - 1 + μ²",
    check: Check::Analytic(reflected_light),
}];

const ROUGHNESS: f64 = 0.35;
const REFLECTANCE: Rgb = Rgb::new(0.5, 0.7, 0.9);
/// The distance of the spherical light.
const DISTANCE: f64 = 2.5;
/// Cosines of the half-angles of the cones that the light fills.
const COSINES: [f64; 3] = [0.995, 0.98, 0.95];

/// A renderer whose pixels all view the same point.
fn scene(direct: &str, cos: f64, pixels: u32) -> Renderer {
    let integrator = sppm(&format!(
        "integer photon_count=100, float initial_radius=0.1, string direct={direct}, integer max_depth=2, string \
         radius_schedule={PER_PASS}"
    ));
    let DVec3 { x, y, z } = DISTANCE * DVec3::new(-DIRECTION.x, -DIRECTION.y, DIRECTION.z);
    let radius = DISTANCE * (1.0 - cos * cos).sqrt();
    let Rgb { x: red, y: green, z: blue } = REFLECTANCE;
    let scene = format!(
        r#"<shape type="disk"><transform name="to_world"><scale value="0.01"/></transform><bsdf type="metal">
           <rgb name="reflectance" value="{red}, {green}, {blue}"/><float name="roughness" value="{ROUGHNESS}"/></bsdf></shape>
           <shape type="sphere"><point name="center" x="{x}" y="{y}" z="{z}"/><float name="radius" value="{radius}"/>{}</shape>"#,
        area(RADIANCE)
    );
    let rows = pixels / COLUMNS;
    let camera = PixelCentres { position: 0.1 * DIRECTION, target: DVec3::ZERO, fov: 1e-6, columns: COLUMNS, rows };
    renderer(&integrator, &camera.xml(), &scene)
}

const COLUMNS: u32 = 100;
/// The unit direction from the metal to the camera.
const DIRECTION: DVec3 = DVec3::new(0.48, -0.36, 0.8);

fn reflected_light(effort: Effort) -> Vec<Finding> {
    let samples = effort.samples(20_000);
    let mut findings = Vec::new();
    for direct in ["traced", "map"] {
        for cos in COSINES {
            let radiances = Image::new(&scene(direct, cos, samples), 1, 76, 0).pass();
            let found = [0, 1, 2].map(|i| radiances.iter().map(|radiance| radiance[i]).collect::<Moments>());
            let kappa = ROUGHNESS * ROUGHNESS - 1.0 + cos * cos;
            let fraction = 1.0 - cos * kappa.powf(1.5) / ROUGHNESS.powi(3);
            for i in 0..3 {
                let subject = format!("{direct}, μ = {cos}, {}", CHANNELS[i]);
                findings.push(Finding::mean(subject, &found[i], REFLECTANCE[i] * RADIANCE[i] * fraction));
            }
        }
    }
    findings
}
