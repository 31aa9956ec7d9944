//! Where light comes from.

mod area;
mod constant;
mod directional;
mod point;
mod spot;

pub use area::Area;
pub use constant::Constant;
pub use directional::Directional;
pub use point::Point;
pub use spot::Spot;

use glam::{DVec2, DVec3};

use crate::{
    math::{PerSolidAngle, Ray, Rgb},
    node::{Category, catalogue},
    shape::{Shape, Surface},
};

/// Light that could arrive at a point, if nothing stands in its way.
#[derive(Clone, Copy, Debug)]
pub struct Incident {
    /// The unit direction to the light.
    pub direction: DVec3,
    /// The stretch on which an occluder would stop it.
    pub shadow_ray: Ray,
    /// Radiance; for a light of a single direction, perpendicular irradiance.
    pub value: Rgb,
    /// How densely directions are drawn; None for a light of a single direction.
    pub density: Option<PerSolidAngle>,
}

/// What an emitter answers. An area light is told the shape that it shines from.
pub trait Model {
    /// Draws a direction in which it could be seen from a point; None if it cannot be.
    fn sample_towards(&self, shape: Option<&Shape>, from: DVec3, u: DVec2) -> Option<Incident>;

    /// The density with which [`Model::sample_towards`] draws the direction to a point of its surface (of an area
    /// light), or a direction of the sky (`surface` is None); 0 for lights that only a draw can find.
    fn density_towards(&self, _shape: Option<&Shape>, _from: DVec3, _surface: Option<&Surface>) -> PerSolidAngle {
        PerSolidAngle(0.0)
    }

    /// The radiance that leaves its surface in a unit direction.
    fn surface_radiance(&self, _surface: &Surface, _towards: DVec3) -> Rgb {
        Rgb::ZERO
    }

    /// The radiance that comes from outside the scene along a ray of this direction.
    fn sky_radiance(&self, _direction: DVec3) -> Rgb {
        Rgb::ZERO
    }

    /// Whether it surrounds the scene.
    fn is_sky(&self) -> bool {
        false
    }
}

catalogue! { ($)
    /// A light.
    pub enum Emitter in Category::Emitter, each_emitter {
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

impl Model for Emitter {
    #[inline]
    fn sample_towards(&self, shape: Option<&Shape>, from: DVec3, u: DVec2) -> Option<Incident> {
        each_emitter!(self, emitter => emitter.sample_towards(shape, from, u))
    }

    #[inline]
    fn density_towards(&self, shape: Option<&Shape>, from: DVec3, surface: Option<&Surface>) -> PerSolidAngle {
        each_emitter!(self, emitter => emitter.density_towards(shape, from, surface))
    }

    #[inline]
    fn surface_radiance(&self, surface: &Surface, towards: DVec3) -> Rgb {
        each_emitter!(self, emitter => emitter.surface_radiance(surface, towards))
    }

    fn sky_radiance(&self, direction: DVec3) -> Rgb {
        each_emitter!(self, emitter => emitter.sky_radiance(direction))
    }

    fn is_sky(&self) -> bool {
        each_emitter!(self, emitter => emitter.is_sky())
    }
}
