use std::{
    f64::consts::{FRAC_1_PI, PI, TAU},
    sync::Arc,
};

use glam::{DMat3, DVec2, DVec3};

use super::{Emission, EmissionTarget, EmitterModel, EmitterSample, orientation::Orientation};
use crate::{
    math::{BilinearDistribution, PerSolidAngle, Ray, Rgb, luminance},
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, Range, SceneError, manual},
    shape::{Shape, Surface},
    texture::read_picture,
};

/// An environment whose radiance is an image in latitude-longitude format, interpolated bilinearly. The centre of the
/// image is the local direction -z, the left half is towards +x, and the top is +y.
///
/// As in Mitsuba, the centres of the texels of the first and the last row are the poles, and the columns join
/// seamlessly: the texel (x, y) of a W x H image is the radiance at the longitude `2π (x + ½) / W` and the colatitude
/// `π y / (H - 1)`. Directions are sampled in proportion to the luminance.
#[derive(Clone, Debug)]
pub struct EnvMap {
    radiance: Arc<Panorama>,
    orientation: Orientation,
}

/// The radiance in local directions.
#[derive(Debug)]
struct Panorama {
    width: usize,
    height: usize,
    texels: Vec<[f32; 3]>,
    scale: f64,
    /// The density of directions in terms of longitude and colatitude, each from 0 to 1.
    distribution: BilinearDistribution,
    /// The integral of the radiance over all local directions.
    integral: Rgb,
}

impl Described for EnvMap {
    const PLUGIN: Plugin = Plugin {
        category: Category::Emitter,
        manual: manual!("envmap.rs": "EnvMap"),
        name: "envmap",
        summary: "An environment from an image in latitude-longitude format.",
        params: &[
            Param::required("filename", ParamKind::File, "the image file, at least 2 x 3 texels"),
            Param::new("scale", ParamKind::Float, "1", "scales the radiance of the image").within(Range::LIGHT),
            Param::optional(
                "to_world",
                ParamKind::Transform,
                "the identity",
                "maps the image's directions to the world",
            ),
            Param::ignored("mis_compensation", ParamKind::Boolean, "it would change the noise only"),
        ],
        examples: &[],
        evidence: &["environment/*"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let picture = read_picture(&params.file("filename")?).map_err(|what| params.error("filename", what))?;
        let (width, height, texels) = (picture.width, picture.height, picture.linear(false));
        if width < 2 || height < 3 {
            let error = params.error("filename", format!("the image has {width} x {height} texels"));
            return Err(error.hint("an environment needs at least 2 x 3"));
        }
        if texels.iter().flatten().any(|x| !x.is_finite() || *x < 0.0) {
            return Err(params.error("filename", "the image has a value that is negative, infinite or NaN"));
        }
        let radiance = Arc::new(Panorama::new(width, height, texels, params.float("scale")?));
        Ok(Self { radiance, orientation: Orientation::read(params)? })
    }
}

impl EnvMap {
    /// An environment from texels, row by row, in W/(m² sr). `to_world` maps its local directions to the world.
    ///
    /// # Panics
    /// If the width is below 2 or the height below 3, or if `texels` has another length than their product.
    #[must_use]
    pub fn new([width, height]: [usize; 2], texels: Vec<[f32; 3]>, to_world: DMat3) -> Self {
        assert!(width >= 2 && height >= 3 && texels.len() == width * height, "an image of at least 2 x 3 texels");
        let radiance = Arc::new(Panorama::new(width, height, texels, 1.0));
        Self { radiance, orientation: Orientation::new(to_world) }
    }
}

impl Panorama {
    fn new(width: usize, height: usize, texels: Vec<[f32; 3]>, scale: f64) -> Self {
        let sin = |y: usize| (PI * y as f64 / (height - 1) as f64).sin();
        let texel = |x: usize, y: usize| scale * Rgb::from(texels[y * width + x % width].map(f64::from));
        // The last column of nodes repeats the first.
        let nodes = (0..height).flat_map(|y| (0..=width).map(move |x| (x, y)));
        let weights = nodes.map(|(x, y)| (luminance(texel(x, y)) * sin(y)) as f32).collect();
        // The integral of sin θ times a row's weight, which falls linearly to 0 at the rows beside it.
        let step = PI / (height - 1) as f64;
        let solid_angle = |y: usize| match y {
            _ if y == 0 || y == height - 1 => 1.0 - step.sin() / step,
            _ => sin(y) * 4.0 * (0.5 * step).sin().powi(2) / step,
        };
        let rows = (0..height).map(|y| (0..width).map(|x| texel(x, y)).sum::<Rgb>() * solid_angle(y));
        let integral = rows.sum::<Rgb>() * (TAU / width as f64);
        Self { width, height, scale, distribution: BilinearDistribution::new(width + 1, weights), integral, texels }
    }

    fn texel(&self, x: usize, y: usize) -> Rgb {
        Rgb::from(self.texels[y * self.width + x % self.width].map(f64::from))
    }

    /// The position in the image of a local direction of any length: the longitude from the centre of the first column
    /// and the colatitude, each from 0 to 1, with the sine of the colatitude.
    fn position(&self, local: DVec3) -> (DVec2, f64) {
        let across = local.x.hypot(local.z);
        let longitude = local.x.atan2(-local.z) / TAU - 0.5 / self.width as f64;
        let colatitude = across.atan2(local.y) * FRAC_1_PI;
        (DVec2::new(longitude - longitude.floor(), colatitude), across / local.length())
    }

    fn radiance(&self, position: DVec2) -> Rgb {
        let p = position * DVec2::new(self.width as f64, (self.height - 1) as f64);
        let (x, y) = ((p.x as usize).min(self.width - 1), (p.y as usize).min(self.height - 2));
        let (u, v) = (p.x - x as f64, p.y - y as f64);
        let row = |y| self.texel(x, y).lerp(self.texel(x + 1, y), u);
        self.scale * row(y).lerp(row(y + 1), v)
    }

    /// The pdf of a position per local solid angle.
    fn pdf(&self, position: DVec2, sin: f64) -> f64 {
        if sin > 0.0 { self.distribution.pdf(position) / (TAU * PI * sin) } else { 0.0 }
    }

    /// Samples a position, and returns it with its local direction and the sine of its colatitude.
    fn sample(&self, u: DVec2) -> Option<(DVec2, DVec3, f64)> {
        let (position, _) = self.distribution.sample(u)?;
        let (sin_longitude, cos_longitude) = (TAU * (position.x + 0.5 / self.width as f64)).sin_cos();
        let (sin, cos) = (PI * position.y).sin_cos();
        Some((position, DVec3::new(sin * sin_longitude, cos, -sin * cos_longitude), sin))
    }
}

impl EnvMap {
    /// Samples a world direction to the environment, its radiance, and its pdf.
    fn sample(&self, u: DVec2) -> Option<(DVec3, Rgb, PerSolidAngle)> {
        let (position, local, sin) = self.radiance.sample(u)?;
        let (direction, ratio) = self.orientation.world(local);
        let pdf = self.radiance.pdf(position, sin) / ratio;
        (pdf > 0.0).then(|| (direction, self.radiance.radiance(position), PerSolidAngle(pdf)))
    }
}

impl EmitterModel for EnvMap {
    fn sample_direction(&self, _shape: Option<&Shape>, from: DVec3, u: DVec2) -> Option<EmitterSample> {
        let (direction, value, pdf) = self.sample(u)?;
        Some(EmitterSample { direction, shadow_ray: Ray::leaving(from, direction), value, pdf: Some(pdf) })
    }

    fn pdf_direction(&self, _: Option<&Shape>, _: DVec3, direction: DVec3, surface: Option<&Surface>) -> PerSolidAngle {
        if surface.is_some() {
            return PerSolidAngle(0.0);
        }
        let (position, sin) = self.radiance.position(self.orientation.local(direction));
        PerSolidAngle(self.radiance.pdf(position, sin) / self.orientation.solid_angle_ratio(direction))
    }

    fn environment_radiance(&self, direction: DVec3) -> Rgb {
        self.radiance.radiance(self.radiance.position(self.orientation.local(direction)).0)
    }

    fn is_environment(&self) -> bool {
        true
    }

    fn is_distant(&self) -> bool {
        true
    }

    fn emit(&self, _shape: Option<&Shape>, target: &EmissionTarget, u: [DVec2; 2]) -> Option<Emission> {
        let (direction, radiance, pdf) = self.sample(u[1])?;
        let ray = target.entering(-direction, u[0]);
        Some(Emission { ray, flux: radiance * (target.cross_section() / pdf.0) })
    }

    /// Ignores a shear in the transform.
    fn power(&self, _shape: Option<&Shape>, target: &EmissionTarget) -> Rgb {
        self.radiance.integral * target.cross_section()
    }
}
