use crate::node::{Diagnostic, Place, SceneError};

use super::limit;

/// One fault whose place its finder does not know.
#[derive(Debug)]
pub(super) struct Fault {
    /// What is wrong.
    pub(super) what: String,
    /// What would have been right.
    pub(super) hint: Option<String>,
    /// The attribute that is at fault, unless it is the element.
    pub(super) attribute: Option<&'static str>,
}

impl Fault {
    pub(super) fn new(what: impl Into<String>) -> Self {
        Self { what: what.into(), hint: None, attribute: None }
    }

    pub(super) fn hint(self, hint: impl Into<String>) -> Self {
        Self { hint: Some(hint.into()), ..self }
    }

    pub(super) fn on(self, attribute: &'static str) -> Self {
        Self { attribute: Some(attribute), ..self }
    }

    pub(super) fn at(self, place: Option<Place>) -> Diagnostic {
        Diagnostic { place, what: self.what, hint: self.hint }
    }
}

/// The faults found so far. Reading goes on after most of them, to report several at once.
#[derive(Debug, Default)]
pub(super) struct Faults {
    list: Vec<Diagnostic>,
    stopped: bool,
}

impl Faults {
    pub(super) fn push(&mut self, place: &Place, fault: Fault) {
        self.report(fault.at(Some(place.clone())));
    }

    pub(super) fn report(&mut self, diagnostic: Diagnostic) {
        if self.stopped {
            return;
        }
        self.list.push(diagnostic);
        if self.list.len() == limit::FAULTS {
            self.list.push(Fault::new(format!("more than {} faults: the rest is not shown", limit::FAULTS)).at(None));
            self.stopped = true;
        }
    }

    /// Ends the reading: what follows would take too much.
    pub(super) fn stop(&mut self) {
        self.stopped = true;
    }

    pub(super) fn stopped(&self) -> bool {
        self.stopped
    }

    pub(super) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// The value, if nothing was wrong.
    pub(super) fn or<T>(self, value: T) -> Result<T, SceneError> {
        if self.list.is_empty() { Ok(value) } else { Err(SceneError(self.list)) }
    }
}

/// The candidate that was probably meant: equal but for case and underscores, or else the nearest spelling.
pub(super) fn closest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // Nobody mistypes a long text; its edit distance to many names would take long.
    if word.len() > limit::PARAMETER_NAME {
        return None;
    }
    let plain = |text: &str| text.replace('_', "").to_lowercase();
    candidates
        .into_iter()
        .map(|candidate| {
            let alike = plain(candidate) == plain(word);
            (if alike { 1.0 } else { strsim::normalized_damerau_levenshtein(word, candidate) }, candidate)
        })
        .filter(|(likeness, _)| *likeness >= 0.6)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}
