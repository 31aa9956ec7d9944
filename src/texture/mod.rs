//! Textures: colours that vary over a surface with its `uv` coordinates.
//!
//! A parameter of kind *texture* accepts an `<rgb>`, a `<float>` for grey, or one of these plugins.

mod bitmap;
mod checkerboard;
mod constant;
mod picture_file;
mod spectra;

pub use bitmap::Bitmap;
pub use checkerboard::Checkerboard;
pub use constant::Constant;
pub(crate) use picture_file::read as read_picture;
pub use spectra::{BlackBody, D65, Irregular, Regular, Srgb, Uniform};

use enum_dispatch::enum_dispatch;
use glam::{DAffine3, DVec2};

use crate::{
    math::{Rgb, luminance},
    scene_file::{Category, Params, SceneError, Value, catalogue},
    spectrum::Quantity,
};

/// The interface of all textures.
#[enum_dispatch]
pub trait TextureModel {
    /// The colour at `uv`, linear RGB.
    fn eval(&self, uv: DVec2) -> Rgb;

    /// The minimum and the maximum of each channel over the texture, to check parameter ranges.
    fn extremes(&self) -> (Rgb, Rgb);
}

catalogue! {
    /// A texture.
    pub enum Texture: TextureModel in Category::Texture, {
        /// A constant colour.
        Constant(Constant),
        /// A checkerboard.
        Checkerboard(Checkerboard),
        /// An image.
        Bitmap(Bitmap),
        /// One value at every wavelength.
        Uniform(Uniform),
        /// A colour.
        Srgb(Srgb),
        /// The standard illuminant D65.
        D65(D65),
        /// The emission of a black body.
        BlackBody(BlackBody),
        /// A spectrum of values at equal distances.
        Regular(Regular),
        /// A spectrum of values at any wavelengths.
        Irregular(Irregular),
    }
}

impl Texture {
    /// A constant texture.
    #[must_use]
    pub fn constant(colour: Rgb) -> Self {
        Self::Constant(Constant { colour })
    }

    /// Reads a parameter that is a colour or a texture.
    ///
    /// # Errors
    /// If the parameter is neither, if a channel is outside its range, or if it is absent and has no default.
    pub fn of(params: &Params<'_>, name: &str) -> Result<Self, SceneError> {
        let Some(property) = params.find(name) else {
            return params.rgb(name).map(Self::constant);
        };
        let Value::Object(id) = property.value else {
            return params.colour(property).map(Self::constant);
        };
        let texture = Self::read(params.document(), id)?.used_as(params.quantity(name));
        let (least, greatest) = texture.extremes();
        let (least, greatest) = (least.min_element(), greatest.max_element());
        let range = params.range(name);
        if range.contains(least) && range.contains(greatest) {
            return Ok(texture);
        }
        let what = format!("the texture \"{name}\" has values from {least} to {greatest}");
        Err(params.error(name, what).hint(format!("each must be {}", range.describe())))
    }

    /// The texture as one number: the luminance of its colour.
    #[must_use]
    pub fn value(&self, uv: DVec2) -> f64 {
        luminance(self.eval(uv))
    }

    /// The texture where its values are used as a quantity. Tabulated spectra are another colour as light.
    fn used_as(self, quantity: Quantity) -> Self {
        match self {
            Self::BlackBody(BlackBody(colours))
            | Self::Regular(Regular(colours))
            | Self::Irregular(Irregular(colours))
                if quantity == Quantity::Light =>
            {
                Self::constant(colours.light())
            }
            other => other,
        }
    }
}

/// Applies the `to_uv` parameter. Mitsuba uses the upper left 3 x 3 part of the matrix as a homogeneous map of the
/// plane, which drops a three-dimensional translation. `<scale x= y=/>` means the same in both interpretations;
/// `<translate x= y=/>` has an effect here only.
fn to_uv(map: &DAffine3, uv: DVec2) -> DVec2 {
    map.transform_point3(uv.extend(0.0)).truncate()
}

/// The minimum and the maximum of each channel of some colours.
fn extremes_of(colours: impl IntoIterator<Item = Rgb>) -> (Rgb, Rgb) {
    let start = (Rgb::INFINITY, Rgb::NEG_INFINITY);
    colours.into_iter().fold(start, |(least, greatest), c| (least.min(c), greatest.max(c)))
}
