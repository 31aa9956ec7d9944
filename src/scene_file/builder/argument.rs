use std::{path::Path, sync::Arc};

use glam::{DAffine3, DVec3};

use super::{ObjectBuilder, Reference};
use crate::scene_file::{MeshArrays, Spectrum, Transform, Value, fault::ParseFault, transform::regular, xml::values};

/// The value of a parameter. It is made from
///
/// | Rust | scene file |
/// |---|---|
/// | `f64`, `f32` | `<float>` |
/// | `i32`, `u32`, `i64`, `usize` | `<integer>`, which may also stand for a float |
/// | `bool` | `<boolean>` |
/// | `&str`, `String`, `&Path` | `<string>` |
/// | [`rgb`]`(r, g, b)` | `<rgb>`; a number stands for a grey |
/// | [`Spectrum`] | `<spectrum>` |
/// | `[f64; 3]`, [`DVec3`] | `<point>` and `<vector>` |
/// | [`Transform`], [`DAffine3`] | `<transform>` |
/// | [`MeshArrays`], also in an [`Arc`] | none: triangles of a shape `mesh` |
/// | [`ObjectBuilder`] | an object with a `name` |
/// | [`Reference`] | `<ref>` with a `name` |
#[derive(Clone, Debug)]
pub struct Argument(pub(super) Content);

#[derive(Clone, Debug)]
pub(super) enum Content {
    Value(Value),
    Object(Box<ObjectBuilder>),
    Reference(String),
    /// The given value is invalid.
    Invalid(ParseFault),
}

/// A colour in linear Rec. 709 RGB. What its channels mean depends on the parameter: a reflectance from 0 to 1, or a
/// radiance.
#[must_use]
pub fn rgb(red: f64, green: f64, blue: f64) -> Argument {
    Value::Rgb(DVec3::new(red, green, blue)).into()
}

impl From<Value> for Argument {
    /// # Panics
    /// If the value is a [`Value::Object`], whose number belongs to another document.
    fn from(value: Value) -> Self {
        assert!(!matches!(value, Value::Object(_)), "an object of another document is given as a parameter");
        Self(Content::Value(value))
    }
}

/// Implements `From` for the types that are one variant of [`Value`].
macro_rules! from {
    ($($Type:ty => $value:expr),* $(,)?) => {
        $(impl From<$Type> for Argument {
            fn from(given: $Type) -> Self {
                let value: fn($Type) -> Value = $value;
                Self(Content::Value(value(given)))
            }
        })*
    };
}

from! {
    f64 => Value::Float,
    f32 => |x| Value::Float(x.into()),
    i64 => Value::Integer,
    i32 => |i| Value::Integer(i.into()),
    u32 => |i| Value::Integer(i.into()),
    bool => Value::Boolean,
    &str => |text| Value::String(text.to_owned()),
    String => Value::String,
    Spectrum => Value::Spectrum,
    [f64; 3] => |p| Value::Vector(p.into()),
    DVec3 => Value::Vector,
    DAffine3 => Value::Transform,
    MeshArrays => |arrays| Value::Mesh(Arc::new(arrays)),
    Arc<MeshArrays> => Value::Mesh,
}

impl From<usize> for Argument {
    fn from(count: usize) -> Self {
        let fault = || ParseFault::new(format!("{count} is too large")).hint("integers have 64 bits and a sign");
        Self(i64::try_from(count).map_or_else(|_| Content::Invalid(fault()), |i| Content::Value(Value::Integer(i))))
    }
}

impl From<&Path> for Argument {
    fn from(path: &Path) -> Self {
        let fault = || ParseFault::new(format!("{} is not UTF-8", path.display())).hint("rename the file");
        let text = path.to_str().map(|text| Content::Value(Value::String(text.to_owned())));
        Self(text.unwrap_or_else(|| Content::Invalid(fault())))
    }
}

impl From<Transform> for Argument {
    fn from(transform: Transform) -> Self {
        Self(transform.0.map_or_else(Content::Invalid, |map| Content::Value(Value::Transform(map))))
    }
}

impl From<ObjectBuilder> for Argument {
    fn from(object: ObjectBuilder) -> Self {
        Self(Content::Object(Box::new(object)))
    }
}

impl From<Reference> for Argument {
    fn from(Reference(id): Reference) -> Self {
        Self(Content::Reference(id))
    }
}

/// Rejects values that a scene file could not hold.
pub(super) fn checked(value: Value) -> Result<Value, ParseFault> {
    let not_finite = |what: String| Err(ParseFault::new(format!("{what} is not finite")).hint("give finite numbers"));
    match value {
        // An infinite float is allowed, as in a scene file.
        Value::Float(x) if x.is_nan() => Err(ParseFault::new("NaN is not a number").hint("give a number")),
        Value::Rgb(v) | Value::Vector(v) if !v.is_finite() => not_finite(format!("{:?}", v.to_array())),
        Value::Transform(map) => regular(map).map(Value::Transform),
        Value::Spectrum(Spectrum::Uniform(x)) if !x.is_finite() => not_finite(x.to_string()),
        Value::Spectrum(Spectrum::Tabulated(pairs)) => {
            match pairs.iter().find(|(wavelength, x)| !wavelength.is_finite() || !x.is_finite()) {
                Some(pair) => not_finite(format!("{pair:?}")),
                None => values::tabulated(pairs).map(Value::Spectrum),
            }
        }
        value => Ok(value),
    }
}
