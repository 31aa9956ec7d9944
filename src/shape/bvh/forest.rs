//! A hierarchy over hierarchies as one tree, so that a ray is made ready once and goes down once.

use super::{Bvh, Child, Node, Test, Tree, simd};
use crate::math::Ray;

/// A block of one of the hierarchies, or a primitive that has none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Leaf {
    /// The primitive of the hierarchy on top.
    pub primitive: u32,
    /// The block of that primitive's own hierarchy; 0 if it has none.
    pub block: u32,
}

/// A hierarchy over primitives of which some have hierarchies of their own.
///
/// Its promise is that of [`Bvh`], with the greatest coordinate of all.
#[derive(Clone, Debug)]
pub struct Forest {
    tree: Tree,
    leaves: Vec<Leaf>,
}

impl Forest {
    /// Puts copies of the hierarchies that primitives have themselves where `top` has their boxes.
    #[must_use]
    pub fn new<'a>(top: &Bvh, own: impl Fn(u32) -> Option<&'a Bvh>) -> Self {
        let mut forest = Self { tree: Tree { nodes: Vec::new(), magnitude: top.tree.magnitude }, leaves: Vec::new() };
        let mut roots = Vec::with_capacity(top.block_count());
        // The nodes on top come first, whatever their blocks turn into.
        forest.tree.nodes.extend_from_slice(&top.tree.nodes);
        for block in 0..top.block_count() as u32 {
            let &[primitive] = top.block(block) else { panic!("the hierarchy on top has one primitive to a block") };
            roots.push(match own(primitive) {
                Some(below) => forest.append(primitive, below),
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

    /// Appends the hierarchy of a primitive; its root.
    fn append(&mut self, primitive: u32, below: &Bvh) -> Child {
        let (first_node, first_leaf) = (self.tree.nodes.len(), self.leaves.len());
        self.leaves.extend((0..below.block_count() as u32).map(|block| Leaf { primitive, block }));
        for mut node in below.tree.nodes.iter().cloned() {
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

    /// The parameter of the closest hit: tests leaves that the ray may hit, about front to back.
    #[inline]
    pub fn closest(&self, ray: &Ray, test: impl Test<Leaf>) -> Option<f64> {
        simd::closest(&self.tree, ray, OfLeaves { leaves: &self.leaves, test })
    }

    /// Whether anything is hit.
    #[inline]
    pub fn any(&self, ray: &Ray, test: impl Test<Leaf>) -> bool {
        simd::any(&self.tree, ray, OfLeaves { leaves: &self.leaves, test })
    }
}

/// A test of leaves as one of their numbers.
struct OfLeaves<'f, T> {
    leaves: &'f [Leaf],
    test: T,
}

impl<T: Test<Leaf>> Test<u32> for OfLeaves<'_, T> {
    #[inline(always)]
    fn test(&mut self, block: u32, ray: &Ray) -> Option<f64> {
        self.test.test(self.leaves[block as usize], ray)
    }
}

/// The children that a node has.
fn present(node: &mut Node) -> impl Iterator<Item = &mut Child> {
    let present = node.present;
    node.children.iter_mut().enumerate().filter(move |(slot, _)| present >> slot & 1 == 1).map(|(_, child)| child)
}
