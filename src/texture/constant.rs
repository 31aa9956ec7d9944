use glam::DVec2;

use super::TextureModel;
use crate::{
    math::Rgb,
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, SceneError, manual},
};

/// A constant colour as a texture.
#[derive(Clone, Debug)]
pub struct Constant {
    /// The colour, linear RGB.
    pub colour: Rgb,
}

impl Described for Constant {
    const PLUGIN: Plugin = Plugin {
        category: Category::Texture,
        manual: manual!("constant.rs": "Constant"),
        name: "rawconstant",
        summary: "A constant colour.",
        params: &[Param::required("value", ParamKind::Rgb, "the colour, linear RGB")],
        examples: &[r#"<texture type="rawconstant"><rgb name="value" value="0.2, 0.5, 0.7"/></texture>"#],
        evidence: &["radiometry/white-environment"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        // Mitsuba also accepts a vector of three channels here.
        let colour = match params.find("value").map(|property| &property.value) {
            Some(crate::scene_file::Value::Vector(v)) => *v,
            _ => params.rgb("value")?,
        };
        Ok(Self { colour })
    }
}

impl TextureModel for Constant {
    fn eval(&self, _uv: DVec2) -> Rgb {
        self.colour
    }

    fn extremes(&self) -> (Rgb, Rgb) {
        super::extremes_of([self.colour])
    }
}
