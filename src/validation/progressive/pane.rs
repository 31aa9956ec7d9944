//! A floor that is lit and seen through a pane of glass.

use std::f64::consts::{FRAC_1_PI, PI};

use glam::DVec2;
use rayon::prelude::*;

use super::{Image, PER_PASS, PER_PIXEL, sppm, squares_of_passes};
use crate::{
    law::{Check, Effort, Finding, Law},
    photon::Kernel,
    render::Renderer,
    stats::{Estimate, Moments},
    validation::{
        caustics::pane::{self, INTENSITY, PANE, RINGS, ring_means},
        setup::{ALBEDO, CHANNELS, renderer},
        theory::density::Photons,
    },
};

/// This law.
pub const LAWS: &[Law] = &[Law {
    name: "progressive/pane",
    claim: "Progressive photon mapping shows a floor under a pane of glass with the radiance of the closed form, at three angles of the \
            eye: with the blur of its passes exactly, and without it within 2 %, with a radius for each pass and for each pixel.",
    source: "the closed form of caustic/pane, blurred by the kernel of each pass",
    check: Check::Analytic(seen_through),
}];

const PHOTONS: u32 = 10_000;
const PASSES: u32 = 16;
const RADIUS: f64 = 0.25;
const ALPHA: f64 = 2.0 / 3.0;

/// Paths of six segments are those without reflections.
fn scene(schedule: &str) -> Renderer {
    let integrator = sppm(&format!(
        "integer photon_count={PHOTONS}, float initial_radius={RADIUS}, float alpha={ALPHA}, integer max_depth=6, string \
         kernel=epanechnikov, string radius_schedule={schedule}"
    ));
    renderer(&integrator, &pane::camera(), &pane::scene())
}

fn seen_through(effort: Effort) -> Vec<Finding> {
    const IMAGES: u32 = 20;
    let mut findings = Vec::new();
    for (which, schedule) in [PER_PASS, PER_PIXEL].into_iter().enumerate() {
        let renderer = scene(schedule);
        let found: Vec<_> = (0..effort.samples(IMAGES))
            .into_par_iter()
            .map(|number| means(&mut Image::new(&renderer, PASSES, 75 + which as u64, u64::from(number))))
            .collect();
        for i in 0..RINGS.len() {
            let (eye, direction, degrees) = pane::ray(i);
            let subject = format!("{schedule}, {degrees:.0}°, {}", CHANNELS[i]);
            let moments: Moments = found.iter().map(|means| means[i]).collect();
            let scale = ALBEDO[i] * INTENSITY[i];
            // The radii of pixels are not known beforehand.
            if schedule == PER_PASS {
                findings.push(Finding::mean(format!("{subject}, blurred"), &moments, scale * blurred(i)));
            }
            let exact = Estimate::exact(scale * PANE.radiance(eye, direction, 1.0, 0));
            let estimate = Estimate::from_moments(&moments).expect("there are two images or more");
            findings.push(Finding::equivalent(subject, &estimate, &exact, effort.bound(IMAGES, 0.02)));
        }
    }
    findings
}

/// The means over passes and pixels of what the rings show.
fn means(image: &mut Image<'_>) -> [f64; RINGS.len()] {
    let mut means = [0.0; RINGS.len()];
    for _ in 0..PASSES {
        let shown = ring_means(&image.pass());
        means.iter_mut().zip(shown).for_each(|(mean, shown)| *mean += shown / f64::from(PASSES));
    }
    means
}

/// What the kernels of all passes make of the floor's radiance where an eye sees it, for an albedo of 1.
fn blurred(which: usize) -> f64 {
    let (eye, direction, _) = pane::ray(which);
    let photons = Photons {
        irradiance: |place: DVec2| PANE.irradiance(place.length(), 0),
        power: 4.0 * PI * PANE.intensity,
        count: PHOTONS,
    };
    let seen = PANE.footprints(eye, direction).next().expect("there is an order 0");
    let mean = |squared: f64| photons.within(Kernel::Epanechnikov, seen.place, RADIUS * squared.sqrt()).mean;
    let sum: f64 = squares_of_passes(ALPHA).take(PASSES as usize).map(mean).sum();
    seen.weight * FRAC_1_PI * sum / f64::from(PASSES)
}
