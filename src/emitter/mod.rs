//! Emitters: the sources of light.

mod area;
mod constant;
mod directional;
mod envmap;
pub mod environment_laws;
pub mod laws;
mod orientation;
mod point;
mod spot;

pub use area::Area;
pub use constant::Constant;
pub use directional::Directional;
pub use envmap::EnvMap;
pub use point::Point;
pub use spot::Spot;

use std::f64::consts::PI;

use enum_dispatch::enum_dispatch;
use glam::{DVec2, DVec3};

use crate::{
    math::{Frame, PerSolidAngle, Ray, Rgb, warp},
    scene_file::{Category, catalogue},
    shape::{Shape, Surface},
};

/// A sampled direction from a point to an emitter, and the light that arrives if nothing blocks it.
#[derive(Clone, Copy, Debug)]
pub struct EmitterSample {
    /// The unit direction to the emitter.
    pub direction: DVec3,
    /// The segment to the emitter, on which an occluder blocks the light.
    pub shadow_ray: Ray,
    /// The radiance in W/(m² sr); for a delta emitter, the irradiance at normal incidence in W/m².
    pub value: Rgb,
    /// The pdf of the direction; None for a delta emitter.
    pub pdf: Option<PerSolidAngle>,
}

/// A sampled ray of light from an emitter.
#[derive(Clone, Copy, Debug)]
pub struct Emission {
    /// The ray, with a unit direction.
    pub ray: Ray,
    /// The power in W that it carries if it is the only sample: the emitted quantity over the pdf of the sample.
    pub flux: Rgb,
}

/// A sphere that contains some geometry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundingSphere {
    /// The centre.
    pub centre: DVec3,
    /// The radius.
    pub radius: f64,
}

/// Restricts emission to rays through a bounding sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmissionTarget {
    /// The sphere. Distant emitters always emit through it; other emitters do only if `is_aimed` is set.
    pub sphere: BoundingSphere,
    /// The distance from the centre of the sphere at which rays of distant emitters start, before everything else in
    /// the scene.
    pub before: f64,
    /// Whether emitters within the scene emit towards the sphere only, or in all directions.
    pub is_aimed: bool,
}

impl EmissionTarget {
    /// A ray of a distant emitter in a direction, through a uniformly sampled point of the sphere's cross-section.
    #[must_use]
    pub fn entering(&self, direction: DVec3, u: DVec2) -> Ray {
        let across = (self.sphere.radius * warp::square_to_disc(u)).extend(-self.before);
        Ray::new(self.sphere.centre + Frame::from_normal(direction).to_world(across), direction)
    }

    /// The area of the sphere's cross-section.
    #[must_use]
    pub fn cross_section(&self) -> f64 {
        PI * self.sphere.radius * self.sphere.radius
    }

    /// Samples a direction from a point to the sphere uniformly: over the cone that the sphere subtends, or over all
    /// directions if the point is inside.
    #[must_use]
    pub fn towards(&self, from: DVec3, u: DVec2) -> (DVec3, PerSolidAngle) {
        let (axis, one_minus_cos) = self.cone(from);
        let direction = Frame::from_normal(axis).to_world(warp::square_to_cone(u, one_minus_cos));
        (direction, PerSolidAngle(warp::square_to_cone_pdf(one_minus_cos)))
    }

    /// The axis of the cone that the sphere subtends, and one minus the cosine of its half-angle.
    fn cone(&self, from: DVec3) -> (DVec3, f64) {
        let to_centre = self.sphere.centre - from;
        let sin_squared = self.sphere.radius * self.sphere.radius / to_centre.length_squared();
        if sin_squared >= 1.0 || !sin_squared.is_finite() {
            return (DVec3::Z, 2.0);
        }
        (to_centre.normalize(), sin_squared / (1.0 + (1.0 - sin_squared).sqrt()))
    }

    /// The factor of a ray's pdf that depends on the target: per area of the cross-section for distant emitters, per
    /// solid angle for others.
    #[must_use]
    pub fn pdf(&self, ray: &Ray, is_distant: bool) -> f64 {
        if is_distant {
            let is_hit = (self.sphere.centre - ray.origin).cross(ray.direction).length() < self.sphere.radius;
            return if is_hit { 1.0 / self.cross_section() } else { 0.0 };
        }
        let (axis, one_minus_cos) = self.cone(ray.origin);
        // Sines, because cosines lose precision in narrow cones.
        let (sin_squared, sin_squared_of_ray) =
            (one_minus_cos * (2.0 - one_minus_cos), axis.cross(ray.direction).length_squared());
        let is_in_cone = axis.dot(ray.direction) > 0.0 && sin_squared_of_ray <= sin_squared;
        let is_towards = one_minus_cos == 2.0 || is_in_cone;
        if is_towards { warp::square_to_cone_pdf(one_minus_cos) } else { 0.0 }
    }
}

/// The interface of all emitters. An area light receives the shape that it emits from.
#[enum_dispatch]
pub trait EmitterModel {
    /// Samples a direction from a point to the emitter; None if the sample carries no light to it.
    fn sample_direction(&self, shape: Option<&Shape>, from: DVec3, u: DVec2) -> Option<EmitterSample>;

    /// The pdf with which [`EmitterModel::sample_direction`] samples a unit direction, to a point of an area light or to
    /// the environment (`surface` is None); 0 for delta emitters.
    fn pdf_direction(
        &self,
        _shape: Option<&Shape>,
        _from: DVec3,
        _direction: DVec3,
        _surface: Option<&Surface>,
    ) -> PerSolidAngle {
        PerSolidAngle(0.0)
    }

    /// The radiance that an area light emits from a point of its surface in a unit direction.
    fn surface_radiance(&self, _surface: &Surface, _towards: DVec3) -> Rgb {
        Rgb::ZERO
    }

    /// The radiance that arrives from the environment along a ray of this direction.
    fn environment_radiance(&self, _direction: DVec3) -> Rgb {
        Rgb::ZERO
    }

    /// Whether it emits from the surface of a shape, and so must belong to one.
    fn is_of_surface(&self) -> bool {
        false
    }

    /// Whether it is an environment, which surrounds the scene.
    fn is_environment(&self) -> bool {
        false
    }

    /// Whether its light comes from infinitely far away. Such light falls on all of an infinite plane.
    fn is_distant(&self) -> bool {
        false
    }

    /// Samples a ray of emitted light: its position by the first point of `u`, its direction by the second. None if the
    /// sample carries no light.
    fn emit(&self, shape: Option<&Shape>, target: &EmissionTarget, u: [DVec2; 2]) -> Option<Emission>;

    /// The power in W that it emits into the scene, regardless of `is_aimed`. An approximation for textured area lights
    /// and sheared spot lights, used to choose emitters by power.
    fn power(&self, shape: Option<&Shape>, target: &EmissionTarget) -> Rgb;
}

catalogue! {
    /// An emitter.
    pub enum Emitter: EmitterModel in Category::Emitter, {
        /// A point light.
        Point(Point),
        /// A spot light.
        Spot(Spot),
        /// Parallel light.
        Directional(Directional),
        /// A surface that emits light.
        Area(Area),
        /// A constant environment.
        Constant(Constant),
        /// An environment from an image.
        EnvMap(EnvMap),
    }
}
