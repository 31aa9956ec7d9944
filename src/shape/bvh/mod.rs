//! A bounding volume hierarchy with eight children per node, over any primitives that have bounding boxes: the shapes
//! of a scene, the triangles of a mesh.
//!
//! **Structure.** A binary tree is built by the binned surface-area heuristic (Wald 2007, "On fast construction of
//! SAH-based bounding volume hierarchies"). Its nodes are collapsed to nodes with up to eight children at the least
//! cost (Ylitie, Karras & Laine 2017). A leaf is a *block*: a slice of at most `block` primitives that the caller tests
//! together. Boxes are `f32`, rounded outwards.
//!
//! **Guarantee.** The traversal does not miss a primitive whose hit the caller's `f64` test would report if the hit
//! point lies within [`SLACK`] `* (M + |o|)` of the primitive's box. `M` is the greatest coordinate of any box and `o`
//! the origin of the ray, both in the maximum norm. The documentation of `Slabs` derives this for the `f32` slab test.
//! Coordinates beyond `1e37` count as infinite; the origin must be finite in this sense.
//!
//! **Determinism.** The tree depends only on the boxes, not on the number of threads that build it. The traversal
//! visits the same blocks in the same order with and without AVX2, because both kernels round alike (no fused
//! multiply-add).
//!
//! **Two levels.** A [`Forest`] is a hierarchy over shapes some of which have their own hierarchies, merged into one
//! tree.

mod build;
mod forest;
mod simd;
mod traverse;

pub use forest::{Forest, Leaf};

use crate::math::{Aabb, Ray};

/// The distance by which a hit may lie outside the box of its primitive, as a fraction of the coordinates involved.
/// `2^-40` allows for about 8000 roundings in the `f64` arithmetic of an intersection.
pub const SLACK: f64 = 1.0 / (1_u64 << 40) as f64;

/// The maximum number of children of a node.
const WIDTH: usize = 8;

/// The maximum number of nodes on a path from the root. The builder guarantees it, see `build`.
const MAX_LEVELS: u32 = 32;

/// A number for each child of a node, aligned for a vector register.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
struct Lanes([f32; WIDTH]);

/// A node: up to eight children and their boxes.
#[derive(Clone, Debug, PartialEq)]
#[repr(C, align(64))]
struct Node {
    /// `planes[axis][0]` are the lower, `planes[axis][1]` the upper bounds.
    planes: [[Lanes; 2]; 3],
    children: [Child; WIDTH],
    /// The set of children that exist, as bits.
    present: u32,
}

/// The index of a node or, with the most significant bit set, of a block.
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

    /// The index of the block, or `None` for a node.
    fn as_block(self) -> Option<u32> {
        (self.0 & Self::BLOCK != 0).then_some(self.0 & !Self::BLOCK)
    }
}

/// The caller's test of a ray with a block that it may hit. Every closure of this signature is a test. If the method of
/// a named type is `inline(always)`, it is compiled with the same target features (AVX2) as the traversal that calls
/// it.
pub trait Test<Block> {
    /// The parameter of the closest hit with `t_min < t < t_max`, if any. The ray's `t_max` is the parameter of the
    /// closest hit so far. The test itself stores any other data of a hit.
    fn test(&mut self, block: Block, ray: &Ray) -> Option<f64>;
}

impl<Block, F: FnMut(Block, &Ray) -> Option<f64>> Test<Block> for F {
    #[inline(always)]
    fn test(&mut self, block: Block, ray: &Ray) -> Option<f64> {
        self(block, ray)
    }
}

/// The nodes of a hierarchy. Blocks are known by their index only.
#[derive(Clone, Debug)]
struct Tree {
    /// The nodes in depth-first order, with the root first. Empty if there are no primitives.
    nodes: Vec<Node>,
    /// The greatest absolute value of the finite coordinates of all boxes.
    magnitude: f64,
}

/// A bounding volume hierarchy. The caller keeps the primitives.
#[derive(Clone, Debug)]
pub struct Bvh {
    tree: Tree,
    /// The indices of the primitives, block after block.
    order: Vec<u32>,
    /// The index in `order` at which each block begins, and the end of the last block.
    starts: Vec<u32>,
    bounds: Aabb,
}

impl Bvh {
    /// Builds a hierarchy with one primitive per block, for primitives that are expensive to intersect.
    ///
    /// Empty boxes and boxes with NaN cannot be hit and are left out. Boxes may be infinite, but are then culled
    /// poorly.
    ///
    /// # Panics
    /// There are `2^31` or more boxes that are not empty.
    #[must_use]
    pub fn build(bounds: &[Aabb]) -> Self {
        Self::build_in_blocks(bounds.iter().copied(), 1)
    }

    /// Builds a hierarchy with up to `block` primitives per block, for primitives that are tested in groups of that
    /// size: the cost model assigns the same cost to full and to partly filled blocks.
    ///
    /// # Panics
    /// `block` is 0, or there are `2^31` or more boxes that are not empty.
    #[must_use]
    pub fn build_in_blocks(bounds: impl Iterator<Item = Aabb>, block: usize) -> Self {
        build::build(bounds, block)
    }

    /// The bounding box of all primitives.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// The number of blocks.
    #[must_use]
    pub fn block_count(&self) -> usize {
        self.starts.len() - 1
    }

    /// The indices of the primitives of a block.
    #[must_use]
    pub fn block(&self, block: u32) -> &[u32] {
        let block = block as usize;
        &self.order[self.starts[block] as usize..self.starts[block + 1] as usize]
    }

    /// The memory of the hierarchy, in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.tree.nodes) + size_of_val(&*self.order) + size_of_val(&*self.starts)
    }

    /// The parameter of the closest hit. Calls `test` with the indices of the blocks that the ray may hit,
    /// approximately front to back.
    #[inline]
    pub fn closest_block(&self, ray: &Ray, test: impl Test<u32>) -> Option<f64> {
        simd::closest(&self.tree, ray, test)
    }

    /// Whether the ray hits anything. Calls `test` with the indices of blocks that the ray may hit, until one is hit.
    #[inline]
    pub fn any_block(&self, ray: &Ray, test: impl Test<u32>) -> bool {
        simd::any(&self.tree, ray, test)
    }
}

#[cfg(test)]
mod tests;
