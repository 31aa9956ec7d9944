//! The results of a study: its cells, fits and comparisons.

use std::path::PathBuf;

use super::{comparison::MethodComparison, fits::Fit, tables::CellFound};

/// The results of a study.
#[derive(Debug)]
pub struct Evaluation {
    pub(super) cells: Vec<CellFound>,
    pub(super) fits: Vec<Fit>,
    pub(super) comparisons: Vec<MethodComparison>,
    /// The number of runs without an image.
    pub missing: usize,
    /// The path of the page.
    pub page: PathBuf,
}

impl Evaluation {
    /// One line for each fit and each comparison.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        self.fits.iter().map(Fit::line).chain(self.comparisons.iter().map(MethodComparison::line)).collect()
    }

    /// Whether all predictions of the study hold.
    #[must_use]
    pub fn passed(&self) -> bool {
        let verdicts =
            self.fits.iter().map(|fit| fit.holds).chain(self.comparisons.iter().map(|comparison| comparison.holds));
        verdicts.flatten().all(|holds| holds)
    }
}
