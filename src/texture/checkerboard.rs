use glam::{DAffine3, DVec2};

use super::TextureModel;
use crate::{
    math::Rgb,
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, SceneError, manual},
};

/// A checkerboard of two colours, with four squares per unit square of `uv`: `color0` where the fractional parts of
/// both coordinates are in the same half, `color1` elsewhere.
#[derive(Clone, Debug)]
pub struct Checkerboard {
    colours: [Rgb; 2],
    to_uv: DAffine3,
}

impl Described for Checkerboard {
    const PLUGIN: Plugin = Plugin {
        category: Category::Texture,
        manual: manual!("checkerboard.rs": "Checkerboard"),
        name: "checkerboard",
        summary: "A checkerboard of two colours.",
        params: &[
            Param::new("color0", ParamKind::Rgb, "0.4", "the colour of the square at the origin, linear RGB"),
            Param::new("color1", ParamKind::Rgb, "0.2", "the other colour, linear RGB"),
            Param::optional("to_uv", ParamKind::Transform, "the identity", "a transform of the uv coordinates"),
        ],
        examples: &[r#"<texture type="checkerboard"><rgb name="color0" value="0.8, 0.1, 0.1"/>
            <transform name="to_uv"><scale x="4" y="4"/></transform></texture>"#],
        evidence: &["reference/glass-on-checker", "reference/mesh-lamp"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self { colours: [params.rgb("color0")?, params.rgb("color1")?], to_uv: params.transform("to_uv")? })
    }
}

impl TextureModel for Checkerboard {
    fn eval(&self, uv: DVec2) -> Rgb {
        let fraction = super::to_uv(&self.to_uv, uv).fract_gl();
        let same_half = (fraction.x > 0.5) == (fraction.y > 0.5);
        self.colours[usize::from(!same_half)]
    }

    fn extremes(&self) -> (Rgb, Rgb) {
        super::extremes_of(self.colours)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_squares_match_mitsuba() {
        let board =
            Checkerboard { colours: [Rgb::X, Rgb::Y], to_uv: DAffine3::from_scale(glam::DVec3::new(2.0, 1.0, 1.0)) };
        assert_eq!(board.eval(DVec2::new(0.1, 0.1)), Rgb::X);
        assert_eq!(board.eval(DVec2::new(0.3, 0.1)), Rgb::Y);
        assert_eq!(board.eval(DVec2::new(0.3, 0.7)), Rgb::X);
        assert_eq!(board.eval(DVec2::new(-0.1, 0.1)), Rgb::Y);
    }
}
