//! Images reduced to square tiles of pixels, with the uncertainty of every mean.

use super::{Estimate, Moments};
use serde::{Deserialize, Serialize};

/// The weights of linear red, green and blue in luminance: ITU-R BT.709.
pub const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// The luminance of linear BT.709 radiance, in the units of its channels.
#[must_use]
pub fn luminance(rgb: [f64; 3]) -> f64 {
    LUMINANCE.iter().zip(rgb).map(|(weight, channel)| weight * channel).sum()
}

/// A division of an image of `width` × `height` pixels into tiles of `size` × `size` pixels, both row by row. The last
/// column and the last row of tiles may be smaller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Tiling {
    /// The width of the image in pixels.
    pub width: usize,
    /// The height of the image in pixels.
    pub height: usize,
    /// The side of a tile in pixels, at least 1.
    pub size: usize,
}

impl Tiling {
    /// Tiles across.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.width.div_ceil(self.size)
    }

    /// Tiles down.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.height.div_ceil(self.size)
    }

    /// The index of the tile that contains the pixel with this index.
    #[must_use]
    pub fn tile_of(&self, pixel: usize) -> usize {
        let (x, y) = (pixel % self.width, pixel / self.width);
        y / self.size * self.columns() + x / self.size
    }

    /// The number of pixels in each tile that are set in `mask`: the weights for [`TiledMeans::from_batches`].
    ///
    /// # Errors
    /// If `mask` does not have one entry per pixel.
    pub fn counts(&self, mask: &[bool]) -> Result<Vec<u32>, TilesError> {
        self.check("mask", mask.len())?;
        let mut counts = vec![0; self.columns() * self.rows()];
        for (pixel, _) in mask.iter().enumerate().filter(|(_, marked)| **marked) {
            counts[self.tile_of(pixel)] += 1;
        }
        Ok(counts)
    }

    /// The mean over the masked-in pixels of each tile, NaN in a tile without any: a batch for
    /// [`TiledMeans::from_batches`].
    ///
    /// # Errors
    /// If `pixels` or `mask` does not have one entry per pixel.
    pub fn means(&self, pixels: &[[f64; 3]], mask: &[bool]) -> Result<Vec<[f64; 3]>, TilesError> {
        self.check("pixels", pixels.len())?;
        let counts = self.counts(mask)?;
        let mut sums = vec![[0.0; 3]; counts.len()];
        for (pixel, _) in mask.iter().enumerate().filter(|(_, marked)| **marked) {
            let sum = &mut sums[self.tile_of(pixel)];
            *sum = std::array::from_fn(|c| sum[c] + pixels[pixel][c]);
        }
        Ok(sums.iter().zip(counts).map(|(sum, count)| sum.map(|x| x / f64::from(count))).collect())
    }

    fn check(&self, what: &'static str, found: usize) -> Result<(), TilesError> {
        expect_length(what, self.width * self.height, found)
    }
}

/// An image reduced to tiles, with the uncertainty of every mean: one side of a comparison.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TiledMeans {
    /// Tiles across.
    pub columns: usize,
    /// Tiles down.
    pub rows: usize,
    /// Red, green and blue of each tile, row by row; `None` where the tile is masked out.
    pub tiles: Vec<Option<[Estimate; 3]>>,
    /// The BT.709 luminance of each tile; `None` where the tile is masked out.
    pub luminance: Vec<Option<Estimate>>,
    /// Red, green and blue over all pixels that are not masked out, with equal weight for each pixel.
    pub global: [Estimate; 3],
}

/// An image with a variance for each pixel, whose pixels are independent.
#[derive(Debug, Clone, Copy)]
pub struct PixelMeans<'a> {
    /// Linear red, green and blue of each pixel, row by row.
    pub mean: &'a [[f64; 3]],
    /// The variance of each of those means, in squared units.
    pub variance_of_mean: &'a [[f64; 3]],
    /// The pixels to use: those that are estimated. Compare the others by a tolerance.
    pub mask: &'a [bool],
    /// The degrees of freedom of each variance: the number of samples per pixel minus 1.
    pub dof: f64,
}

/// An error in the input of a reduction to tiles.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TilesError {
    /// A slice does not have one entry for each pixel or tile.
    #[error("{what}: {found} entries where {expected} are needed")]
    Length {
        /// The name of the slice.
        what: &'static str,
        /// The expected number of entries.
        expected: usize,
        /// Its number of entries.
        found: usize,
    },
    /// Variances need at least two batches.
    #[error("{0} sub-render(s) give no variance: at least 2 are needed")]
    TooFewBatches(usize),
}

impl TiledMeans {
    /// The tiles of K >= 2 independent sub-renders, each reduced to `columns` × `rows` tile means in linear RGB.
    ///
    /// Variances come only from the scatter between sub-renders, so they are correct even if filters or samplers
    /// correlate pixels. Global means weight each tile by `weights`, its number of used pixels. A tile is masked out if
    /// its weight is 0 or any sub-render has a NaN there. A verdict rejects sides with different masks, so a NaN of one
    /// renderer is an error.
    ///
    /// # Errors
    /// If there are fewer than two batches, or lengths differ from `columns` × `rows`.
    pub fn from_batches(
        columns: usize,
        rows: usize,
        batches: &[Vec<[f64; 3]>],
        weights: &[u32],
    ) -> Result<Self, TilesError> {
        if batches.len() < 2 {
            return Err(TilesError::TooFewBatches(batches.len()));
        }
        let count = columns * rows;
        expect_length("weights", count, weights.len())?;
        for batch in batches {
            expect_length("batch", count, batch.len())?;
        }
        let is_nan = |tile: usize| batches.iter().any(|batch| batch[tile].iter().any(|x| x.is_nan()));
        let used: Vec<bool> = (0..count).map(|tile| weights[tile] > 0 && !is_nan(tile)).collect();

        let channels = |tile: usize| std::array::from_fn(|c| scatter(batches, |batch| batch[tile][c]));
        let total: f64 = (0..count).filter(|&tile| used[tile]).map(|tile| f64::from(weights[tile])).sum();
        let weighted = |batch: &[[f64; 3]], c: usize| {
            let used = (0..count).filter(|&tile| used[tile]);
            used.map(|tile| f64::from(weights[tile]) * batch[tile][c]).sum::<f64>() / total.max(1.0)
        };
        Ok(Self {
            columns,
            rows,
            tiles: (0..count).map(|tile| used[tile].then(|| channels(tile))).collect(),
            luminance: (0..count)
                .map(|tile| used[tile].then(|| scatter(batches, |batch| luminance(batch[tile]))))
                .collect(),
            global: std::array::from_fn(|c| scatter(batches, |batch| weighted(batch, c))),
        })
    }

    /// The tiles of one image with variances, assuming that its pixels are independent (box filter, independent
    /// sampler, no photons shared between pixels).
    ///
    /// The correlation of the channels within a pixel is unknown, so the variance of the luminance is an upper bound:
    /// it assumes perfectly correlated channels. It is exact for grey noise and conservative otherwise.
    ///
    /// # Errors
    /// If a slice does not have one entry per pixel.
    pub fn from_pixels(tiling: &Tiling, pixels: &PixelMeans<'_>) -> Result<Self, TilesError> {
        tiling.check("mean", pixels.mean.len())?;
        tiling.check("variance of the mean", pixels.variance_of_mean.len())?;
        tiling.check("mask", pixels.mask.len())?;
        let mut tiles = vec![[PixelSum::default(); 4]; tiling.columns() * tiling.rows()];
        let mut global = [PixelSum::default(); 4];
        for pixel in (0..pixels.mask.len()).filter(|&pixel| pixels.mask[pixel]) {
            let (mean, variance) = (pixels.mean[pixel], pixels.variance_of_mean[pixel]);
            let grey_variance = luminance(variance.map(f64::sqrt)).powi(2);
            let values = [
                (mean[0], variance[0]),
                (mean[1], variance[1]),
                (mean[2], variance[2]),
                (luminance(mean), grey_variance),
            ];
            for sums in [&mut tiles[tiling.tile_of(pixel)], &mut global] {
                sums.iter_mut().zip(values).for_each(|(sum, (mean, variance))| sum.push(mean, variance));
            }
        }
        let estimate = |sum: &PixelSum| sum.estimate(pixels.dof);
        let rgb = |sums: &[PixelSum; 4]| std::array::from_fn(|c| estimate(&sums[c]));
        Ok(Self {
            columns: tiling.columns(),
            rows: tiling.rows(),
            tiles: tiles.iter().map(|sums| (sums[0].n > 0).then(|| rgb(sums))).collect(),
            luminance: tiles.iter().map(|sums| (sums[3].n > 0).then(|| estimate(&sums[3]))).collect(),
            global: rgb(&global),
        })
    }
}

/// The estimate of a quantity of each batch, with the variance from the scatter between batches.
fn scatter(batches: &[Vec<[f64; 3]>], quantity: impl Fn(&[[f64; 3]]) -> f64) -> Estimate {
    let moments: Moments = batches.iter().map(|batch| quantity(batch)).collect();
    Estimate::from_moments(&moments).expect("there are at least two batches")
}

/// Sums over independent pixels: of means, of variances, and of squared variances for the degrees of freedom.
#[derive(Debug, Clone, Copy, Default)]
struct PixelSum {
    n: u32,
    mean: f64,
    variance: f64,
    variance_sq: f64,
}

impl PixelSum {
    fn push(&mut self, mean: f64, variance: f64) {
        self.n += 1;
        self.mean += mean;
        self.variance += variance;
        self.variance_sq += variance * variance;
    }

    /// The mean over the pixels, with (Σv)² / Σ(v²/d) degrees of freedom, Satterthwaite 1946.
    fn estimate(&self, dof: f64) -> Estimate {
        let n = f64::from(self.n.max(1));
        let pooled = self.variance * self.variance / self.variance_sq;
        Estimate {
            mean: self.mean / n,
            variance_of_mean: self.variance / (n * n),
            dof: if pooled.is_finite() { dof * pooled } else { dof },
        }
    }
}

fn expect_length(what: &'static str, expected: usize, found: usize) -> Result<(), TilesError> {
    if expected == found { Ok(()) } else { Err(TilesError::Length { what, expected, found }) }
}

#[cfg(test)]
mod tests {
    use super::super::draws::Draws;
    use super::*;

    const TILING: Tiling = Tiling { width: 5, height: 3, size: 2 };

    #[test]
    fn tiles_contain_pixels_row_by_row() {
        assert_eq!((TILING.columns(), TILING.rows()), (3, 2));
        let tiles: Vec<usize> = (0..15).map(|pixel| TILING.tile_of(pixel)).collect();
        assert_eq!(tiles, [0, 0, 1, 1, 2, 0, 0, 1, 1, 2, 3, 3, 4, 4, 5]);
    }

    #[test]
    fn tile_means_use_only_masked_in_pixels() {
        let pixels: Vec<[f64; 3]> = (0..15).map(|i| [f64::from(i), 1.0, 2.0 * f64::from(i)]).collect();
        let mut mask = vec![true; 15];
        for pixel in [0, 4, 9] {
            mask[pixel] = false;
        }
        assert_eq!(TILING.counts(&mask).unwrap(), [3, 4, 0, 2, 2, 1]);
        let means = TILING.means(&pixels, &mask).unwrap();
        assert_eq!(means[0], [4.0, 1.0, 8.0]);
        assert!(means[2].iter().all(|x| x.is_nan()));
        assert_eq!(means[5], [14.0, 1.0, 28.0]);
    }

    #[test]
    fn estimates_from_batches_match_values_by_hand() {
        // Two batches, two used tiles of weights 3 and 1, one tile masked by its weight and one by a NaN.
        let batches = [
            vec![[1.0, 2.0, 4.0], [5.0, 0.0, 0.0], [9.0; 3], [1.0; 3]],
            vec![[3.0, 2.0, 0.0], [1.0, 0.0, 0.0], [9.0; 3], [1.0, f64::NAN, 1.0]],
        ];
        let side = TiledMeans::from_batches(2, 2, &batches, &[3, 1, 0, 4]).unwrap();
        let red = side.tiles[0].unwrap()[0];
        assert_eq!(red, Estimate { mean: 2.0, variance_of_mean: 1.0, dof: 1.0 });
        assert_eq!(side.tiles[2..], [None, None]);
        assert_eq!(side.luminance[2..], [None, None]);
        // (3·1 + 5)/4 = 2 and (3·3 + 1)/4 = 2.5.
        assert_eq!(side.global[0], Estimate { mean: 2.25, variance_of_mean: 0.0625, dof: 1.0 });
        // The channels are anticorrelated, so the luminance has less variance than they have.
        let luminance = side.luminance[0].unwrap();
        let half_step = 0.5 * (0.2126 * 2.0 - 0.0722 * 4.0);
        assert!((luminance.variance_of_mean - half_step * half_step).abs() < 1e-15);
    }

    #[test]
    fn wrong_lengths_are_rejected() {
        let batch = || vec![[1.0; 3]; 4];
        let rejected = |batches: &[Vec<[f64; 3]>], weights: &[u32]| {
            TiledMeans::from_batches(2, 2, batches, weights).unwrap_err().to_string()
        };
        assert_eq!(rejected(&[batch()], &[1; 4]), "1 sub-render(s) give no variance: at least 2 are needed");
        assert_eq!(rejected(&[batch(), batch()], &[1; 3]), "weights: 3 entries where 4 are needed");
        assert_eq!(rejected(&[batch(), vec![]], &[1; 4]), "batch: 0 entries where 4 are needed");
        assert!(TILING.means(&batch(), &[true; 15]).is_err() && TILING.counts(&[true; 4]).is_err());
    }

    #[test]
    fn independent_pixels_agree_with_batches() {
        // The same 400 grey sub-renders, once by their scatter and once by pixel variances.
        let (tiling, mut draws) = (Tiling { width: 8, height: 4, size: 4 }, Draws::new(9));
        let mut mask = vec![true; 32];
        mask[3] = false;
        let renders: Vec<Vec<[f64; 3]>> = (0..400)
            .map(|_| {
                (0..32)
                    .map(|i| {
                        [f64::from(i), 1.0, 0.5].map({
                            let noise = draws.normal();
                            move |x| x + (x + 1.0) * noise
                        })
                    })
                    .collect()
            })
            .collect();
        let batches: Vec<_> = renders.iter().map(|r| tiling.means(r, &mask).unwrap()).collect();
        let scatter = TiledMeans::from_batches(2, 1, &batches, &tiling.counts(&mask).unwrap()).unwrap();

        let moments = |pixel: usize, c: usize| renders.iter().map(|r| r[pixel][c]).collect::<Moments>();
        let each = |of: &dyn Fn(Moments) -> f64| -> Vec<[f64; 3]> {
            (0..32).map(|pixel| std::array::from_fn(|c| of(moments(pixel, c)))).collect()
        };
        let (mean, variance) = (each(&|m| m.mean), each(&|m| m.variance_of_mean().unwrap()));
        let pixels = PixelMeans { mean: &mean, variance_of_mean: &variance, mask: &mask, dof: 399.0 };
        let independent = TiledMeans::from_pixels(&tiling, &pixels).unwrap();

        let flat = |side: &TiledMeans| -> Vec<Estimate> {
            let tiles = side.tiles.iter().flat_map(|tile| tile.unwrap());
            tiles.chain(side.luminance.iter().map(|l| l.unwrap())).chain(side.global).collect()
        };
        for (a, b) in flat(&scatter).iter().zip(flat(&independent)) {
            assert!((a.mean - b.mean).abs() < 1e-12 * a.mean.abs());
            // A variance from 400 renders has a relative standard error of √(2/399) = 7 %; the bound is four of them.
            assert!((a.variance_of_mean / b.variance_of_mean - 1.0).abs() < 0.28, "{a:?} {b:?}");
            assert!(b.dof > 399.0 && b.dof <= 31.0 * 399.0 + 1e-6, "{b:?}");
        }
    }

    #[test]
    fn exact_pixels_have_a_defined_dof() {
        let tiling = Tiling { width: 2, height: 1, size: 2 };
        let pixels = PixelMeans { mean: &[[1.0; 3]; 2], variance_of_mean: &[[0.0; 3]; 2], mask: &[true; 2], dof: 15.0 };
        let side = TiledMeans::from_pixels(&tiling, &pixels).unwrap();
        assert_eq!(side.global, [Estimate { mean: 1.0, variance_of_mean: 0.0, dof: 15.0 }; 3]);
    }
}
