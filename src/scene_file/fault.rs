use crate::scene_file::{Diagnostic, SceneError, SourceLocation};

/// The number of faults that are reported.
pub(super) const MAX_FAULTS: usize = 50;
/// Messages with more bytes are shortened in the middle.
const MAX_MESSAGE: usize = 400;

/// One fault whose place is not yet known.
#[derive(Clone, Debug)]
pub(super) struct ParseFault {
    /// What is wrong.
    pub(super) what: String,
    /// How to correct it.
    pub(super) hint: Option<String>,
    /// The attribute at fault; None if the element is at fault.
    pub(super) attribute: Option<&'static str>,
}

impl ParseFault {
    pub(super) fn new(what: impl Into<String>) -> Self {
        Self { what: what.into(), hint: None, attribute: None }
    }

    pub(super) fn hint(self, hint: impl Into<String>) -> Self {
        Self { hint: Some(hint.into()), ..self }
    }

    pub(super) fn on(self, attribute: &'static str) -> Self {
        Self { attribute: Some(attribute), ..self }
    }

    pub(super) fn at(self, place: Option<SourceLocation>) -> Diagnostic {
        Diagnostic { place, what: one_line(self.what), hint: self.hint.map(one_line) }
    }
}

/// Shortens a message and joins its lines. A message quotes the file, whose texts may be long and have line breaks.
fn one_line(text: String) -> String {
    let mut line = text;
    if line.len() > MAX_MESSAGE {
        let head: String = line.chars().take(MAX_MESSAGE / 2).collect();
        let tail: Vec<_> = line.chars().rev().take(MAX_MESSAGE / 4).collect();
        line = format!("{head} ... {}", tail.iter().rev().collect::<String>());
    }
    if line.contains(char::is_control) {
        line = line.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    }
    line
}

/// The faults found so far. Reading continues after most of them, to report several at once.
#[derive(Debug, Default)]
pub(super) struct Faults {
    list: Vec<Diagnostic>,
    stopped: bool,
}

impl Faults {
    pub(super) fn push(&mut self, place: &SourceLocation, fault: ParseFault) {
        self.report(fault.at(Some(place.clone())));
    }

    pub(super) fn report(&mut self, diagnostic: Diagnostic) {
        if self.stopped {
            return;
        }
        self.list.push(diagnostic);
        if self.list.len() == MAX_FAULTS {
            self.list.push(ParseFault::new(format!("more than {} faults: the rest is not shown", MAX_FAULTS)).at(None));
            self.stopped = true;
        }
    }

    /// Stops the reading, because the rest would take too much time or memory.
    pub(super) fn stop(&mut self) {
        self.stopped = true;
    }

    pub(super) fn stopped(&self) -> bool {
        self.stopped
    }

    pub(super) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// The value if there are no faults, otherwise the faults as an error.
    pub(super) fn or<T>(self, value: T) -> Result<T, SceneError> {
        if self.list.is_empty() { Ok(value) } else { Err(SceneError(self.list)) }
    }
}
