use glam::DVec3;

use super::{
    Hit, Shape, ShapeModel as _,
    bvh::{Bvh, Forest, Leaf, Test},
    mesh::Shear,
};
use crate::math::{Aabb, Ray};

/// Shapes with a hierarchy over all their parts.
#[derive(Debug)]
pub struct Shapes {
    shapes: Vec<Shape>,
    /// Over those of finite size.
    forest: Forest,
    /// The others, which no box can cull.
    unbounded: Vec<usize>,
}

impl Shapes {
    /// These shapes, each known by its place in the list.
    #[must_use]
    pub fn new(shapes: Vec<Shape>) -> Self {
        let is_unbounded = |bounds: &Aabb| !(bounds.is_empty() || bounds.min.is_finite() && bounds.max.is_finite());
        let mut boxes: Vec<_> = shapes.iter().map(Shape::bounds).collect();
        let unbounded: Vec<_> = (0..shapes.len()).filter(|&shape| is_unbounded(&boxes[shape])).collect();
        unbounded.iter().for_each(|&shape| boxes[shape] = Aabb::EMPTY);
        let forest = Forest::new(&Bvh::build(&boxes), |shape| shapes[shape as usize].hierarchy());
        Self { shapes, forest, unbounded }
    }

    /// The first hit of a ray, and of which shape.
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

    /// A box around those of finite size; of a single point if there are none.
    #[must_use]
    pub fn finite_bounds(&self) -> Aabb {
        let finite = (0..self.shapes.len()).filter(|shape| !self.unbounded.contains(shape));
        let bounds = finite.map(|shape| self.shapes[shape].bounds()).fold(Aabb::EMPTY, Aabb::union);
        if bounds.is_empty() { Aabb { min: DVec3::ZERO, max: DVec3::ZERO } } else { bounds }
    }

    /// Whether any of them has no end.
    #[must_use]
    pub fn is_unbounded(&self) -> bool {
        !self.unbounded.is_empty()
    }

    /// Whether there is any such hit.
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

/// The nearest hit of one ray so far, and of which shape.
struct Nearest<'s> {
    shapes: &'s [Shape],
    shear: Option<Shear>,
    found: Option<(usize, Hit)>,
}

impl Test<Leaf> for &mut Nearest<'_> {
    #[inline(always)]
    fn test(&mut self, operand_index: Leaf, ray: &Ray) -> Option<f64> {
        let shape = operand_index.primitive as usize;
        let hit = self.shapes[shape].intersect_block(operand_index.block, ray, &mut self.shear)?;
        self.found = Some((shape, hit));
        Some(hit.t)
    }
}
