use std::{fmt, sync::Arc};

/// A position in a scene's files, or an argument of the command line that changes the scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceLocation {
    /// The file as the user named it, or the argument.
    pub file: Arc<str>,
    /// The line, from 1; 0 for an argument.
    pub line: u32,
    /// The column in characters, from 1; 0 for an argument.
    pub column: u32,
}

impl SourceLocation {
    /// An argument of the command line.
    #[must_use]
    pub fn argument(text: &str) -> Self {
        Self { file: text.into(), line: 0, column: 0 }
    }
}

impl fmt::Display for SourceLocation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.line == 0 {
            return f.write_str(&self.file);
        }
        write!(f, "{}:{}:{}", self.file, self.line, self.column)
    }
}

/// One fault in a scene file: where, what, and what would have been right. Displays as one line.
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

/// All that is wrong with a scene, at least one fault; displays as one line each.
#[derive(Clone, Debug, PartialEq, Eq)]
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

impl std::error::Error for SceneError {}
