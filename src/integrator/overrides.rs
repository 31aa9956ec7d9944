use std::time::Duration;

use super::Integrator;
use crate::scene_file::{
    Category, Document, Object, ObjectId, Override, Property, SceneError, SourceLocation, TIMEOUT, Value, whole_number,
};

/// The error message for a scene without an integrator.
pub const NO_INTEGRATOR: &str = "the scene has no integrator";

/// The changes of a render to its scene's integrator.
#[derive(Clone, Debug, Default)]
pub struct Overrides {
    /// The name of another integrator. It takes over the parameters that both have, such as `max_depth`.
    pub name: Option<String>,
    /// Parameters to set, as names and texts.
    pub params: Vec<(String, String)>,
}

impl Integrator {
    /// The name of a scene's own integrator, if it has one.
    #[must_use]
    pub fn name_in(document: &Document) -> Option<&str> {
        let id = document.child(document.root, Category::Integrator)?;
        Some(&document.object(id).plugin)
    }

    /// The integrator of a scene's document.
    ///
    /// # Errors
    /// If the scene has no integrator and none is named, or the integrator is invalid.
    pub fn of_scene(document: &Document, overrides: &Overrides) -> Result<Self, SceneError> {
        let (document, id) = overrides.applied(document)?;
        Self::read(&document, id)
    }

    /// The time after which the integrator of a scene's document ends a render; None without a limit.
    ///
    /// # Errors
    /// As [`Integrator::of_scene`].
    pub fn timeout(document: &Document, overrides: &Overrides) -> Result<Option<Duration>, SceneError> {
        let (document, id) = overrides.applied(document)?;
        let seconds = Self::params(&document, id)?.float(TIMEOUT.name)?;
        // A negative number is no duration.
        Ok(Duration::try_from_secs_f64(seconds).ok().filter(|duration| !duration.is_zero()))
    }

    /// The integrator as text: its name, and the parameters that are set and determine the image.
    ///
    /// # Errors
    /// If the scene has no integrator and none is named.
    pub fn described(document: &Document, overrides: &Overrides) -> Result<String, SceneError> {
        let (document, id) = overrides.applied(document)?;
        Ok(document.describe(id, &[TIMEOUT.name]))
    }
}

impl Overrides {
    /// The document with the changed integrator.
    fn applied(&self, document: &Document) -> Result<(Document, ObjectId), SceneError> {
        let own = document.child(document.root, Category::Integrator);
        let mut document = document.clone();
        let id = match (own, &self.name) {
            (None, None) => {
                let root = document.object(document.root);
                let error = SceneError::at(&root.place, NO_INTEGRATOR);
                return Err(error.hint("give it one, or choose one for this render"));
            }
            (Some(id), None) => id,
            (own, Some(name)) => document.add_stand_in(own, Category::Integrator, name, Integrator::PLUGINS),
        };
        for (name, text) in &self.params {
            set(&mut document.objects[id.0], name, text);
        }
        Ok((document, id))
    }
}

/// Sets a parameter from text. The type of the value follows from the text.
fn set(object: &mut Object, name: &str, text: &str) {
    let value = if let Some(integer) = whole_number(text).and_then(|number| number.try_into().ok()) {
        Value::Integer(integer)
    } else if let Ok(float) = text.parse() {
        Value::Float(float)
    } else if let Ok(boolean) = text.parse() {
        Value::Boolean(boolean)
    } else {
        Value::String(text.to_owned())
    };
    object.properties.retain(|property| property.name != name);
    let place = SourceLocation::Override(Override::Parameter { name: name.to_owned(), value: text.to_owned() });
    object.properties.push(Property { name: name.to_owned(), value, place });
}
