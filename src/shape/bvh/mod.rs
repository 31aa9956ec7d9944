//! A bounding volume hierarchy with eight children a node, over anything that has boxes: the shapes of a scene, the
//! triangles of a mesh.
//!
//! **Structure.** Binned surface-area heuristic (Wald 2007, "On fast construction of SAH-based bounding volume
//! hierarchies"), the binary splits gathered eight to a node at the least cost (Ylitie, Karras & Laine 2017). A leaf is
//! a *block*: a slice of at most `block` primitives that the caller tests in one go. Boxes are `f32`, rounded outwards.
//!
//! **Promise.** No primitive is passed over whose hit the caller's `f64` test would report, as long as the point of the
//! hit lies within [`SLACK`] `* (M + |o|)` of the primitive's box, `M` being the greatest coordinate of any box and `o`
//! the origin of the ray, both in the maximum norm. How the `f32` slab test keeps that promise is derived at `Slabs`.
//! Coordinates beyond `1e37` count as infinite; the origin must not be there.
//!
//! **Determinism.** The tree depends on the boxes alone, not on the number of threads that built it. Traversal visits
//! the same blocks in the same order with and without AVX2, because both kernels round alike (no fused multiply-add).
//!
//! **Levels.** A [`Forest`] is a hierarchy over shapes of which some have hierarchies of their own, all in one tree.

mod build;
mod forest;
mod simd;
mod traverse;

pub use forest::{Forest, Leaf};

use crate::math::{Aabb, Ray};

/// How far a hit may lie outside the box of its primitive, as a fraction of the coordinates involved: `2^-40`, which
/// leaves some 8000 roundings to the arithmetic of an intersection in `f64`.
pub const SLACK: f64 = 1.0 / (1_u64 << 40) as f64;

/// Children of a node.
const WIDTH: usize = 8;

/// The most nodes on a path from the root. See `build` for how the builder keeps to it.
const MAX_LEVELS: u32 = 32;

/// One number for each child of a node, aligned for a vector register.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
struct Lanes([f32; WIDTH]);

/// Eight boxes and what is in them.
#[derive(Clone, Debug, PartialEq)]
#[repr(C, align(64))]
struct Node {
    /// `planes[axis][0]` are the lower, `planes[axis][1]` the upper bounds.
    planes: [[Lanes; 2]; 3],
    children: [Child; WIDTH],
    /// The set of children that there are, as bits.
    present: u32,
}

/// A node (its index) or, with the topmost bit set, a block (its index).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(transparent)]
struct Child(u32);

impl Child {
    const BLOCK: u32 = 1 << 31;

    fn node(index: usize) -> Self {
        Self(index as u32)
    }

    fn block(index: usize) -> Self {
        Self(index as u32 | Self::BLOCK)
    }

    /// The block, or `None` for a node.
    fn as_block(self) -> Option<u32> {
        (self.0 & Self::BLOCK != 0).then_some(self.0 & !Self::BLOCK)
    }
}

/// What is done with a block that a ray may hit. Any closure of this form is a test; a type of its own has its code
/// compiled for the same processor as the traversal around it, if it is `inline(always)`.
pub trait Test<Block> {
    /// The parameter of the closest hit that [`Ray::contains`], if any. The ray's `t_max` has shrunk to the closest hit
    /// so far; what else there is to know about a hit the test keeps for itself.
    fn test(&mut self, block: Block, ray: &Ray) -> Option<f64>;
}

impl<Block, F: FnMut(Block, &Ray) -> Option<f64>> Test<Block> for F {
    #[inline(always)]
    fn test(&mut self, block: Block, ray: &Ray) -> Option<f64> {
        self(block, ray)
    }
}

/// Nodes over blocks, of which only the number is known.
#[derive(Clone, Debug)]
struct Tree {
    /// In depth-first order, the root first; empty if there is nothing to hit.
    nodes: Vec<Node>,
    /// The greatest coordinate of any box, not counting infinite ones.
    magnitude: f64,
}

/// The hierarchy; the primitives themselves stay with the caller.
#[derive(Clone, Debug)]
pub struct Bvh {
    tree: Tree,
    /// Indices of the primitives, block after block.
    order: Vec<u32>,
    /// Where each block begins in `order`, and the end of the last.
    starts: Vec<u32>,
    bounds: Aabb,
}

impl Bvh {
    /// A hierarchy with one primitive to a block: for primitives that are dear to intersect.
    ///
    /// Empty boxes (and such with a NaN) cannot be hit and are left out. Boxes may be infinite, but those are not
    /// culled well. There may be at most `2^31` boxes.
    #[must_use]
    pub fn build(bounds: &[Aabb]) -> Self {
        Self::build_in_blocks(bounds.iter().copied(), 1)
    }

    /// A hierarchy with up to `block` primitives to a block, for primitives that are tested so many at once: the cost
    /// model takes a block to cost the same however full it is.
    #[must_use]
    pub fn build_in_blocks(bounds: impl Iterator<Item = Aabb>, block: usize) -> Self {
        build::build(bounds, block)
    }

    /// The box around everything.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// How many blocks there are.
    #[must_use]
    pub fn block_count(&self) -> usize {
        self.starts.len() - 1
    }

    /// The primitives of a block.
    #[must_use]
    pub fn block(&self, block: u32) -> &[u32] {
        let block = block as usize;
        &self.order[self.starts[block] as usize..self.starts[block + 1] as usize]
    }

    /// The memory of the hierarchy.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.tree.nodes) + size_of_val(&*self.order) + size_of_val(&*self.starts)
    }

    /// The parameter of the closest hit: tests blocks, of which it gets the indices, that the ray may hit, about front to
    /// back.
    #[inline]
    pub fn closest_block(&self, ray: &Ray, test: impl Test<u32>) -> Option<f64> {
        simd::closest(&self.tree, ray, test)
    }

    /// Whether anything is hit, by such tests of blocks.
    #[inline]
    pub fn any_block(&self, ray: &Ray, test: impl Test<u32>) -> bool {
        simd::any(&self.tree, ray, test)
    }
}

#[cfg(test)]
mod tests;
