//! Emitters: the sources of light.

mod area;
mod constant;
mod directional;
pub mod laws;
mod point;
mod spot;

pub use area::Area;
pub use constant::Constant;
pub use directional::Directional;
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

/// A direction from a point to an emitter, with the light that arrives if nothing blocks it.
#[derive(Clone, Copy, Debug)]
pub struct EmitterSample {
    /// The unit direction to the emitter.
    pub direction: DVec3,
    /// The segment on which a surface would block the light.
    pub shadow_ray: Ray,
    /// The radiance in W/(m² sr); for a delta emitter (a point, a spot, parallel light), the irradiance perpendicular to the
    /// direction in W/m².
    pub value: Rgb,
    /// The density with which the direction was sampled; None for a delta emitter.
    pub pdf: Option<PerSolidAngle>,
}

/// A ray of light that leaves an emitter.
#[derive(Clone, Copy, Debug)]
pub struct Emission {
    /// The ray, with a unit direction.
    pub ray: Ray,
    /// The power in W that it carries if it is the only sample: the emission divided by the density of the sample.
    pub flux: Rgb,
}

/// A sphere around a part of the scene.
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
    /// The sphere. All light of distant emitters goes through it; light from within the scene does if it is aimed.
    pub sphere: BoundingSphere,
    /// The distance before the centre of the sphere at which rays of distant emitters start: outside of the scene.
    pub before: f64,
    /// Whether emitters within the scene sample only directions towards the sphere.
    pub is_aimed: bool,
}

impl EmissionTarget {
    /// A ray of a distant emitter in a direction, through a point that `u` samples uniformly on the sphere's cross-section.
    #[must_use]
    pub fn entering(&self, direction: DVec3, u: DVec2) -> Ray {
        let across = (self.sphere.radius * warp::square_to_disc(u)).extend(-self.before);
        Ray::new(self.sphere.centre + Frame::from_normal(direction).to_world(across), direction)
    }

    /// The area of the sphere's cross-section, in m².
    #[must_use]
    pub fn cross_section(&self) -> f64 {
        PI * self.sphere.radius * self.sphere.radius
    }

    /// Samples a direction uniformly in the cone in which the sphere is seen from a point; all directions if the point is inside.
    #[must_use]
    pub fn towards(&self, from: DVec3, u: DVec2) -> (DVec3, PerSolidAngle) {
        let (axis, one_minus_cos) = self.cone(from);
        let direction = Frame::from_normal(axis).to_world(warp::square_to_cone(u, one_minus_cos));
        (direction, PerSolidAngle(warp::square_to_cone_pdf(one_minus_cos)))
    }

    /// The axis of the cone in which the ball is seen, and one minus the cosine of its angle.
    fn cone(&self, from: DVec3) -> (DVec3, f64) {
        let way = self.sphere.centre - from;
        let sin_squared = self.sphere.radius * self.sphere.radius / way.length_squared();
        if sin_squared >= 1.0 || !sin_squared.is_finite() {
            return (DVec3::Z, 2.0);
        }
        (way.normalize(), sin_squared / (1.0 + (1.0 - sin_squared).sqrt()))
    }

    /// The density of a ray that is aimed at the sphere, without the factors that all spheres share: per area of the
    /// cross-section for distant emitters, per solid angle for others. It is 0 for a ray that misses the sphere.
    #[must_use]
    pub fn pdf(&self, ray: &Ray, is_distant: bool) -> f64 {
        if is_distant {
            let is_hit = (self.sphere.centre - ray.origin).cross(ray.direction).length() < self.sphere.radius;
            return if is_hit { 1.0 / self.cross_section() } else { 0.0 };
        }
        let (axis, one_minus_cos) = self.cone(ray.origin);
        // By sines: cosines cannot tell narrow cones apart.
        let (sin_squared, sin_squared_of_ray) =
            (one_minus_cos * (2.0 - one_minus_cos), axis.cross(ray.direction).length_squared());
        let is_in_cone = axis.dot(ray.direction) > 0.0 && sin_squared_of_ray <= sin_squared;
        let is_seen = one_minus_cos == 2.0 || is_in_cone;
        if is_seen { warp::square_to_cone_pdf(one_minus_cos) } else { 0.0 }
    }
}

/// The interface of all emitters. `shape` is the shape of an area light, and None for other emitters.
#[enum_dispatch]
pub trait EmitterModel {
    /// Samples a direction from a point to the emitter; None if the sample carries no light.
    fn sample_direction(&self, shape: Option<&Shape>, from: DVec3, u: DVec2) -> Option<EmitterSample>;

    /// The density with which [`EmitterModel::sample_direction`] samples the direction to a point of the surface of an area
    /// light, or a direction of the environment if `surface` is None. It is 0 for delta emitters, which no ray meets.
    fn pdf_direction(&self, _shape: Option<&Shape>, _from: DVec3, _surface: Option<&Surface>) -> PerSolidAngle {
        PerSolidAngle(0.0)
    }

    /// The radiance that its surface emits in a unit direction, in W/(m² sr).
    fn surface_radiance(&self, _surface: &Surface, _towards: DVec3) -> Rgb {
        Rgb::ZERO
    }

    /// The radiance of the environment along a ray in this direction, in W/(m² sr).
    fn environment_radiance(&self, _direction: DVec3) -> Rgb {
        Rgb::ZERO
    }

    /// Whether it is an environment, which surrounds the scene.
    fn is_environment(&self) -> bool {
        false
    }

    /// Whether its light comes from infinitely far away.
    fn is_distant(&self) -> bool {
        false
    }

    /// Samples a ray that leaves the emitter: the position by the first point of `u`, the direction by the second. None if the
    /// sample carries no light.
    fn emit(&self, shape: Option<&Shape>, target: &EmissionTarget, u: [DVec2; 2]) -> Option<Emission>;

    /// The power in W that it sends into the scene, whether or not it is aimed. It is exact but for textures and sheared spot
    /// lights, where it is an approximation for choosing emitters.
    fn power(&self, shape: Option<&Shape>, target: &EmissionTarget) -> Rgb;
}

catalogue! {
    /// A light.
    pub enum Emitter: EmitterModel in Category::Emitter, {
        /// An isotropic point light.
        Point(Point),
        /// A spot light.
        Spot(Spot),
        /// Parallel light.
        Directional(Directional),
        /// The surface of a shape.
        Area(Area),
        /// A uniform environment.
        Constant(Constant),
    }
}
