//! False-colour pictures of where two images differ.

use crate::{
    film::picture::RgbImage,
    stats::{Verdict, tiles::luminance},
};

/// The signed difference of luminances relative to the mean luminance of the reference. Pixels are blue where the test
/// image is darker, red where it is brighter and white where the two are equal. A difference of `range` or more has
/// full colour.
#[must_use]
pub fn difference(width: usize, test: &[[f64; 3]], reference: &[[f64; 3]], range: f64) -> RgbImage {
    let mean = reference.iter().map(|p| luminance(*p)).sum::<f64>() / reference.len() as f64;
    let scale = 1.0 / (range * mean.max(f64::MIN_POSITIVE));
    picture(width, test.len() / width, |i| diverging(scale * (luminance(test[i]) - luminance(reference[i]))))
}

/// The p-value of every tile, from white at 1 over yellow to black at 1e-4 and below. Tiles that were not tested are
/// grey. If the images agree, about one tile in ten has p < 0.1.
#[must_use]
pub fn p_values(verdict: &Verdict, width: usize, height: usize, tile: usize) -> RgbImage {
    picture(width, height, |i| {
        let (x, y) = (i % width / tile, i / width / tile);
        match &verdict.tiles[y * verdict.columns + x] {
            Some(comparison) => sequential(-comparison.luminance.p.max(1e-4).log10() / 4.0),
            None => [128; 3],
        }
    })
}

fn picture(width: usize, height: usize, colour: impl Fn(usize) -> [u8; 3]) -> RgbImage {
    RgbImage::from_fn(width as u32, height as u32, |x, y| colour(y as usize * width + x as usize))
}

/// A diverging colour map from -1 (blue) over 0 (white) to 1 (red).
pub(crate) fn diverging(x: f64) -> [u8; 3] {
    let end = if x < 0.0 { [33.0, 102.0, 172.0] } else { [178.0, 24.0, 43.0] };
    end.map(|channel: f64| (255.0 + (channel - 255.0) * x.abs().min(1.0)) as u8)
}

/// A sequential colour map from 0 (white) over yellow and red to 1 (black).
pub(crate) fn sequential(x: f64) -> [u8; 3] {
    const STOPS: [[f64; 3]; 4] = [[255.0, 255.0, 255.0], [254.0, 217.0, 118.0], [189.0, 0.0, 38.0], [0.0, 0.0, 0.0]];
    let at = x.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let i = (at as usize).min(STOPS.len() - 2);
    let w = at - i as f64;
    [0, 1, 2].map(|c| ((1.0 - w) * STOPS[i][c] + w * STOPS[i + 1][c]) as u8)
}
