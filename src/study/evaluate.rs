//! Computes rows, cells, fits, plots and the page from the images that exist.

use std::{collections::BTreeMap, sync::Mutex};

use rayon::prelude::*;

use super::{
    Plan, Run, Study, StudyError, comparison,
    error_decomposition::{ErrorDecomposition, Uncertain},
    fits,
    ground_truth::{GroundTruth, Picture, Target},
    measures::Measures,
    outcome::Evaluation,
    page,
    plan::Cell,
    record::{self, TableRow},
    tables::{self, CellFound, RunResult},
};
use crate::{
    film::exr::{self, FileError, write_whole},
    provenance,
};

/// The table of runs. Each row is added as soon as the run's image exists.
#[derive(Debug)]
pub struct Rows<'s> {
    study: &'s Study,
    plan: &'s Plan,
    ground_truths: BTreeMap<usize, GroundTruth>,
    /// Held while a row is appended to the table.
    table: Mutex<()>,
}

impl<'s> Rows<'s> {
    /// Replaces the table by one with the rows of all images that exist.
    ///
    /// # Errors
    /// If a reference or an image cannot be used.
    pub fn begin(study: &'s Study, plan: &'s Plan) -> Result<Self, StudyError> {
        let rows = Self::load(study, plan)?;
        rows.write(&rows.cells()?)?;
        Ok(rows)
    }

    /// Loads the references that exist.
    fn load(study: &'s Study, plan: &'s Plan) -> Result<Self, StudyError> {
        std::fs::create_dir_all(&plan.folder).map_err(|error| FileError::new(&plan.folder, error))?;
        let mut ground_truths = BTreeMap::new();
        for index in 0..study.spec.scenes.as_ref().len() {
            if let Some(ground_truth) = GroundTruth::load(study, plan, index)? {
                ground_truths.insert(index, ground_truth);
            }
        }
        Ok(Self { study, plan, ground_truths, table: Mutex::new(()) })
    }

    /// Adds the row of a run whose image was just rendered. A run of a reference has no row.
    ///
    /// # Errors
    /// If its image cannot be used.
    pub fn add(&self, run: &Run) -> Result<(), StudyError> {
        let Some(cell) = self.plan.cells.iter().find(|cell| cell.id == run.cell) else { return Ok(()) };
        if cell.method.is_none() || !self.ground_truths.contains_key(&cell.scene) {
            return Ok(());
        }
        let (made, target, _) = self.measure(cell, run)?;
        let _alone = self.table.lock().expect("no thread panics while it holds the lock");
        record::append(&self.plan.folder, "rows", &tables::row(self.study, cell, run, &made, &target))?;
        Ok(())
    }

    fn measure(&self, cell: &Cell, run: &Run) -> Result<(RunResult, Target, Picture), StudyError> {
        let scene = &self.study.spec.scenes.as_ref()[cell.scene];
        let image = exr::read(&run.output)?;
        let (picture, _) = Picture::of(&run.output, scene.layer.as_deref())?;
        let target =
            self.ground_truths[&cell.scene].fitted(self.study, scene, &picture, &run.output.display().to_string())?;
        let made = RunResult::new(&image, Measures::new(&picture, &target));
        Ok((made, target, picture))
    }

    /// Every cell that has images and a reference.
    fn cells(&self) -> Result<Vec<(&'s Cell, CellRuns)>, StudyError> {
        let known = |cell: &&Cell| cell.method.is_some() && self.ground_truths.contains_key(&cell.scene);
        let cells: Vec<&'s Cell> = self.plan.cells.iter().filter(known).collect();
        let seen = cells.par_iter().map(|cell| Ok((*cell, self.evaluate_cell(cell)?)));
        let all: Result<Vec<_>, StudyError> = seen.collect();
        Ok(all?.into_iter().filter(|(_, seen)| !seen.rows.is_empty()).collect())
    }

    fn evaluate_cell(&self, cell: &Cell) -> Result<CellRuns, StudyError> {
        let mut seen = CellRuns::default();
        for run in cell.runs.iter().filter(|run| run.is_made()) {
            let (made, target, picture) = self.measure(cell, run)?;
            seen.rows.push(tables::row(self.study, cell, run, &made, &target));
            seen.made.push(made);
            seen.pictures.push(picture);
            seen.target = Some(target);
        }
        Ok(seen)
    }

    fn write(&self, all: &[(&Cell, CellRuns)]) -> Result<(), StudyError> {
        let rows: Vec<TableRow> = all.iter().flat_map(|(_, seen)| seen.rows.iter().cloned()).collect();
        Ok(record::write(&self.plan.folder, "rows", &rows)?)
    }
}

/// The evaluated runs of a cell.
#[derive(Default)]
struct CellRuns {
    rows: Vec<TableRow>,
    made: Vec<RunResult>,
    pictures: Vec<Picture>,
    target: Option<Target>,
}

impl CellRuns {
    fn found(&self, study: &Study, cell: &Cell) -> Option<CellFound> {
        let target = self.target.as_ref()?;
        let spec = &study.spec.methods.as_ref()[cell.method?];
        let mean = |value: &dyn Fn(&RunResult) -> Option<f64>| {
            let all: Option<Vec<f64>> = self.made.iter().map(value).collect();
            Uncertain::mean(all?)
        };
        Some(CellFound {
            cell: cell.clone(),
            scene: study.spec.scenes.as_ref()[cell.scene].name(),
            method: spec.name.as_ref().clone(),
            renderer: spec.renderer,
            seeds: self.made.len(),
            whole: self.error_decomposition(target, None),
            masked: target.mask.as_deref().map(|mask| self.error_decomposition(target, Some(mask))),
            relative_mse: mean(&|made| Some(made.measures.metrics.relative_mse)),
            flip: mean(&|made| Some(made.measures.flip)),
            ssim: mean(&|made| made.measures.ssim),
            seconds: mean(&|made| made.cost.seconds),
            core_seconds: mean(&|made| made.cost.core_seconds),
            peak_bytes: self.made.iter().filter_map(|made| made.cost.peak_bytes).reduce(f64::max),
        })
    }

    fn error_decomposition(&self, target: &Target, mask: Option<&[bool]>) -> ErrorDecomposition {
        let counting = |pixels: &[[f64; 3]]| -> Vec<f64> {
            let counts = |(i, _): &(usize, &[f64; 3])| mask.is_none_or(|mask| mask[*i]);
            pixels.iter().enumerate().filter(counts).flat_map(|(_, pixel)| *pixel).collect()
        };
        let runs: Vec<Vec<f64>> = self.pictures.iter().map(|picture| counting(&picture.pixels)).collect();
        ErrorDecomposition::new(&runs, &counting(&target.pixels), target.noise.as_deref().map(counting).as_deref())
    }
}

/// Evaluates the images that exist, and writes the tables, fits, plots and page into the plan's folder.
///
/// # Errors
/// If a reference or an image cannot be used, or a file cannot be written.
pub fn evaluate(study: &Study, plan: &Plan, command: &str) -> Result<Evaluation, StudyError> {
    let rows = Rows::load(study, plan)?;
    let seen = rows.cells()?;
    rows.write(&seen)?;
    let cells: Vec<CellFound> = seen.iter().filter_map(|(cell, seen)| seen.found(study, cell)).collect();
    let lines: Vec<TableRow> = cells.iter().map(|cell| cell.record(study)).collect();
    record::write(&plan.folder, "cells", &lines)?;
    let fits = fits::all(study, &cells);
    let comparisons = comparison::all(study, &cells);
    let json = serde_json::json!({
        "study": study.name, "command": command, "version": provenance::version(), "fits": fits, "comparisons": comparisons,
    });
    let text = serde_json::to_string_pretty(&json).expect("fits are plain data");
    write_whole(&plan.folder.join("fits.json"), text.as_bytes())?;
    let missing = plan.runs().filter(|run| !run.is_made()).count();
    let page = plan.folder.join("index.html");
    let evaluation = Evaluation { cells, fits, comparisons, missing, page };
    page::write(study, plan, &evaluation, command)?;
    Ok(evaluation)
}
