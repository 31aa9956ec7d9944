//! Where light comes from.

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

/// Light that could arrive at a point, if nothing stands in its way.
#[derive(Clone, Copy, Debug)]
pub struct EmitterSample {
    /// The unit direction to the light.
    pub direction: DVec3,
    /// The stretch on which an occluder would stop it.
    pub shadow_ray: Ray,
    /// Radiance; for a light of a single direction, perpendicular irradiance.
    pub value: Rgb,
    /// How densely directions are drawn; None for a light of a single direction.
    pub pdf: Option<PerSolidAngle>,
}

/// Light that sets out from an emitter.
#[derive(Clone, Copy, Debug)]
pub struct Emission {
    /// Where it goes, in a unit direction.
    pub ray: Ray,
    /// The power in W that it stands for if it is the only one drawn: what is emitted over the density of the draw.
    pub flux: Rgb,
}

/// A ball of space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundingSphere {
    /// The middle.
    pub centre: DVec3,
    /// The radius.
    pub radius: f64,
}

/// Which light of an emitter is asked for: that which goes through a ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmissionTarget {
    /// The ball. It is never missed by light from far away; by light from within the scene only if it is aimed.
    pub sphere: BoundingSphere,
    /// How far before the middle of the ball light from far away sets out: before everything else in the scene.
    pub before: f64,
    /// Whether light from within the scene is aimed at the ball, or goes everywhere.
    pub is_aimed: bool,
}

impl EmissionTarget {
    /// A ray from far away in a direction, through a point of the ball's cross-section that `u` draws uniformly.
    #[must_use]
    pub fn entering(&self, direction: DVec3, u: DVec2) -> Ray {
        let across = (self.sphere.radius * warp::square_to_disc(u)).extend(-self.before);
        Ray::new(self.sphere.centre + Frame::from_normal(direction).to_world(across), direction)
    }

    /// The area of the ball's cross-section.
    #[must_use]
    pub fn cross_section(&self) -> f64 {
        PI * self.sphere.radius * self.sphere.radius
    }

    /// Draws a direction uniformly among those in which the ball is seen from a point, which are all if it is in it.
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

    /// How densely a ray of light is drawn when it is aimed at the ball, apart from what all balls share: per area of the
    /// cross-section for light from far away, per solid angle for other light.
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

/// What an emitter answers. An area light is told the shape that it shines from.
#[enum_dispatch]
pub trait EmitterModel {
    /// Draws a direction in which it could be seen from a point; None if it cannot be.
    fn sample_direction(&self, shape: Option<&Shape>, from: DVec3, u: DVec2) -> Option<EmitterSample>;

    /// The density with which [`EmitterModel::sample_direction`] draws the direction to a point of its surface (of an area
    /// light), or a direction of the sky (`surface` is None); 0 for lights that only a draw can find.
    fn pdf_direction(&self, _shape: Option<&Shape>, _from: DVec3, _surface: Option<&Surface>) -> PerSolidAngle {
        PerSolidAngle(0.0)
    }

    /// The radiance that leaves its surface in a unit direction.
    fn surface_radiance(&self, _surface: &Surface, _towards: DVec3) -> Rgb {
        Rgb::ZERO
    }

    /// The radiance that comes from outside the scene along a ray of this direction.
    fn environment_radiance(&self, _direction: DVec3) -> Rgb {
        Rgb::ZERO
    }

    /// Whether it surrounds the scene.
    fn is_environment(&self) -> bool {
        false
    }

    /// Whether its light comes from infinitely far away, and so falls on all of an infinite plane.
    fn is_distant(&self) -> bool {
        false
    }

    /// Draws light that sets out: where by the first point of `u`, in which direction by the second. None where the
    /// draw carries nothing.
    fn emit(&self, shape: Option<&Shape>, target: &EmissionTarget, u: [DVec2; 2]) -> Option<Emission>;

    /// The power in W that it sends into the scene, as if it were not aimed: exact but for textures and sheared spot
    /// lights, where it is good enough to choose lights by.
    fn power(&self, shape: Option<&Shape>, target: &EmissionTarget) -> Rgb;
}

catalogue! {
    /// A light.
    pub enum Emitter: EmitterModel in Category::Emitter, {
        /// A point.
        Point(Point),
        /// A cone of light.
        Spot(Spot),
        /// Parallel light.
        Directional(Directional),
        /// A surface.
        Area(Area),
        /// The sky, equally bright all around.
        Constant(Constant),
    }
}
