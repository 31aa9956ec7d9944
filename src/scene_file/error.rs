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
    /// A change of the scene that is not in any of its files.
    Override(Override),
}

impl SourceLocation {
    /// The same position, with the label of an object.
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
    /// Another plugin that replaces the scene's own.
    Plugin {
        /// The category of the plugin.
        category: Category,
        /// The name of the plugin.
        name: String,
    },
    /// A changed parameter of the integrator.
    Parameter {
        /// The name of the parameter.
        name: String,
        /// The new value of the parameter.
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

/// One fault of a scene: its place, what is wrong, and how to correct it. Displays as one line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// The place; None if the fault has no place.
    pub place: Option<SourceLocation>,
    /// What is wrong.
    pub what: String,
    /// How to correct it.
    pub hint: Option<String>,
}

impl Diagnostic {
    /// What is wrong and how to correct it, without the place.
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

/// All faults of a scene, at least one. Displays as one line for each. The `Debug` output is the same, so that a `main`
/// that returns this error prints readable lines.
#[derive(Clone, PartialEq, Eq)]
pub struct SceneError(pub Vec<Diagnostic>);

impl SceneError {
    /// One fault at a place.
    pub fn at(place: &SourceLocation, what: impl Into<String>) -> Self {
        Self(vec![Diagnostic { place: Some(place.clone()), what: what.into(), hint: None }])
    }

    /// One fault without a place.
    pub fn nowhere(what: impl Into<String>) -> Self {
        Self(vec![Diagnostic { place: None, what: what.into(), hint: None }])
    }

    /// The same faults in the order of their places in the scene's files. Faults without a place come last.
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

    /// The same fault with a hint how to correct it.
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
