//! The error metrics of one image.

use super::{
    flip,
    ground_truth::{Picture, Target},
    ssim,
};
use crate::{
    comparison::{Metrics, TILE},
    film::picture::{self, RgbImage},
    stats::Tiling,
};

/// The error metrics of one image. They account neither for its noise nor for the noise of the reference.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measures {
    /// Metrics over all pixels.
    pub(super) metrics: Metrics,
    /// The RMSE over the pixels of the mask.
    pub(super) rmse_masked: Option<f64>,
    /// The largest RMSE of a tile of 8 x 8 pixels.
    pub(super) worst_tile: f64,
    /// The mean RMSE of the tiles.
    pub(super) mean_tile: f64,
    /// The mean FLIP of both pictures in sRGB, with the automatic exposure of the reference.
    pub(super) flip: f64,
    /// The mean SSIM of the same pictures; None if they are smaller than its window.
    pub(super) ssim: Option<f64>,
}

impl Measures {
    /// Measures an image that has the size of its reference.
    pub(super) fn new(image: &Picture, target: &Target) -> Self {
        let squares: Vec<f64> = image.pixels.iter().zip(&target.pixels).map(|(a, b)| squared(*a, *b)).collect();
        let tiles = tiles(&squares, image.width, image.height);
        let [ours, theirs] = pictures(image, target);
        Self {
            metrics: Metrics::new(&image.pixels, &target.pixels),
            rmse_masked: target.mask.as_ref().map(|mask| {
                let marked: Vec<f64> =
                    squares.iter().zip(mask).filter(|(_, counts)| **counts).map(|(s, _)| *s).collect();
                (marked.iter().sum::<f64>() / marked.len() as f64).sqrt()
            }),
            worst_tile: tiles.iter().fold(0.0, |worst: f64, tile| worst.max(*tile)),
            mean_tile: tiles.iter().sum::<f64>() / tiles.len() as f64,
            flip: flip::mean(&ours, &theirs),
            ssim: ssim::mean(&ours, &theirs),
        }
    }
}

/// The mean squared difference of the channels of a pixel.
fn squared(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / 3.0
}

/// The RMSE of every tile.
fn tiles(squares: &[f64], width: usize, height: usize) -> Vec<f64> {
    let tiling = Tiling { width, height, size: TILE };
    let mut sums = vec![(0.0, 0.0); tiling.columns() * tiling.rows()];
    for (pixel, square) in squares.iter().enumerate() {
        let (sum, count) = &mut sums[tiling.tile_of(pixel)];
        *sum += square;
        *count += 1.0;
    }
    sums.into_iter().map(|(sum, count): (f64, f64)| (sum / count).sqrt()).collect()
}

/// Both pictures with the exposure of the reference, so that differences in brightness count.
fn pictures(image: &Picture, target: &Target) -> [RgbImage; 2] {
    let narrow = |pixels: &[[f64; 3]]| pixels.iter().map(|p| p.map(|x| x as f32)).collect::<Vec<_>>();
    let reference = narrow(&target.pixels);
    let exposure = picture::automatic_exposure(&reference);
    [narrow(&image.pixels), reference].map(|pixels| picture::tone_mapped(image.width as u32, &pixels, exposure))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_and_masks_match_hand_calculation() {
        // 16 x 8 pixels: the left tile is exact, the right one is off by 0.5 in one channel.
        let reference = vec![[1.0; 3]; 128];
        let wrong = |i: usize| if i % 16 < 8 { [1.0; 3] } else { [1.5, 1.0, 1.0] };
        let image = Picture { width: 16, height: 8, pixels: (0..128).map(wrong).collect() };
        let mask = (0..128).map(|i| i % 16 >= 12).collect();
        let target = Target { name: "r".into(), pixels: reference, noise: None, mask: Some(mask) };
        let found = Measures::new(&image, &target);
        let tile = (0.25_f64 / 3.0).sqrt();
        assert!((found.worst_tile - tile).abs() < 1e-15 && (found.mean_tile - tile / 2.0).abs() < 1e-15, "{found:?}");
        assert!((found.rmse_masked.unwrap() - tile).abs() < 1e-15);
        assert!((found.metrics.rmse - (0.25_f64 / 6.0).sqrt()).abs() < 1e-15);
        assert!(found.flip > 0.0 && found.ssim.is_none());
    }
}
