use std::{sync::Arc, time::Instant};

use super::settings::{Schedule, Settings};
use crate::{
    integrator::{Iteration, Notes},
    math::rng::hash,
    photon::{
        EmittedPhotons, PhotonGrid, PhotonMapKind,
        radius::{PixelRadius, of_pass},
        trace_photon_batches,
    },
    scene::Scene,
};

/// The photons of a pass, and their gather radii.
#[derive(Debug)]
pub(super) struct PhotonPass {
    pub(super) photons: PhotonGrid,
    radii: Radii,
    notes: Notes,
}

/// Squared radii relative to the first pass.
#[derive(Debug)]
enum Radii {
    /// One radius for all pixels.
    Shared(f64),
    /// One radius for each pixel.
    Pixels(Arc<[PixelRadius]>),
}

/// An identifier that separates the random numbers of photons from those of the pixels' samples.
const PHOTONS: u64 = 0x73_7070_6d00;

impl PhotonPass {
    /// Emits the photons of an iteration. `radii` are the result of the iteration before; None in the first.
    pub(super) fn new(
        scene: &Scene,
        settings: &Settings,
        iteration: &Iteration,
        radii: Option<Arc<[PixelRadius]>>,
    ) -> Self {
        let start = Instant::now();
        let radii = match settings.schedule {
            Schedule::PerPass => Radii::Shared(of_pass(iteration.sample, settings.alpha)),
            Schedule::PerPixel | Schedule::ErrorDriven => {
                Radii::Pixels(radii.unwrap_or_else(|| first_radii(scene).into()))
            }
        };
        // Each pass has different random numbers.
        let address = [iteration.seed, iteration.replicate, hash(&[PHOTONS, u64::from(iteration.sample)])];
        // The connection to the camera path adds the last segment.
        let limits = settings.limits.without_last();
        let batches = trace_photon_batches(scene, PhotonMapKind::Global, settings.photon_count, limits, address);
        let radius = settings.typical_radius(scene) * radii.mean_squared().sqrt();
        let photons = PhotonGrid::new(&batches, 2.0 * radius);
        let fact = format!(
            "pass {}: {} photons of {} emitted, radii some {radius:.3e} m, {:.2} s",
            iteration.sample,
            photons.len(),
            settings.photon_count,
            start.elapsed().as_secs_f64()
        );
        let warning =
            if photons.is_empty() { EmittedPhotons::join(batches).warning(PhotonMapKind::Global) } else { None };
        let notes = Notes { facts: vec![fact], warnings: warning.into_iter().collect() };
        Self { photons, radii, notes }
    }

    pub(super) fn notes(&self) -> Notes {
        self.notes.clone()
    }

    /// The radius of a pixel relative to the first pass.
    pub(super) fn relative_radius(&self, pixel: usize) -> f64 {
        match &self.radii {
            Radii::Shared(squared) => squared.sqrt(),
            Radii::Pixels(radii) => radii[pixel].squared.sqrt(),
        }
    }

    /// The radii of all pixels; None if all pixels share one radius.
    pub(super) fn pixel_radii(&self) -> Option<&[PixelRadius]> {
        match &self.radii {
            Radii::Shared(_) => None,
            Radii::Pixels(radii) => Some(radii),
        }
    }
}

/// The radii of all pixels in the first pass.
fn first_radii(scene: &Scene) -> Vec<PixelRadius> {
    let crop = scene.sensor.film.rendered();
    vec![PixelRadius::FIRST; crop.width as usize * crop.height as usize]
}

impl Radii {
    fn mean_squared(&self) -> f64 {
        match self {
            Self::Shared(squared) => *squared,
            Self::Pixels(radii) => radii.iter().map(|radius| radius.squared).sum::<f64>() / radii.len().max(1) as f64,
        }
    }
}
