//! Rows of evidence.

use std::path::PathBuf;

use crate::{
    comparison::{Comparison, ComparisonError, ReferenceError},
    law::{CheckError, Effort, Finding},
    scene_file::SceneError,
    stats::Outcome,
};

/// One line of the table: a claim about a subject, the number that was found, and whether it bears the claim out.
#[derive(Clone, Debug)]
pub struct Row {
    /// The law's name.
    pub name: String,
    /// What is claimed.
    pub claim: String,
    /// Where the claim comes from.
    pub source: String,
    /// The number.
    pub finding: Finding,
    /// The level at which a test fails, [`level_of_each`](crate::law::level_of_each).
    pub level: f64,
    /// The relative bias of a mean that the test would have detected, if it is a test of means.
    pub detectable_bias: Option<f64>,
    /// Whether it holds.
    pub passed: bool,
    /// The command that finds it again.
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
    /// Who made the reference: renderer, version, variant and samples per pixel.
    pub reference_by: String,
    /// What was found.
    pub comparison: Comparison,
    /// In words.
    pub conclusion: String,
    /// Whether they agree.
    pub passed: bool,
    /// The factor by which the image was falsified, to see that its verdict would notice.
    pub scale: f64,
    /// The verdict on the falsified image, which must differ.
    pub scaled: Outcome,
    /// Seconds to render.
    pub seconds: f64,
    /// Commands that show the same.
    pub reproduce: Vec<String>,
    /// Our pixels and the reference's, for the pictures.
    pub images: Images,
}

/// Linear pixels of both sides, row by row.
#[derive(Clone, Debug, Default)]
pub struct Images {
    /// Columns.
    pub width: usize,
    /// Ours.
    pub ours: Vec<[f64; 3]>,
    /// The reference's.
    pub reference: Vec<[f64; 3]>,
}

/// The time that a law took.
#[derive(Clone, Debug)]
pub struct LawTime {
    /// The law's name.
    pub name: String,
    /// Wall-clock seconds; other laws may have run at the same time.
    pub seconds: f64,
}

/// A run of `verify`.
#[derive(Clone, Debug)]
pub struct Evidence {
    /// The version of this program.
    pub version: String,
    /// Which rows were asked for, as a glob.
    pub only: String,
    /// How much work was done.
    pub effort: Effort,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// Threads that rendered.
    pub threads: usize,
    /// The time that each law took.
    pub times: Vec<LawTime>,
    /// Every finding of every law.
    pub rows: Vec<Row>,
    /// Every scene.
    pub scenes: Vec<SceneEvidence>,
}

impl Evidence {
    /// Whether everything holds.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.failed() == 0
    }

    /// How many rows and scenes do not hold.
    #[must_use]
    pub fn failed(&self) -> usize {
        self.rows.iter().filter(|row| !row.passed).count() + self.scenes.iter().filter(|scene| !scene.passed).count()
    }
}

/// Why `verify` could not run; one line.
#[derive(Debug, thiserror::Error)]
pub enum EvidenceError {
    /// A scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Its reference.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// The comparison of the two.
    #[error(transparent)]
    Comparison(#[from] ComparisonError),
    /// A law about scene files.
    #[error(transparent)]
    Law(#[from] CheckError),
    /// The folder of scenes.
    #[error("{}: {what}; run it where the repository is, or say where with --root", folder.display())]
    Folder {
        /// Which.
        folder: PathBuf,
        /// Why.
        what: String,
    },
    /// The glob.
    #[error("nothing is called \"{0}\"")]
    Nothing(String),
}
