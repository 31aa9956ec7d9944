//! Convergence studies: scenes x methods x budgets, each with independent runs, against what is known of the truth.
//!
//! A study is a TOML file; `assets/studies/README.md` describes its form and has examples. Each *cell* (a scene, a
//! method and one value of what is varied) has several *runs* of different seeds, and each run is an image that a
//! process of its own made. Everything else follows from the images.
//!
//! | part | file |
//! |---|---|
//! | the form of the file; how it is read, and what is refused | `spec`; `check` |
//! | cells and runs, their seeds and command lines | [`plan`] |
//! | a run, whether it is there, and how it is made | [`run`] |
//! | what the images should be, and which pixels count | `ground_truth`, `mask` |
//! | one image against the truth | `measures`, `flip`, `ssim` |
//! | the images of a cell together: variance and bias apart | `error_decomposition` |
//! | tables that people and programs read | `record`, `tables` |
//! | closed list of predicted curves | `theory` |
//! | slopes, amplitudes, crossings, and whether predictions hold | `fits`, `comparison` |
//! | everything that was found; how it is found | `outcome`; [`evaluate`] |
//! | drawings and the page | `drawings`, `page` |
//!
//! # Errors that are stated
//!
//! Let x_kp be the value of pixel and channel p in run k of K, r_p the reference with the variance v_p of its noise.
//! Over all n values of p that count,
//!
//! - the variance is the mean over p of the unbiased variance between runs, Σ_k (x_kp − x̄_p)² / (K − 1);
//! - the squared bias is the mean over p of (x̄_p − r_p)², less variance / K and less the mean of v_p, both of which it would
//!   hold else; it may be negative, as what is 0 must be half of the time;
//! - the MSE is the mean over k and p of (x_kp − r_p)², less the mean of v_p. It is their sum.
//!
//! Standard errors come from the scatter between runs: of means directly, of variance and squared bias by leaving out
//! one run after the other (the jackknife of Efron and Stein 1981, which errs to the large side). What the noise of the
//! reference adds to those of MSE and squared bias is added in quadrature.

mod check;
mod comparison;
mod drawings;
pub mod evaluate;
mod fits;
mod flip;
mod spec;
mod mask;
mod measures;
mod outcome;
mod page;
pub mod plan;
mod record;
pub mod run;
mod error_decomposition;
mod ssim;
mod tables;
mod theory;
mod ground_truth;

pub use outcome::Evaluation;
pub use plan::Plan;
pub use run::Run;
pub use spec::Study;

use std::path::PathBuf;

use crate::{
    comparison::{ComparisonError, ReferenceError},
    film::exr::FileError,
    scene_file::SceneError,
};

/// Why a study cannot go on; one line.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// What the file of the study says.
    #[error("{}:{line}:{column}: {what}", file.display())]
    StudySpec {
        /// The file.
        file: PathBuf,
        /// From 1.
        line: usize,
        /// From 1, in characters.
        column: usize,
        /// What is wrong, and what would be right.
        what: String,
    },
    /// A file.
    #[error(transparent)]
    File(#[from] FileError),
    /// A scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A reference folder.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// An image.
    #[error(transparent)]
    Comparison(#[from] ComparisonError),
    /// A run.
    #[error("{cell}, seed {seed}: {what}")]
    Run {
        /// Of which cell.
        cell: String,
        /// Its seed.
        seed: u64,
        /// What its process said.
        what: String,
    },
}
