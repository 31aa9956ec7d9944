//! The evidence of a run: findings of laws, and comparisons of scenes.

use std::path::PathBuf;

use crate::{
    comparison::{Comparison, ComparisonError, ReferenceError},
    law::{CheckError, Effort, Finding},
    scene_file::SceneError,
    stats::Outcome,
};

/// A finding: a claim about a subject, the number that was found, and whether it supports the claim.
#[derive(Clone, Debug)]
pub struct Row {
    /// The name of the law.
    pub name: String,
    /// The claim of the law.
    pub claim: String,
    /// The source of the claim.
    pub source: String,
    /// The subject and the number that was found.
    pub finding: Finding,
    /// The level at which a test fails, [`level_of_each`](crate::law::level_of_each).
    pub level: f64,
    /// The relative bias of a mean that the test would have detected, if it is a test of means.
    pub detectable_bias: Option<f64>,
    /// Whether the finding holds.
    pub passed: bool,
    /// The command that reproduces the finding.
    pub reproduce: String,
}

/// A scene that was rendered and compared with its reference.
#[derive(Clone, Debug)]
pub struct SceneEvidence {
    /// The name of its row, `reference/` and the name of the scene.
    pub name: String,
    /// The scene file.
    pub scene: PathBuf,
    /// The reference folder.
    pub reference: PathBuf,
    /// The origin of the reference: renderer, version, variant and samples per pixel.
    pub reference_by: String,
    /// The comparison of the image with the reference.
    pub comparison: Comparison,
    /// The conclusion in words.
    pub conclusion: String,
    /// Whether the image agrees with the reference.
    pub passed: bool,
    /// The factor by which the image was scaled, to check that the verdict detects a known bias.
    pub scale: f64,
    /// The verdict on the scaled image, which must be *differs*.
    pub scaled: Outcome,
    /// The seconds that the rendering took.
    pub seconds: f64,
    /// Commands that reproduce the comparison.
    pub reproduce: Vec<String>,
    /// The pixels of our image and of the reference, for the pictures.
    pub images: Images,
}

/// Linear pixels of our image and of the reference, row by row.
#[derive(Clone, Debug, Default)]
pub struct Images {
    /// The number of columns.
    pub width: usize,
    /// The pixels of our image.
    pub ours: Vec<[f64; 3]>,
    /// The pixels of the reference.
    pub reference: Vec<[f64; 3]>,
}

/// The time that a law took.
#[derive(Clone, Debug)]
pub struct LawTime {
    /// The name of the law.
    pub name: String,
    /// Wall-clock seconds; other laws may have run at the same time.
    pub seconds: f64,
}

/// A run of `verify`.
#[derive(Clone, Debug)]
pub struct Evidence {
    /// The version of this program.
    pub version: String,
    /// The glob that selected the rows.
    pub only: String,
    /// The effort of the run.
    pub effort: Effort,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// The number of threads.
    pub threads: usize,
    /// The time that each law took.
    pub times: Vec<LawTime>,
    /// Every finding of every law.
    pub rows: Vec<Row>,
    /// Every scene.
    pub scenes: Vec<SceneEvidence>,
}

impl Evidence {
    /// Whether all rows and scenes hold.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.failed() == 0
    }

    /// The number of rows and scenes that do not hold.
    #[must_use]
    pub fn failed(&self) -> usize {
        self.rows.iter().filter(|row| !row.passed).count() + self.scenes.iter().filter(|scene| !scene.passed).count()
    }
}

/// Why `verify` could not run; one line.
#[derive(Debug, thiserror::Error)]
pub enum EvidenceError {
    /// A scene cannot be read or built.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A reference cannot be used.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// An image and its reference cannot be compared.
    #[error(transparent)]
    Comparison(#[from] ComparisonError),
    /// A law about scene files cannot be checked.
    #[error(transparent)]
    Law(#[from] CheckError),
    /// The folder of scenes cannot be read.
    #[error("{}: {what}; run it in the repository, or give its folder by --root", folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// The reason.
        what: String,
    },
    /// The glob matches no law and no scene.
    #[error("no law and no scene matches \"{0}\"")]
    Nothing(String),
}
