use glam::DAffine3;
use roxmltree::Node;

use crate::scene_file::{Spectrum, Value, closest, transform::regular};

use super::{
    element::Element,
    reader::{File, Parent, Reader},
    refs::DraftValue,
    transform::{self, OPERATIONS},
    values,
};
use crate::scene_file::fault::ParseFault;

impl Reader {
    /// Reads a value other than a transform.
    pub(super) fn property(&mut self, file: &File<'_>, element: &mut Element<'_>, parent: &mut Parent) {
        let (required, optional): (&[_], &[_]) = match element.tag {
            "point" | "vector" if element.has("value") => (&["name"], &values::COORDINATES),
            "point" | "vector" => (&["name", "x", "y", "z"], &["value"]),
            "spectrum" => (&["name"], &["value", "filename"]),
            _ => (&["name", "value"], &[]),
        };
        element.check(file.source, required, optional, &mut self.faults);
        if !element.sound {
            return;
        }
        match value(element) {
            Ok(value) => self.named(file, element, parent, DraftValue::Ready(value)),
            Err(fault) => self.fault(file, element, fault),
        }
    }

    /// Reads a transform. Each operation is multiplied from the left.
    pub(super) fn transform(
        &mut self,
        file: &File<'_>,
        node: Node<'_, '_>,
        mut element: Element<'_>,
        parent: &mut Parent,
    ) {
        element.check(file.source, &["name"], &[], &mut self.faults);
        let mut whole = Some(DAffine3::IDENTITY);
        for child in node.children().filter(Node::is_element) {
            if self.faults.stopped() {
                return;
            }
            let operation = self.operation(file, child);
            whole = whole.zip(operation).map(|(before, operation)| operation * before);
        }
        // A fault of an operation is already reported.
        let Some(whole) = whole.filter(|_| element.sound) else { return };
        match regular(whole) {
            Ok(whole) => self.named(file, &element, parent, DraftValue::Ready(Value::Transform(whole))),
            Err(fault) => self.fault(file, &element, fault),
        }
    }

    fn operation(&mut self, file: &File<'_>, node: Node<'_, '_>) -> Option<DAffine3> {
        let mut element = Element::new(node, file.source, &mut self.parameters, &mut self.faults);
        if !OPERATIONS.contains(&element.tag) {
            let fault = ParseFault::new(format!("unexpected <{}> inside <transform>", element.tag));
            let hint = match closest(element.tag, OPERATIONS) {
                Some(near) => format!("did you mean <{near}>?"),
                None => format!("it holds {}", OPERATIONS.join(", ")),
            };
            self.faults.push(&element.place, fault.hint(hint));
            return None;
        }
        let (required, optional) = transform::attributes(element.tag);
        element.check(file.source, required, optional, &mut self.faults);
        self.childless(file, node);
        if !element.sound {
            return None;
        }
        transform::operation(&element).map_err(|fault| self.fault(file, &element, fault)).ok()
    }
}

/// The value of an element other than a transform.
fn value(element: &Element<'_>) -> Result<Value, ParseFault> {
    let text = element.required("value");
    let value = match element.tag {
        "float" => values::float(text).map(Value::Float),
        "integer" if element.is_substituted("value") => values::parameter_integer(text).map(Value::Integer),
        "integer" => values::integer(text).map(Value::Integer),
        "boolean" => values::boolean(text).map(Value::Boolean),
        "rgb" => values::rgb(text).map(Value::Rgb),
        "point" | "vector" => return values::coordinates(element, 0.0).map(Value::Vector),
        "spectrum" => {
            let filename = element.required("filename");
            match (text.is_empty(), filename.is_empty()) {
                (false, true) => values::spectrum(text).map(Value::Spectrum),
                (true, false) => return Ok(Value::Spectrum(Spectrum::File(filename.into()))),
                _ => {
                    let fault = ParseFault::new("a <spectrum> needs either \"value\" or \"filename\"");
                    return Err(fault.hint("give one of them"));
                }
            }
        }
        _ => Ok(Value::String(text.into())),
    };
    value.map_err(|fault| fault.on("value"))
}
