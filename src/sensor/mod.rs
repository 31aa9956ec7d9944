//! Sensors: cameras with their film and sampler.

pub mod laws;
mod perspective;
mod thinlens;

pub use perspective::Perspective;
pub use thinlens::ThinLens;

use enum_dispatch::enum_dispatch;
use glam::{DAffine3, DVec2, DVec3};

use crate::{
    film::{FilmPlugin, HdrFilm},
    math::Ray,
    sampler::{Independent, Sampler},
    scene_file::{Category, FARTHEST, Param, ParamKind, Params, Range, SceneError, catalogue},
};

/// A sampled direction from a point to the sensor.
#[derive(Clone, Copy, Debug)]
pub struct SensorSample {
    /// The position of the point's projection on the film, in pixels; it may lie outside the film.
    pub film: DVec2,
    /// The unit direction from the point to the sensor.
    pub direction: DVec3,
    /// The segment to the sensor, on which an occluder hides the point.
    pub ray: Ray,
    /// The importance: pixels per m² perpendicular to `direction` at the point. A pixel's radiance is the sum of the
    /// flux towards the sensor times this importance.
    pub importance: f64,
}

/// The interface of all sensors.
#[enum_dispatch]
pub trait SensorModel {
    /// The ray through a position on the film, in pixels from its top left corner, and a point of the lens sampled by
    /// `lens`. The direction has unit length. All rays have the same weight.
    fn ray(&self, film: DVec2, lens: DVec2) -> Ray;

    /// Samples a point of the lens by `lens`, and the direction to it from `p`; None if `p` is not between the clipping
    /// planes.
    fn sample_direction(&self, p: DVec3, lens: DVec2) -> Option<SensorSample>;

    /// The width of a pixel, in m, projected onto the plane through `p` that is perpendicular to the camera's axis.
    fn footprint(&self, p: DVec3) -> f64;
}

catalogue! {
    /// A camera.
    pub enum Camera: SensorModel in Category::Sensor, {
        /// A pinhole camera.
        Perspective(Perspective),
        /// A camera with a thin lens.
        ThinLens(ThinLens),
    }
}

/// A camera with its film and its sampler.
#[derive(Clone, Debug)]
pub struct Sensor {
    /// The camera, which generates rays.
    pub camera: Camera,
    /// The film, which samples positions.
    pub film: HdrFilm,
    /// The sampler, which generates random numbers.
    pub sampler: Sampler,
}

impl Sensor {
    /// Reads a sensor element and its children.
    ///
    /// # Errors
    /// If a parameter or a child is invalid.
    pub fn read(document: &crate::scene_file::Document, id: crate::scene_file::ObjectId) -> Result<Self, SceneError> {
        let params = Camera::params(document, id)?;
        let camera = Camera::read_from(&params)?;
        let film = read_film(&params)?;
        let sampler = match params.child(Category::Sampler)? {
            Some(id) => Sampler::read(document, id)?,
            None => Independent::default().into(),
        };
        params.finish()?;
        Ok(Self { camera, film, sampler })
    }
}

/// The film of the sensor, or the default film.
fn read_film(params: &Params<'_>) -> Result<HdrFilm, SceneError> {
    match params.child(Category::Film)? {
        Some(id) => Ok(FilmPlugin::read(params.document(), id)?.format().clone()),
        None => Ok(HdrFilm::default()),
    }
}

/// The parameters of both cameras.
const FOV: Param = Param::optional("fov", ParamKind::Float, "focal_length", "the field of view in degrees")
    .within(Range { min: 1e-6, max: 180.0 - 1e-6, open: false });
const FOCAL_LENGTH: Param = Param::optional(
    "focal_length",
    ParamKind::String,
    "50mm",
    "the focal length of a 35 mm camera, such as 50mm; an alternative to fov",
);
const FOV_AXIS: Param = Param::new(
    "fov_axis",
    ParamKind::Choice(&["x", "y", "diagonal", "smaller", "larger"]),
    "x",
    "the side of the film along which the field of view is measured",
);
const NEAR_CLIP: Param =
    Param::new("near_clip", ParamKind::Float, "0.01", "the depth of the near clipping plane").within(Range::LENGTH);
const FAR_CLIP: Param =
    Param::new("far_clip", ParamKind::Float, "10000", "the depth of the far clipping plane").within(Range::POSITIVE);
const TO_WORLD: Param = Param::optional(
    "to_world",
    ParamKind::Transform,
    "the identity",
    "maps the camera to the world; it looks along +z, and +x is left",
);
const NO_FOCUS: Param = Param::ignored("focus_distance", ParamKind::Float, "everything is in focus");
const FILM: Param = Param::optional("film", ParamKind::Object(Category::Film), "hdrfilm, 768 x 576", "the film");
const SAMPLER: Param = Param::optional("sampler", ParamKind::Object(Category::Sampler), "independent", "the sampler");

/// The view frustum.
#[derive(Clone, Debug)]
struct Projection {
    to_world: DAffine3,
    to_local: DAffine3,
    /// The position of the film's top left corner at depth 1, to the left of the optical axis and above it.
    corner: DVec2,
    /// The width and height of a pixel at depth 1.
    pixel: DVec2,
    near: f64,
    far: f64,
}

impl Projection {
    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let film = read_film(params)?.size();
        let (near, far) = (params.float(NEAR_CLIP.name)?, params.float(FAR_CLIP.name)?);
        if near >= far {
            return Err(params.error(FAR_CLIP.name, format!("far_clip {far} is not beyond near_clip {near}")));
        }
        let to_world = params.transform(TO_WORLD.name)?;
        check_rigid(params, &to_world)?;
        let tangent = Self::half_width(params, film)?;
        let half_size = DVec2::new(tangent, tangent * film.y / film.x);
        let pixel = 2.0 * half_size / film;
        Ok(Self { to_world, to_local: to_world.inverse(), corner: half_size, pixel, near, far })
    }

    /// The same frustum with a film that is shifted to the right and downwards, in widths and heights of the film.
    fn shifted(self, offset: DVec2) -> Self {
        Self { corner: self.corner - 2.0 * offset * self.corner, ..self }
    }

    /// The tangent of half the horizontal field of view.
    fn half_width(params: &Params<'_>, film: DVec2) -> Result<f64, SceneError> {
        let fov = params.optional_float(FOV.name)?;
        let focal_length = params.optional_string(FOCAL_LENGTH.name)?;
        let (tangent, axis) = match (fov, focal_length) {
            (Some(_), Some(_)) => {
                return Err(params
                    .error(FOCAL_LENGTH.name, "the sensor has both \"fov\" and \"focal_length\"")
                    .hint("give one"));
            }
            (Some(fov), None) => ((0.5 * fov.to_radians()).tan(), params.string(FOV_AXIS.name)?),
            // A 35 mm film is 36 mm by 24 mm. The diagonal field of view is kept.
            (None, given) => {
                params.string(FOV_AXIS.name)?;
                let millimetres = parse_millimetres(params, given.unwrap_or("50mm"))?;
                (0.5 * 36.0_f64.hypot(24.0) / millimetres, "diagonal")
            }
        };
        let landscape = film.x >= film.y;
        Ok(match axis {
            "y" => tangent * film.x / film.y,
            "smaller" if landscape => tangent * film.x / film.y,
            "larger" if !landscape => tangent * film.x / film.y,
            "diagonal" => tangent * film.x / film.length(),
            _ => tangent,
        })
    }

    fn footprint(&self, p: DVec3) -> f64 {
        self.pixel.x * self.to_world.matrix3.z_axis.dot(p - self.to_world.translation)
    }

    /// The local direction through a position on the film, with a z of 1.
    fn direction(&self, film: DVec2) -> DVec3 {
        (self.corner - film * self.pixel).extend(1.0)
    }

    /// The world-space ray from a local origin, which starts and ends on the clipping planes.
    #[inline]
    fn ray(&self, origin: DVec3, direction: DVec3) -> Ray {
        let (length, per_depth) = (direction.length(), direction.z.recip());
        let start = origin + self.near * per_depth * direction;
        let unit = direction * length.recip();
        let ray = Ray::new(self.to_world.transform_point3(start), self.to_world.transform_vector3(unit));
        Ray { t_max: (self.far - self.near) * (length * per_depth), ..ray }
    }

    /// The sensor sample of a point through a local origin on the lens, if all rays of a film position converge at the
    /// depth `focus`.
    #[inline]
    fn sample_direction(&self, p: DVec3, origin: DVec3, focus: f64) -> Option<SensorSample> {
        let local = self.to_local.transform_point3(p);
        if !(self.near..self.far).contains(&local.z) {
            return None;
        }
        let offset = local - origin;
        let distance_squared = offset.length_squared();
        let distance = distance_squared.sqrt();
        let at_depth_one = (origin + offset * (focus / local.z)).truncate() / focus;
        let cos = local.z / distance;
        // A pixel subtends the solid angle of its area at depth 1, px py cos³ θ, through any point of the lens.
        let solid_angle = self.pixel.x * self.pixel.y * cos * cos * cos;
        let start = self.to_world.transform_point3(origin + offset * (self.near / local.z));
        Some(SensorSample {
            film: (self.corner - at_depth_one) / self.pixel,
            direction: self.to_world.transform_vector3(offset / -distance),
            ray: Ray::between(p, start),
            importance: 1.0 / (solid_angle * distance_squared),
        })
    }
}

fn parse_millimetres(params: &Params<'_>, text: &str) -> Result<f64, SceneError> {
    let number = text.trim().strip_suffix("mm").unwrap_or(text.trim()).trim().parse::<f64>();
    number.ok().filter(|f| f.is_finite() && *f > 0.0).ok_or_else(|| {
        params.error(FOCAL_LENGTH.name, format!("\"{text}\" is not a focal length")).hint("write it as 50mm")
    })
}

/// A camera may be rotated, moved and mirrored but not scaled, because its lengths are in world units.
fn check_rigid(params: &Params<'_>, to_world: &DAffine3) -> Result<(), SceneError> {
    if to_world.translation.abs().max_element() > FARTHEST {
        let error = params.error(TO_WORLD.name, "the sensor is too far away");
        return Err(error.hint(format!("no coordinate may exceed {FARTHEST:e}")));
    }
    let gram = to_world.matrix3.transpose() * to_world.matrix3;
    if gram.abs_diff_eq(glam::DMat3::IDENTITY, 1e-4) {
        return Ok(());
    }
    let error = params.error(TO_WORLD.name, "the sensor's to_world scales or shears");
    Err(error.hint("a camera can only be rotated, moved and mirrored"))
}
