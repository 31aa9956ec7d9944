//! Textures: colours that vary over a surface with its `uv` coordinates.
//!
//! Wherever a plugin's table says *texture*, a scene may give `<rgb>`, a `<float>` for grey, or one of these plugins.

mod bitmap;
mod checkerboard;
mod constant;
mod picture_file;

pub use bitmap::Bitmap;
pub use checkerboard::Checkerboard;
pub use constant::Constant;

use enum_dispatch::enum_dispatch;
use glam::{DAffine3, DVec2};

use crate::{
    math::Rgb,
    scene_file::{Category, Params, SceneError, Value, catalogue},
};

/// The interface of all textures.
#[enum_dispatch]
pub trait TextureModel {
    /// The colour at `uv`, in linear RGB.
    fn eval(&self, uv: DVec2) -> Rgb;

    /// The least and the greatest value of each channel over the whole texture, for checking ranges.
    fn extremes(&self) -> (Rgb, Rgb);
}

catalogue! {
    /// A texture.
    pub enum Texture: TextureModel in Category::Texture, {
        /// One colour everywhere.
        Constant(Constant),
        /// Squares of two colours.
        Checkerboard(Checkerboard),
        /// An image file.
        Bitmap(Bitmap),
    }
}

impl Texture {
    /// The same colour everywhere.
    #[must_use]
    pub fn constant(colour: Rgb) -> Self {
        Self::Constant(Constant { colour })
    }

    /// Reads a plugin's parameter that may be a colour or a texture.
    ///
    /// # Errors
    /// If it is of another type, a channel is out of range, or the parameter is absent and has no default.
    pub fn of(params: &Params<'_>, name: &str) -> Result<Self, SceneError> {
        let Some(property) = params.find(name) else {
            return params.rgb(name).map(Self::constant);
        };
        let Value::Object(id) = property.value else {
            return params.colour(property).map(Self::constant);
        };
        let texture = Self::read(params.document(), id)?;
        let (least, greatest) = texture.extremes();
        let (least, greatest) = (least.min_element(), greatest.max_element());
        let range = params.range(name);
        if range.contains(least) && range.contains(greatest) {
            return Ok(texture);
        }
        let what = format!("the texture \"{name}\" has values from {least} to {greatest}");
        Err(params.error(name, what).hint(format!("each must be {}", range.describe())))
    }
}

/// The `to_uv` parameter, applied: Mitsuba uses the upper left 3 x 3 part of the matrix as a homogeneous map of the
/// plane, so that of a translation by (x, y, z) in three dimensions nothing remains. What users write is
/// `<scale x= y=/>`, which means the same in both readings, and `<translate x= y=/>`, which here does translate.
fn to_uv(map: &DAffine3, uv: DVec2) -> DVec2 {
    map.transform_point3(uv.extend(0.0)).truncate()
}

/// The range of each channel of some colours.
fn extremes_of(colours: impl IntoIterator<Item = Rgb>) -> (Rgb, Rgb) {
    let start = (Rgb::INFINITY, Rgb::NEG_INFINITY);
    colours.into_iter().fold(start, |(least, greatest), c| (least.min(c), greatest.max(c)))
}
