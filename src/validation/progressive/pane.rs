//! Progressive photon mapping of a floor lit and viewed through a pane of glass.

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

/// The law of the floor under a pane, for progressive photon mapping.
pub const LAWS: &[Law] = &[Law {
    name: "progressive/pane",
    claim: "Progressive photon mapping gives a floor under a pane of glass the radiance of the closed form, in three bands of viewing angles. \
            With a radius for each pass it agrees exactly with the closed form blurred by the kernel. With a radius for each pass or for \
            each pixel it is within 2 % of the closed form itself.",
    source: "the closed form of caustic/pane, blurred by the kernel of each pass",
    check: Check::Analytic(floor_under_pane),
}];

const PHOTONS: u32 = 10_000;
const PASSES: u32 = 16;
const RADIUS: f64 = 0.25;
const ALPHA: f64 = 2.0 / 3.0;

/// A renderer with a max_depth of 6, which admits only paths without reflections inside the pane.
fn scene(schedule: &str) -> Renderer {
    let integrator = sppm(&format!(
        "integer photon_count={PHOTONS}, float initial_radius={RADIUS}, float alpha={ALPHA}, integer max_depth=6, string \
         kernel=epanechnikov, string radius_schedule={schedule}"
    ));
    renderer(&integrator, &pane::camera(), &pane::scene())
}

fn floor_under_pane(effort: Effort) -> Vec<Finding> {
    const IMAGES: u32 = 26;
    let mut findings = Vec::new();
    for (i, schedule) in [PER_PASS, PER_PIXEL].into_iter().enumerate() {
        let renderer = scene(schedule);
        let pixels = pane::pixels(&renderer.scene.sensor.camera);
        let image = |number: u32| {
            let film =
                renderer.render(Replicate { seed: 75 + i as u64, number: u64::from(number), samples: PASSES }, &|_| {});
            let radiances: Vec<_> = film.means().into_iter().map(Rgb::from_array).collect();
            pane::band_means(&radiances, &pixels)
        };
        let found: Vec<_> = (0..effort.samples(IMAGES)).into_par_iter().map(image).collect();
        let radii: Vec<_> =
            squares_of_passes(ALPHA).take(PASSES as usize).map(|squared| RADIUS * squared.sqrt()).collect();
        let blurred = pane::expected(&pixels, pane::blurred(Kernel::Epanechnikov, &radii, &pixels));
        let exact = pane::expected(&pixels, |distance| PANE.irradiance(distance, 0));
        for (i, band) in BANDS.into_iter().enumerate() {
            let subject = format!("{schedule}, {band}");
            let moments: Moments = found.iter().map(|means| means[i]).collect();
            // Radii of pixels depend on the photons found, so the blur is predicted for a radius per pass only.
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
