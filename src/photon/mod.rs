//! Photons: light that is traced from emitters and stored where it arrives, and the density estimates made from it.
//!
//! Jensen 2001, *Realistic Image Synthesis Using Photon Mapping*.

mod border;
mod estimate;
pub mod files;
mod grid;
mod kernel;
mod map;
mod octahedral;
pub mod radius;
mod shadow;
mod stored;
mod trace;

pub use estimate::{EstimateParameters, GatherPoint, NearbyPhoton, PhotonLookup, radiance_estimate};
pub use grid::{GridLookup, PhotonGrid};
pub use kernel::Kernel;
pub use map::{MapLookup, PhotonMap};
pub use shadow::{ShadowMap, Visibility};
pub use stored::{MAX_PHOTON_DEPTH, Photon, Stored, SurfaceSide};
pub use trace::{EmittedPhotons, PhotonAddress, PhotonMapKind, PhotonStatistics, trace_photon_batches, trace_photons};
