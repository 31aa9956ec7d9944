//! Tests of the whole program, most of them through its command line.

mod bad_input;
mod cli;
mod determinism;
mod geometry;
mod hostile_images;
mod kit;
mod layers;
mod semantics;
