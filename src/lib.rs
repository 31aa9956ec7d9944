//! A deterministic, seeded light-transport laboratory: it reads Mitsuba 3's scene files, renders them, and proves what
//! it renders.
//!
//! The modules stand in the order of the data flow, and each uses only those above it.

pub mod math;
pub mod stats;
pub mod law;
pub mod node;
pub mod texture;
pub mod shape;
pub mod bsdf;
pub mod emitter;
pub mod sampler;
pub mod film;
pub mod sensor;
pub mod scene;
pub mod transport;
pub mod integrator;
pub mod render;
pub mod catalogue;
pub mod provenance;
pub mod comparison;
pub mod evidence;
pub mod report;
