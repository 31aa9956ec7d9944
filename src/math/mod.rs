//! Geometry and random numbers: rays, boxes, frames, warps, densities with their measures, and random streams.
//!
//! All arithmetic is `f64`. The hit of a ray with a sphere a hundred radii away is off by about `4e-14` radii in `f64`, and by
//! `2e-5` in `f32`, which is too much for quadrics and for fits of convergence rates.

mod aabb;
mod distribution;
mod frame;
mod measure;
mod ray;
pub mod rng;
pub mod roots;
pub mod warp;

pub use aabb::Aabb;
pub use distribution::{Distribution1D, Draw};
pub use frame::{Frame, cos_theta};
pub use measure::{PerArea, PerSolidAngle};
pub use ray::Ray;

/// Linear Rec. 709 / sRGB radiometric values (radiance, throughput, reflectance), one per channel.
pub type Rgb = glam::DVec3;

/// Rec. 709 luminance of linear RGB.
#[must_use]
pub fn luminance(rgb: Rgb) -> f64 {
    rgb.dot(Rgb::new(0.212_671, 0.715_160, 0.072_169))
}
