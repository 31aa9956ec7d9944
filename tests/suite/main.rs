//! Tests of the whole program, most of them through its command line.

#![allow(clippy::unwrap_used, reason = "a failed unwrap in a helper fails the test that called it")]

mod bad_input;
mod bad_photons;
mod bad_solids;
mod checkpoints;
mod cli;
mod determinism;
mod geometry;
mod hostile_images;
mod imports;
#[cfg(unix)]
mod interruptions;
mod kit;
mod layers;
mod library;
#[cfg(target_os = "linux")]
mod memory;
mod mitsuba_scenes;
mod photons;
mod semantics;
mod solids;
mod study;
