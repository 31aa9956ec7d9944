//! A deterministic, seeded light-transport laboratory: it reads Mitsuba 3's scene files, renders them, and proves what
//! it renders.
//!
//! The modules stand in this order, and each uses only itself and those above it; a test holds them to it:
//!
//! 1. what everything stands on: [`math`], [`stats`] and [`law`], which is how claims are written down;
//! 2. what a scene file says: [`node`], and [`provenance`], which hashes its files;
//! 3. what a scene is made of: [`texture`], [`shape`], [`bsdf`], [`emitter`], [`sampler`], [`film`], [`sensor`], and the
//!    [`scene`] that they make;
//! 4. how light travels through it: [`transport`], [`integrator`], [`render`];
//! 5. all of it looked at from outside: the [`catalogue`] of everything that scene files can name, the [`comparison`] of
//!    images, the [`evidence`] that claims hold, and its [`report`].
//!
//! The command line, `cli`, is the binary's.

pub mod math;
pub mod stats;
pub mod law;
pub mod node;
pub mod provenance;
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
pub mod comparison;
pub mod evidence;
pub mod report;
