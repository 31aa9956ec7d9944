use crate::scene_file::{Diagnostic, SceneError, SourceLocation};

use super::limit;

/// One fault whose place its finder does not know.
#[derive(Clone, Debug)]
pub(in crate::scene_file) struct ParseFault {
    /// What is wrong.
    pub(in crate::scene_file) what: String,
    /// What would have been right.
    pub(in crate::scene_file) hint: Option<String>,
    /// The attribute that is at fault, unless it is the element.
    pub(in crate::scene_file) attribute: Option<&'static str>,
}

impl ParseFault {
    pub(in crate::scene_file) fn new(what: impl Into<String>) -> Self {
        Self { what: what.into(), hint: None, attribute: None }
    }

    pub(in crate::scene_file) fn hint(self, hint: impl Into<String>) -> Self {
        Self { hint: Some(hint.into()), ..self }
    }

    pub(in crate::scene_file) fn on(self, attribute: &'static str) -> Self {
        Self { attribute: Some(attribute), ..self }
    }

    pub(in crate::scene_file) fn at(self, place: Option<SourceLocation>) -> Diagnostic {
        Diagnostic { place, what: one_line(self.what), hint: self.hint.map(one_line) }
    }
}

/// A message quotes the file, whose texts may be of any length and have line breaks in them.
fn one_line(text: String) -> String {
    let mut line = text;
    if line.len() > limit::MESSAGE {
        let head: String = line.chars().take(limit::MESSAGE / 2).collect();
        let tail: Vec<_> = line.chars().rev().take(limit::MESSAGE / 4).collect();
        line = format!("{head} ... {}", tail.iter().rev().collect::<String>());
    }
    if line.contains(char::is_control) {
        line = line.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    }
    line
}

/// The faults found so far. Reading goes on after most of them, to report several at once.
#[derive(Debug, Default)]
pub(in crate::scene_file) struct Faults {
    list: Vec<Diagnostic>,
    stopped: bool,
}

impl Faults {
    pub(in crate::scene_file) fn push(&mut self, place: &SourceLocation, fault: ParseFault) {
        self.report(fault.at(Some(place.clone())));
    }

    pub(in crate::scene_file) fn report(&mut self, diagnostic: Diagnostic) {
        if self.stopped {
            return;
        }
        self.list.push(diagnostic);
        if self.list.len() == limit::FAULTS {
            self.list
                .push(ParseFault::new(format!("more than {} faults: the rest is not shown", limit::FAULTS)).at(None));
            self.stopped = true;
        }
    }

    /// Ends the reading: what follows would take too much.
    pub(in crate::scene_file) fn stop(&mut self) {
        self.stopped = true;
    }

    pub(in crate::scene_file) fn stopped(&self) -> bool {
        self.stopped
    }

    pub(in crate::scene_file) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// The value, if nothing was wrong.
    pub(in crate::scene_file) fn or<T>(self, value: T) -> Result<T, SceneError> {
        if self.list.is_empty() { Ok(value) } else { Err(SceneError(self.list)) }
    }
}
