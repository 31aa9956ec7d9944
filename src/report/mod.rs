//! The report: a self-contained HTML page, and summaries in Markdown and JSON. It reads evidence and does not render.
//!
//! | part | file |
//! |---|---|
//! | the whole page; the style sheet, shared with the pages of studies | `page`, `template.html`, `style.css`, `script.js` |
//! | the laws, grouped by the first part of their names; statistics of groups | `laws`, `laws.html`; `groups` |
//! | the scenes | `scenes`, `scene.html` |
//! | pictures as data URIs, with the ramps of their legends | `pictures` |
//! | plots | `drawings` |
//! | numbers as text; pass or fail as symbol and word | `number`; `mark`, `mark.html` |
//! | `reports/verify.md` and `reports/verify.json` | `summary` |

mod drawings;
mod groups;
mod laws;
mod mark;
pub(crate) mod number;
mod page;
mod pictures;
#[cfg(test)]
mod sample;
mod scenes;
pub mod summary;

pub use groups::{GroupSummary, power};
pub(crate) use mark::Mark;
#[cfg(feature = "study")]
pub(crate) use page::{environment, now, style};

use std::path::{Path, PathBuf};

use crate::{
    film::exr::{FileError, write_whole},
    validation::Evidence,
};

/// Writes the page under a root and returns its path: `reports/verify/index.html`, or `reports/verify/part.html` if
/// only some rows were selected. With `summary`, also writes `reports/verify.md` and `reports/verify.json`.
///
/// # Errors
/// If a file cannot be written.
pub fn write(root: &Path, evidence: &Evidence, summary: bool) -> Result<PathBuf, FileError> {
    let folder = root.join("reports/verify");
    std::fs::create_dir_all(&folder).map_err(|error| FileError::new(&folder, error))?;
    if summary {
        write_whole(&root.join("reports/verify.md"), summary::markdown(evidence).as_bytes())?;
        let json = serde_json::to_string_pretty(&summary::Summary::new(evidence)).expect("a summary is plain data");
        write_whole(&root.join("reports/verify.json"), json.as_bytes())?;
    }
    let page = folder.join(if evidence.only == "*" { "index.html" } else { "part.html" });
    write_whole(&page, page::render(evidence).as_bytes())?;
    Ok(page)
}

/// The command that gathers the same evidence.
fn command(evidence: &Evidence) -> String {
    let mut command = "etendue verify".to_owned();
    if evidence.only != "*" {
        command += &format!(" --only '{}'", evidence.only);
    }
    command + evidence.effort.option()
}

/// A name as the anchor of a link: ASCII letters and digits; every other character becomes a hyphen.
fn anchor(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn writes_the_page_and_on_request_the_summaries() {
        let folder = tempfile::tempdir().unwrap();
        let exists = |name: &str| folder.path().join("reports").join(name).exists();
        let page = write(folder.path(), &sample::failing(), false).unwrap();
        assert!(page.ends_with("reports/verify/index.html") && page.exists());
        assert!(!exists("verify.md") && !exists("verify.json"));
        write(folder.path(), &sample::passing(), true).unwrap();
        assert!(exists("verify.md") && exists("verify.json"));
    }

    #[test]
    fn anchors_need_no_escaping() {
        assert_eq!(anchor("calibration/a-a 0°"), "calibration-a-a-0-");
    }
}
