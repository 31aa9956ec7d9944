//! Quadrics in boxes: any of ten coefficients, and those around an axis that have names.

mod form;
mod general;
mod revolved;

pub use general::General;
pub use revolved::{Cone, Cylinder, Hyperboloid, Paraboloid};

use std::fmt::Debug;

use glam::{DAffine3, DVec2, DVec3};

use super::{Crossing, Crossings, Hit, Line, ShapeModel, ShapeSample, SolidModel, Surface, affine::Affine};
use crate::{
    math::{Aabb, PerArea, Ray},
    scene_file::{Described, Params, Plugin, SceneError},
};
use form::{QuadraticForm, Within};

/// Ways to describe a quadric in a scene file.
pub trait QuadricKind: Clone + Debug {
    /// The manual page.
    const PLUGIN: Plugin;

    /// Its equation and its place.
    ///
    /// # Errors
    /// If a parameter is wrong.
    fn read(params: &Params<'_>) -> Result<Canonical<Self>, SceneError>;

    /// The texture coordinates of a point of the quadric.
    fn uv(&self, local: DVec3) -> DVec2;

    /// Draws a point of the quadric, with the density per area of the canonical form, if there is a way.
    fn sample(&self, u: DVec2) -> Option<(DVec3, PerArea)>;

    /// The density with which [`QuadricKind::sample`] draws a point.
    fn pdf(&self, local: DVec3) -> PerArea;

    /// Why it cannot be a light, if it cannot.
    fn not_an_emitter_because() -> Option<&'static str> {
        None
    }
}

/// A quadric in the space where its equation is simple.
pub struct Canonical<K> {
    form: QuadraticForm,
    clip: Aabb,
    to_shape: DAffine3,
    kind: K,
}

/// The part of a quadric that lies in a box. Its normals point to where its equation is positive.
///
/// On its own it is an open surface; as an operand of a csg it is the solid in the box where the equation is not
/// positive, its ends closed by the faces of the box.
#[derive(Clone, Debug)]
pub struct Clipped<K> {
    form: QuadraticForm,
    clip: Aabb,
    affine: Affine,
    kind: K,
}

impl<K: QuadricKind> Described for Clipped<K> {
    const PLUGIN: Plugin = K::PLUGIN;

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let Canonical { form, clip, to_shape, kind } = K::read(params)?;
        Ok(Self { form, clip, affine: Affine::read(params, to_shape)?, kind })
    }
}

/// The faces of the box, as primitives; the quadric itself is 0.
fn primitive_of(face: usize) -> u32 {
    face as u32 + 1
}

impl<K: QuadricKind> Clipped<K> {
    /// Where a local line is in the box, and through which faces it comes and goes.
    fn slab(&self, local: &Ray) -> Option<[Crossing; 2]> {
        Some(self.clip.cross(local)?.map(|(t, face)| Crossing::new(t, primitive_of(face))))
    }

    fn drawn<Density>(&self, local: DVec3, pdf: Density) -> ShapeSample<Density> {
        let n = self.affine.normal(self.form.gradient(local));
        ShapeSample { p: self.affine.point(local), n, uv: self.kind.uv(local), pdf }
    }

    /// How a density of the canonical form looks in the world.
    fn world_pdf(&self, local: DVec3, pdf: PerArea) -> PerArea {
        self.affine.pdf(pdf, self.form.gradient(local).normalize())
    }
}

impl<K: QuadricKind> ShapeModel for Clipped<K> {
    fn bounds(&self) -> Aabb {
        self.clip.transformed(&self.affine.to_world)
    }

    // Five kinds of it would crowd the traversal that calls it.
    #[inline(never)]
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let local = self.affine.ray(ray);
        let roots = self.form.roots(&local, self.clip.centre())?;
        let t = roots.into_iter().find(|t| ray.contains(*t) && self.clip.contains(local.at(*t)))?;
        Some(Hit::new(t, 0, DVec2::ZERO))
    }

    fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let at = self.affine.ray(ray).at(hit.t);
        let (local, n) = self.form.project(at);
        Surface::flat(self.affine.point(local), self.affine.normal(n), self.kind.uv(local), 0)
    }

    fn not_an_emitter_because(&self) -> Option<&'static str> {
        K::not_an_emitter_because()
    }

    fn sample_position(&self, u: DVec2) -> ShapeSample<PerArea> {
        let (local, pdf) = self.kind.sample(u).expect("only a shape that can shine is drawn from");
        self.drawn(local, self.world_pdf(local, pdf))
    }

    fn pdf_position(&self, surface: &Surface) -> PerArea {
        let local = self.affine.to_local.transform_point3(surface.p);
        self.world_pdf(local, self.kind.pdf(local))
    }
}

impl<K: QuadricKind> SolidModel for Clipped<K> {
    fn check_solid(&self) -> Result<(), String> {
        Ok(())
    }

    fn cross(&self, line: &Line) -> Crossings {
        let local = self.affine.ray(&line.ray);
        let Some([entry, exit]) = self.slab(&local) else { return Crossings::new() };
        let on = |t: f64| Crossing::new(t, 0);
        let mut crossings = Crossings::new();
        let mut push = |from: f64, to: f64| {
            let (from, to) = (on(from.max(entry.t)), on(to.min(exit.t)));
            if from.t < to.t {
                crossings.push(if from.t == entry.t { entry } else { from });
                crossings.push(if to.t == exit.t { exit } else { to });
            }
        };
        match self.form.within(&local, self.clip.centre()) {
            Within::Nowhere => {}
            Within::Everywhere => push(f64::NEG_INFINITY, f64::INFINITY),
            Within::Between([from, to]) => push(from, to),
            Within::Outside([to, from]) => {
                push(f64::NEG_INFINITY, to);
                push(from, f64::INFINITY);
            }
        }
        crossings
    }

    fn solid_surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let Some(face) = (hit.primitive as usize).checked_sub(1) else {
            return self.surface(ray, hit);
        };
        let (axis, side) = (face / 2, face % 2);
        let mut local = self.affine.ray(ray).at(hit.t);
        local[axis] = [self.clip.min, self.clip.max][side][axis];
        let n = self.affine.normal(DVec3::AXES[axis] * [-1.0, 1.0][side]);
        let uv = DVec2::new(local[(axis + 1) % 3], local[(axis + 2) % 3]);
        Surface::flat(self.affine.point(local), n, uv, hit.primitive)
    }
}
