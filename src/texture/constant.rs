use glam::DVec2;

use super::TextureModel;
use crate::{
    math::Rgb,
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, SceneError, manual},
};

/// One colour everywhere, written as a texture.
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
        summary: "One colour everywhere.",
        params: &[Param::required("value", ParamKind::Rgb, "the colour, linear RGB")],
        examples: &[r#"<texture type="rawconstant"><rgb name="value" value="0.2, 0.5, 0.7"/></texture>"#],
        evidence: &["radiometry/white-sky"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        // Mitsuba gives this plugin its three channels as a vector as well.
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
