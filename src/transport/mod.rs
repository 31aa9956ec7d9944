//! Code that integrators share: paths from the camera, paths from emitters, emitter sampling and Russian roulette.

mod camera_path;
mod class;
mod light_path;
mod shading_point;

pub use camera_path::CameraPath;
pub use class::{CameraPathClass, ClassRadiance, LightPathClass, PathClass};
pub use light_path::{LightVertex, shading_normal_correction, trace_light_path};
pub use shading_point::{DirectSample, SampleCounts, ShadingPoint, Shadows};

use crate::math::{PerSolidAngle, Rgb};

/// Limits of the path length. A path from the camera directly to an emitter has depth 1, as in Mitsuba; each scattering
/// adds 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathLimits {
    /// The maximum depth.
    pub max_depth: u32,
    /// The depth from which Russian roulette may end a path.
    pub rr_depth: u32,
}

impl PathLimits {
    /// The limits of a subpath that is connected to the camera or to a photon, which adds 1 to its depth.
    #[must_use]
    pub fn without_last(self) -> Self {
        Self { max_depth: self.max_depth.saturating_sub(1), ..self }
    }
}

/// The power heuristic with exponent 2 for the pdf `ours`, given another pdf of the same direction, Veach 1997, eq.
/// (9.14).
#[must_use]
pub fn power_heuristic(ours: PerSolidAngle, other: PerSolidAngle) -> f64 {
    let (ours, other) = (ours.0 * ours.0, other.0 * other.0);
    if ours > 0.0 { ours / (ours + other) } else { 0.0 }
}

/// The greatest probability with which Russian roulette lets a path continue. It is below 1, so that paths caught by
/// total internal reflection end.
const MAX_SURVIVAL: f64 = 0.95;
/// Up to this depth, light paths may survive Russian roulette with probability 1.
const MAX_CERTAIN_DEPTH: u32 = 32;

/// The probability with which Russian roulette lets a camera path continue: its throughput, at most 0.95. `eta` is the
/// index of refraction where the path is, over that where it began: the compression of radiance in a dense medium does
/// not count as loss.
#[must_use]
pub fn survival(throughput: Rgb, eta: f64) -> f64 {
    (throughput.max_element() * eta * eta).min(MAX_SURVIVAL)
}
