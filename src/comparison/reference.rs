use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use serde::Deserialize;

use super::{TILE, npy};
use crate::{
    film::exr::{self, FileError},
    provenance,
    stats::{Estimate, TiledMeans, TilesError, Tiling},
};

/// An image that another renderer made, in many independent batches. `scripts/make_references.py` writes it.
#[derive(Debug)]
pub struct Reference {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The mean of all batches, row by row.
    pub pixels: Vec<[f64; 3]>,
    /// Which pixels have noise and lie in a tile where at least a quarter of the pixels have.
    pub stochastic: Vec<bool>,
    /// Which pixels are known exactly. Those that are neither have noise almost alone in their tile: its mean rests on
    /// events as rare as an edge that one sample in a thousand meets, too skewed for a t test. The rule knows
    /// nothing of the image that is judged.
    pub exact: Vec<bool>,
    /// The standard errors of the pixels' means.
    pub std_errors: Vec<[f64; 3]>,
    /// The means of the stochastic pixels of every tile, with their scatter between batches.
    pub tiles: TiledMeans,
    /// How it was made.
    pub provenance: Provenance,
}

/// The fewest noisy pixels of a tile that is tested, a quarter of all.
pub(super) const MIN_COUNT: u32 = (TILE * TILE / 4) as u32;

/// How a reference was made: its `PROVENANCE.toml`.
#[derive(Clone, Debug, Deserialize)]
pub struct Provenance {
    /// The name of the renderer.
    pub renderer: String,
    /// Its version.
    pub version: String,
    /// Which of its variants.
    pub variant: String,
    /// The name of the integrator in the scene, unless another stands in for it.
    pub integrator: String,
    /// Samples per pixel of a batch.
    pub spp_per_batch: u64,
    /// How many batches.
    pub batches: u64,
    /// The largest relative difference allowed where the reference has no noise: 1e-4, unless the renderer is known to
    /// be less exact there.
    pub exact_tolerance: f64,
    /// The command that makes it again.
    pub command: String,
    /// What took the place of what the renderer lacks.
    #[serde(default)]
    pub stand_ins: Vec<String>,
    /// The SHA-256 of every file the scene read, by its path from the scene's folder.
    pub files: BTreeMap<String, String>,
}

impl Provenance {
    /// Whether its renderer followed light from its source, and so shows mirrors and glass black.
    #[must_use]
    pub fn shows_no_specular(&self) -> bool {
        self.integrator == "ptracer"
            || self.stand_ins.iter().any(|stand_in| stand_in.starts_with("photonmapper: ptracer"))
    }
}

/// Why a reference cannot be used; one line.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// The image.
    #[error(transparent)]
    File(#[from] FileError),
    /// One of the other files.
    #[error("{}: {what}", file.display())]
    Broken {
        /// Which.
        file: PathBuf,
        /// Why.
        what: String,
    },
    /// Made of another scene than there is now.
    #[error("{}: is stale: {changed} has changed since it was rendered; run: {command}", folder.display())]
    Stale {
        /// The reference.
        folder: PathBuf,
        /// The scene's file that has another hash now.
        changed: String,
        /// What makes it anew.
        command: String,
    },
    /// Reduction to tiles.
    #[error("{}: {what}", folder.display())]
    Tiles {
        /// The reference.
        folder: PathBuf,
        /// What does not fit.
        what: TilesError,
    },
}

impl Reference {
    /// Loads a reference folder.
    ///
    /// # Errors
    /// If a file is missing or broken, or they do not fit together.
    pub fn load(folder: &Path) -> Result<Self, ReferenceError> {
        let provenance = load_provenance(folder)?;
        let path = folder.join("reference.exr");
        let image = exr::read(&path)?;
        let broken = |what: &str| ReferenceError::Broken { file: path.clone(), what: what.to_owned() };
        let pixels = image.rgb(["R", "G", "B"]).ok_or_else(|| broken("has no channels R, G and B"))?;
        let std_errors = image.rgb(["se.R", "se.G", "se.B"]);
        let std_errors = std_errors.ok_or_else(|| broken("has no channels se.R, se.G and se.B"))?;
        let exact = image.channel("deterministic").ok_or_else(|| broken("has no channel \"deterministic\""))?;
        let exact: Vec<bool> = exact.iter().map(|&flag| flag >= 0.5).collect();
        let tiling = Tiling { width: image.crop.width as usize, height: image.crop.height as usize, size: TILE };
        let batches = load_batches(&folder.join("tiles.npy"), &tiling)?;
        let fault = |what| ReferenceError::Tiles { folder: folder.to_owned(), what };
        let stochastic = well_filled(&tiling, &exact).map_err(fault)?;
        let tiles = tiling
            .counts(&stochastic)
            .and_then(|counts| TiledMeans::from_batches(tiling.columns(), tiling.rows(), &batches, &counts))
            .map_err(fault)?;
        Ok(Self {
            width: tiling.width,
            height: tiling.height,
            pixels: pixels.into_iter().map(|p| p.map(f64::from)).collect(),
            std_errors: std_errors.into_iter().map(|p| p.map(f64::from)).collect(),
            stochastic,
            exact,
            tiles,
            provenance,
        })
    }

    /// What is known of the channels of a pixel.
    pub(super) fn estimates(&self, pixel: usize) -> [Estimate; 3] {
        let dof = self.provenance.batches.saturating_sub(1).max(1) as f64;
        [0, 1, 2].map(|c| Estimate {
            mean: self.pixels[pixel][c],
            variance_of_mean: self.std_errors[pixel][c].powi(2),
            dof,
        })
    }

    /// Checks that the scene is still the one it was made of.
    ///
    /// # Errors
    /// If a file of the scene is missing or has changed.
    pub fn check_fresh(&self, folder: &Path, scene: &Path) -> Result<(), ReferenceError> {
        let base = scene.parent().unwrap_or(Path::new(""));
        for (name, hash) in &self.provenance.files {
            let now = provenance::hash_of_file(&base.join(name)).ok();
            if now.as_ref() != Some(hash) {
                return Err(ReferenceError::Stale {
                    folder: folder.to_owned(),
                    changed: name.clone(),
                    command: self.provenance.command.clone(),
                });
            }
        }
        Ok(())
    }
}

/// The noisy pixels of tiles that hold enough of them.
fn well_filled(tiling: &Tiling, exact: &[bool]) -> Result<Vec<bool>, TilesError> {
    let noisy: Vec<bool> = exact.iter().map(|exact| !exact).collect();
    let counts = tiling.counts(&noisy)?;
    Ok((0..noisy.len()).map(|pixel| noisy[pixel] && counts[tiling.tile_of(pixel)] >= MIN_COUNT).collect())
}

fn load_provenance(folder: &Path) -> Result<Provenance, ReferenceError> {
    let file = folder.join("PROVENANCE.toml");
    let broken = |what: String| ReferenceError::Broken { file: file.clone(), what };
    let text = fs::read_to_string(&file).map_err(|error| broken(error.to_string()))?;
    toml::from_str(&text).map_err(|error| broken(error.message().to_owned()))
}

/// The array of shape (batches, rows of tiles, columns of tiles, 3).
fn load_batches(file: &Path, tiling: &Tiling) -> Result<Vec<Vec<[f64; 3]>>, ReferenceError> {
    let broken = |what: String| ReferenceError::Broken { file: file.to_owned(), what };
    let bytes = fs::read(file).map_err(|error| broken(error.to_string()))?;
    let npy::Array { shape, values } = npy::read(&bytes).map_err(broken)?;
    let (rows, columns) = (tiling.rows(), tiling.columns());
    if shape.len() != 4 || shape[1..] != [rows, columns, 3] {
        return Err(broken(format!("has shape {shape:?}; the image needs (batches, {rows}, {columns}, 3)")));
    }
    let pixels: Vec<[f64; 3]> = values.chunks_exact(3).map(|p| [0, 1, 2].map(|c| f64::from(p[c]))).collect();
    Ok(pixels.chunks_exact(rows * columns).map(<[_]>::to_vec).collect())
}
