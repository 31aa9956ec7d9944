//! The laws of whole renders, and what `etendue verify` runs and the report tabulates: all laws and all reference
//! scenes.
//!
//! The laws of plugin lists stay beside their lists. A sub-module uses only itself and those above it.

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
