use std::{fmt, path::PathBuf, sync::Arc};

use super::Category;

/// Where a value of a scene comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SourceLocation {
    /// A position in one of the scene's files.
    File {
        /// The file as the user named it.
        file: Arc<str>,
        /// The line, from 1.
        line: u32,
        /// The column in characters, from 1.
        column: u32,
    },
    /// A position in the program that builds the scene.
    Code {
        /// The Rust source file.
        file: Arc<str>,
        /// The line, from 1.
        line: u32,
        /// The column in characters, from 1.
        column: u32,
        /// The object with those around it, such as `shape "sphere" #2 > bsdf "diffuse"`: a loop makes many objects at
        /// one position.
        object: Option<Arc<str>>,
    },
    /// A change of the scene that stands in none of its files.
    Override(Override),
}

impl SourceLocation {
    /// The same position in a program, for an object.
    #[must_use]
    pub(super) fn for_object(self, label: &Arc<str>) -> Self {
        match self {
            Self::Code { file, line, column, .. } => Self::Code { file, line, column, object: Some(label.clone()) },
            other => other,
        }
    }
}

/// A change of a scene after its files were read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Override {
    /// Another plugin in the place of the scene's own.
    Plugin {
        /// What it is.
        category: Category,
        /// Its name.
        name: String,
    },
    /// A parameter of the integrator.
    Parameter {
        /// Its name.
        name: String,
        /// Its value.
        value: String,
    },
}

impl fmt::Display for Override {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Plugin { category, name } => write!(f, "override {category}={name}"),
            Self::Parameter { name, value } => write!(f, "override {name}={value}"),
        }
    }
}

impl fmt::Display for SourceLocation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File { file, line, column } => write!(f, "{file}:{line}:{column}"),
            Self::Code { file, line, column, object: None } => write!(f, "{file}:{line}:{column}"),
            Self::Code { file, line, column, object: Some(object) } => write!(f, "{file}:{line}:{column}: {object}"),
            Self::Override(change) => change.fmt(f),
        }
    }
}

/// One fault of a scene: where, what, and what would have been right. Displays as one line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Where, unless the fault has no place.
    pub place: Option<SourceLocation>,
    /// What is wrong.
    pub what: String,
    /// What would have been right.
    pub hint: Option<String>,
}

impl Diagnostic {
    /// What is wrong and what would have been right, without the place.
    #[must_use]
    pub fn message(&self) -> String {
        match &self.hint {
            Some(hint) => format!("{}; {hint}", self.what),
            None => self.what.clone(),
        }
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(place) = &self.place {
            write!(f, "{place}: ")?;
        }
        f.write_str(&self.message())
    }
}

/// All that is wrong with a scene, at least one fault. Displays as one line for each; its `Debug` output is the same, so
/// that a `main` that returns it prints lines to read.
#[derive(Clone, PartialEq, Eq)]
pub struct SceneError(pub Vec<Diagnostic>);

impl SceneError {
    /// One fault at a place.
    pub fn at(place: &SourceLocation, what: impl Into<String>) -> Self {
        Self(vec![Diagnostic { place: Some(place.clone()), what: what.into(), hint: None }])
    }

    /// One fault in no file.
    pub fn nowhere(what: impl Into<String>) -> Self {
        Self(vec![Diagnostic { place: None, what: what.into(), hint: None }])
    }

    /// The same faults in the order in which they stand in a scene's files; those without a place come last.
    #[must_use]
    pub fn in_order(mut self, files: &[PathBuf]) -> Self {
        let names: Vec<_> = files.iter().map(|file| file.display().to_string()).collect();
        self.0.sort_by_key(|fault| match &fault.place {
            Some(SourceLocation::File { file, line, column }) => {
                let number = names.iter().position(|name| **name == **file);
                (number.unwrap_or(names.len()), *line, *column)
            }
            // The builder visits objects in the order of the program, which the sort keeps.
            Some(SourceLocation::Code { .. } | SourceLocation::Override(_)) | None => (usize::MAX, 0, 0),
        });
        self
    }

    /// The same with what would have been right.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        if let Some(last) = self.0.last_mut() {
            last.hint = Some(hint.into());
        }
        self
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, diagnostic) in self.0.iter().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            write!(f, "{diagnostic}")?;
        }
        Ok(())
    }
}

impl fmt::Debug for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl std::error::Error for SceneError {}
