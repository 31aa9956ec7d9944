//! Pearson's chi-square test of counts against expected counts.

use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// A chi-square test: Pearson 1900 for counts, or a sum of squared standard normals.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Chi2 {
    /// Sum over cells of (observed - expected)² / expected, or of z².
    #[serde(with = "super::float")]
    pub statistic: f64,
    /// Degrees of freedom.
    pub dof: f64,
    /// The probability of a statistic at least this large if the null hypothesis is true.
    pub p: f64,
    /// The number of given cells that were pooled with others because of a small expected count.
    pub pooled: usize,
}

/// One cell of the test, or several pooled cells.
#[derive(Debug, Clone, Copy, Default)]
struct Cell {
    expected: f64,
    observed: f64,
    members: usize,
}

impl Cell {
    fn absorb(&mut self, other: Self) {
        self.expected += other.expected;
        self.observed += other.observed;
        self.members += other.members;
    }
}

impl Chi2 {
    /// Tests `observed` counts against `expected` counts of the same length, at least 0.
    ///
    /// Cells with an expected count below `min_expected` (5 is usual: Cochran 1954) are pooled, from the smallest up,
    /// until each pooled cell expects that much. The rest joins the last cell. All cells are tested; none is dropped. A
    /// positive count in a cell with expected count 0 is impossible and gives p = 0.
    ///
    /// `constraints` is the number of parameters of the expected counts that were computed from the observed ones: 1 if
    /// they were scaled to the same total. Returns `None` if no degree of freedom remains.
    ///
    /// # Panics
    /// If the lengths differ, or an expected count is negative or not finite.
    #[must_use]
    pub fn goodness_of_fit(observed: &[u64], expected: &[f64], min_expected: f64, constraints: usize) -> Option<Self> {
        assert_eq!(observed.len(), expected.len(), "every cell has an observed and an expected count");
        assert!(
            expected.iter().all(|e| (0.0..f64::INFINITY).contains(e)),
            "an expected count is finite and at least 0"
        );
        let given = observed.iter().zip(expected);
        let impossible = given.clone().any(|(&o, &e)| e == 0.0 && o > 0);
        let cells = given
            .filter(|&(_, &expected)| expected > 0.0)
            .map(|(&o, &expected)| Cell { expected, observed: o as f64, members: 1 })
            .collect();
        let cells = pool(cells, min_expected);

        let pooled = cells.iter().filter(|cell| cell.members > 1).map(|cell| cell.members).sum();
        let dof = cells.len().saturating_sub(constraints) as f64;
        if impossible {
            return Some(Self { statistic: f64::INFINITY, dof, p: 0.0, pooled });
        }
        let statistic = cells.iter().map(|c| (c.observed - c.expected).powi(2) / c.expected).sum();
        (dof > 0.0).then(|| Self { statistic, dof, p: tail(statistic, dof), pooled })
    }

    /// Tests that the `z` are independent standard normals, one-sided against too large squares. Without any, the
    /// statistic and dof are 0 and p is 1.
    #[must_use]
    pub fn sum_of_squares(z: &[f64]) -> Self {
        Self::of_squares(z.iter().map(|z| z * z).sum(), z.len())
    }

    /// Tests a sum of squares with `dof` degrees of freedom. With 0 degrees of freedom, p is 1.
    #[must_use]
    pub fn of_squares(statistic: f64, dof: usize) -> Self {
        let p = if dof == 0 { 1.0 } else { tail(statistic, dof as f64) };
        Self { statistic, dof: dof as f64, p, pooled: 0 }
    }
}

/// Pools cells from the smallest expected count up until each expects at least `min_expected`.
fn pool(mut cells: Vec<Cell>, min_expected: f64) -> Vec<Cell> {
    // The sort is stable, so cells of equal expected counts are pooled in the given order.
    cells.sort_by(|a, b| a.expected.total_cmp(&b.expected));
    let mut pooled: Vec<Cell> = Vec::with_capacity(cells.len());
    let mut open = Cell::default();
    for cell in cells {
        open.absorb(cell);
        if open.expected >= min_expected {
            pooled.push(std::mem::take(&mut open));
        }
    }
    if open.members > 0 {
        match pooled.last_mut() {
            Some(last) => last.absorb(open),
            None => pooled.push(open),
        }
    }
    pooled
}

/// P(χ² > statistic).
fn tail(statistic: f64, dof: f64) -> f64 {
    ChiSquared::new(dof).expect("degrees of freedom are above 0").sf(statistic)
}

#[cfg(test)]
mod tests {
    use super::super::Ks;
    use super::super::draws::Draws;
    use super::*;

    #[test]
    fn agrees_with_scipy() {
        // scipy 1.17.1: chisquare([16, 18, 16, 14, 12, 12], [16, 16, 16, 16, 16, 8]).
        let chi2 = Chi2::goodness_of_fit(&[16, 18, 16, 14, 12, 12], &[16.0, 16.0, 16.0, 16.0, 16.0, 8.0], 5.0, 1);
        let chi2 = chi2.unwrap();
        assert_eq!((chi2.statistic, chi2.dof, chi2.pooled), (3.5, 5.0, 0));
        assert!((chi2.p / 0.623_387_627_749_582_2 - 1.0).abs() < 1e-11, "{chi2:?}");

        // scipy 1.17.1: chi2.sf(x, dof).
        for (x, dof, p) in [
            (120.0, 64.0, 2.829_965_629_754_399_5e-5),
            (400.0, 64.0, 4.272_581_226_061_48e-50),
            (10_400.0, 10_000.0, 2.584_813_495_353_811_4e-3),
            (1.0, 1.0, 0.317_310_507_862_911_15),
        ] {
            assert!((tail(x, dof) / p - 1.0).abs() < 1e-9, "{x} {dof}");
        }
    }

    #[test]
    fn pooled_cells_are_tested() {
        // Twelve cells expect 0.5 each and hold 5 each: without pooling the test would not reject.
        let observed = [[100; 4].as_slice(), &[5; 12]].concat();
        let expected = [[113.5; 4].as_slice(), &[0.5; 12]].concat();
        let chi2 = Chi2::goodness_of_fit(&observed, &expected, 5.0, 1).unwrap();
        // Ten cells make up the 5; the other two join the next regular cell.
        assert_eq!((chi2.pooled, chi2.dof), (13, 4.0));
        let by_hand = 3.0 * 13.5 * 13.5 / 113.5 + (110.0 - 114.5_f64).powi(2) / 114.5 + 45.0 * 45.0 / 5.0;
        assert!((chi2.statistic - by_hand).abs() < 1e-12, "{chi2:?}");
        assert!(chi2.p < 1e-50);
    }

    #[test]
    fn a_remaining_pool_is_tested_too() {
        let chi2 = Chi2::goodness_of_fit(&[40, 20, 1, 9], &[40.0, 26.0, 2.0, 2.0], 5.0, 0).unwrap();
        // 2 + 2 + 26 make one cell that holds 30.
        assert_eq!((chi2.statistic, chi2.dof, chi2.pooled), (0.0, 2.0, 3));
        let small = Chi2::goodness_of_fit(&[3, 0, 0], &[1.0, 1.0, 1.0], 5.0, 0).unwrap();
        assert_eq!((small.statistic, small.dof, small.pooled), (0.0, 1.0, 3));
        // 4 + 4 make one cell; the last 4 are too few for another and join it.
        let last = Chi2::goodness_of_fit(&[4, 4, 40], &[4.0; 3], 5.0, 0).unwrap();
        assert_eq!((last.statistic, last.dof, last.pooled), (36.0 * 36.0 / 12.0, 1.0, 3));
        assert_eq!(Chi2::goodness_of_fit(&[3, 0, 0], &[1.0, 1.0, 1.0], 5.0, 1), None);
    }

    #[test]
    fn a_count_in_a_cell_of_expected_count_zero_is_rejected() {
        let observed = [1000, 1000, 1];
        assert_eq!(Chi2::goodness_of_fit(&observed, &[1000.5, 1000.5, 0.0], 5.0, 1).unwrap().p, 0.0);
        let empty = Chi2::goodness_of_fit(&[1000, 1001, 0], &[1000.5, 1000.5, 0.0], 5.0, 1).unwrap();
        assert_eq!((empty.dof, empty.pooled), (1.0, 0));
    }

    #[test]
    fn p_values_are_uniform_under_the_null() {
        // Geometric cells, expected 500, 250, ... 0.5: the last five are pooled.
        let probability: Vec<f64> = (1..=10).map(|k| 0.5_f64.powi(k.min(9))).collect();
        let expected: Vec<f64> = probability.iter().map(|p| 1024.0 * p).collect();
        let mut draws = Draws::new(5);
        let p: Vec<f64> = (0..2000)
            .map(|_| {
                let mut observed = [0; 10];
                for _ in 0..1024 {
                    let halvings = (-draws.uniform().log2()).floor() as usize;
                    observed[halvings.min(9)] += 1;
                }
                Chi2::goodness_of_fit(&observed, &expected, 5.0, 1).unwrap().p
            })
            .collect();
        let ks = Ks::one_sample(&p, |p| p);
        assert!(ks.p > 0.01, "{ks:?}");
    }
}
