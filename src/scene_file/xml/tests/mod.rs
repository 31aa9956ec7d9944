//! Each rule of the language with accepted and rejected examples, and the exact messages.

mod hostile;
mod includes;
mod structure;
mod transforms;
mod values;

use std::path::Path;

use crate::scene_file::{Document, Object, SceneError, Value};

use super::parse;

/// A scene with these lines, which begin at line 2.
fn scene(body: &str) -> String {
    format!("<scene version=\"3.0.0\">\n{body}\n</scene>")
}

fn parse_with(text: &str, definitions: &[(&str, &str)]) -> Result<Document, SceneError> {
    let definitions: Vec<_> = definitions.iter().map(|(name, value)| (name.to_string(), value.to_string())).collect();
    parse(text, "s.xml", Path::new(""), &definitions)
}

fn read(text: &str) -> Document {
    parse_with(text, &[]).unwrap_or_else(|error| panic!("{text}\n{error}"))
}

/// The message for a scene that is rejected, one line for each fault.
fn refused(text: &str) -> String {
    match parse_with(text, &[]) {
        Ok(_) => panic!("not refused: {text}"),
        Err(error) => error.to_string(),
    }
}

/// The value of the first property of the first object in a scene with this body.
fn value(body: &str) -> Value {
    first(&read(&scene(&format!("<shape type=\"s\">{body}</shape>")))).properties[0].value.clone()
}

/// The first object in the root.
fn first(document: &Document) -> &Object {
    &document.objects[1]
}

/// The message for a property in an object, without the place of the object.
fn refused_in_shape(body: &str) -> String {
    refused(&scene(&format!("<shape type=\"s\">\n{body}\n</shape>")))
}

fn names(object: &Object) -> Vec<&str> {
    object.properties.iter().map(|property| &*property.name).collect()
}
