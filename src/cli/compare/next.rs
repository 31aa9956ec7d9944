//! The command to run after an undecided comparison.

use std::path::Path;

use etendue::{comparison::Comparison, film::Image, stats::Outcome};

use crate::cli::source::quoted;

/// The test image and the reference, in this order.
pub(super) struct Sides<'a> {
    pub(super) files: [&'a Path; 2],
    /// The images with their headers; None for a reference folder.
    pub(super) images: [Option<&'a Image>; 2],
}

/// The factor for the number of samples of an image where the needed factor is unknown.
const MORE: f64 = 16.0;
/// The number of samples that a verdict needs is estimated from noise. This safety factor covers the error of the
/// estimate.
const MARGIN: f64 = 1.5;

/// The next step towards *agrees* or *differs*; None if the comparison is decided.
pub(super) fn step(comparison: &Comparison, sides: &Sides<'_>) -> Option<String> {
    match comparison.verdict.as_ref().map(|verdict| verdict.outcome) {
        _ if comparison.identical => None,
        // The images have no variances, most often because they have one sample per pixel.
        None => {
            (0..2).find_map(|side| command(sides, side, MORE).filter(|_| sides.images[side].and_then(spp) == Some(1)))
        }
        Some(Outcome::Undecided { needed_factor: Some(factor) }) => {
            let factor = MARGIN * factor;
            let by_hand = || format!("render {} with {factor:.1} times as many samples", sides.files[0].display());
            Some(command(sides, 0, factor).unwrap_or_else(by_hand))
        }
        Some(Outcome::Undecided { needed_factor: None }) => {
            let by_hand = || format!("make {} with {MORE} times as many samples", sides.files[1].display());
            Some(command(sides, 1, MORE).unwrap_or_else(by_hand))
        }
        Some(Outcome::Agrees | Outcome::Differs) => None,
    }
}

fn spp(image: &Image) -> Option<u32> {
    image.attribute("etendue.spp")?.parse().ok()
}

fn seed(image: &Image) -> Option<u64> {
    image.attribute("etendue.seed")?.parse().ok()
}

/// The command that renders one image again with more samples; None if its header lacks the scene or the options. The
/// new seed differs from the seed of the other image, because the two must be independent.
fn command(sides: &Sides<'_>, side: usize, factor: f64) -> Option<String> {
    let image = sides.images[side]?;
    let (scene, options) = (image.attribute("etendue.scene")?, image.attribute("etendue.options")?);
    let samples = (f64::from(spp(image)?) * factor).ceil() as u32;
    let own = seed(image)?;
    let other = sides.images[1 - side].and_then(seed);
    let seed = if other == Some(own) { own.wrapping_add(1) } else { own };
    let output = quoted(&sides.files[side].display().to_string());
    let words = ["etendue render", &quoted(scene), "-o", &output, options];
    let words: Vec<_> = words.into_iter().filter(|word| !word.is_empty()).collect();
    Some(format!("{} --spp {samples} --seed {seed}", words.join(" ")))
}
