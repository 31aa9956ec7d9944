//! A floor that is lit and seen through a pane of glass.

use std::f64::consts::{FRAC_1_PI, PI, TAU};

use glam::{DQuat, DVec2, DVec3};

use crate::{
    integrator::{EyeRay, IntegratorModel as _, Iteration},
    law::{Effort, Finding, Law},
    math::{Ray, Rgb, rng::Stream},
    photon::Kernel,
    sampler::PathSampler,
    stats::{Estimate, Moments},
    validation::{
        setup::{ALBEDO, CHANNELS, GLASS, Setup, ground},
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
    check: seen_through,
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

/// Degrees to the vertical, and where the eye is.
pub(in crate::validation) const EYES: [(f64, DVec3); 3] =
    [(20.0, DVec3::new(0.2, -0.5, 2.6)), (45.0, DVec3::new(-1.4, 0.3, 2.6)), (60.0, DVec3::new(-3.2, -0.4, 2.6))];

/// How far photons count, and how.
const LOOKUP: (f64, Kernel) = (0.2, Kernel::Epanechnikov);
const PHOTONS: u32 = 100_000;

/// Paths of six segments are those without reflections.
fn setup() -> Setup {
    let integrator = format!(
        r#"<integrator type="photonmapper"><integer name="max_depth" value="6"/><integer name="global_photons" value="1"/>
           <integer name="caustic_photons" value="{PHOTONS}"/><integer name="lookup_size" value="0"/>
           <float name="caustic_lookup_radius" value="{}"/><string name="kernel" value="epanechnikov"/></integrator>"#,
        LOOKUP.0
    );
    Setup::new(&integrator, &scene())
}

fn seen_through(effort: Effort) -> Vec<Finding> {
    let setup = setup();
    let mut found = [Moments::default(); EYES.len()];
    for replicate in 0..u64::from(effort.samples(40)) {
        let mapper = setup
            .integrator
            .prepared(&setup.scene, &Iteration { seed: 51, replicate, sample: 0 })
            .expect("there are photons to emit");
        for (i, (degrees, eye)) in EYES.into_iter().enumerate() {
            let mut numbers = PathSampler::Independent(Stream::at(&[52, replicate, i as u64]));
            let radiance = around(&Ray::new(eye, looking(degrees)), |ray| {
                mapper.radiance(&setup.scene, &EyeRay::alone(*ray), &mut numbers, &mut [])
            });
            found[i].push(radiance[i]);
        }
    }
    let mut findings = Vec::new();
    for (channel, ((degrees, eye), moments)) in EYES.into_iter().zip(found).enumerate() {
        let subject = format!("{degrees}°, {}", CHANNELS[channel]);
        let scale = ALBEDO[channel] * INTENSITY[channel];
        let blurred = scale * blurred_radiance(eye, looking(degrees));
        findings.push(Finding::mean(format!("{subject}, blurred"), &moments, blurred));
        let exact = Estimate::exact(scale * PANE.radiance(eye, looking(degrees), 1.0, 0));
        let estimate = Estimate::from_moments(&moments).expect("there are two passes or more");
        findings.push(Finding::equivalent(subject, &estimate, &exact, 0.02));
    }
    findings
}

/// A direction at an angle to the vertical.
pub(in crate::validation) fn looking(degrees: f64) -> DVec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    DVec3::new(0.96 * sin, 0.28 * sin, -cos)
}

/// The mean radiance along rays that see the same, all around the light's axis, many times.
fn around(ray: &Ray, mut radiance: impl FnMut(&Ray) -> Rgb) -> Rgb {
    const PLACES: u32 = 24;
    const TIMES: u32 = 32;
    let mut sum = Rgb::ZERO;
    for place in 0..PLACES {
        let turn = DQuat::from_rotation_z(TAU * f64::from(place) / f64::from(PLACES));
        let turned = Ray::new(turn * ray.origin, turn * ray.direction);
        sum += (0..TIMES).map(|_| radiance(&turned)).sum::<Rgb>();
    }
    sum / f64::from(PLACES * TIMES)
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
