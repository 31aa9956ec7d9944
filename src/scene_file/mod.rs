//! What a scene file says, before anyone asks what it means: typed objects with typed properties, each of which
//! knows its file, line and column; and [`Params`], through which a plugin reads its own.
//!
//! [`xml`] makes a [`Document`] from text. Nothing in here knows a shape from a light.

mod catalogue;
mod described;
mod edit;
mod error;
mod params;
mod plugin;
pub mod xml;

pub(crate) use catalogue::catalogue;
pub use described::Described;
pub use error::{Diagnostic, SceneError, SourceLocation};
pub use params::Params;
pub use plugin::{DefaultValue, FARTHEST, Param, ParamKind, Plugin, Range};

use std::{fmt, path::PathBuf, sync::Arc};

use glam::{DAffine3, DVec3};

/// What an object is, by its tag.
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

/// Which object of a [`Document`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ObjectId(pub usize);

/// A whole scene description: all its objects, with references resolved.
#[derive(Clone, Debug)]
pub struct Document {
    /// Every object; an object that is referred to twice stands here once.
    pub objects: Vec<Object>,
    /// The outermost one.
    pub root: ObjectId,
    /// The files that were read to make it, the scene file first.
    pub files: Vec<PathBuf>,
}

/// One element with a `type`.
#[derive(Clone, Debug)]
pub struct Object {
    /// What it is.
    pub category: Category,
    /// Which of that kind: the `type` attribute; empty for a scene.
    pub plugin: String,
    /// Its `id`, if it has one.
    pub id: Option<String>,
    /// Where it stands.
    pub place: SourceLocation,
    /// The folder that its relative file names start from.
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
    /// Where it stands.
    pub place: SourceLocation,
}

/// What a property can hold.
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
    /// `<rgb>`, linear Rec. 709
    Rgb(DVec3),
    /// `<spectrum>`
    Spectrum(Spectrum),
    /// `<point>` or `<vector>`, which may stand for each other
    Vector(DVec3),
    /// `<transform>`, affine and regular
    Transform(DAffine3),
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
    /// A file of such pairs.
    File(String),
}

impl Value {
    /// What a message calls this type.
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
            Self::Object(_) => "object",
        }
    }
}

impl Document {
    /// The object with this number.
    #[must_use]
    pub fn object(&self, id: ObjectId) -> &Object {
        &self.objects[id.0]
    }
}
