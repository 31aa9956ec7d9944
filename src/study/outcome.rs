//! What a study has found: its cells, fits and comparisons.

use std::path::PathBuf;

use super::{comparison::MethodComparison, fits::Fit, tables::CellFound};

/// What a study has found.
#[derive(Debug)]
pub struct Evaluation {
    pub(super) cells: Vec<CellFound>,
    pub(super) fits: Vec<Fit>,
    pub(super) comparisons: Vec<MethodComparison>,
    /// Runs that are not there.
    pub missing: usize,
    /// The page.
    pub page: PathBuf,
}

impl Evaluation {
    /// A line for each fit and each comparison.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        self.fits.iter().map(Fit::line).chain(self.comparisons.iter().map(MethodComparison::line)).collect()
    }

    /// Whether everything holds that the study predicts.
    #[must_use]
    pub fn passed(&self) -> bool {
        let verdicts =
            self.fits.iter().map(|fit| fit.holds).chain(self.comparisons.iter().map(|comparison| comparison.holds));
        verdicts.flatten().all(|holds| holds)
    }
}
