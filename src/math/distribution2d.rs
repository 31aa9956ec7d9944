use glam::DVec2;

use super::{DiscreteSample, Distribution1D};

/// A density on the unit square that is proportional to a bilinear interpolant of values at the nodes of a grid, whose
/// outer nodes lie on the border of the square. Pharr, Jakob and Humphreys 2023, *Physically Based Rendering*, sections
/// A.4 and A.5.
#[derive(Clone, Debug)]
pub struct BilinearDistribution {
    columns: usize,
    values: Vec<f32>,
    /// The rows of cells, in proportion to their sums.
    rows: Distribution1D,
    /// The cells of each row.
    cells: Vec<Distribution1D>,
}

impl BilinearDistribution {
    /// The density of values at the nodes, row by row, in at least two columns and two rows. No value may be negative.
    #[must_use]
    pub fn new(columns: usize, values: Vec<f32>) -> Self {
        let at = |i: usize| f64::from(values[i]);
        let cell = |i: usize| 0.25 * (at(i) + at(i + 1) + at(i + columns) + at(i + columns + 1));
        let row = |y: usize| Distribution1D::new((0..columns - 1).map(|x| cell(y * columns + x)).collect::<Vec<_>>());
        let cells: Vec<_> = (0..values.len() / columns - 1).map(row).collect();
        let rows = Distribution1D::new(cells.iter().map(Distribution1D::total).collect::<Vec<_>>());
        Self { columns, values, rows, cells }
    }

    /// The integral of the interpolant over the unit square.
    #[must_use]
    pub fn integral(&self) -> f64 {
        self.rows.total() / (self.cells.len() * (self.columns - 1)) as f64
    }

    /// The density at a point of the unit square; 0 if all values are 0.
    #[must_use]
    pub fn pdf(&self, p: DVec2) -> f64 {
        let integral = self.integral();
        if integral > 0.0 { self.interpolated(p) / integral } else { 0.0 }
    }

    /// Samples a point of the unit square, and returns its density; `None` if all values are 0.
    #[must_use]
    pub fn sample(&self, u: DVec2) -> Option<(DVec2, f64)> {
        if self.rows.total() == 0.0 {
            return None;
        }
        let DiscreteSample { index: y, remapped: v } = self.rows.sample(u.y);
        let DiscreteSample { index: x, remapped: u } = self.cells[y].sample(u.x);
        let [[a, b], [c, d]] = self.corners(x, y);
        let v = sample_linear(v, a + b, c + d);
        let u = sample_linear(u, a + v * (c - a), b + v * (d - b));
        let p = (DVec2::new(x as f64, y as f64) + DVec2::new(u, v)) / self.size();
        Some((p, self.pdf(p)))
    }

    /// The number of cells along each axis.
    fn size(&self) -> DVec2 {
        DVec2::new((self.columns - 1) as f64, self.cells.len() as f64)
    }

    /// The values at the corners of a cell, row by row.
    fn corners(&self, x: usize, y: usize) -> [[f64; 2]; 2] {
        let i = y * self.columns + x;
        [i, i + self.columns].map(|i| [i, i + 1].map(|i| f64::from(self.values[i])))
    }

    fn interpolated(&self, p: DVec2) -> f64 {
        let (p, most) = (p * self.size(), self.size() - 1.0);
        let cell = p.floor().clamp(DVec2::ZERO, most);
        let [[a, b], [c, d]] = self.corners(cell.x as usize, cell.y as usize);
        let t = p - cell;
        let across = |from: f64, to: f64| from + t.x * (to - from);
        across(a, b) + t.y * (across(c, d) - across(a, b))
    }
}

/// Samples [0, 1] with a density that is linear between values at both ends, one of which is above 0.
fn sample_linear(u: f64, from: f64, to: f64) -> f64 {
    if from == to || u == 0.0 {
        return u;
    }
    // The root of the quadratic CDF, in the form without cancellation.
    let root = (from * from + u * (to * to - from * from)).max(0.0).sqrt();
    (u * (from + to) / (from + root)).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distribution() -> BilinearDistribution {
        BilinearDistribution::new(4, vec![0.0, 1.0, 3.0, 0.5, 2.0, 0.0, 0.0, 4.0, 1.0, 0.0, 0.0, 0.0])
    }

    #[test]
    fn the_density_integrates_to_one_and_samples_have_it() {
        const N: u32 = 600;
        let distribution = distribution();
        let centre = |i: u32| (f64::from(i) + 0.5) / f64::from(N);
        let points = || (0..N * N).map(|i| DVec2::new(centre(i % N), centre(i / N)));
        let square = f64::from(N * N);
        assert!((points().map(|p| distribution.pdf(p)).sum::<f64>() / square - 1.0).abs() < 1e-5);
        // The mean of a function over stratified samples is its integral with the density.
        let function = |p: DVec2| (3.0 * p.x).sin() + p.y * p.y * p.x;
        let sampled = points().map(|u| {
            let (p, pdf) = distribution.sample(u).expect("some values are above 0");
            assert!((pdf - distribution.pdf(p)).abs() < 1e-12);
            function(p)
        });
        let expected = points().map(|p| function(p) * distribution.pdf(p)).sum::<f64>() / square;
        // The map from u jumps between cells, within strata.
        assert!((sampled.sum::<f64>() / square - expected).abs() < 1e-3);
    }

    #[test]
    fn cells_of_zero_are_not_sampled_and_nothing_is_sampled_from_zeros() {
        let distribution = distribution();
        for i in 0..1000 {
            let u = DVec2::new((f64::from(i % 100) + 0.5) / 100.0, (f64::from(i) + 0.5) / 1000.0);
            let (p, pdf) = distribution.sample(u).expect("some values are above 0");
            assert!(pdf > 0.0 && !(p.x > 1.0 / 3.0 && p.x < 2.0 / 3.0 && p.y > 0.5), "{p}");
        }
        let zero = BilinearDistribution::new(2, vec![0.0; 4]);
        assert!(zero.sample(DVec2::splat(0.5)).is_none() && zero.pdf(DVec2::splat(0.5)) == 0.0);
    }
}
