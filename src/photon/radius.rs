//! Radius reduction of density estimates over the passes, so that bias and variance both vanish. Squared radii are
//! relative to the first pass.

use statrs::function::gamma::ln_gamma;

/// The squared radius in a pass (counted from 0), the same for all pixels. From the i-th pass (counted from 1) to the
/// next, it changes by the factor `(i + α) / (i + 1)`, so it tends to `i^(α-1) / Γ(1+α)`. Passes are independent.
///
/// The variance of the mean of n passes falls like `n^-α` and its bias like `n^(α-1)`; α = 2/3 minimizes the mean
/// square error asymptotically. Knaus and Zwicker 2011, "Progressive Photon Mapping: A Probabilistic Approach", eq.
/// (15).
#[must_use]
pub fn of_pass(pass: u32, alpha: f64) -> f64 {
    let i = f64::from(pass) + 1.0;
    // The product in closed form, by Γ(x + 1) = x Γ(x).
    (ln_gamma(i + alpha) - ln_gamma(1.0 + alpha) - ln_gamma(i + 1.0)).exp()
}

/// The radius of one pixel, which shrinks depending on the photons that the pixel finds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelRadius {
    /// The squared radius, relative to the first pass.
    pub squared: f64,
    /// The accumulated photon count N of Hachisuka and Jensen 2009. [`PixelRadius::after_test`] counts the photons
    /// found within the current radius instead.
    pub photons: f64,
    /// The sum of the photons' squared distances over the squared radius, used by [`PixelRadius::after_test`] only.
    pub squared_distances: f64,
}

/// The photons that a pixel finds in a pass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PassCounts {
    /// The number of photons.
    pub photons: u32,
    /// The sum of their squared distances over the squared radius.
    pub squared_distances: f64,
}

/// The minimum number of photons for the test of bias.
const MIN_COUNT: f64 = 8.0;
/// The deviation of the mean squared distance, in standard errors, from which it indicates bias.
const MAX_DEVIATION: f64 = 2.0;
/// The factor by which the squared radius then shrinks.
const SHRINKAGE: f64 = 0.5;

impl PixelRadius {
    /// The radius of the first pass.
    pub const FIRST: Self = Self { squared: 1.0, photons: 0.0, squared_distances: 0.0 };

    /// The radius after a pass, reduced only if the photons' distances indicate that the estimate is biased.
    ///
    /// A photon's squared distance over the squared radius is uniform on [0, 1] if the density's average over circles
    /// around the centre is constant. Its mean is `1/2 + b/6` if the estimate has the relative bias b, to first order
    /// in the density's Laplacian. A mean that differs from 1/2 by more than its noise therefore indicates bias.
    /// Gradients that cancel do not shrink the disc. The disc then shrinks to half its area, and the counts restart.
    /// Where the density is constant, the radius shrinks only by false alarms. Elsewhere it shrinks like `n^(-1/6)`,
    /// the optimal rate.
    ///
    /// Similar to Lin et al. 2020, "CPPM: Chi-squared Progressive Photon Mapping", who test whether the density is
    /// constant over the whole disc; the aim is the same as in Kaplanyan and Dachsbacher 2013, "Adaptive Progressive
    /// Photon Mapping".
    #[must_use]
    pub fn after_test(self, found: PassCounts) -> Self {
        let (photons, squared_distances) =
            (self.photons + f64::from(found.photons), self.squared_distances + found.squared_distances);
        // The variance of a uniform variable on [0, 1] is 1/12.
        let deviation = (squared_distances - 0.5 * photons).abs() / (photons / 12.0).sqrt();
        if photons < MIN_COUNT || deviation < MAX_DEVIATION {
            return Self { photons, squared_distances, ..self };
        }
        Self { squared: SHRINKAGE * self.squared, photons: 0.0, squared_distances: 0.0 }
    }

    /// The radius after a pass that found `found` photons within it, of which the fraction α is kept.
    ///
    /// Where the density is constant, a pass finds photons in proportion to the disc's area. The squared radius after n
    /// passes is then `Γ(n+α) / (Γ(α) Γ(n+1))`, which tends to `n^(α-1) / Γ(α)`: the rate of [`of_pass`], starting from
    /// α after the first pass. If every pass found the same number of photons for any area, it would be
    /// `Γ(n+1) Γ(1/α) / Γ(n+1/α)`. Hachisuka and Jensen 2009, "Stochastic Progressive Photon Mapping", eq. (3) and (4).
    #[must_use]
    pub fn after(self, found: u32, alpha: f64) -> Self {
        if found == 0 {
            return self;
        }
        let found = f64::from(found);
        let kept = self.photons + alpha * found;
        Self { squared: self.squared * (kept / (self.photons + found)), photons: kept, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rng::Stream;
    use proptest::prelude::*;

    #[test]
    fn the_first_radii_match_values_by_hand() {
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

    /// Passes of `each` photons, whose squared distances have the density `1 + slope (x - 1/2)` on [0, 1].
    fn passes(slope: f64, each: u32, seed: u64) -> impl Iterator<Item = PassCounts> {
        let mut stream = Stream::at(&[seed]);
        let draw = move || loop {
            let x = stream.next_1d();
            if stream.next_1d() * (1.0 + 0.5 * slope.abs()) < 1.0 + slope * (x - 0.5) {
                return x;
            }
        };
        let mut draw = draw;
        std::iter::repeat_with(move || PassCounts { photons: each, squared_distances: (0..each).map(|_| draw()).sum() })
    }

    #[test]
    fn biased_estimates_shrink_the_radius_and_unbiased_ones_hardly_do() {
        let after = |slope: f64| -> f64 {
            let run =
                |seed| passes(slope, 10, seed).take(100).fold(PixelRadius::FIRST, PixelRadius::after_test).squared;
            (0..200).map(run).sum::<f64>() / 200.0
        };
        let even = after(0.0);
        // By the law of the iterated logarithm, the deviation exceeds two standard errors again and again: some alarms
        // are false.
        assert!((0.6..0.95).contains(&even), "{even}");
        // The slope and therefore the bias stay constant here, so the radius keeps shrinking.
        assert!(after(0.5) < 0.2 && after(-0.5) < 0.2);
    }

    #[test]
    fn gradients_that_cancel_do_not_shrink_the_radius() {
        // Photons of a disc centred on a shadow boundary have the distances of a constant density.
        let exactly = PassCounts { photons: 1000, squared_distances: 500.0 };
        assert_eq!(PixelRadius::FIRST.after_test(exactly).squared, 1.0);
    }

    proptest! {
        #[test]
        fn consecutive_passes_satisfy_the_recursion(pass in 0..100_000u32, alpha in 0.01..0.99f64) {
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
