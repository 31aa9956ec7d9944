use glam::{DAffine3, DMat3, DVec3};

use crate::{
    math::{PerArea, Ray},
    scene_file::{Params, SceneError},
};

/// The map from a canonical geometry to the world, with its inverse and its effect on normals and areas.
#[derive(Clone, Debug)]
pub(super) struct Affine {
    pub(super) to_world: DAffine3,
    pub(super) to_local: DAffine3,
    /// The inverse transpose: maps local normals to world normals up to their length.
    normals: DMat3,
    volume_scale: f64,
}

impl Affine {
    pub(super) fn new(to_world: DAffine3) -> Self {
        let to_local = to_world.inverse();
        let normals = to_local.matrix3.transpose();
        Self { to_world, to_local, normals, volume_scale: to_world.matrix3.determinant().abs() }
    }

    /// The shape's `to_world` composed with a map from canonical to shape space. An error if the composition is
    /// singular.
    pub(super) fn read(params: &Params<'_>, canonical: DAffine3) -> Result<Self, SceneError> {
        let to_world = params.transform(super::TO_WORLD.name)? * canonical;
        let affine = Self::new(to_world);
        if affine.to_local.is_finite() && affine.to_world.is_finite() {
            return Ok(affine);
        }
        let what = "the transform of the shape is singular or infinite";
        Err(params.error(super::TO_WORLD.name, what).hint("no scale may be 0 or beyond 1e308"))
    }

    #[inline]
    pub(super) fn ray(&self, ray: &Ray) -> Ray {
        ray.transformed(&self.to_local)
    }

    #[inline]
    pub(super) fn point(&self, local: DVec3) -> DVec3 {
        self.to_world.transform_point3(local)
    }

    #[inline]
    pub(super) fn normal(&self, local: DVec3) -> DVec3 {
        (self.normals * local).normalize()
    }

    /// The density per world area of a density per local area, at a point with this unit local normal.
    /// An area element `n dA` becomes `det M · M⁻ᵀ n dA` (Nanson's formula).
    pub(super) fn pdf(&self, local: PerArea, local_normal: DVec3) -> PerArea {
        PerArea(local.0 / (self.volume_scale * (self.normals * local_normal).length()))
    }
}
