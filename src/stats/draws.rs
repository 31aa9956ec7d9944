//! Frozen-seed random variates for the tests of this module.

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};
use std::f64::consts::TAU;

/// A stream of independent random variates, a pure function of its seed.
pub(super) struct Draws(Pcg64Mcg);

impl Draws {
    pub(super) fn new(seed: u64) -> Self {
        Self(Pcg64Mcg::seed_from_u64(seed))
    }

    /// Uniform in (0, 1): the midpoints of 2^53 equal cells, so that a logarithm is always finite.
    pub(super) fn uniform(&mut self) -> f64 {
        ((self.0.next_u64() >> 11) as f64 + 0.5) * 2.0_f64.powi(-53)
    }

    /// Standard normal, by Box and Muller 1958.
    pub(super) fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (TAU * self.uniform()).cos()
    }

    /// Exponential with mean 1 and variance 1.
    pub(super) fn exponential(&mut self) -> f64 {
        -self.uniform().ln()
    }

    /// Log-normal with mean 1 and sigma 1: variance e - 1, skewness 6.2.
    pub(super) fn lognormal(&mut self) -> f64 {
        (self.normal() - 0.5).exp()
    }
}
