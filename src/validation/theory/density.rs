//! The exact mean and variance of irradiance estimates from finitely many photons.
//!
//! Photons are independent, have equal powers, and land with a density proportional to the irradiance. With these
//! predictions a law can test a measured bias itself instead of a slope of convergence. Silverman 1986, *Density
//! Estimation for Statistics and Data Analysis*, chapters 4 and 5.

use std::f64::consts::{PI, TAU};

use glam::DVec2;
use statrs::distribution::{Beta, Continuous as _};

use super::numeric::{bisect, integral};
use crate::photon::Kernel;

/// The bias of an estimate divided by `r² ∇²E`, for small radii `r`.
#[must_use]
pub fn bias(kernel: Kernel) -> f64 {
    match kernel {
        Kernel::Constant => 1.0 / 8.0,
        Kernel::Cone => 3.0 / 40.0,
        Kernel::Epanechnikov => 1.0 / 12.0,
    }
}

/// The variance of an estimate divided by `E φ / (π r²)`, for photons of the power φ and small radii `r`.
#[must_use]
pub fn variance(kernel: Kernel) -> f64 {
    match kernel {
        Kernel::Constant => 1.0,
        Kernel::Cone => 3.0 / 2.0,
        Kernel::Epanechnikov => 4.0 / 3.0,
    }
}

/// Photons on a plane.
#[derive(Clone, Copy, Debug)]
pub struct Photons<F> {
    /// The irradiance as a function of the point: smooth, and positive where it is estimated.
    pub irradiance: F,
    /// The power of all emitted photons, including those that never land.
    pub power: f64,
    /// The number of emitted photons.
    pub count: u32,
}

/// The first two moments of an estimate of irradiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// The mean.
    pub mean: f64,
    /// The variance of one estimate.
    pub variance: f64,
}

impl<F: Fn(DVec2) -> f64> Photons<F> {
    /// The estimate with all photons within a radius: `Σ φ K(d)`. With a constant kernel the photon count in
    /// the disc is binomial, and the variance is `q (1 - q) / N (Φ / π r²)²` for the fraction `q` of the power.
    #[must_use]
    pub fn within(&self, kernel: Kernel, point: DVec2, radius: f64) -> Prediction {
        let [mean, square] = [1, 2].map(|n| self.weighted(kernel, n, point, radius));
        Prediction { mean, variance: (self.power * square - mean * mean) / f64::from(self.count) }
    }

    /// The estimate with the nearest photons. The `k`-th photon gives the radius, and the `k - 1` nearer photons are
    /// counted. This is unbiased under uniform irradiance. An estimate that also counts the `k`-th photon is, with a
    /// constant kernel, larger by the factor `k / (k - 1)`. `k` must be at least 3 and far below the number of landing
    /// photons.
    ///
    /// The fraction `q` of the power nearer than the `k`-th of `N` photons is distributed as Beta(k, N - k + 1). The
    /// nearer photons are distributed as the irradiance. David and Nagaraja 2003, *Order Statistics*, section 2.1.
    #[must_use]
    pub fn nearest(&self, kernel: Kernel, point: DVec2, k: u32) -> Prediction {
        let (n, before) = (f64::from(self.count), f64::from(k - 1));
        let beta = Beta::new(f64::from(k), n - before).expect("1 <= k <= N");
        let photon = self.power / n;
        let radii = self.likely_radii(point, k);
        let moment = |of_radius: &dyn Fn(f64, f64) -> f64| {
            let along = |radius: f64| {
                let power = disc_power(&self.irradiance, point, radius);
                let growth = TAU * radius * ring_mean(&self.irradiance, point, radius) / self.power;
                growth * beta.pdf(power / self.power) * of_radius(radius, power)
            };
            integral(along, radii)
        };
        let mean = moment(&|radius, power| before * photon * self.weighted(kernel, 1, point, radius) / power);
        let square = moment(&|radius, power| {
            let [one, two] = [1, 2].map(|n| self.weighted(kernel, n, point, radius) / power);
            before * photon.powi(2) * (two + (before - 1.0) * one * one)
        });
        Prediction { mean, variance: square - mean * mean }
    }

    /// The integral of the irradiance times a power of the kernel.
    fn weighted(&self, kernel: Kernel, exponent: i32, point: DVec2, radius: f64) -> f64 {
        let ring = |r: f64| {
            TAU * r * kernel.density(r * r, radius * radius).powi(exponent) * ring_mean(&self.irradiance, point, r)
        };
        integral(ring, [0.0, radius])
    }

    /// Radii that enclose the `k`-th photon except with a probability below 1e-15.
    fn likely_radii(&self, point: DVec2, k: u32) -> [f64; 2] {
        let k = f64::from(k);
        let photon = self.power / f64::from(self.count);
        // Chernoff bounds of a Poisson count: 9 standard deviations, plus a margin for small counts.
        [k - 9.0 * k.sqrt(), k + 9.0 * k.sqrt() + 30.0].map(|photons| {
            let power = (photons * photon).max(0.0);
            let excess = |radius: f64| disc_power(&self.irradiance, point, radius) - power;
            let mut outer = (power / (PI * (self.irradiance)(point))).sqrt();
            while excess(outer) < 0.0 {
                outer *= 2.0;
                assert!(outer.is_finite(), "fewer than {k} photons land");
            }
            bisect(excess, [0.0, outer])
        })
    }
}

/// The power within a disc, of an irradiance that is smooth in the disc.
#[must_use]
pub fn disc_power(irradiance: impl Fn(DVec2) -> f64, centre: DVec2, radius: f64) -> f64 {
    integral(|r| TAU * r * ring_mean(&irradiance, centre, r), [0.0, radius])
}

/// The maximum number of points on a circle.
const MAX_POINTS: u32 = 512;

/// The mean of a smooth function on a circle. Equidistant points converge faster than any power of their number.
/// Trefethen and Weideman 2014, "The Exponentially Convergent Trapezoidal Rule", SIAM Review 56(3).
fn ring_mean(f: &impl Fn(DVec2) -> f64, centre: DVec2, radius: f64) -> f64 {
    let even = |points: u32, offset: f64| {
        let point = |i: u32| centre + radius * DVec2::from_angle(TAU * (f64::from(i) + offset) / f64::from(points));
        (0..points).map(|i| f(point(i))).sum::<f64>() / f64::from(points)
    };
    let mut points = 8;
    let mut mean = even(points, 0.0);
    while points < MAX_POINTS {
        let finer = 0.5 * (mean + even(points, 0.5));
        let change = (finer - mean).abs();
        (mean, points) = (finer, 2 * points);
        if change <= 1e-12 * mean.abs() {
            break;
        }
    }
    mean
}

/// The irradiance of a point light over a plane: `I h / (h² + r²)^(3/2)` at the distance `r` from the point below it.
pub fn point_light(intensity: f64, height: f64) -> impl Fn(DVec2) -> f64 + Copy {
    move |point| intensity * height / (height * height + point.length_squared()).powf(1.5)
}

#[cfg(test)]
mod tests;
