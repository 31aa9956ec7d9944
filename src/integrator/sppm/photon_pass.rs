use std::{
    sync::{Mutex, PoisonError},
    time::Instant,
};

use super::settings::{Schedule, Settings};
use crate::{
    integrator::{Iteration, Notes},
    math::rng::hash,
    photon::{
        EmittedPhotons, Grid, PhotonMapKind,
        radius::{PassCounts, PixelRadius, of_pass},
        trace_photon_batches,
    },
    scene::Scene,
    transport::PathLimits,
};

/// What a pass has: photons and radii, and what its pixels find.
#[derive(Debug)]
pub(super) struct PhotonPass {
    pub(super) photons: Grid,
    radii: Radii,
    /// What each pixel has found.
    found: Vec<Mutex<PassCounts>>,
    notes: Notes,
}

/// Squares of radii over those of the first pass.
#[derive(Debug)]
enum Radii {
    /// Of all pixels.
    Pass(f64),
    /// Of each.
    Pixels(Vec<PixelRadius>),
}

/// What streams of random numbers are for, so that photons share none with the samples of pixels.
const PHOTONS: u64 = 0x73_7070_6d00;

impl PhotonPass {
    /// Emits the photons of a round. The radii are those after the round before, none before the first.
    pub(super) fn new(scene: &Scene, settings: &Settings, iteration: &Iteration, radii: Vec<PixelRadius>) -> Self {
        let start = Instant::now();
        let crop = scene.sensor.film.rendered();
        let pixels = crop.width as usize * crop.height as usize;
        let radii = match settings.schedule {
            Schedule::PerPass => Radii::Pass(of_pass(iteration.sample, settings.alpha)),
            _ if radii.is_empty() => Radii::Pixels(vec![PixelRadius::FIRST; pixels]),
            _ => Radii::Pixels(radii),
        };
        // The last segment is that to the eye.
        let limits = PathLimits { max_depth: settings.limits.max_depth.saturating_sub(1), ..settings.limits };
        // No two passes share a number.
        let address = [iteration.seed, iteration.replicate, hash(&[PHOTONS, u64::from(iteration.sample)])];
        let emitted = trace_photon_batches(scene, PhotonMapKind::Global, settings.photon_count, limits, address);
        let radius = settings.typical_radius(scene) * radii.mean().sqrt();
        let photons = Grid::new(&emitted, 2.0 * radius);
        let fact = format!(
            "pass {}: {} photons of {} emitted, radii some {radius:.3e} m, {:.2} s",
            iteration.sample,
            photons.len(),
            settings.photon_count,
            start.elapsed().as_secs_f64()
        );
        let warning =
            if photons.is_empty() { EmittedPhotons::join(emitted).warning(PhotonMapKind::Global) } else { None };
        let notes = Notes { facts: vec![fact], warnings: warning.into_iter().collect() };
        let found = if matches!(radii, Radii::Pixels(_)) { pixels } else { 0 };
        Self { photons, radii, found: std::iter::repeat_with(Mutex::default).take(found).collect(), notes }
    }

    pub(super) fn notes(&self) -> Notes {
        self.notes.clone()
    }

    /// The radius of a pixel over that of the first pass.
    pub(super) fn shrinkage(&self, pixel: usize) -> f64 {
        match &self.radii {
            Radii::Pass(squared) => squared.sqrt(),
            Radii::Pixels(radii) => radii[pixel].squared.sqrt(),
        }
    }

    /// Counts what a pixel has found.
    pub(super) fn count(&self, pixel: usize, more: PassCounts) {
        if let Some(found) = self.found.get(pixel) {
            let mut found = found.lock().unwrap_or_else(PoisonError::into_inner);
            found.photons += more.photons;
            found.squared_distances += more.squared_distances;
        }
    }

    /// The radii of the next round, if they depend on this one.
    pub(super) fn next_radii(&self, settings: &Settings) -> Vec<PixelRadius> {
        let Radii::Pixels(radii) = &self.radii else { return Vec::new() };
        let next = |(radius, found): (&PixelRadius, &Mutex<PassCounts>)| {
            let found = *found.lock().unwrap_or_else(PoisonError::into_inner);
            match settings.schedule {
                Schedule::ErrorDriven => radius.after_test(found),
                Schedule::PerPixel | Schedule::PerPass => radius.after(found.photons, settings.alpha),
            }
        };
        radii.iter().zip(&self.found).map(next).collect()
    }
}

impl Radii {
    /// The mean of the squares.
    fn mean(&self) -> f64 {
        match self {
            Self::Pass(squared) => *squared,
            Self::Pixels(radii) => radii.iter().map(|radius| radius.squared).sum::<f64>() / radii.len().max(1) as f64,
        }
    }
}
