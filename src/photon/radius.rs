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
    /// The photons that would be within it if the density of those found so far were the same everywhere; to
    /// [`PixelRadius::after_test`], those found within the current radius.
    pub photons: f64,
    /// Their sum of squares of distances over the square of the radius; of [`PixelRadius::after_test`] alone.
    pub squared_distances: f64,
}

/// What a pixel finds in a pass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PassCounts {
    /// Photons.
    pub photons: u32,
    /// The sum of the squares of their distances over the square of the radius.
    pub squared_distances: f64,
}

/// From how many photons on their spread is put to the test.
const MIN_COUNT: f64 = 8.0;
/// How many standard errors of the spread of even light tell that the light is not even.
const TELLING: f64 = 2.0;
/// What is left of the square of the radius then.
const LEFT: f64 = 0.5;

impl PixelRadius {
    /// Before the first pass.
    pub const FIRST: Self = Self { squared: 1.0, photons: 0.0, squared_distances: 0.0 };

    /// After a pass, by the error: the radius stays as long as photons are spread over the disc as if the estimate were
    /// unbiased.
    ///
    /// The square of a photon's distance over that of the radius is uniform on [0, 1] where the density is even on
    /// average around the middle, and has the mean `1/2 + b/6` where the estimate has the relative bias b, to first order in
    /// the density's Laplacian. So a mean that is further from 1/2 than its noise explains tells of bias, and of nothing
    /// else: slopes that cancel do not shrink the disc. The disc shrinks to half its area then, and counting begins anew.
    /// In even light the radius never shrinks, but by false alarms; elsewhere like `n^(-1/6)`, which is the best rate.
    ///
    /// In the manner of Lin et al. 2020, "CPPM: Chi-squared Progressive Photon Mapping", who test the evenness of the whole
    /// disc, and with the aim of Kaplanyan and Dachsbacher 2013, "Adaptive Progressive Photon Mapping".
    #[must_use]
    pub fn after_test(self, found: PassCounts) -> Self {
        let (photons, squared_distances) =
            (self.photons + f64::from(found.photons), self.squared_distances + found.squared_distances);
        // The variance of a uniform number is 1/12.
        let deviation = (squared_distances - 0.5 * photons).abs() / (photons / 12.0).sqrt();
        if photons < MIN_COUNT || deviation < TELLING {
            return Self { photons, squared_distances, ..self };
        }
        Self { squared: LEFT * self.squared, photons: 0.0, squared_distances: 0.0 }
    }

    /// After a pass that found so many photons within it: of those added, the share α stays within.
    ///
    /// In even light a pass finds photons in proportion to the disc, so that the square after n passes is
    /// `Γ(n+α) / (Γ(α) Γ(n+1))`, which tends to `n^(α-1) / Γ(α)`: at the rate of [`of_pass`], from α after the first pass on.
    /// If every pass found the same number whatever the disc, it would be `Γ(n+1) Γ(1/α) / Γ(n+1/α)`.
    /// Hachisuka and Jensen 2009, "Stochastic Progressive Photon Mapping", eq. (3) and (4).
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

    /// SampleStream of [0, 1] with the density `1 + slope (x - 1/2)`, so many in each pass.
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
    fn uneven_light_shrinks_a_radius_and_even_light_hardly_does() {
        let after = |slope: f64| -> f64 {
            let run =
                |seed| passes(slope, 10, seed).take(100).fold(PixelRadius::FIRST, PixelRadius::after_test).squared;
            (0..200).map(run).sum::<f64>() / 200.0
        };
        let even = after(0.0);
        // The law of the iterated logarithm keeps two standard errors from lasting: some alarms are false.
        assert!((0.6..0.95).contains(&even), "{even}");
        // The radius shrinks for as long as the bias, half the slope, shows; here the slope stays.
        assert!(after(0.5) < 0.2 && after(-0.5) < 0.2);
    }

    #[test]
    fn slopes_that_cancel_do_not_shrink_a_radius() {
        // The photons of a disc on the border of a shadow: their distances are spread as in even light.
        let exactly = PassCounts { photons: 1000, squared_distances: 500.0 };
        assert_eq!(PixelRadius::FIRST.after_test(exactly).squared, 1.0);
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
