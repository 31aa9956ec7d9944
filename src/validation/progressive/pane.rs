//! A floor that is lit and seen through a pane of glass.

use rayon::prelude::*;

use super::{PER_PASS, PER_PIXEL, sppm, squares_of_passes};
use crate::{
    law::{Check, Effort, Finding, Law},
    math::Rgb,
    photon::Kernel,
    render::{Renderer, Replicate},
    stats::{Estimate, Moments},
    validation::{
        caustics::pane::{self, BANDS, PANE},
        setup::renderer,
    },
};

/// This law.
pub const LAWS: &[Law] = &[Law {
    name: "progressive/pane",
    claim: "Progressive photon mapping shows a floor under a pane of glass with the radiance of the closed form, in three bands of angles of the \
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
    const IMAGES: u32 = 26;
    let mut findings = Vec::new();
    for (which, schedule) in [PER_PASS, PER_PIXEL].into_iter().enumerate() {
        let renderer = scene(schedule);
        let pixels = pane::pixels(&renderer.scene.sensor.camera);
        let image = |number: u32| {
            let film = renderer
                .render(Replicate { seed: 75 + which as u64, number: u64::from(number), samples: PASSES }, &|_| {});
            let shown: Vec<_> = film.means().into_iter().map(Rgb::from_array).collect();
            pane::band_means(&shown, &pixels)
        };
        let found: Vec<_> = (0..effort.samples(IMAGES)).into_par_iter().map(image).collect();
        let radii: Vec<_> =
            squares_of_passes(ALPHA).take(PASSES as usize).map(|squared| RADIUS * squared.sqrt()).collect();
        let blurred = pane::expected(&pixels, pane::blurred(Kernel::Epanechnikov, &radii, &pixels));
        let exact = pane::expected(&pixels, |distance| PANE.irradiance(distance, 0));
        for (i, band) in BANDS.into_iter().enumerate() {
            let subject = format!("{schedule}, {band}");
            let moments: Moments = found.iter().map(|means| means[i]).collect();
            // The radii of pixels are not known beforehand.
            if schedule == PER_PASS {
                findings.push(Finding::mean(format!("{subject}, blurred"), &moments, blurred[i]));
            }
            let estimate = Estimate::from_moments(&moments).expect("there are two images or more");
            findings.push(Finding::equivalent(
                subject,
                &estimate,
                &Estimate::exact(exact[i]),
                effort.bound(IMAGES, 0.02),
            ));
        }
    }
    findings
}
