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

/// An image that another renderer made in many independent batches. `scripts/make_references.py` writes it.
#[derive(Debug)]
pub struct Reference {
    /// The number of columns.
    pub width: usize,
    /// The number of rows.
    pub height: usize,
    /// The mean of all batches: red, green and blue of each pixel, row by row.
    pub pixels: Vec<[f64; 3]>,
    /// The pixels that have noise and lie in a tile where at least a quarter of the pixels have noise.
    pub stochastic: Vec<bool>,
    /// The pixels that are known exactly. A pixel that is neither stochastic nor exact lies in a tile with few noisy
    /// pixels. The mean of such a tile depends on rare events, such as an edge that one sample in a thousand hits, and
    /// is too skewed for a t test. The rule does not depend on the image under test.
    pub exact: Vec<bool>,
    /// The standard errors of the pixels' means.
    pub std_errors: Vec<[f64; 3]>,
    /// The mean of the stochastic pixels of every tile, with its scatter between batches.
    pub tiles: TiledMeans,
    /// How the reference was made.
    pub provenance: Provenance,
}

/// The minimum number of noisy pixels in a tested tile: a quarter of its pixels.
pub(super) const MIN_COUNT: u32 = (TILE * TILE / 4) as u32;

/// How a reference was made: its `PROVENANCE.toml`.
#[derive(Clone, Debug, Deserialize)]
pub struct Provenance {
    /// The name of the renderer.
    pub renderer: String,
    /// The version of the renderer.
    pub version: String,
    /// The variant of the renderer.
    pub variant: String,
    /// The name of the integrator in the scene, or of its stand-in.
    pub integrator: String,
    /// Samples per pixel in a batch.
    pub spp_per_batch: u64,
    /// The number of batches.
    pub batches: u64,
    /// The maximum relative difference allowed where the reference has no noise: 1e-4, unless the renderer is known to
    /// be less exact there.
    pub exact_tolerance: f64,
    /// The command that renders the reference again.
    pub command: String,
    /// The stand-ins for plugins that the renderer lacks.
    #[serde(default)]
    pub stand_ins: Vec<String>,
    /// The SHA-256 of every file that the scene reads, by its path relative to the scene's folder.
    pub files: BTreeMap<String, String>,
}

impl Provenance {
    /// Whether the reference was made by light tracing, which renders mirrors and glass black.
    #[must_use]
    pub fn shows_no_specular(&self) -> bool {
        self.integrator == "ptracer"
            || self.stand_ins.iter().any(|stand_in| stand_in.starts_with("photonmapper: ptracer"))
    }
}

/// The reason why a reference cannot be used. Displays as one line.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// The image cannot be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// Another file of the reference is missing or malformed.
    #[error("{}: {what}", file.display())]
    Broken {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        what: String,
    },
    /// The scene has changed since the reference was rendered.
    #[error("{}: is stale: {changed} has changed since it was rendered; run: {command}", folder.display())]
    Stale {
        /// The reference folder.
        folder: PathBuf,
        /// The file of the scene whose hash has changed.
        changed: String,
        /// The command that renders the reference again.
        command: String,
    },
    /// The images of the reference cannot be reduced to tiles.
    #[error("{}: {what}", folder.display())]
    Tiles {
        /// The reference folder.
        folder: PathBuf,
        /// What is wrong.
        what: TilesError,
    },
}

impl Reference {
    /// Loads a reference folder.
    ///
    /// # Errors
    /// If a file is missing or malformed, or the files do not match.
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

    /// The estimates of the three channels of a pixel.
    pub(super) fn estimates(&self, pixel: usize) -> [Estimate; 3] {
        let dof = self.provenance.batches.saturating_sub(1).max(1) as f64;
        [0, 1, 2].map(|c| Estimate {
            mean: self.pixels[pixel][c],
            variance_of_mean: self.std_errors[pixel][c].powi(2),
            dof,
        })
    }

    /// Checks that the files of the scene have not changed since the reference was rendered.
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

/// The noisy pixels in tiles that contain at least [`MIN_COUNT`] noisy pixels.
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

/// Reads the tile means of each batch from an array of shape (batches, rows of tiles, columns of tiles, 3).
fn load_batches(file: &Path, tiling: &Tiling) -> Result<Vec<Vec<[f64; 3]>>, ReferenceError> {
    let broken = |what: String| ReferenceError::Broken { file: file.to_owned(), what };
    let bytes = fs::read(file).map_err(|error| broken(error.to_string()))?;
    let npy::Array { shape, values } = npy::read(&bytes).map_err(broken)?;
    let (rows, columns) = (tiling.rows(), tiling.columns());
    if shape.len() != 4 || shape[1..] != [rows, columns, 3] {
        return Err(broken(format!("has shape {shape:?}; expected (batches, {rows}, {columns}, 3)")));
    }
    let pixels: Vec<[f64; 3]> = values.chunks_exact(3).map(|p| [0, 1, 2].map(|c| f64::from(p[c]))).collect();
    Ok(pixels.chunks_exact(rows * columns).map(<[_]>::to_vec).collect())
}
