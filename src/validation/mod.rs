//! The laws of whole renders, and the list of all laws and reference scenes that `etendue verify` runs and tabulates.
//!
//! The laws of a plugin list are defined beside that list. Each sub-module uses only itself and the sub-modules above
//! it.

pub mod theory;
mod setup;
mod slope;
pub mod lights;
pub mod rooms;
pub mod extras;
pub mod glass;
pub mod optics;
pub mod absorption;
pub mod photon_map;
pub mod caustics;
pub mod progressive;
pub mod images;
pub mod light_tracing;
pub mod csg;
mod evidence;
mod reference;
mod equivalent;
mod calibration;
mod lists;
mod verify;

pub use evidence::{Evidence, EvidenceError, Images, LawTime, Row, SceneEvidence};
pub use lists::laws;
pub use verify::{compared_scenes, verify};
