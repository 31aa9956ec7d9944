//! A floor that is lit and seen through a pane of glass.

use std::f64::consts::{FRAC_1_PI, PI};

use glam::{DVec2, DVec3};

use crate::{
    law::{Check, Effort, Finding, Law},
    math::Rgb,
    photon::Kernel,
    render::{Renderer, Replicate},
    stats::{Estimate, Moments},
    validation::{
        setup::{ALBEDO, CHANNELS, GLASS, PixelCentres, ground, renderer},
        theory::{density::Photons, pane::Pane},
    },
};

/// These laws.
pub const LAWS: &[Law] = &[Law {
    name: "caustic/pane",
    claim: "Photon mapping shows a floor under a pane of glass with the radiance of the closed form, at three angles of the eye; \
            with the blur of its kernel exactly, and without it within 2 %.",
    source: "light, glass, floor, glass, eye: (1-R)² of the eye's ray times ρ/π E, E = (1-R)² I sin θ / (x dx/dθ) and \
             x = (h-d) tan θ + d tan θt",
    check: Check::Analytic(seen_through),
}];

pub(in crate::validation) const PANE: Pane = Pane { index: 1.5, thickness: 0.4, height: 2.1, intensity: 1.0 };
pub(in crate::validation) const INTENSITY: Rgb = Rgb::new(3.0, 1.0, 0.4);

/// A point light over a pane over a floor.
pub(crate) fn scene() -> String {
    let (half, height, Rgb { x, y, z }) = (0.5 * PANE.thickness, PANE.height, INTENSITY);
    let pane = format!(
        r#"<shape type="cube"><transform name="to_world"><scale x="40" y="40" z="{half}"/><translate z="0.9"/></transform>{GLASS}</shape>"#
    );
    let light = format!(
        r#"<emitter type="point"><point name="position" x="0" y="0" z="{height}"/><rgb name="intensity" value="{x}, {y}, {z}"/></emitter>"#
    );
    light + &pane + &ground(ALBEDO)
}

/// The squares of the distances of rings of pixels from the middle of the film, in halves of a pixel. What a ring shows is
/// the same in all of its pixels, because the eye is on the axis of the light.
pub(in crate::validation) const RINGS: [f64; 3] = [1.0 + 1.0, 1.0 + 9.0, 1.0 + 49.0];
/// Of the film.
const EDGE: u32 = 8;
/// Between the pane and the light.
const EYE: DVec3 = DVec3::new(0.0, 0.0, 1.4);
/// The tangent of half the field of view.
const HALF_WIDTH: f64 = 2.0;

/// A camera that looks down.
pub(in crate::validation) fn camera() -> String {
    let fov = 2.0 * HALF_WIDTH.atan().to_degrees();
    PixelCentres { eye: EYE, target: DVec3::ZERO, fov, columns: EDGE, rows: EDGE }.xml()
}

/// The ray from the eye through a ring: where it starts, in which direction, and its degrees to the vertical.
pub(in crate::validation) fn ray(ring: usize) -> (DVec3, DVec3, f64) {
    let tangent = HALF_WIDTH * RINGS[ring].sqrt() / f64::from(EDGE);
    (EYE, DVec3::new(0.96 * tangent, 0.28 * tangent, -1.0).normalize(), tangent.atan().to_degrees())
}

/// What the pixels of the rings show in the mean, each ring in a channel of its own.
pub(in crate::validation) fn ring_means(shown: &[Rgb]) -> [f64; RINGS.len()] {
    let across = |i: usize| 2.0 * i as f64 + 1.0 - f64::from(EDGE);
    let distance = |pixel: usize| DVec2::new(across(pixel % EDGE as usize), across(pixel / EDGE as usize));
    std::array::from_fn(|ring| {
        let is_on_ring = |pixel: &usize| distance(*pixel).length_squared() == RINGS[ring];
        let (count, sum) = (0..shown.len())
            .filter(is_on_ring)
            .fold((0.0, 0.0), |(count, sum), pixel| (count + 1.0, sum + shown[pixel][ring]));
        sum / count
    })
}

/// How far photons count, and how.
const LOOKUP: (f64, Kernel) = (0.2, Kernel::Epanechnikov);
const PHOTONS: u32 = 100_000;

/// Paths of six segments are those without reflections.
fn mapper() -> Renderer {
    let integrator = format!(
        r#"<integrator type="photonmapper"><integer name="max_depth" value="6"/><integer name="global_photons" value="1"/>
           <integer name="caustic_photons" value="{PHOTONS}"/><integer name="lookup_size" value="0"/>
           <float name="caustic_lookup_radius" value="{}"/><string name="kernel" value="epanechnikov"/></integrator>"#,
        LOOKUP.0
    );
    renderer(&integrator, &camera(), &scene())
}

fn seen_through(effort: Effort) -> Vec<Finding> {
    const SAMPLES: u32 = 48;
    const REPLICATES: u32 = 40;
    let renderer = mapper();
    let mut found = [Moments::default(); RINGS.len()];
    for number in 0..u64::from(effort.samples(REPLICATES)) {
        let film = renderer.render(Replicate { seed: 51, number, samples: SAMPLES }, &|_| {});
        let shown: Vec<_> = film.means().into_iter().map(Rgb::from_array).collect();
        found.iter_mut().zip(ring_means(&shown)).for_each(|(moments, mean)| moments.push(mean));
    }
    let mut findings = Vec::new();
    for (i, moments) in found.iter().enumerate() {
        let (eye, direction, degrees) = ray(i);
        let subject = format!("{degrees:.0}°, {}", CHANNELS[i]);
        let scale = ALBEDO[i] * INTENSITY[i];
        let blurred = scale * blurred_radiance(eye, direction);
        findings.push(Finding::mean(format!("{subject}, blurred"), moments, blurred));
        let exact = Estimate::exact(scale * PANE.radiance(eye, direction, 1.0, 0));
        let estimate = Estimate::from_moments(moments).expect("there are two replicates or more");
        findings.push(Finding::equivalent(subject, &estimate, &exact, effort.bound(REPLICATES, 0.02)));
    }
    findings
}

/// What the kernel makes of the floor's radiance where a ray meets it, for an albedo of 1.
fn blurred_radiance(eye: DVec3, direction: DVec3) -> f64 {
    let photons = Photons {
        irradiance: |place: DVec2| PANE.irradiance(place.length(), 0),
        power: 4.0 * PI * PANE.intensity,
        count: PHOTONS,
    };
    let seen = PANE.footprints(eye, direction).next().expect("there is an order 0");
    let (radius, kernel) = LOOKUP;
    seen.weight * FRAC_1_PI * photons.within(kernel, seen.place, radius).mean
}
