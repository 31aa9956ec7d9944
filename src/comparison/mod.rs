//! Comparison of two images: the verdict of [`stats::verdict`](crate::stats::verdict) and the usual error metrics.
//!
//! [`ImageEstimate::of_image`] takes an image from a film or a file; [`ImageEstimate::of_replicates`] renders one. Then
//! [`with_image`] compares two estimates, and [`with_reference`] compares an estimate with a reference that Mitsuba
//! rendered.

pub mod equivalence;
mod metrics;
mod npy;
pub mod pictures;
mod reference;

pub use metrics::Metrics;
pub use reference::{Provenance, Reference, ReferenceError};

use serde::{Deserialize, Serialize};

use crate::{
    film::{Image, VARIANCE, exr::FileError},
    render::{Renderer, Replicate},
    stats::{
        DeterministicCheck, Estimate, Moments, Outcome, PixelMeans, TiledMeans, TilesError, Tiling, Verdict,
        VerdictConfig, VerdictError,
    },
};

/// The edge length in pixels of the square tiles whose means are compared.
pub const TILE: usize = 8;

/// The result of a comparison.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Comparison {
    /// The verdict; None if an image has no variances.
    pub verdict: Option<Verdict>,
    /// The names of the images that lack variances.
    pub without_variances: Vec<String>,
    /// Whether all pixels are equal to the last bit.
    pub identical: bool,
    /// Error metrics. They do not account for noise.
    pub metrics: Metrics,
    /// Samples per pixel of the test image; None if unknown.
    pub spp: Option<u64>,
}

impl Comparison {
    /// The outcome in words, as one line.
    #[must_use]
    pub fn conclusion(&self) -> String {
        if self.identical {
            return "identical, pixel by pixel".into();
        }
        match self.verdict.as_ref().map(|verdict| verdict.outcome) {
            None => format!(
                "undecided: no variances (render two samples per pixel or more; layers variance.R, .G, .B): {}",
                self.without_variances.join(", ")
            ),
            Some(Outcome::Agrees) => "agrees".into(),
            Some(Outcome::Differs) => "differs".into(),
            Some(Outcome::Undecided { needed_factor: None }) => {
                "undecided (the reference is too noisy; more samples of the test image alone do not help)".into()
            }
            Some(Outcome::Undecided { needed_factor: Some(factor) }) => match self.spp {
                Some(spp) => format!("undecided (not enough samples: needs about {:.0} spp)", spp as f64 * factor),
                None => format!("undecided (not enough samples: needs about {factor:.1} times as many)"),
            },
        }
    }
}

/// The reason why two images could not be compared. Displays as one line.
#[derive(Debug, thiserror::Error)]
pub enum ComparisonError {
    /// A file cannot be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// A reference cannot be read.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// The images have different sizes.
    #[error("{name}: is {}x{} pixels; the reference has {}x{}", found.0, found.1, expected.0, expected.1)]
    Size {
        /// The name of the image with the wrong size.
        name: String,
        /// Its width and height.
        found: (usize, usize),
        /// Width and height of the reference.
        expected: (usize, usize),
    },
    /// An image lacks a channel.
    #[error("{name}: has no channels R, G and B")]
    NoColour {
        /// The file.
        name: String,
    },
    /// A pixel is infinite or not a number.
    #[error("{name}: the pixel in column {column}, row {row} is not finite")]
    NotFinite {
        /// The file.
        name: String,
        /// The column, from 0.
        column: usize,
        /// The row, from 0.
        row: usize,
    },
    /// A variance is negative, infinite or not a number.
    #[error("{name}: the variance of the pixel in column {column}, row {row} is negative or not finite")]
    Variance {
        /// The file.
        name: String,
        /// The column, from 0.
        column: usize,
        /// The row, from 0.
        row: usize,
    },
    /// The images cannot be reduced to tiles.
    #[error(transparent)]
    Tiles(#[from] TilesError),
    /// The verdict cannot be computed.
    #[error(transparent)]
    Verdict(#[from] VerdictError),
}

/// One side of a comparison: an image in linear Rec. 709 with its uncertainty.
#[derive(Clone, Debug)]
pub struct ImageEstimate {
    /// The name used in messages.
    pub name: String,
    /// The number of columns.
    pub width: usize,
    /// The number of rows.
    pub height: usize,
    /// Red, green and blue of each pixel, row by row from the top left.
    pub pixels: Vec<[f64; 3]>,
    /// The uncertainty of the pixels.
    pub uncertainty: Uncertainty,
    /// Samples per pixel; None if unknown. It determines the degrees of freedom of the variances and the number of
    /// samples that an undecided comparison suggests.
    pub spp: Option<u64>,
}

/// The uncertainty of the pixels of an image.
#[derive(Clone, Debug)]
pub enum Uncertainty {
    /// The uncertainty is unknown; a comparison has no verdict.
    Unknown,
    /// The variance of the mean of each pixel. Pixels are assumed to be independent.
    Pixels(Vec<[f64; 3]>),
    /// The replicates whose mean the image is. They are assumed to be independent; their pixels are not.
    Replicates(Vec<Vec<[f64; 3]>>),
}

impl ImageEstimate {
    /// The image of a film or of a file. The number of samples comes from the attribute `etendue.spp` of the header;
    /// set [`ImageEstimate::spp`] where there is none.
    ///
    /// # Errors
    /// If the image lacks R, G or B, a pixel is not finite, or a variance is negative or not finite.
    pub fn of_image(name: &str, image: &Image) -> Result<Self, ComparisonError> {
        let wide = |plane: Vec<[f32; 3]>| plane.into_iter().map(|p| p.map(f64::from)).collect::<Vec<_>>();
        let pixels = image.rgb(["R", "G", "B"]).map(wide);
        let pixels = pixels.ok_or_else(|| ComparisonError::NoColour { name: name.to_owned() })?;
        let (width, height) = (image.crop.width as usize, image.crop.height as usize);
        if let Some(at) = pixels.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
            return Err(ComparisonError::NotFinite { name: name.to_owned(), column: at % width, row: at / width });
        }
        let uncertainty = match image.rgb(VARIANCE).map(wide) {
            // An image of one sample per pixel has infinite variances: its noise is unknown.
            Some(variances) if variances.iter().flatten().any(|x| *x != f64::INFINITY) => {
                if let Some(at) = variances.iter().position(|v| !v.iter().all(|x| (0.0..f64::INFINITY).contains(x))) {
                    return Err(ComparisonError::Variance {
                        name: name.to_owned(),
                        column: at % width,
                        row: at / width,
                    });
                }
                Uncertainty::Pixels(variances)
            }
            _ => Uncertainty::Unknown,
        };
        let spp = image.attribute("etendue.spp").and_then(|text| text.parse().ok());
        Ok(Self { name: name.to_owned(), width, height, pixels, uncertainty, spp })
    }

    /// Renders `count` replicates, beginning with `first`, and returns their mean. Its uncertainty is the scatter
    /// between replicates, so it is also known for integrators whose images have no variances.
    ///
    /// # Panics
    /// If `count` is 0.
    #[must_use]
    pub fn of_replicates(renderer: &Renderer, first: Replicate, count: u64) -> Self {
        Self::of_more_replicates(Vec::new(), renderer, first, count)
    }

    /// The image of [`ImageEstimate::of_replicates`] with a larger `count` of replicates, without rendering again those that
    /// this image has.
    #[must_use]
    pub fn with_replicates(self, renderer: &Renderer, first: Replicate, count: u64) -> Self {
        let known = match self.uncertainty {
            Uncertainty::Replicates(images) => images,
            Uncertainty::Unknown | Uncertainty::Pixels(_) => Vec::new(),
        };
        Self::of_more_replicates(known, renderer, first, count)
    }

    fn of_more_replicates(known: Vec<Vec<[f64; 3]>>, renderer: &Renderer, first: Replicate, count: u64) -> Self {
        let crop = renderer.scene.sensor.film.rendered();
        let render = |k| renderer.render(Replicate { number: first.number + k, ..first }, &|_| {}).means();
        let mut images = known;
        images.extend((images.len() as u64..count).map(render));
        let mean = |p: usize| [0, 1, 2].map(|c| images.iter().map(|image| image[p][c]).sum::<f64>() / count as f64);
        Self {
            name: "ours".into(),
            width: crop.width as usize,
            height: crop.height as usize,
            pixels: (0..images[0].len()).map(mean).collect(),
            uncertainty: Uncertainty::Replicates(images),
            spp: Some(count * u64::from(first.samples)),
        }
    }

    /// The division of the image into tiles of [`TILE`] x [`TILE`] pixels.
    #[must_use]
    pub fn tiling(&self) -> Tiling {
        Tiling { width: self.width, height: self.height, size: TILE }
    }

    /// The means of the tiles over the pixels in a mask; None if the uncertainty is unknown.
    ///
    /// # Errors
    /// If the mask has another size, or there is only one replicate.
    pub fn tiles(&self, mask: &[bool]) -> Result<Option<TiledMeans>, TilesError> {
        let tiling = self.tiling();
        match &self.uncertainty {
            Uncertainty::Unknown => Ok(None),
            Uncertainty::Pixels(variances) => {
                let pixels = PixelMeans { mean: &self.pixels, variance_of_mean: variances, mask, dof: self.dof() };
                TiledMeans::from_pixels(&tiling, &pixels).map(Some)
            }
            Uncertainty::Replicates(images) => {
                let batches = images.iter().map(|image| tiling.means(image, mask)).collect::<Result<Vec<_>, _>>()?;
                TiledMeans::from_batches(tiling.columns(), tiling.rows(), &batches, &tiling.counts(mask)?).map(Some)
            }
        }
    }

    /// Multiplies the image by a factor. This adds a known bias, to check that a verdict detects it.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let scale = |pixels: &Vec<[f64; 3]>, factor: f64| pixels.iter().map(|p| p.map(|x| factor * x)).collect();
        let uncertainty = match &self.uncertainty {
            Uncertainty::Unknown => Uncertainty::Unknown,
            Uncertainty::Pixels(variances) => Uncertainty::Pixels(scale(variances, factor * factor)),
            Uncertainty::Replicates(images) => {
                Uncertainty::Replicates(images.iter().map(|i| scale(i, factor)).collect())
            }
        };
        Self { pixels: scale(&self.pixels, factor), uncertainty, ..self.clone() }
    }

    fn check_size(&self, expected: (usize, usize)) -> Result<(), ComparisonError> {
        let found = (self.width, self.height);
        if found == expected { Ok(()) } else { Err(ComparisonError::Size { name: self.name.clone(), found, expected }) }
    }
}

/// Compares an image with a reference, using the default [`VerdictConfig`].
///
/// # Errors
/// If the sizes differ, or nothing can be compared.
pub fn with_reference(test: &ImageEstimate, reference: &Reference) -> Result<Comparison, ComparisonError> {
    with_reference_configured(test, reference, &VerdictConfig::default())
}

/// Compares an image with a reference, using a given configuration.
///
/// # Errors
/// If the sizes differ, or nothing can be compared.
pub fn with_reference_configured(
    test: &ImageEstimate,
    reference: &Reference,
    config: &VerdictConfig,
) -> Result<Comparison, ComparisonError> {
    test.check_size((reference.width, reference.height))?;
    let tiles = test.tiles(&reference.stochastic)?;
    let tolerance = reference.provenance.exact_tolerance;
    let exact = deterministic(&reference.exact, |p| test.estimates(p), |p| reference.estimates(p), tolerance);
    let judge = |tiles: TiledMeans| Verdict::compare(&tiles, &reference.tiles, exact, config);
    let verdict = tiles.map(judge).transpose()?;
    Ok(Comparison {
        verdict,
        without_variances: without_variances([test]),
        identical: test.pixels == reference.pixels,
        metrics: Metrics::new(&test.pixels, &reference.pixels),
        spp: test.spp,
    })
}

/// Compares two images, using the default [`VerdictConfig`]. The images are assumed to be independent: rendered with
/// different seeds. Pixels without noise in both images are compared within a tolerance.
///
/// # Errors
/// If the sizes differ, or nothing can be compared.
pub fn with_image(test: &ImageEstimate, reference: &ImageEstimate) -> Result<Comparison, ComparisonError> {
    with_image_configured(test, reference, &VerdictConfig::default())
}

/// Compares two independent images, using a given configuration. Pixels without noise in both images are compared
/// within a tolerance.
///
/// # Errors
/// If the sizes differ, or nothing can be compared.
pub fn with_image_configured(
    test: &ImageEstimate,
    reference: &ImageEstimate,
    config: &VerdictConfig,
) -> Result<Comparison, ComparisonError> {
    test.check_size((reference.width, reference.height))?;
    let metrics = Metrics::new(&test.pixels, &reference.pixels);
    let mask: Vec<bool> = (0..test.pixels.len()).map(|p| test.is_noisy(p) || reference.is_noisy(p)).collect();
    let verdict = match (test.tiles(&mask)?, reference.tiles(&mask)?) {
        (Some(ours), Some(theirs)) => {
            let noiseless: Vec<bool> = mask.iter().map(|noisy| !noisy).collect();
            let tolerance = DeterministicCheck::TOLERANCE;
            let exact = deterministic(&noiseless, |p| test.estimates(p), |p| reference.estimates(p), tolerance);
            Some(Verdict::compare(&ours, &theirs, exact, config)?)
        }
        _ => None,
    };
    Ok(Comparison {
        verdict,
        without_variances: without_variances([test, reference]),
        identical: test.pixels == reference.pixels,
        metrics,
        spp: test.spp,
    })
}

fn without_variances<const N: usize>(sides: [&ImageEstimate; N]) -> Vec<String> {
    let unknown = sides.into_iter().filter(|side| matches!(side.uncertainty, Uncertainty::Unknown));
    unknown.map(|side| side.name.clone()).collect()
}

impl ImageEstimate {
    fn is_noisy(&self, pixel: usize) -> bool {
        match &self.uncertainty {
            Uncertainty::Unknown => true,
            Uncertainty::Pixels(variances) => variances[pixel] != [0.0; 3],
            Uncertainty::Replicates(images) => images.iter().any(|image| image[pixel] != images[0][pixel]),
        }
    }

    /// The estimates of the three channels of a pixel.
    fn estimates(&self, pixel: usize) -> [Estimate; 3] {
        let mean = self.pixels[pixel];
        [0, 1, 2].map(|c| match &self.uncertainty {
            Uncertainty::Unknown => Estimate::exact(mean[c]),
            Uncertainty::Pixels(variances) => {
                Estimate { mean: mean[c], variance_of_mean: variances[pixel][c], dof: self.dof() }
            }
            Uncertainty::Replicates(images) => {
                let moments: Moments = images.iter().map(|image| image[pixel][c]).collect();
                Estimate::from_moments(&moments).unwrap_or(Estimate::exact(mean[c]))
            }
        })
    }

    /// The degrees of freedom of a pixel's variance.
    fn dof(&self) -> f64 {
        self.spp.map_or(f64::INFINITY, |spp| spp.saturating_sub(1).max(1) as f64)
    }
}

/// Compares the pixels of a mask within a relative tolerance; None if the mask is empty.
fn deterministic(
    mask: &[bool],
    ours: impl Fn(usize) -> [Estimate; 3],
    reference: impl Fn(usize) -> [Estimate; 3],
    tolerance: f64,
) -> Option<DeterministicCheck> {
    let pixels: Vec<usize> = (0..mask.len()).filter(|pixel| mask[*pixel]).collect();
    let ours: Vec<_> = pixels.iter().flat_map(|pixel| ours(*pixel)).collect();
    let reference: Vec<_> = pixels.iter().flat_map(|pixel| reference(*pixel)).collect();
    (!pixels.is_empty()).then(|| DeterministicCheck::compare(&ours, &reference, tolerance))
}
