//! The folder of a study's results. It belongs to one study, so that no study takes the runs of another for its own.

use std::{
    fs,
    path::{Path, PathBuf},
};

use super::{Study, StudyError};
use crate::film::exr::{FileError, write_whole};

/// The file in a folder of results that holds the path of the study.
const OWNER: &str = "study.txt";

/// The folder of a study's results if the user names none: `reports/studies/` and the study's name.
#[must_use]
pub fn default_folder(study: &Study) -> PathBuf {
    Path::new("reports/studies").join(&study.name)
}

/// Checks that a folder does not hold the results of another study. A study whose file no longer exists does not count.
///
/// # Errors
/// If it does, or the paths cannot be read.
pub fn check_owner(study: &Study, folder: &Path) -> Result<(), StudyError> {
    let Ok(text) = fs::read_to_string(folder.join(OWNER)) else { return Ok(()) };
    let owner = Path::new(text.trim_end());
    let Ok(other) = owner.canonicalize() else { return Ok(()) };
    if other == canonical(study)? {
        return Ok(());
    }
    Err(StudyError::Owner { folder: folder.to_owned(), owner: owner.to_owned() })
}

/// Makes a folder that holds the results of this study only.
///
/// # Errors
/// If it holds the results of another study, or cannot be written.
pub fn claim(study: &Study, folder: &Path) -> Result<(), StudyError> {
    check_owner(study, folder)?;
    fs::create_dir_all(folder).map_err(|error| FileError::new(folder, error))?;
    let path = canonical(study)?;
    Ok(write_whole(&folder.join(OWNER), format!("{}\n", path.display()).as_bytes())?)
}

fn canonical(study: &Study) -> Result<PathBuf, StudyError> {
    Ok(study.file.canonicalize().map_err(|error| FileError::new(&study.file, error))?)
}
