use super::{Category, Manual};

/// The manual page of a plugin. The reader uses its table of parameters, and the laws of its category run over its
/// examples.
#[derive(Clone, Copy, Debug)]
pub struct Plugin {
    /// The category, given by the tag.
    pub category: Category,
    /// The text of its manual page.
    pub manual: Manual,
    /// The `type` attribute.
    pub name: &'static str,
    /// Its purpose in one sentence.
    pub summary: &'static str,
    /// The parameters it reads, without those that every plugin of its category has.
    pub params: &'static [Param],
    /// Elements as they are written in a scene. Each must be valid, and the laws of the category hold for each.
    pub examples: &'static [&'static str],
    /// Names of rows of `etendue verify` that check the plugin, besides the laws of its category; `*` matches any text.
    pub evidence: &'static [&'static str],
}

/// One parameter of a plugin.
#[derive(Clone, Copy, Debug)]
pub struct Param {
    /// The `name` attribute.
    pub name: &'static str,
    /// The type of its value.
    pub kind: ParamKind,
    /// The value when the parameter is absent.
    pub default: DefaultValue,
    /// The allowed numbers, for each channel of a colour.
    pub range: Range,
    /// The meaning, with the unit.
    pub description: &'static str,
    /// Whether the parameter has an effect. One without is accepted because Mitsuba's scenes have it.
    pub has_effect: bool,
}

/// The type of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParamKind {
    /// A number; an integer is accepted.
    Float,
    /// A whole number.
    Integer,
    /// `true` or `false`.
    Boolean,
    /// Any text.
    String,
    /// One of several words.
    Choice(&'static [&'static str]),
    /// A file name, relative to the folder of the scene file.
    File,
    /// Linear RGB.
    Rgb,
    /// An index of refraction in linear RGB.
    Index,
    /// Linear RGB, a number for grey, or a texture.
    Texture,
    /// Three coordinates: a point or a vector.
    Point,
    /// An invertible affine map.
    Transform,
    /// Triangles in arrays, only in scenes built in code.
    Mesh,
    /// A child object.
    Object(Category),
}

/// The value of an absent parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DefaultValue {
    /// No value: the parameter must be given.
    Required,
    /// No value: the text says what the plugin does without it.
    Absent(&'static str),
    /// This value, as written in a scene file.
    Value(&'static str),
}

/// The largest allowed absolute value of a coordinate of a scene.
pub const FARTHEST: f64 = 1e15;

/// An interval of numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// The least allowed number.
    pub min: f64,
    /// The greatest allowed number.
    pub max: f64,
    /// Whether `min` itself is excluded.
    pub open: bool,
}

impl Range {
    /// Every finite number.
    pub const FINITE: Self = Self { min: f64::MIN, max: f64::MAX, open: false };
    /// Above zero and finite.
    pub const POSITIVE: Self = Self { min: 0.0, max: f64::MAX, open: true };
    /// Zero or above, finite.
    pub const NON_NEGATIVE: Self = Self { min: 0.0, max: f64::MAX, open: false };
    /// The emission of a light. Images hold 32-bit floats, which end at 3.4e38.
    pub const LIGHT: Self = Self { min: 0.0, max: 1e30, open: false };
    /// A length. The bounding volume hierarchy holds 32-bit floats, and the squares of lengths must stay below 3.4e38.
    pub const LENGTH: Self = Self { min: 0.0, max: FARTHEST, open: true };
    /// From 0 to 1, both included.
    pub const UNIT: Self = Self { min: 0.0, max: 1.0, open: false };

    /// Whether a number lies in the interval; NaN does not.
    #[must_use]
    pub fn contains(&self, x: f64) -> bool {
        x >= self.min && x <= self.max && !(self.open && x == self.min)
    }

    /// The interval in words.
    #[must_use]
    pub fn describe(&self) -> String {
        match *self {
            Self::FINITE => "a finite number".into(),
            Self::POSITIVE => "a number above 0".into(),
            Self::NON_NEGATIVE => "a number from 0 up".into(),
            Self { min, max: f64::MAX, .. } => format!("a number from {} up", number(min)),
            Self { min, max, open: true } => format!("a number above {}, at most {}", number(min), number(max)),
            Self { min, max, open: false } => format!("a number from {} to {}", number(min), number(max)),
        }
    }
}

/// A number as a person would write it: 0.0001, 4294967295, 1e30.
pub(super) fn number(x: f64) -> String {
    let plain = x == 0.0 || (1e-6..1e15).contains(&x.abs()) || !x.is_finite();
    if plain { x.to_string() } else { format!("{x:e}") }
}

/// The time after which a render ends.
pub const TIMEOUT: Param = Param::new(
    "timeout",
    ParamKind::Float,
    "-1",
    "the time in seconds after which a render ends, unless it is given another; 0 or less sets no limit",
);

const OF_INTEGRATORS: [Param; 3] = [
    TIMEOUT,
    Param::ignored("samples_per_pass", ParamKind::Integer, "memory does not depend on the number of samples"),
    Param::ignored("block_size", ParamKind::Integer, "the size of tiles is fixed"),
];
const OF_SENSORS: [Param; 2] = [
    Param::ignored("shutter_open", ParamKind::Float, "nothing moves"),
    Param::ignored("shutter_close", ParamKind::Float, "nothing moves"),
];
const OF_SHAPES: [Param; 1] =
    [Param::ignored("silhouette_sampling_weight", ParamKind::Float, "only derivatives of images need it")];

impl Plugin {
    /// Every parameter: its own, and those that every plugin of its category has.
    pub fn all_params(&self) -> impl Iterator<Item = &'static Param> + Clone {
        self.params.iter().chain(self.category.shared_params())
    }
}

impl Category {
    /// The parameters that every plugin of the category has.
    pub(super) fn shared_params(self) -> &'static [Param] {
        match self {
            Self::Integrator => &OF_INTEGRATORS,
            Self::Sensor => &OF_SENSORS,
            Self::Shape => &OF_SHAPES,
            _ => &[],
        }
    }
}

impl Param {
    /// A parameter that must be given.
    #[must_use]
    pub const fn required(name: &'static str, kind: ParamKind, description: &'static str) -> Self {
        Self { name, kind, default: DefaultValue::Required, range: Range::FINITE, description, has_effect: true }
    }

    /// A parameter with a default, written as in a scene file.
    #[must_use]
    pub const fn new(name: &'static str, kind: ParamKind, default: &'static str, description: &'static str) -> Self {
        Self { default: DefaultValue::Value(default), ..Self::required(name, kind, description) }
    }

    /// A parameter that may be absent; `without` says what the plugin does then.
    #[must_use]
    pub const fn optional(
        name: &'static str,
        kind: ParamKind,
        without: &'static str,
        description: &'static str,
    ) -> Self {
        Self { default: DefaultValue::Absent(without), ..Self::required(name, kind, description) }
    }

    /// A parameter of Mitsuba that has no effect here; `reason` says why none is needed. Its type is checked.
    #[must_use]
    pub const fn ignored(name: &'static str, kind: ParamKind, reason: &'static str) -> Self {
        Self { has_effect: false, ..Self::optional(name, kind, "no effect", reason) }
    }

    /// The same parameter with a range.
    #[must_use]
    pub const fn within(self, range: Range) -> Self {
        Self { range, ..self }
    }
}
