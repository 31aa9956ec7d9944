//! Sensors: cameras with their films and samplers.

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

/// A direction from a point of the scene to the sensor.
#[derive(Clone, Copy, Debug)]
pub struct SensorSample {
    /// The position on the film at which the point appears, in pixels from the top left corner; it may lie outside of the film.
    pub film: DVec2,
    /// The unit direction from the point to the sensor.
    pub direction: DVec3,
    /// The segment on which a surface would hide the point.
    pub ray: Ray,
    /// The importance of the point, in pixels per m² perpendicular to `direction`: light of the intensity I, in W/sr, that leaves
    /// the point in this direction adds I times this to the radiance of its pixel.
    pub importance: f64,
}

/// The interface of all cameras.
#[enum_dispatch]
pub trait SensorModel {
    /// The ray through a position on the film, in pixels from its top left corner, and a point of the lens, given by a point of
    /// the unit square. Its direction has unit length. All rays have the same weight.
    fn ray(&self, film: DVec2, lens: DVec2) -> Ray;

    /// The direction from a point to a point of the lens, given by a point of the unit square; None if a clipping plane hides
    /// the point.
    fn sample_direction(&self, p: DVec3, lens: DVec2) -> Option<SensorSample>;

    /// The width, in m, of what a pixel covers on the plane through a point perpendicular to the camera's axis.
    fn footprint(&self, p: DVec3) -> f64;
}

catalogue! {
    /// A camera.
    pub enum Camera: SensorModel in Category::Sensor, {
        /// A pinhole.
        Perspective(Perspective),
        /// A thin lens.
        ThinLens(ThinLens),
    }
}

/// A camera with its film and its sampler.
#[derive(Clone, Debug)]
pub struct Sensor {
    /// The camera, which maps film positions to rays.
    pub camera: Camera,
    /// The film.
    pub film: HdrFilm,
    /// The sampler.
    pub sampler: Sampler,
}

impl Sensor {
    /// Reads a sensor with the film and the sampler in it.
    ///
    /// # Errors
    /// All faults of the three.
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

/// The film of the sensor, which an empty element stands for if there is none.
fn read_film(params: &Params<'_>) -> Result<HdrFilm, SceneError> {
    match params.child(Category::Film)? {
        Some(id) => Ok(FilmPlugin::read(params.document(), id)?.format().clone()),
        None => Ok(HdrFilm::default()),
    }
}

/// The parameters that both cameras share.
const FOV: Param = Param::optional("fov", ParamKind::Float, "focal_length", "the field of view in degrees")
    .within(Range { min: 1e-6, max: 180.0 - 1e-6, open: false });
const FOCAL_LENGTH: Param = Param::optional(
    "focal_length",
    ParamKind::String,
    "50mm",
    "the focal length of a 35 mm camera, such as 50mm, instead of fov",
);
const FOV_AXIS: Param = Param::new(
    "fov_axis",
    ParamKind::Choice(&["x", "y", "diagonal", "smaller", "larger"]),
    "x",
    "along which side of the film the field of view is measured",
);
const NEAR_CLIP: Param =
    Param::new("near_clip", ParamKind::Float, "0.01", "nothing nearer is seen, in depth").within(Range::LENGTH);
const FAR_CLIP: Param =
    Param::new("far_clip", ParamKind::Float, "10000", "nothing farther is seen, in depth").within(Range::POSITIVE);
const TO_WORLD: Param = Param::optional(
    "to_world",
    ParamKind::Transform,
    "the identity",
    "the camera's place; it looks along +z, +x being left",
);
const FILM: Param = Param::optional("film", ParamKind::Object(Category::Film), "hdrfilm, 768 x 576", "the film");
const SAMPLER: Param = Param::optional("sampler", ParamKind::Object(Category::Sampler), "independent", "the sampler");

/// The pyramid of view.
#[derive(Clone, Debug)]
struct Projection {
    to_world: DAffine3,
    to_local: DAffine3,
    /// Half the width and height of the film at depth 1.
    half_size: DVec2,
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
        Ok(Self { to_world, to_local: to_world.inverse(), half_size, pixel: 2.0 * half_size / film, near, far })
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
            // A 35 mm film is 36 mm by 24 mm; the diagonal is what is kept.
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

    /// The local direction through a position on the film, with depth 1.
    fn direction(&self, film: DVec2) -> DVec3 {
        (self.half_size - film * self.pixel).extend(1.0)
    }

    /// The world's ray from a local origin, which starts and ends on the clipping planes.
    #[inline]
    fn ray(&self, origin: DVec3, direction: DVec3) -> Ray {
        let (length, per_depth) = (direction.length(), direction.z.recip());
        let start = origin + self.near * per_depth * direction;
        let unit = direction * length.recip();
        let ray = Ray::new(self.to_world.transform_point3(start), self.to_world.transform_vector3(unit));
        Ray { t_max: (self.far - self.near) * (length * per_depth), ..ray }
    }

    /// How a point is seen through a local origin on the lens, if all rays through the film at depth 1 times `focus`
    /// meet there.
    #[inline]
    fn sample_direction(&self, p: DVec3, origin: DVec3, focus: f64) -> Option<SensorSample> {
        let local = self.to_local.transform_point3(p);
        if !(self.near..self.far).contains(&local.z) {
            return None;
        }
        let way = local - origin;
        let distance_squared = way.length_squared();
        let distance = distance_squared.sqrt();
        let at_depth_one = (origin + way * (focus / local.z)).truncate() / focus;
        let cos = local.z / distance;
        // A pixel's solid angle is that of its area at depth 1, px py cos³ θ, through any point of the lens.
        let solid_angle = self.pixel.x * self.pixel.y * cos * cos * cos;
        let start = self.to_world.transform_point3(origin + way * (self.near / local.z));
        Some(SensorSample {
            film: (self.half_size - at_depth_one) / self.pixel,
            direction: self.to_world.transform_vector3(way / -distance),
            ray: Ray::between(p, start),
            importance: 1.0 / (solid_angle * distance_squared),
        })
    }
}

fn parse_millimetres(params: &Params<'_>, text: &str) -> Result<f64, SceneError> {
    let number = text.trim().strip_suffix("mm").unwrap_or(text.trim()).trim().parse::<f64>();
    number.ok().filter(|f| f.is_finite() && *f > 0.0).ok_or_else(|| {
        params.error(FOCAL_LENGTH.name, format!("\"{text}\" is no focal length")).hint("write it as 50mm")
    })
}

/// A camera may be turned, moved and mirrored, not scaled: lengths are the world's.
fn check_rigid(params: &Params<'_>, to_world: &DAffine3) -> Result<(), SceneError> {
    if to_world.translation.abs().max_element() > FARTHEST {
        let error = params.error(TO_WORLD.name, "the sensor is too far away");
        return Err(error.hint(format!("no coordinate may be beyond {FARTHEST:e}")));
    }
    let gram = to_world.matrix3.transpose() * to_world.matrix3;
    if gram.abs_diff_eq(glam::DMat3::IDENTITY, 1e-4) {
        return Ok(());
    }
    let error = params.error(TO_WORLD.name, "the sensor's to_world scales or shears");
    Err(error.hint("a camera can only be turned, moved and mirrored"))
}
