//! Scenes built in code: the same [`Document`] as a scene file gives, without XML.
//!
//! There is a function for each kind of object, named after its tag: [`integrator`], [`sensor`], [`film`], [`rfilter`],
//! [`sampler`], [`shape`], [`bsdf`], [`texture`], [`emitter`], and [`scene`] around them. Each takes the name of a
//! plugin. Parameters have the names that they have in a scene file; `etendue plugins` lists them. An object with the
//! same parameters in the same order gives the same image as its XML, to the last bit.
//!
//! ```
//! use etendue::prelude::*;
//!
//! let camera = sensor("perspective")
//!     .with("to_world", Transform::new().look_at([0.0, 1.0, 5.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]))
//!     .child(film("hdrfilm").with("width", 16).with("height", 16));
//! let mut room = scene()
//!     .child(integrator("path").with("max_depth", 4))
//!     .child(camera)
//!     .child(emitter("constant"))
//!     // One material for several shapes: give it an id and refer to that.
//!     .child(bsdf("diffuse").with("reflectance", rgb(0.8, 0.2, 0.2)).id("red"));
//! for x in [-1.0, 1.0] {
//!     room = room.child(shape("sphere").with("center", [x, 0.0, 0.0]).child(reference("red")));
//! }
//! let renderer = Renderer::new(&room.build()?, &Overrides::default())?;
//! # Ok::<(), SceneError>(())
//! ```
//!
//! # Errors
//!
//! A fault is reported with the line of code that wrote it, the object, and the parameter:
//!
//! ```
//! # use etendue::prelude::*;
//! let glass = shape("sphere").child(bsdf("dielectric").with("int_ior", -1.5));
//! let document = scene().child(integrator("path")).child(sensor("perspective")).child(glass).build()?;
//! let error = Renderer::new(&document, &Overrides::default()).expect_err("no index of refraction is negative");
//! let line = error.to_string();
//! assert!(line.contains(r#": shape "sphere" > bsdf "dielectric": "int_ior" is -1.5; must be "#), "{line}");
//! # Ok::<(), SceneError>(())
//! ```
//!
//! [`ObjectBuilder::build`] reports faults that do not depend on a plugin: names that are given twice, references to
//! ids that no object has, transforms that flatten space, numbers that are not finite.
//! [`Renderer::new`](crate::render::Renderer::new) reports unknown plugins and parameters, wrong types and ranges.

mod argument;
mod collect;
#[cfg(test)]
mod tests;

pub use argument::{Argument, rgb};

use std::{panic::Location, path::PathBuf};

use super::{Category, Document, SceneError, SourceLocation};
use collect::Collector;

/// An object of a scene that is built in code: a plugin with its parameters and the objects in it.
#[derive(Clone, Debug)]
#[must_use]
pub struct ObjectBuilder {
    category: Category,
    plugin: String,
    id: Option<String>,
    place: SourceLocation,
    entries: Vec<Entry>,
}

/// A parameter, or an object without a name.
#[derive(Clone, Debug)]
struct Entry {
    name: Option<String>,
    argument: Argument,
    place: SourceLocation,
}

/// A reference to the object with an id, anywhere in the scene.
#[derive(Clone, Debug)]
pub struct Reference(String);

/// What can stand in an object without a name: an object or a reference to one.
#[derive(Clone, Debug)]
pub struct Child(Argument);

impl From<ObjectBuilder> for Child {
    fn from(object: ObjectBuilder) -> Self {
        Self(object.into())
    }
}

impl From<Reference> for Child {
    fn from(reference: Reference) -> Self {
        Self(reference.into())
    }
}

/// The outermost object, `<scene>`.
#[track_caller]
pub fn scene() -> ObjectBuilder {
    ObjectBuilder::new(Category::Scene, "")
}

/// An integrator by the name of its plugin, such as `path`.
#[track_caller]
pub fn integrator(plugin: &str) -> ObjectBuilder {
    ObjectBuilder::new(Category::Integrator, plugin)
}

/// A camera, such as `perspective`.
#[track_caller]
pub fn sensor(plugin: &str) -> ObjectBuilder {
    ObjectBuilder::new(Category::Sensor, plugin)
}

/// A film, such as `hdrfilm`. It stands in a sensor.
#[track_caller]
pub fn film(plugin: &str) -> ObjectBuilder {
    ObjectBuilder::new(Category::Film, plugin)
}

/// A reconstruction filter, such as `box`. It stands in a film.
#[track_caller]
pub fn rfilter(plugin: &str) -> ObjectBuilder {
    ObjectBuilder::new(Category::Filter, plugin)
}

/// A sampler, such as `independent`. It stands in a sensor.
#[track_caller]
pub fn sampler(plugin: &str) -> ObjectBuilder {
    ObjectBuilder::new(Category::Sampler, plugin)
}

/// A shape, such as `sphere`. Its material and its emitter stand in it.
#[track_caller]
pub fn shape(plugin: &str) -> ObjectBuilder {
    ObjectBuilder::new(Category::Shape, plugin)
}

/// A material, such as `diffuse`.
#[track_caller]
pub fn bsdf(plugin: &str) -> ObjectBuilder {
    ObjectBuilder::new(Category::Bsdf, plugin)
}

/// A texture, such as `checkerboard`. It stands in a material, under the name of the parameter that it gives.
#[track_caller]
pub fn texture(plugin: &str) -> ObjectBuilder {
    ObjectBuilder::new(Category::Texture, plugin)
}

/// A light source, such as `constant`, or `area` within a shape.
#[track_caller]
pub fn emitter(plugin: &str) -> ObjectBuilder {
    ObjectBuilder::new(Category::Emitter, plugin)
}

/// A reference to the object that [`ObjectBuilder::id`] gave this id.
#[must_use]
pub fn reference(id: &str) -> Reference {
    Reference(id.to_owned())
}

impl ObjectBuilder {
    #[track_caller]
    fn new(category: Category, plugin: &str) -> Self {
        Self { category, plugin: plugin.to_owned(), id: None, place: here(), entries: Vec::new() }
    }

    /// Sets a parameter; [`Argument`] lists the types of its value. Each can be set once.
    #[track_caller]
    pub fn with(mut self, name: &str, value: impl Into<Argument>) -> Self {
        self.entries.push(Entry { name: Some(name.to_owned()), argument: value.into(), place: here() });
        self
    }

    /// Adds an object, or a reference to one, without a name.
    #[track_caller]
    pub fn child(mut self, child: impl Into<Child>) -> Self {
        self.entries.push(Entry { name: None, argument: child.into().0, place: here() });
        self
    }

    /// Adds several objects without names, in order.
    #[track_caller]
    pub fn children<C: Into<Child>>(mut self, children: impl IntoIterator<Item = C>) -> Self {
        let place = here();
        let entry = |child: C| Entry { name: None, argument: child.into().0, place: place.clone() };
        self.entries.extend(children.into_iter().map(entry));
        self
    }

    /// Names the object for references to it. No two objects of a scene can have the same id.
    pub fn id(self, id: &str) -> Self {
        Self { id: Some(id.to_owned()), ..self }
    }

    /// The document with this object as its root. File names in it start from the current folder.
    ///
    /// # Errors
    /// All faults that can be found without knowing the plugins, in the order of the objects; faults of references come
    /// last.
    pub fn build(self) -> Result<Document, SceneError> {
        self.build_in("")
    }

    /// As [`ObjectBuilder::build`], but file names in the scene are relative to a folder.
    ///
    /// # Errors
    /// As [`ObjectBuilder::build`].
    pub fn build_in(self, folder: impl Into<PathBuf>) -> Result<Document, SceneError> {
        Collector::default().document(self, folder.into())
    }
}

/// The line of code that called the function that calls `here`.
#[track_caller]
fn here() -> SourceLocation {
    let caller = Location::caller();
    SourceLocation::Code { file: caller.file().into(), line: caller.line(), column: caller.column(), object: None }
}
