//! Scene descriptions: a [`Document`] of typed objects with typed properties, each with the place where it was written.
//!
//! A document comes from a Mitsuba 3 file ([`xml`]) or from code ([`builder`]). Plugins read their parameters from it
//! through [`Params`], which checks types and ranges. This module does not depend on any plugin.

pub mod builder;
mod catalogue;
mod described;
mod edit;
mod error;
mod fault;
mod manual;
mod mesh;
pub mod mitsuba;
mod number;
mod page;
mod params;
mod plugin;
mod spelling;
mod transform;
pub mod xml;

pub(crate) use catalogue::catalogue;
pub use described::Described;
pub use error::{Diagnostic, Override, SceneError, SourceLocation};
pub use manual::Manual;
pub(crate) use manual::manual;
pub use mesh::MeshArrays;
pub use number::whole_number;
pub use params::Params;
pub use plugin::{DefaultValue, FARTHEST, Param, ParamKind, Plugin, Range, TIMEOUT};
pub use spelling::{closest, unknown_plugin};
pub use transform::Transform;

use std::{fmt, path::PathBuf, sync::Arc};

use glam::{DAffine3, DVec3};

/// The kind of an object, given by its tag.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Category {
    /// `<scene>`
    Scene,
    /// `<integrator>`
    Integrator,
    /// `<sensor>`
    Sensor,
    /// `<film>`
    Film,
    /// `<rfilter>`
    Filter,
    /// `<sampler>`
    Sampler,
    /// `<shape>`
    Shape,
    /// `<bsdf>`
    Bsdf,
    /// `<texture>`
    Texture,
    /// `<emitter>`
    Emitter,
    /// `<medium>`
    Medium,
    /// `<phase>`
    Phase,
    /// `<volume>`
    Volume,
}

impl Category {
    /// Every category with its tag.
    pub const ALL: [(Self, &'static str); 13] = [
        (Self::Scene, "scene"),
        (Self::Integrator, "integrator"),
        (Self::Sensor, "sensor"),
        (Self::Film, "film"),
        (Self::Filter, "rfilter"),
        (Self::Sampler, "sampler"),
        (Self::Shape, "shape"),
        (Self::Bsdf, "bsdf"),
        (Self::Texture, "texture"),
        (Self::Emitter, "emitter"),
        (Self::Medium, "medium"),
        (Self::Phase, "phase"),
        (Self::Volume, "volume"),
    ];

    /// The tag in a scene file.
    #[must_use]
    pub fn tag(self) -> &'static str {
        Self::ALL.iter().find(|(category, _)| *category == self).expect("every category has a tag").1
    }

    /// Whether its objects have an effect only where other objects use them.
    #[must_use]
    pub fn is_part(self) -> bool {
        !matches!(self, Self::Scene | Self::Integrator | Self::Sensor | Self::Shape | Self::Emitter)
    }

    /// The category of a tag.
    #[must_use]
    pub fn from_tag(tag: &str) -> Option<Self> {
        Self::ALL.iter().find(|(_, t)| *t == tag).map(|(category, _)| *category)
    }
}

impl fmt::Display for Category {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.tag())
    }
}

/// The index of an object in a [`Document`], from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ObjectId(pub usize);

/// A whole scene description: all objects, with references resolved. [`xml::read`] and
/// [`builder::ObjectBuilder::build`] make one.
#[derive(Clone, Debug)]
pub struct Document {
    /// Every object, each before its children. An object with several references to it is listed once.
    pub objects: Vec<Object>,
    /// The outermost object, a `<scene>`.
    pub root: ObjectId,
    /// The files that were read, the scene file first; empty if the scene was built in code.
    pub files: Vec<PathBuf>,
}

/// An object of a scene: an element with a `type`.
#[derive(Clone, Debug)]
pub struct Object {
    /// The category, given by the tag.
    pub category: Category,
    /// The name of its plugin, the `type` attribute; empty for a scene.
    pub plugin: String,
    /// The `id`, if the object has one.
    pub id: Option<String>,
    /// Where it was written.
    pub place: SourceLocation,
    /// The folder that relative file names start from.
    pub folder: Arc<PathBuf>,
    /// Its properties and child objects in document order. Children without a name are called `_arg_0`, `_arg_1`, ...
    pub properties: Vec<Property>,
}

/// A named value of an object.
#[derive(Clone, Debug)]
pub struct Property {
    /// The `name` attribute.
    pub name: String,
    /// The value.
    pub value: Value,
    /// Where it was written.
    pub place: SourceLocation,
}

/// The value of a property.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// `<float>`
    Float(f64),
    /// `<integer>`
    Integer(i64),
    /// `<boolean>`
    Boolean(bool),
    /// `<string>`
    String(String),
    /// `<rgb>`: red, green and blue in linear Rec. 709
    Rgb(DVec3),
    /// `<spectrum>`
    Spectrum(Spectrum),
    /// `<point>` or `<vector>`, which are interchangeable: x, y and z
    Vector(DVec3),
    /// `<transform>`, affine and invertible
    Transform(DAffine3),
    /// Triangles, in a scene that is built in code
    Mesh(Arc<MeshArrays>),
    /// A child object or a `<ref>` to one
    Object(ObjectId),
}

/// A `<spectrum>` element.
#[derive(Clone, Debug, PartialEq)]
pub enum Spectrum {
    /// The same value at every wavelength.
    Uniform(f64),
    /// Pairs of wavelength in nanometres and value.
    Tabulated(Vec<(f64, f64)>),
    /// A file of pairs of wavelength and value.
    File(String),
}

impl Value {
    /// The name of the value's type, for messages.
    #[must_use]
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::Float(_) => "float",
            Self::Integer(_) => "integer",
            Self::Boolean(_) => "boolean",
            Self::String(_) => "string",
            Self::Rgb(_) => "rgb",
            Self::Spectrum(_) => "spectrum",
            Self::Vector(_) => "vector",
            Self::Transform(_) => "transform",
            Self::Mesh(_) => "mesh",
            Self::Object(_) => "object",
        }
    }
}

impl Document {
    /// The object with a number.
    ///
    /// # Panics
    /// If the document has no object with this number.
    #[must_use]
    pub fn object(&self, id: ObjectId) -> &Object {
        &self.objects[id.0]
    }

    /// For each object, whether the image depends on it: the integrator, the sensors, the shapes and the emitters of the
    /// scene, and what they refer to.
    #[must_use]
    pub fn used(&self) -> Vec<bool> {
        let mut used = vec![false; self.objects.len()];
        used[self.root.0] = true;
        let mut next: Vec<_> = self.children(self.root).filter(|id| !self.object(*id).category.is_part()).collect();
        while let Some(id) = next.pop() {
            if !std::mem::replace(&mut used[id.0], true) {
                next.extend(self.children(id));
            }
        }
        used
    }

    /// The objects that an object has or refers to, in document order.
    fn children(&self, parent: ObjectId) -> impl Iterator<Item = ObjectId> {
        self.object(parent).properties.iter().filter_map(|property| match property.value {
            Value::Object(id) => Some(id),
            _ => None,
        })
    }
}
