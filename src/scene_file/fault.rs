use crate::scene_file::{Diagnostic, SceneError, SourceLocation};

/// The number of faults that are reported.
pub(super) const MAX_FAULTS: usize = 50;
/// The number of bytes of a message beyond which its middle is left out.
const MAX_MESSAGE: usize = 400;

/// One fault whose place its finder does not know.
#[derive(Clone, Debug)]
pub(super) struct ParseFault {
    /// What is wrong.
    pub(super) what: String,
    /// What would have been right.
    pub(super) hint: Option<String>,
    /// The attribute that is at fault, unless it is the element.
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

/// A message quotes the file, whose texts may be of any length and have line breaks in them.
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

/// The faults found so far. Reading goes on after most of them, to report several at once.
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
