//! Maps from the unit square to directions and surfaces, with their pdfs.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_4, PI, TAU};

use glam::{DVec2, DVec3};

/// Maps the unit square to the unit disc. The map is continuous and preserves area up to the factor π.
/// Shirley and Chiu 1997, "A Low Distortion Map Between Disk and Square".
#[inline]
#[must_use]
pub fn square_to_disc(u: DVec2) -> DVec2 {
    let p = 2.0 * u - DVec2::ONE;
    let is_flat = p.x.abs() > p.y.abs();
    // The greater coordinate is the signed distance from the centre. The ratio of the other one to it is the angle from
    // the axis of the greater coordinate, as a fraction of an eighth of a turn.
    let (r, across) = if is_flat { (p.x, p.y) } else { (p.y, p.x) };
    if r == 0.0 {
        return DVec2::ZERO;
    }
    let (sin, cos) = sin_cos_of_eighth(across / r);
    if is_flat { DVec2::new(r * cos, r * sin) } else { DVec2::new(r * sin, r * cos) }
}

/// The inverse of [`square_to_disc`].
#[must_use]
pub fn disc_to_square(p: DVec2) -> DVec2 {
    let r = p.length();
    let is_flat = p.x.abs() > p.y.abs();
    // The signed distance takes the sign of the greater coordinate. The angle from the axis of that coordinate is a
    // fraction of an eighth of a turn.
    let (greater, lesser) = if is_flat { (p.x, p.y) } else { (p.y, p.x) };
    let signed = r.copysign(greater);
    let across = if r == 0.0 { 0.0 } else { signed * (lesser / greater).atan() / FRAC_PI_4 };
    0.5 * (if is_flat { DVec2::new(signed, across) } else { DVec2::new(across, signed) } + DVec2::ONE)
}

/// The sine and the cosine of `π/4 x` for `x` in [-1, 1], with an error of at most 2.3e-16. They are Taylor series
/// around zero, without branches, and give the same bits on all machines.
#[inline]
fn sin_cos_of_eighth(x: f64) -> (f64, f64) {
    const TERMS: usize = 10;
    /// The coefficients of φ φ^2k and of φ^2k, in descending order of k.
    const SIN: [f64; TERMS] = coefficients(1);
    const COS: [f64; TERMS] = coefficients(0);
    let phi = FRAC_PI_4 * x;
    let square = phi * phi;
    let fourth = square * square;
    // Two terms at a time shorten the chain of dependent products by half.
    let sum = |series: &[f64]| series.chunks_exact(2).fold(0.0, |sum, c| sum * fourth + (c[0] * square + c[1]));
    (phi * sum(&SIN), sum(&COS))
}

/// `(-1)^k / (2k + first)!` for k from `N - 1` to 0.
const fn coefficients<const N: usize>(first: usize) -> [f64; N] {
    let mut series = [1.0; N];
    let mut k = 1;
    while k < N {
        let n = (2 * k + first) as f64;
        series[N - 1 - k] = -series[N - k] / (n * (n - 1.0));
        k += 1;
    }
    series
}

/// Maps the unit square to the hemisphere around +z, with pdf cos θ / π per solid angle. Malley's method.
#[inline]
#[must_use]
pub fn square_to_cosine_hemisphere(u: DVec2) -> DVec3 {
    let p = square_to_disc(u);
    p.extend((1.0 - p.length_squared()).max(0.0).sqrt())
}

/// The pdf of [`square_to_cosine_hemisphere`], per solid angle.
#[must_use]
pub fn square_to_cosine_hemisphere_pdf(cos_theta: f64) -> f64 {
    cos_theta.max(0.0) * FRAC_1_PI
}

/// Maps the unit square to the hemisphere around +z, with pdf `(n + 1) / 2π cosⁿ θ` per solid angle.
#[must_use]
pub fn square_to_cosine_power(u: DVec2, n: f64) -> DVec3 {
    // The logarithm of the squared cosine, so that the sine of narrow lobes is accurate.
    let log = 2.0 * (-u.x).ln_1p() / (n + 1.0);
    let (sin, cos) = (TAU * u.y).sin_cos();
    (-log.exp_m1()).sqrt() * DVec3::new(cos, sin, 0.0) + (0.5 * log).exp() * DVec3::Z
}

/// Maps the unit square to the unit sphere, with pdf 1 / 4π per solid angle. The square is mapped to the disc, whose
/// concentric circles become circles of latitude that enclose the same fraction of the area (Lambert's azimuthal
/// projection, which preserves areas by Archimedes' hat-box theorem).
#[must_use]
pub fn square_to_sphere(u: DVec2) -> DVec3 {
    square_to_cone(u, 2.0)
}

/// The pdf of [`square_to_sphere`], per solid angle.
pub const SQUARE_TO_SPHERE_PDF: f64 = 0.25 * FRAC_1_PI;

/// Maps the unit square to the cone of directions around +z, with pdf `1 / 2π(1 - cos)` per solid angle.
/// `one_minus_cos` is one minus the cosine of the cone's half-angle: for narrow cones the cosine itself is too close to
/// 1 to be accurate.
#[inline]
#[must_use]
pub fn square_to_cone(u: DVec2, one_minus_cos: f64) -> DVec3 {
    let p = square_to_disc(u);
    let below_one = p.length_squared() * one_minus_cos;
    // The ratio of the sine to the distance from the disc's centre.
    let stretch = (one_minus_cos * (2.0 - below_one)).max(0.0).sqrt();
    (stretch * p).extend(1.0 - below_one)
}

/// The pdf of [`square_to_cone`], per solid angle.
#[must_use]
pub fn square_to_cone_pdf(one_minus_cos: f64) -> f64 {
    1.0 / (2.0 * PI * one_minus_cos)
}

/// Maps the unit square uniformly to a triangle. The result is the barycentric coordinates of its second and third
/// corner.
#[must_use]
pub fn square_to_triangle(u: DVec2) -> DVec2 {
    let root = (1.0 - u.x).sqrt();
    DVec2::new(1.0 - root, u.y * root)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn disc_to_square_inverts_square_to_disc() {
        for (i, j) in (0..=20).flat_map(|i| (0..=20).map(move |j| (i, j))) {
            let u = DVec2::new(f64::from(i), f64::from(j)) / 20.0;
            assert!((disc_to_square(square_to_disc(u)) - u).length() < 1e-12, "{u}");
        }
    }

    #[test]
    fn the_series_equal_sine_and_cosine() {
        for i in -1000..=1000 {
            let x = f64::from(i) / 1000.0;
            let ((sin, cos), (expected_sin, expected_cos)) = (sin_cos_of_eighth(x), (FRAC_PI_4 * x).sin_cos());
            assert!(
                (sin - expected_sin).abs() <= 2.3e-16 && (cos - expected_cos).abs() <= 2.3e-16,
                "{x}: {sin}, {cos}"
            );
        }
    }
}
