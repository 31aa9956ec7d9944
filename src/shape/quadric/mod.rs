//! Quadrics clipped by boxes: the general one with ten coefficients, and the named quadrics of revolution.

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
use form::{InsideIntervals, QuadraticForm};

/// A plugin that describes a quadric in a scene file.
pub trait QuadricKind: Clone + Debug {
    /// The manual page.
    const PLUGIN: Plugin;

    /// Reads the equation, the box and the transform.
    ///
    /// # Errors
    /// A parameter is wrong.
    fn read(params: &Params<'_>) -> Result<Canonical<Self>, SceneError>;

    /// The texture coordinates of a point of the quadric.
    fn uv(&self, local: DVec3) -> DVec2;

    /// Samples a point of the quadric in canonical space, with its pdf per area there. `None` if the plugin cannot be
    /// an area light.
    fn sample(&self, u: DVec2) -> Option<(DVec3, PerArea)>;

    /// The pdf with which [`QuadricKind::sample`] samples a point, per area in canonical space.
    fn pdf(&self, local: DVec3) -> PerArea;

    /// The reason why the plugin cannot be an area light, or `None` if it can.
    fn not_an_emitter_because() -> Option<&'static str> {
        None
    }
}

/// A quadric in its canonical space, where its equation is simple.
pub struct Canonical<K> {
    form: QuadraticForm,
    clip: Aabb,
    to_shape: DAffine3,
    kind: K,
}

/// The part of a quadric that lies in a box. The normals point to the side where the quadratic form is positive.
///
/// A clipped quadric is an open surface. As an operand of a csg it is the part of the box in which the quadratic form
/// is not positive, closed by the faces of the box.
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

/// The primitive index of a face of the box. The quadric itself has index 0.
fn primitive_of(face: usize) -> u32 {
    face as u32 + 1
}

impl<K: QuadricKind> Clipped<K> {
    /// The crossings of a local line with the box.
    fn cross_box(&self, local: &Ray) -> Option<[Crossing; 2]> {
        Some(self.clip.cross(local)?.map(|(t, face)| Crossing::new(t, primitive_of(face))))
    }

    fn sample<Density>(&self, local: DVec3, pdf: Density) -> ShapeSample<Density> {
        let n = self.affine.normal(self.form.gradient(local));
        ShapeSample { p: self.affine.point(local), n, uv: self.kind.uv(local), pdf }
    }

    /// The density per world area of a density per area in canonical space.
    fn world_pdf(&self, local: DVec3, pdf: PerArea) -> PerArea {
        self.affine.pdf(pdf, self.form.gradient(local).normalize())
    }
}

impl<K: QuadricKind> ShapeModel for Clipped<K> {
    fn bounds(&self) -> Aabb {
        self.clip.transformed(&self.affine.to_world)
    }

    // Inlining all five plugins would bloat the traversal that calls this.
    #[inline(never)]
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let local = self.affine.ray(ray);
        let roots = self.form.roots(&local, self.clip.centre())?;
        let t = roots.into_iter().find(|t| ray.contains(*t) && self.clip.contains(local.at(*t)))?;
        Some(Hit::new(t, 0, DVec2::ZERO))
    }

    fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let (local, n) = self.form.project(self.affine.ray(ray).at(hit.t));
        Surface::flat(self.affine.point(local), self.affine.normal(n), self.kind.uv(local), 0)
    }

    fn not_an_emitter_because(&self) -> Option<&'static str> {
        K::not_an_emitter_because()
    }

    fn sample_position(&self, u: DVec2) -> ShapeSample<PerArea> {
        let (local, pdf) = self.kind.sample(u).expect("only shapes that can be area lights are sampled");
        self.sample(local, self.world_pdf(local, pdf))
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
        let Some([entry, exit]) = self.cross_box(&local) else { return Crossings::new() };
        let crossing = |t: f64| Crossing::new(t, 0);
        let mut crossings = Crossings::new();
        let mut push = |from: f64, to: f64| {
            let (from, to) = (crossing(from.max(entry.t)), crossing(to.min(exit.t)));
            if from.t < to.t {
                crossings.push(if from.t == entry.t { entry } else { from });
                crossings.push(if to.t == exit.t { exit } else { to });
            }
        };
        match self.form.inside(&local, self.clip.centre()) {
            InsideIntervals::None => {}
            InsideIntervals::All => push(f64::NEG_INFINITY, f64::INFINITY),
            InsideIntervals::Between([from, to]) => push(from, to),
            InsideIntervals::Outside([to, from]) => {
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
