use std::sync::Arc;

use glam::{DAffine3, DVec2};

use super::{TextureModel, picture_file};
use crate::{
    math::Rgb,
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, SceneError, manual},
};

/// A texture from an image file, whose first row lies at `v = 0`. Images with 8 or 16 bits per channel are decoded from
/// sRGB unless `raw` is set. `OpenEXR` images are linear.
#[derive(Clone, Debug)]
pub struct Bitmap {
    width: usize,
    height: usize,
    texels: Arc<Vec<[f32; 3]>>,
    nearest: bool,
    wrap: Wrap,
    to_uv: DAffine3,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Wrap {
    Repeat,
    Mirror,
    Clamp,
}

impl Described for Bitmap {
    const PLUGIN: Plugin = Plugin {
        category: Category::Texture,
        manual: manual!("bitmap.rs": "Bitmap"),
        name: "bitmap",
        summary: "An image from a PNG, JPEG or EXR file.",
        params: &[
            Param::required("filename", ParamKind::File, "the image file"),
            Param::new(
                "filter_type",
                ParamKind::Choice(&["bilinear", "nearest"]),
                "bilinear",
                "the interpolation of texels",
            ),
            Param::new(
                "wrap_mode",
                ParamKind::Choice(&["repeat", "mirror", "clamp"]),
                "repeat",
                "the continuation outside [0, 1]²",
            ),
            Param::new(
                "raw",
                ParamKind::Boolean,
                "false",
                "whether images with 8 or 16 bits per channel are linear instead of sRGB",
            ),
            Param::optional("to_uv", ParamKind::Transform, "the identity", "a transform of the uv coordinates"),
            Param::ignored("format", ParamKind::String, "texels are 32-bit floats"),
            Param::ignored("accel", ParamKind::Boolean, "textures are interpolated in software"),
        ],
        examples: &[],
        evidence: &["reference/metal-spheres", "reference/torus-thinlens"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let raw = params.boolean("raw")?;
        let picture = picture_file::read(&params.file("filename")?).map_err(|what| params.error("filename", what))?;
        let (width, height, texels) = (picture.width, picture.height, picture.linear(raw));
        if texels.iter().flatten().any(|x| !x.is_finite()) {
            return Err(params.error("filename", "the image has a value that is infinite or NaN"));
        }
        let wrap = match params.string("wrap_mode")? {
            "mirror" => Wrap::Mirror,
            "clamp" => Wrap::Clamp,
            _ => Wrap::Repeat,
        };
        let nearest = params.string("filter_type")? == "nearest";
        let to_uv = params.transform("to_uv")?;
        Ok(Self { width, height, texels: Arc::new(texels), nearest, wrap, to_uv })
    }
}

impl Bitmap {
    fn texel(&self, x: i64, y: i64) -> Rgb {
        let x = wrapped(x, self.width, self.wrap);
        let y = wrapped(y, self.height, self.wrap);
        Rgb::from(self.texels[y * self.width + x].map(f64::from))
    }
}

fn wrapped(i: i64, size: usize, wrap: Wrap) -> usize {
    let size = size as i64;
    let i = match wrap {
        Wrap::Repeat => i.rem_euclid(size),
        Wrap::Clamp => i.clamp(0, size - 1),
        Wrap::Mirror => {
            let i = i.rem_euclid(2 * size);
            if i < size { i } else { 2 * size - 1 - i }
        }
    };
    i as usize
}

impl TextureModel for Bitmap {
    fn eval(&self, uv: DVec2) -> Rgb {
        let p = super::to_uv(&self.to_uv, uv) * DVec2::new(self.width as f64, self.height as f64);
        if self.nearest {
            return self.texel(p.x.floor() as i64, p.y.floor() as i64);
        }
        // The value of a texel applies at its centre.
        let p = p - 0.5;
        let corner = p.floor();
        let (w, x, y) = (p - corner, corner.x as i64, corner.y as i64);
        let row = |y| self.texel(x, y).lerp(self.texel(x + 1, y), w.x);
        row(y).lerp(row(y + 1), w.y)
    }

    fn extremes(&self) -> (Rgb, Rgb) {
        super::extremes_of(self.texels.iter().map(|t| Rgb::from(t.map(f64::from))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_by_one(nearest: bool, wrap: Wrap) -> Bitmap {
        let texels = Arc::new(vec![[0.0; 3], [1.0; 3]]);
        Bitmap { width: 2, height: 1, texels, nearest, wrap, to_uv: DAffine3::IDENTITY }
    }

    #[test]
    fn bilinear_interpolation_is_exact_at_texel_centres() {
        let image = two_by_one(false, Wrap::Clamp);
        for (u, expected) in [(0.25, 0.0), (0.5, 0.5), (0.75, 1.0), (0.0, 0.0), (1.0, 1.0)] {
            assert!((image.eval(DVec2::new(u, 0.5)).x - expected).abs() < 1e-12, "{u}");
        }
    }

    #[test]
    fn wrap_modes_continue_outside_the_unit_square() {
        let value = |wrap, u| two_by_one(true, wrap).eval(DVec2::new(u, 0.5)).x;
        assert_eq!((value(Wrap::Repeat, 1.25), value(Wrap::Mirror, 1.25), value(Wrap::Clamp, 1.25)), (0.0, 1.0, 1.0));
        assert_eq!(
            (value(Wrap::Repeat, -0.25), value(Wrap::Mirror, -0.25), value(Wrap::Clamp, -0.25)),
            (1.0, 0.0, 0.0)
        );
    }
}
