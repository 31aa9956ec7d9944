//! Caustics: light that a mirror or a lens gathers on a diffuse surface.

pub mod theory;
