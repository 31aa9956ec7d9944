//! A two-level hierarchy merged into one tree, so that a ray is prepared once and traverses one tree.

use super::{Bvh, Child, Node, Test, Tree, simd};
use crate::math::Ray;

/// A leaf: a block of a primitive's own hierarchy, or a primitive without one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Leaf {
    /// The index of the primitive in the top-level hierarchy.
    pub primitive: u32,
    /// The block of the primitive's own hierarchy, or 0 if it has none.
    pub block: u32,
}

/// A hierarchy over primitives some of which have their own hierarchies.
///
/// It gives the same guarantee as [`Bvh`], with the greatest coordinate of all boxes.
#[derive(Clone, Debug)]
pub struct Forest {
    tree: Tree,
    leaves: Vec<Leaf>,
}

impl Forest {
    /// Merges the top-level hierarchy with copies of the primitives' own hierarchies, which `own` returns.
    ///
    /// # Panics
    /// A block of `top` does not have exactly one primitive.
    #[must_use]
    pub fn new<'a>(top: &Bvh, own: impl Fn(u32) -> Option<&'a Bvh>) -> Self {
        let mut forest = Self { tree: Tree { nodes: Vec::new(), magnitude: top.tree.magnitude }, leaves: Vec::new() };
        let mut roots = Vec::with_capacity(top.block_count());
        // The top-level nodes come first. Their blocks are replaced below.
        forest.tree.nodes.extend_from_slice(&top.tree.nodes);
        for block in 0..top.block_count() as u32 {
            let &[primitive] = top.block(block) else { panic!("the top-level hierarchy has one primitive per block") };
            roots.push(match own(primitive) {
                Some(bvh) => forest.append(primitive, bvh),
                None => forest.push_leaf(Leaf { primitive, block: 0 }),
            });
        }
        for node in &mut forest.tree.nodes[..top.tree.nodes.len()] {
            for child in present(node) {
                if let Some(block) = child.as_block() {
                    *child = roots[block as usize];
                }
            }
        }
        forest
    }

    fn push_leaf(&mut self, leaf: Leaf) -> Child {
        self.leaves.push(leaf);
        Child::block(self.leaves.len() - 1)
    }

    /// Appends the hierarchy of a primitive and returns its root.
    fn append(&mut self, primitive: u32, bvh: &Bvh) -> Child {
        let (first_node, first_leaf) = (self.tree.nodes.len(), self.leaves.len());
        self.leaves.extend((0..bvh.block_count() as u32).map(|block| Leaf { primitive, block }));
        for mut node in bvh.tree.nodes.iter().cloned() {
            for child in present(&mut node) {
                *child = match child.as_block() {
                    Some(block) => Child::block(first_leaf + block as usize),
                    None => Child::node(first_node + child.0 as usize),
                };
            }
            self.tree.nodes.push(node);
        }
        Child::node(first_node)
    }

    /// The parameter of the closest hit. Calls `test` with the leaves that the ray may hit, approximately front to
    /// back.
    #[inline]
    pub fn closest(&self, ray: &Ray, test: impl Test<Leaf>) -> Option<f64> {
        simd::closest(&self.tree, ray, LeafTest { leaves: &self.leaves, test })
    }

    /// Whether the ray hits anything. Calls `test` with leaves that the ray may hit, until one is hit.
    #[inline]
    pub fn any(&self, ray: &Ray, test: impl Test<Leaf>) -> bool {
        simd::any(&self.tree, ray, LeafTest { leaves: &self.leaves, test })
    }
}

/// Adapts a test of leaves to their indices.
struct LeafTest<'f, T> {
    leaves: &'f [Leaf],
    test: T,
}

impl<T: Test<Leaf>> Test<u32> for LeafTest<'_, T> {
    #[inline(always)]
    fn test(&mut self, block: u32, ray: &Ray) -> Option<f64> {
        self.test.test(self.leaves[block as usize], ray)
    }
}

/// The children of a node.
fn present(node: &mut Node) -> impl Iterator<Item = &mut Child> {
    let present = node.present;
    node.children.iter_mut().enumerate().filter(move |(slot, _)| present >> slot & 1 == 1).map(|(_, child)| child)
}
