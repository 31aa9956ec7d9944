use std::{
    borrow::Cow,
    collections::{BTreeSet, HashMap},
};

use super::limit;
use crate::scene_file::closest;
use crate::scene_file::fault::ParseFault;

/// The parameters of a scene, `$name` in its attributes. The first definition wins; the command line comes before every
/// `<default>`.
pub(super) struct Parameters {
    values: HashMap<String, Parameter>,
    /// The lengths of all names, for the longest match.
    lengths: BTreeSet<usize>,
    substitutions: usize,
    substituted: usize,
}

struct Parameter {
    value: String,
    used: bool,
}

impl Parameters {
    /// Starts with the parameters of the command line. Their faults have no place in a file.
    pub(super) fn new(definitions: &[(String, String)]) -> Result<Self, ParseFault> {
        let mut parameters =
            Self { values: HashMap::new(), lengths: BTreeSet::new(), substitutions: 0, substituted: 0 };
        for (name, value) in definitions {
            if !parameters.define(name, value)? {
                return Err(ParseFault::new(format!("parameter ${name} is defined twice")).hint("give it one value"));
            }
        }
        Ok(parameters)
    }

    /// Defines a parameter unless it is already defined. Returns whether it was defined now.
    pub(super) fn define(&mut self, name: &str, value: &str) -> Result<bool, ParseFault> {
        if name.is_empty() || name.len() > limit::PARAMETER_NAME || name.contains(['$', '\\']) {
            return Err(ParseFault::new(format!("\"{name}\" cannot be the name of a parameter"))
                .hint(format!("a name has 1 to {} letters, digits or underscores", limit::PARAMETER_NAME))
                .on("name"));
        }
        // Mitsuba would substitute again in the value, but only shorter names, and a trailing backslash would escape
        // the next character.
        if value.contains('$') || value.ends_with('\\') {
            return Err(ParseFault::new(format!("\"{value}\" cannot be the value of a parameter"))
                .hint("it may not contain $ nor end in \\")
                .on("value"));
        }
        if self.values.contains_key(name) {
            return Ok(false);
        }
        self.lengths.insert(name.len());
        self.values.insert(name.into(), Parameter { value: value.into(), used: false });
        Ok(true)
    }

    /// Replaces each `$name` in a text by its value. The longest matching name wins, so that `$ab` is not `$a` and `b`.
    /// `\$` is a dollar sign.
    pub(super) fn substitute<'a>(&mut self, text: &'a str) -> Result<Cow<'a, str>, ParseFault> {
        let mut pieces = text.split('$');
        let Some(first) = pieces.next().filter(|first| first.len() < text.len()) else {
            return Ok(Cow::Borrowed(text));
        };
        let mut result = String::from(first);
        for piece in pieces {
            if result.ends_with('\\') {
                result.pop();
                result.push('$');
                result.push_str(piece);
                continue;
            }
            let Some(length) = self.longest(piece) else { return Err(self.undefined(piece)) };
            let (name, rest) = piece.split_at(length);
            self.expand(name, &mut result)?;
            result.push_str(rest);
        }
        Ok(Cow::Owned(result))
    }

    /// The parameters of the command line that were not used, as they were given.
    pub(super) fn unused<'a>(
        &'a self,
        definitions: &'a [(String, String)],
    ) -> impl Iterator<Item = &'a (String, String)> {
        definitions.iter().filter(|(name, _)| !self.values.get(name).is_some_and(|parameter| parameter.used))
    }

    /// A defined name that was probably meant.
    pub(super) fn near(&self, name: &str) -> Option<&str> {
        closest(name, self.values.keys().map(String::as_str).filter(|other| *other != name))
    }

    /// A list of the defined names, for messages.
    fn known(&self) -> Option<String> {
        let mut names: Vec<_> = self.values.keys().map(|name| format!("${name}")).collect();
        names.sort();
        names.truncate(12);
        (!names.is_empty()).then(|| names.join(", "))
    }

    /// The length of the longest defined name that the text begins with.
    fn longest(&self, text: &str) -> Option<usize> {
        self.lengths
            .iter()
            .rev()
            .copied()
            .find(|length| text.get(..*length).is_some_and(|name| self.values.contains_key(name)))
    }

    fn expand(&mut self, name: &str, result: &mut String) -> Result<(), ParseFault> {
        let Some(parameter) = self.values.get_mut(name) else { return Ok(()) };
        parameter.used = true;
        self.substitutions += 1;
        self.substituted += parameter.value.len();
        if self.substitutions > limit::SUBSTITUTIONS || self.substituted > limit::SUBSTITUTED {
            return Err(ParseFault::new("the parameters expand to too much text"));
        }
        result.push_str(&parameter.value);
        Ok(())
    }

    fn undefined(&self, text: &str) -> ParseFault {
        let end = text.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(text.len());
        let name = &text[..end];
        let fault = ParseFault::new(format!("undefined parameter: ${name}"));
        if name.is_empty() {
            return fault.hint("write \\$ for a dollar sign");
        }
        match (self.near(name), self.known()) {
            (Some(near), _) => fault.hint(format!("did you mean ${near}?")),
            (None, Some(known)) => fault.hint(format!("defined before this place: {known}")),
            (None, None) => fault.hint(format!("define it before with <default name=\"{name}\" value=\"...\"/>")),
        }
    }
}
