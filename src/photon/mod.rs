//! Photons: light that was followed from its source, kept where it arrived, and estimates of density from it.
//!
//! Jensen 2001, *Realistic Image Synthesis Using Photon Mapping*.

mod border;
pub mod files;
mod grid;
mod kernel;
mod map;
mod packed;
pub mod radius;
mod shadow;
mod trace;

pub use grid::Grid;
pub use kernel::Kernel;
pub use map::{EstimateParameters, GatherPoint, Map};
pub use packed::{MAX_PHOTON_DEPTH, Photon};
pub use shadow::{ShadowMap, Visibility};
pub use trace::{EmittedPhotons, PhotonMapKind, PhotonStatistics, trace_photon_batches, trace_photons};
