//! Geometry and numerics that all other modules use: rays, boxes, frames, warps, roots and random streams.
//!
//! All arithmetic is `f64`. The hit of a ray that starts a hundred radii from a sphere is off its surface by about
//! `4e-14` radii in `f64`. In `f32` the error is `2e-5` radii, which is too much for quadrics and for slope fits.

mod aabb;
mod distribution;
mod distribution2d;
mod frame;
mod measure;
mod ray;
pub mod rng;
pub mod roots;
pub mod warp;

pub use aabb::Aabb;
pub use distribution::{DiscreteSample, Distribution1D};
pub use distribution2d::BilinearDistribution;
pub use frame::{Frame, cos_theta};
pub use measure::{PerArea, PerSolidAngle};
pub use ray::Ray;

/// A radiometric value (radiance, throughput, reflectance) per channel of linear Rec. 709 / sRGB.
pub type Rgb = glam::DVec3;

/// The Rec. 709 luminance of linear RGB.
#[must_use]
pub fn luminance(rgb: Rgb) -> f64 {
    rgb.dot(Rgb::new(0.212_671, 0.715_160, 0.072_169))
}
