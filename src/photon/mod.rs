//! Photons: light that was followed from its source, kept where it arrived, and estimates of density from it.
//!
//! Jensen 2001, *Realistic Image Synthesis Using Photon Mapping*.

mod border;
pub mod files;
mod grid;
mod kernel;
pub mod laws;
mod map;
mod packed;
pub mod radius;
mod shadow;
mod trace;

pub use border::mass_within;
pub use grid::Grid;
pub use kernel::Kernel;
pub use map::{Lookup, Map, Site};
pub use packed::{LONGEST, Photon};
pub use shadow::{Shade, ShadowMap};
pub use trace::{Aim, Harvest, Tally, batches, harvest};
