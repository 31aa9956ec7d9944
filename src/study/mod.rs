//! Convergence studies: scenes x methods x budgets, each with independent runs, compared with references.
//!
//! A study is a TOML file; `assets/studies/README.md` describes its format and has examples. Each *cell* (a scene, a
//! method and one value of the varied parameter) has several *runs* with different seeds. Each run is an image rendered
//! by a separate process. All results are computed from the images.
//!
//! | part | file |
//! |---|---|
//! | the format of the file; how it is read and validated | `spec`; `check` |
//! | the folder of the results | [`folder`] |
//! | cells and runs, their seeds and command lines | [`plan`] |
//! | a run, whether its image exists, and how it is rendered | [`run`] |
//! | references, and masks of pixels | `ground_truth`, `mask` |
//! | error metrics of one image | `measures`, `flip`, `ssim` |
//! | variance and bias from the images of a cell | `error_decomposition` |
//! | tables as JSON lines and CSV | `record`, `tables` |
//! | the predicted curves | `theory` |
//! | slopes, amplitudes, crossings, and whether predictions hold | `fits`, `comparison` |
//! | all results; how they are computed | `outcome`; [`evaluate`] |
//! | drawings and the page | `drawings`, `page` |
//!
//! # Reported errors
//!
//! Let x_kp be the value of pixel and channel p in run k of K, r_p the reference with the variance v_p of its noise.
//! Over all n values of p in the image or mask,
//!
//! - the variance is the mean over p of the unbiased variance between runs, Σ_k (x_kp − x̄_p)² / (K − 1);
//! - the squared bias is the mean over p of (x̄_p − r_p)², less variance / K and less the mean of v_p, because (x̄_p −
//!   r_p)² contains both. The estimate may be negative; if the true value is 0, it is negative about half of the time;
//! - the MSE is the mean over k and p of (x_kp − r_p)², less the mean of v_p. It is the sum of variance and squared
//!   bias.
//!
//! Standard errors come from the scatter between runs. Standard errors of means are computed directly. Standard errors
//! of variance and squared bias are jackknife estimates (Efron and Stein 1981), which are biased upwards. The
//! contribution of the reference's noise to the standard errors of MSE and squared bias is added in quadrature.

mod check;
mod comparison;
mod drawings;
mod error_decomposition;
pub mod evaluate;
mod fits;
mod flip;
pub mod folder;
mod ground_truth;
mod mask;
mod measures;
mod outcome;
mod page;
pub mod plan;
mod record;
pub mod run;
mod spec;
mod ssim;
mod tables;
mod theory;

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

/// The reason why a study cannot continue. Displays as one line.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The file of the study is invalid.
    #[error("{}:{line}:{column}: {what}", file.display())]
    StudySpec {
        /// The file.
        file: PathBuf,
        /// The line, from 1.
        line: usize,
        /// The column in characters, from 1.
        column: usize,
        /// What is wrong, and how to correct it.
        what: String,
    },
    /// The folder of the results belongs to another study.
    #[error("{}: holds the results of {}", folder.display(), owner.display())]
    Owner {
        /// The folder.
        folder: PathBuf,
        /// The file of the other study.
        owner: PathBuf,
    },
    /// A file cannot be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A scene cannot be read.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A reference folder cannot be used.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// An image cannot be compared.
    #[error(transparent)]
    Comparison(#[from] ComparisonError),
    /// A run failed.
    #[error("{cell}, seed {seed}: {what}")]
    Run {
        /// The name of its cell.
        cell: String,
        /// Its seed.
        seed: u64,
        /// The message of its process.
        what: String,
    },
}
