//! Equivalence tests of biased images with references.

use super::Reference;
use crate::{
    law::Finding,
    math::luminance,
    render::{Renderer, Replicate},
    stats::{Estimate, Moments, equivalence::TO_RADIUS_ZERO},
};

/// The bound on the relative difference of a channel's mean over the film.
const BOUND: f64 = 0.015;
/// The bound on the relative difference of the mean luminance of a quarter of the film.
const BOUND_OF_QUARTER: f64 = 0.03;

/// The replicates that an equivalence test renders, and the width of its bounds.
#[derive(Clone, Copy, Debug)]
pub struct Work {
    /// The first replicate.
    pub replicate: Replicate,
    /// The number of replicates, at least 2.
    pub passes: u64,
    /// The factor that widens the bounds; 1 is the usual width.
    pub widening: f64,
}

/// Tests whether a photon-mapped image, extrapolated to lookup radius 0, is equivalent to a reference.
///
/// There are seven findings: the mean of each channel, and the mean luminance of each quarter of the film. There is one
/// renderer for each radius of [`TO_RADIUS_ZERO`]; all renderers of a replicate use the same photons and the same
/// samples.
///
/// The extrapolation relies on the bias of density estimates being even in the radius. A biased image is never tested
/// for a difference.
///
/// # Panics
/// If there are fewer than two replicates.
#[must_use]
pub fn photon_map(renderers: &[Renderer; 3], reference: &Reference, work: &Work) -> Vec<Finding> {
    let without_specular = reference.provenance.shows_no_specular();
    let mut means = [Moments::default(); 7];
    for i in 0..work.passes {
        let replicate = Replicate { number: work.replicate.number + i, ..work.replicate };
        let mut sums = [0.0; 7];
        for (renderer, (_, weight)) in renderers.iter().zip(TO_RADIUS_ZERO) {
            let pixels = pixels(renderer, replicate, without_specular);
            sums.iter_mut().zip(summary(&pixels, reference.width)).for_each(|(sum, mean)| *sum += weight * mean);
        }
        means.iter_mut().zip(sums).for_each(|(moments, sum)| moments.push(sum));
    }
    let expected = summary(&reference.pixels, reference.width);
    let finding = |i: usize| {
        let ours = Estimate::from_moments(&means[i]).expect("there are two replicates or more");
        let reference = Estimate { mean: expected[i], variance_of_mean: variance(reference, i), dof: f64::INFINITY };
        let bound = if i < 3 { BOUND } else { BOUND_OF_QUARTER };
        Finding::equivalent(NAMES[i], &ours, &reference, work.widening * bound)
    };
    (0..NAMES.len()).map(finding).collect()
}

const NAMES: [&str; 7] = ["red", "green", "blue", "upper left", "upper right", "lower left", "lower right"];

/// The pixels of a replicate, without the layer `specular` (mirrors and glass) if the reference lacks it.
fn pixels(renderer: &Renderer, replicate: Replicate, without_specular: bool) -> Vec<[f64; 3]> {
    let image = renderer.render(replicate, &|_| {}).image();
    let beauty = image.rgb(["R", "G", "B"]).expect("every image has R, G and B");
    let specular =
        image.rgb(["specular.R", "specular.G", "specular.B"]).expect("a photon mapper writes the layer specular");
    let rest = |(all, specular): (&[f32; 3], &[f32; 3])| [0, 1, 2].map(|c| f64::from(all[c]) - f64::from(specular[c]));
    if without_specular {
        return beauty.iter().zip(&specular).map(rest).collect();
    }
    beauty.iter().map(|pixel| pixel.map(f64::from)).collect()
}

/// The index of the quarter's mean, 3 to 6, that a pixel belongs to.
fn quarter(pixel: usize, width: usize, count: usize) -> usize {
    let (x, y) = (pixel % width, pixel / width);
    3 + usize::from(2 * x >= width) + 2 * usize::from(2 * y >= count / width)
}

/// The means of the three channels over all pixels, then the mean luminances of the four quarters.
fn summary(pixels: &[[f64; 3]], width: usize) -> [f64; 7] {
    let mut sums = [0.0; 7];
    let n = pixels.len() as f64;
    for (i, pixel) in pixels.iter().enumerate() {
        (0..3).for_each(|c| sums[c] += pixel[c] / n);
        sums[quarter(i, width, pixels.len())] += 4.0 * luminance((*pixel).into()) / n;
    }
    sums
}

/// The variance of one of the seven means of the reference. Its pixels are independent.
fn variance(reference: &Reference, which: usize) -> f64 {
    let n = reference.pixels.len() as f64;
    let weights = luminance_weights();
    let of_pixel = |(i, errors): (usize, &[f64; 3])| match which {
        0..3 => errors[which].powi(2),
        _ if quarter(i, reference.width, reference.pixels.len()) != which => 0.0,
        // The channels of a path are assumed to be fully correlated.
        _ => 16.0 * (0..3).map(|c| weights[c] * errors[c]).sum::<f64>().powi(2),
    };
    reference.std_errors.iter().enumerate().map(of_pixel).sum::<f64>() / (n * n)
}

fn luminance_weights() -> [f64; 3] {
    [glam::DVec3::X, glam::DVec3::Y, glam::DVec3::Z].map(luminance)
}
