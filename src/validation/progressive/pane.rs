//! A floor that is lit and seen through a pane of glass.

use std::f64::consts::{FRAC_1_PI, PI, TAU};

use glam::{DQuat, DVec2};
use rayon::prelude::*;

use super::{Image, PER_PASS, PER_PIXEL, sppm, squares_of_passes};
use crate::{
    law::{Effort, Finding, Law},
    math::Ray,
    photon::Kernel,
    stats::{Estimate, Moments},
    validation::{
        caustics::pane::{EYES, INTENSITY, PANE, looking, scene},
        setup::{ALBEDO, CHANNELS, Setup},
        theory::density::Photons,
    },
};

/// This law.
pub const LAWS: &[Law] = &[Law {
    name: "progressive/pane",
    claim: "Progressive photon mapping shows a floor under a pane of glass with the radiance of the closed form, at three angles of the \
            eye: with the blur of its passes exactly, and without it within 2 %, with a radius for each pass and for each pixel.",
    source: "the closed form of caustic/pane, blurred by the kernel of each pass",
    check: seen_through,
}];

const PHOTONS: u32 = 10_000;
const PASSES: u32 = 16;
const RADIUS: f64 = 0.25;
const ALPHA: f64 = 2.0 / 3.0;
/// Pixels of each eye, around the light's axis, that see the same.
const PLACES: usize = 128;

/// Paths of six segments are those without reflections.
fn setup(schedule: &str) -> Setup {
    let integrator = sppm(&format!(
        "integer photon_count={PHOTONS}, float initial_radius={RADIUS}, float alpha={ALPHA}, integer max_depth=6, string \
         kernel=epanechnikov, string radius_schedule={schedule}"
    ));
    Setup::of_pixels(&integrator, (EYES.len() * PLACES) as u32, &scene())
}

fn ray(pixel: usize) -> Ray {
    let (degrees, eye) = EYES[pixel / PLACES];
    let turn = DQuat::from_rotation_z(TAU * (pixel % PLACES) as f64 / PLACES as f64);
    Ray::new(turn * eye, turn * looking(degrees))
}

fn seen_through(effort: Effort) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (which, schedule) in [PER_PASS, PER_PIXEL].into_iter().enumerate() {
        let setup = setup(schedule);
        let found: Vec<_> = (0..effort.samples(20))
            .into_par_iter()
            .map(|number| means(&mut Image::new(&setup, 75 + which as u64, u64::from(number))))
            .collect();
        for (i, (degrees, eye)) in EYES.into_iter().enumerate() {
            let subject = format!("{schedule}, {degrees}°, {}", CHANNELS[i]);
            let moments: Moments = found.iter().map(|means| means[i]).collect();
            let scale = ALBEDO[i] * INTENSITY[i];
            // The radii of pixels are not known beforehand.
            if schedule == PER_PASS {
                findings.push(Finding::mean(format!("{subject}, blurred"), &moments, scale * blurred(i)));
            }
            let exact = Estimate::exact(scale * PANE.radiance(eye, looking(degrees), 1.0, 0));
            let estimate = Estimate::from_moments(&moments).expect("there are two images or more");
            findings.push(Finding::equivalent(subject, &estimate, &exact, 0.02));
        }
    }
    findings
}

/// The means over passes and pixels of what the eyes see, each in a channel of its own.
fn means(image: &mut Image<'_>) -> [f64; EYES.len()] {
    let mut means = [0.0; EYES.len()];
    for pass in 0..PASSES {
        image.pass(pass);
        for pixel in 0..EYES.len() * PLACES {
            let eye = pixel / PLACES;
            means[eye] += image.radiance(pixel, &ray(pixel), pass)[eye] / (PLACES as f64 * f64::from(PASSES));
        }
    }
    means
}

/// What the kernels of all passes make of the floor's radiance where an eye sees it, for an albedo of 1.
fn blurred(which: usize) -> f64 {
    let (degrees, eye) = EYES[which];
    let photons = Photons {
        irradiance: |place: DVec2| PANE.irradiance(place.length(), 0),
        power: 4.0 * PI * PANE.intensity,
        count: PHOTONS,
    };
    let seen = PANE.footprints(eye, looking(degrees)).next().expect("there is an order 0");
    let mean = |squared: f64| photons.within(Kernel::Epanechnikov, seen.place, RADIUS * squared.sqrt()).mean;
    let sum: f64 = squares_of_passes(ALPHA).take(PASSES as usize).map(mean).sum();
    seen.weight * FRAC_1_PI * sum / f64::from(PASSES)
}
