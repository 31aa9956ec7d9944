use glam::DVec3;

use super::{
    Hit, Shape, ShapeModel as _,
    bvh::{Bvh, Forest, Leaf, Test},
    mesh::Shear,
};
use crate::math::{Aabb, Ray};

/// The shapes of a scene, with one hierarchy over all their primitives.
#[derive(Debug)]
pub struct Shapes {
    shapes: Vec<Shape>,
    /// The hierarchy over the shapes of finite size.
    forest: Forest,
    /// The indices of the infinite shapes, which boxes cannot cull.
    unbounded: Vec<usize>,
}

impl Shapes {
    /// Builds the hierarchy. A shape is identified by its index in `shapes`.
    #[must_use]
    pub fn new(shapes: Vec<Shape>) -> Self {
        let is_unbounded = |bounds: &Aabb| !(bounds.is_empty() || bounds.min.is_finite() && bounds.max.is_finite());
        let mut boxes: Vec<_> = shapes.iter().map(Shape::bounds).collect();
        let unbounded: Vec<_> = (0..shapes.len()).filter(|&shape| is_unbounded(&boxes[shape])).collect();
        unbounded.iter().for_each(|&shape| boxes[shape] = Aabb::EMPTY);
        let forest = Forest::new(&Bvh::build(&boxes), |shape| shapes[shape as usize].hierarchy());
        Self { shapes, forest, unbounded }
    }

    /// The first hit of a ray, with the index of the shape.
    #[inline]
    #[must_use]
    pub fn intersect(&self, ray: &Ray) -> Option<(usize, Hit)> {
        let mut nearest = Nearest { shapes: &self.shapes, shear: None, found: None };
        if self.unbounded.is_empty() {
            self.forest.closest(ray, &mut nearest);
            return nearest.found;
        }
        let mut ray = *ray;
        for &shape in &self.unbounded {
            if let Some(hit) = self.shapes[shape].intersect(&ray) {
                nearest.found = Some((shape, hit));
                ray.t_max = hit.t;
            }
        }
        self.forest.closest(&ray, &mut nearest);
        nearest.found
    }

    /// The bounding box of the shapes of finite size. It is the single point 0 if there are none.
    #[must_use]
    pub fn finite_bounds(&self) -> Aabb {
        let finite = (0..self.shapes.len()).filter(|shape| !self.unbounded.contains(shape));
        let bounds = finite.map(|shape| self.shapes[shape].bounds()).fold(Aabb::EMPTY, Aabb::union);
        if bounds.is_empty() { Aabb { min: DVec3::ZERO, max: DVec3::ZERO } } else { bounds }
    }

    /// Whether any of the shapes is infinite.
    #[must_use]
    pub fn is_unbounded(&self) -> bool {
        !self.unbounded.is_empty()
    }

    /// Whether the ray hits any of the shapes.
    #[inline]
    #[must_use]
    pub fn occlude(&self, ray: &Ray) -> bool {
        let is_hit = |&shape: &usize| self.shapes[shape].intersect(ray).is_some();
        self.unbounded.iter().any(is_hit)
            || self.forest.any(ray, &mut Nearest { shapes: &self.shapes, shear: None, found: None })
    }
}

impl std::ops::Index<usize> for Shapes {
    type Output = Shape;

    fn index(&self, index: usize) -> &Shape {
        &self.shapes[index]
    }
}

/// The nearest hit of one ray so far, with the index of the shape.
struct Nearest<'s> {
    shapes: &'s [Shape],
    shear: Option<Shear>,
    found: Option<(usize, Hit)>,
}

impl Test<Leaf> for &mut Nearest<'_> {
    #[inline(always)]
    fn test(&mut self, leaf: Leaf, ray: &Ray) -> Option<f64> {
        let shape = leaf.primitive as usize;
        let hit = self.shapes[shape].intersect_block(leaf.block, ray, &mut self.shear)?;
        self.found = Some((shape, hit));
        Some(hit.t)
    }
}
