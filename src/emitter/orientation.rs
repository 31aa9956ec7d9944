use glam::{DMat3, DVec3};

use crate::scene_file::{Params, SceneError};

/// The linear map of an emitter's local directions to the world. It may mirror, scale and shear.
#[derive(Clone, Debug)]
pub(super) struct Orientation {
    to_world: DMat3,
    to_local: DMat3,
    volume: f64,
}

impl Orientation {
    /// The linear part of the parameter `to_world`.
    pub(super) fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let orientation = Self::new(params.transform("to_world")?.matrix3);
        if orientation.to_local.is_finite() {
            return Ok(orientation);
        }
        Err(params.error("to_world", "the transform leaves the emitter no direction"))
    }

    pub(super) fn new(to_world: DMat3) -> Self {
        Self { to_world, to_local: to_world.inverse(), volume: to_world.determinant().abs() }
    }

    /// The local direction of a world direction, of any length.
    pub(super) fn local(&self, direction: DVec3) -> DVec3 {
        self.to_local * direction
    }

    /// The unit world direction of a local unit direction, and the solid angle around it over the solid angle around
    /// the local one: `|det M| / |M ω|³`.
    pub(super) fn world(&self, local: DVec3) -> (DVec3, f64) {
        let direction = self.to_world * local;
        let length = direction.length();
        (direction / length, self.volume / (length * length * length))
    }

    /// The ratio of solid angles of [`Orientation::world`], for a unit world direction.
    pub(super) fn solid_angle_ratio(&self, direction: DVec3) -> f64 {
        // The local vector of length 1 / |M ω| has the direction ω.
        let length = self.local(direction).length();
        self.volume * length * length * length
    }
}
