use std::{fmt, sync::Arc};

/// A position in a scene's files, in the program that builds a scene, or an argument of the command line that changes
/// the scene. Displays as `FILE:LINE:COLUMN`, followed by the object for a scene that is built in code.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceLocation {
    /// The file as the user named it, the Rust source that builds the scene, or the argument.
    pub file: Arc<str>,
    /// The line, from 1; 0 for an argument.
    pub line: u32,
    /// The column in characters, from 1; 0 for an argument.
    pub column: u32,
    /// In a scene that is built in code, the object with those around it, such as `shape "sphere" #2 > bsdf "diffuse"`:
    /// a loop makes many objects at one position.
    pub object: Option<Arc<str>>,
}

impl SourceLocation {
    /// An argument of the command line.
    #[must_use]
    pub fn argument(text: &str) -> Self {
        Self { file: text.into(), line: 0, column: 0, object: None }
    }
}

impl fmt::Display for SourceLocation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.line == 0 {
            return f.write_str(&self.file);
        }
        write!(f, "{}:{}:{}", self.file, self.line, self.column)?;
        match &self.object {
            Some(object) => write!(f, ": {object}"),
            None => Ok(()),
        }
    }
}

/// One fault of a scene: where, what, and what would have been right. Displays as one line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Where, unless the fault is in no file (a parameter given on the command line).
    pub place: Option<SourceLocation>,
    /// What is wrong.
    pub what: String,
    /// What would have been right.
    pub hint: Option<String>,
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(place) = &self.place {
            write!(f, "{place}: ")?;
        }
        f.write_str(&self.what)?;
        match &self.hint {
            Some(hint) => write!(f, "; {hint}"),
            None => Ok(()),
        }
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
