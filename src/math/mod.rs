//! The geometry and the numbers that everything else stands on: rays, boxes, frames, warps and random streams.
//!
//! All arithmetic is `f64`. A ray that meets a sphere from a hundred radii away misses its surface by about `4e-14`
//! radii in `f64`; in `f32` it would be `2e-5`, which no quadric or slope fit can carry.

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
