use std::borrow::Cow;

use roxmltree::Node;

use crate::scene_file::{SourceLocation, closest};

use super::{params::Parameters, source::SourceText};
use crate::scene_file::fault::{Faults, ParseFault};

/// An element with its parameters substituted.
pub(super) struct Element<'a> {
    pub(super) tag: &'a str,
    pub(super) place: SourceLocation,
    /// False once a fault of the attributes was reported; their values are then not read.
    pub(super) sound: bool,
    attributes: Vec<Attribute<'a>>,
}

struct Attribute<'a> {
    name: &'a str,
    value: Cow<'a, str>,
    offset: usize,
}

impl<'a> Element<'a> {
    /// Substitutes parameters in every attribute except `version`, which determines how the rest is read.
    pub(super) fn new(
        node: Node<'a, '_>,
        source: &SourceText<'_>,
        parameters: &mut Parameters,
        faults: &mut Faults,
    ) -> Self {
        let place = source.place(node.range().start);
        let mut element = Self { tag: node.tag_name().name(), place, sound: true, attributes: Vec::new() };
        for attribute in node.attributes() {
            let (name, text, offset) = (attribute.name(), attribute.value(), attribute.range().start);
            let value = if name == "version" { Ok(Cow::Borrowed(text)) } else { parameters.substitute(text) };
            let value = value.unwrap_or_else(|fault| {
                faults.push(&source.place(offset), fault);
                element.sound = false;
                Cow::Borrowed(text)
            });
            element.attributes.push(Attribute { name, value, offset });
        }
        element
    }

    /// Reports attributes that are not allowed, and required ones that are missing.
    pub(super) fn check(&mut self, source: &SourceText<'_>, required: &[&str], optional: &[&str], faults: &mut Faults) {
        let allowed = || required.iter().chain(optional).copied();
        for attribute in &self.attributes {
            if allowed().any(|name| name == attribute.name) {
                continue;
            }
            let absent = allowed().filter(|name| !self.has(name));
            let hint = match closest(attribute.name, absent) {
                Some(near) => format!("did you mean \"{near}\"?"),
                None => format!("<{}> may have {}", self.tag, allowed().collect::<Vec<_>>().join(", ")),
            };
            let what = format!("unexpected attribute \"{}\" in <{}>", attribute.name, self.tag);
            faults.push(&source.place(attribute.offset), ParseFault::new(what).hint(hint));
            self.sound = false;
        }
        for name in required {
            if self.has(name) {
                continue;
            }
            let what = format!("missing attribute \"{name}\" in <{}>", self.tag);
            faults.push(&self.place, ParseFault::new(what).hint(format!("write <{} {name}=\"...\">", self.tag)));
            self.sound = false;
        }
    }

    pub(super) fn has(&self, name: &str) -> bool {
        self.get(name).is_some()
    }

    pub(super) fn get(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|attribute| attribute.name == name).map(|attribute| &*attribute.value)
    }

    /// Whether the text of an attribute contains a substituted parameter.
    pub(super) fn is_substituted(&self, name: &str) -> bool {
        let is_it = |attribute: &Attribute<'_>| attribute.name == name && matches!(attribute.value, Cow::Owned(_));
        self.attributes.iter().any(is_it)
    }

    /// An attribute that [`Element::check`] required.
    pub(super) fn required(&self, name: &str) -> &str {
        self.get(name).unwrap_or_default()
    }

    /// The place of a fault: its attribute, or else the element.
    pub(super) fn place_of(&self, fault: &ParseFault, source: &SourceText<'_>) -> SourceLocation {
        let attribute = self.attributes.iter().find(|attribute| Some(attribute.name) == fault.attribute);
        attribute.map_or_else(|| self.place.clone(), |attribute| source.place(attribute.offset))
    }
}
