//! Maps from the unit square to directions and surfaces, each with its density.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4, PI, TAU};

use glam::{DVec2, DVec3};

/// The square onto the unit disc, area-preserving up to the factor π and continuous.
/// Shirley and Chiu 1997, "A Low Distortion Map Between Disk and Square".
#[must_use]
pub fn square_to_disc(u: DVec2) -> DVec2 {
    let p = 2.0 * u - DVec2::ONE;
    if p == DVec2::ZERO {
        return DVec2::ZERO;
    }
    let (r, phi) =
        if p.x.abs() > p.y.abs() { (p.x, FRAC_PI_4 * (p.y / p.x)) } else { (p.y, FRAC_PI_2 - FRAC_PI_4 * (p.x / p.y)) };
    let (sin, cos) = phi.sin_cos();
    r * DVec2::new(cos, sin)
}

/// The square onto the hemisphere around +z, with density cos θ / π. Malley's method.
#[must_use]
pub fn square_to_cosine_hemisphere(u: DVec2) -> DVec3 {
    let p = square_to_disc(u);
    p.extend((1.0 - p.length_squared()).max(0.0).sqrt())
}

/// The density of [`square_to_cosine_hemisphere`], per solid angle.
#[must_use]
pub fn cosine_hemisphere_density(cos_theta: f64) -> f64 {
    cos_theta.max(0.0) * FRAC_1_PI
}

/// The square onto the unit sphere, with density 1 / 4π. Archimedes' hat-box theorem.
#[must_use]
pub fn square_to_sphere(u: DVec2) -> DVec3 {
    direction(1.0 - 2.0 * u.y, TAU * u.x)
}

/// The density of [`square_to_sphere`], per solid angle.
pub const SPHERE_DENSITY: f64 = 0.25 * FRAC_1_PI;

/// The square onto the cap of directions within an angle of +z, with density `1 / 2π(1 - cos)`.
/// `one_minus_cos` is one minus the cosine of that angle, since narrow cones have no digits left in the cosine itself.
#[must_use]
pub fn square_to_cone(u: DVec2, one_minus_cos: f64) -> DVec3 {
    let below_one = u.y * one_minus_cos;
    let sin = (below_one * (2.0 - below_one)).max(0.0).sqrt();
    let (sin_phi, cos_phi) = (TAU * u.x).sin_cos();
    DVec3::new(sin * cos_phi, sin * sin_phi, 1.0 - below_one)
}

/// The density of [`square_to_cone`], per solid angle.
#[must_use]
pub fn cone_density(one_minus_cos: f64) -> f64 {
    1.0 / (2.0 * PI * one_minus_cos)
}

/// The square onto a triangle, uniformly: the barycentric coordinates of the second and third corner.
#[must_use]
pub fn square_to_triangle(u: DVec2) -> DVec2 {
    let root = (1.0 - u.x).sqrt();
    DVec2::new(1.0 - root, u.y * root)
}

fn direction(cos_theta: f64, phi: f64) -> DVec3 {
    let sin_theta = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
    let (sin_phi, cos_phi) = phi.sin_cos();
    DVec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
}
