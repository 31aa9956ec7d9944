//! How the radii of density estimates shrink from pass to pass, so that bias and variance both vanish. Squares of radii are
//! relative to that of the first pass.

use statrs::function::gamma::ln_gamma;

/// The square of the radius in a pass, from 0, that is the same for all pixels: each is `(i + α) / (i + 1)` times that before
/// it, the i-th, so that it tends to `i^(α-1) / Γ(1+α)`. Passes know nothing of one another.
///
/// The variance of the mean of n passes falls like `n^-α` and its bias like `n^(α-1)`; α = 2/3 is the best for both together.
/// Knaus and Zwicker 2011, "Progressive Photon Mapping: A Probabilistic Approach", eq. (15).
#[must_use]
pub fn of_pass(pass: u32, alpha: f64) -> f64 {
    let i = f64::from(pass) + 1.0;
    // The product, by Γ(x + 1) = x Γ(x).
    (ln_gamma(i + alpha) - ln_gamma(1.0 + alpha) - ln_gamma(i + 1.0)).exp()
}

/// The radius of one pixel, which shrinks by the photons that it finds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelRadius {
    /// Its square, over that of the first pass.
    pub squared: f64,
    /// The photons that would be within it if the density of those found so far were the same everywhere.
    pub photons: f64,
}

impl PixelRadius {
    /// Before the first pass.
    pub const FIRST: Self = Self { squared: 1.0, photons: 0.0 };

    /// After a pass that found so many photons within it: of those added, the share α stays within.
    ///
    /// Where every pass finds the same number, the square after n passes is `Γ(n+1) Γ(1/α) / Γ(n+1/α)`, which tends to
    /// `Γ(1/α) n^(1-1/α)`: an α here does what 2 - 1/α does in [`of_pass`].
    /// Hachisuka and Jensen 2009, "Stochastic Progressive Photon Mapping", eq. (3) and (4).
    #[must_use]
    pub fn after(self, found: u32, alpha: f64) -> Self {
        if found == 0 {
            return self;
        }
        let found = f64::from(found);
        let kept = self.photons + alpha * found;
        Self { squared: self.squared * (kept / (self.photons + found)), photons: kept }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_first_radii_by_hand() {
        // α = 1/2: 1, 3/4, 3/4 · 5/6, 5/8 · 7/8.
        for (pass, squared) in [(0, 1.0), (1, 0.75), (2, 0.625), (3, 0.546_875)] {
            assert!((of_pass(pass, 0.5) - squared).abs() < 1e-14, "pass {pass}: {}", of_pass(pass, 0.5));
        }
        // α = 1/2, two photons each: N = 1, 2, 3 and R² = 1/2, 1/2 · 2/3, 1/3 · 3/4.
        let mut radius = PixelRadius::FIRST;
        for (photons, squared) in [(1.0, 0.5), (2.0, 1.0 / 3.0), (3.0, 0.25)] {
            radius = radius.after(2, 0.5);
            assert_eq!(radius.photons, photons);
            assert!((radius.squared - squared).abs() < 1e-15);
        }
    }

    proptest! {
        #[test]
        fn a_pass_follows_from_the_one_before(pass in 0..100_000u32, alpha in 0.01..0.99f64) {
            let i = f64::from(pass) + 1.0;
            let expected = of_pass(pass, alpha) * (i + alpha) / (i + 1.0);
            prop_assert!((of_pass(pass + 1, alpha) / expected - 1.0).abs() < 1e-9);
        }

        #[test]
        fn a_pixel_keeps_the_density_of_its_photons(found in prop::collection::vec(0..50u32, 1..30), alpha in 0.01..0.99f64) {
            let mut radius = PixelRadius::FIRST;
            for found in found {
                let next = radius.after(found, alpha);
                let (density, before) = (next.photons / next.squared, (radius.photons + f64::from(found)) / radius.squared);
                prop_assert!((density - before).abs() <= 1e-12 * before);
                prop_assert!(next.squared <= radius.squared && next.squared > 0.0);
                radius = next;
            }
        }
    }
}
