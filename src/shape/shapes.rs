use super::{
    Hit, Model as _, Shape,
    bvh::{Bvh, Forest, Leaf, Test},
    mesh::Shear,
};
use crate::math::Ray;

/// Shapes with a hierarchy over all their parts.
#[derive(Debug)]
pub struct Shapes {
    shapes: Vec<Shape>,
    forest: Forest,
}

impl Shapes {
    /// These shapes, each known by its place in the list.
    #[must_use]
    pub fn new(shapes: Vec<Shape>) -> Self {
        let boxes: Vec<_> = shapes.iter().map(Shape::bounds).collect();
        let forest = Forest::new(&Bvh::build(&boxes), |shape| shapes[shape as usize].hierarchy());
        Self { shapes, forest }
    }

    /// The first hit of a ray, and of which shape.
    #[inline]
    #[must_use]
    pub fn intersect(&self, ray: &Ray) -> Option<(usize, Hit)> {
        let mut nearest = Nearest { shapes: &self.shapes, shear: None, found: None };
        self.forest.closest(ray, &mut nearest);
        nearest.found
    }

    /// Whether there is any such hit.
    #[inline]
    #[must_use]
    pub fn occlude(&self, ray: &Ray) -> bool {
        self.forest.any(ray, &mut Nearest { shapes: &self.shapes, shear: None, found: None })
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
    fn test(&mut self, leaf: Leaf, ray: &Ray) -> Option<f64> {
        let shape = leaf.primitive as usize;
        let hit = self.shapes[shape].intersect_block(leaf.block, ray, &mut self.shear)?;
        self.found = Some((shape, hit));
        Some(hit.t)
    }
}
