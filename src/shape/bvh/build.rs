//! Top-down building by the binned surface-area heuristic.
//!
//! **Depth.** With `levels` nodes left on the path, a range of `n` primitives is split by the heuristic only if
//! `n <= block * 8^(levels - 1)`, so that whatever the children are they fit what is left; otherwise it is split
//! evenly by count, which leaves `n / 8` to each child. Hence `n <= block * 8^levels` holds all the way down.

use glam::DVec3;
use rayon::prelude::*;

use super::{Bvh, Child, Lanes, MAX_LEVELS, Node, WIDTH};
use crate::math::Aabb;

/// Bins along each axis.
const BINS: usize = 16;

/// Ranges above this size are built by several threads.
const PARALLEL: usize = 8192;

/// Bounds of a lesser magnitude are rounded out to this one or to zero: subnormal numbers, which they or their
/// products would be, halve the speed of traversal.
const TINIEST: f32 = 1e-30;

/// Builds the hierarchy over the boxes that are not empty.
pub(super) fn build(bounds: impl Iterator<Item = Aabb>, block: usize) -> Bvh {
    assert!(block > 0, "a block holds at least one primitive");
    let mut whole = Aabb::EMPTY;
    let mut magnitude = 0.0_f64;
    let mut items = Vec::with_capacity(bounds.size_hint().0);
    for (index, bounds) in bounds.enumerate() {
        if bounds.is_empty() {
            continue;
        }
        whole = whole.union(bounds);
        for x in bounds.min.to_array().into_iter().chain(bounds.max.to_array()) {
            magnitude = magnitude.max(if x.is_finite() { x.abs() } else { 0.0 });
        }
        items.push(Item { bounds: Bounds::around(&bounds), index: index as u32 });
    }
    assert!(items.len() < Child::BLOCK as usize, "at most 2^31 primitives");
    let mut tree = Tree::default();
    if !items.is_empty() {
        tree.add_node(&mut items, Range { first: 0, block, levels: MAX_LEVELS });
    }
    let (order, starts) = tree.order(&items);
    Bvh { nodes: tree.nodes, order, starts, bounds: whole, magnitude }
}

/// The greatest `f32` at or below `x`, not subnormal.
pub(super) fn round_down(x: f64) -> f32 {
    -round_up(-x)
}

/// The least `f32` at or above `x`, not subnormal.
pub(super) fn round_up(x: f64) -> f32 {
    let near = x as f32;
    let up = if f64::from(near) < x { near.next_up() } else { near };
    match up.abs() < TINIEST {
        true if x > 0.0 => TINIEST,
        true => 0.0,
        false => up,
    }
}

/// A box in `f32`.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    min: [f32; 3],
    max: [f32; 3],
}

impl Bounds {
    const EMPTY: Self = Self { min: [f32::INFINITY; 3], max: [f32::NEG_INFINITY; 3] };

    /// The `f32` box around an `f64` box.
    fn around(bounds: &Aabb) -> Self {
        let down = |v: DVec3| v.to_array().map(round_down);
        let up = |v: DVec3| v.to_array().map(round_up);
        Self { min: down(bounds.min), max: up(bounds.max) }
    }

    #[inline]
    fn union(&self, other: &Self) -> Self {
        let less = |a: f32, b: f32| if a < b { a } else { b };
        Self {
            min: std::array::from_fn(|i| less(self.min[i], other.min[i])),
            max: std::array::from_fn(|i| -less(-self.max[i], -other.max[i])),
        }
    }

    /// Twice the centre; finite even for infinite boxes.
    #[inline]
    fn centre2(&self) -> [f32; 3] {
        const FAR: f32 = 1e37;
        std::array::from_fn(|i| self.min[i].max(-FAR) + self.max[i].min(FAR))
    }

    /// Half the surface area; in `f64` for the sake of huge and tiny boxes.
    fn half_area(&self) -> f64 {
        let e: [f64; 3] = std::array::from_fn(|i| f64::from(self.max[i]) - f64::from(self.min[i]));
        e[0] * e[1] + e[1] * e[2] + e[2] * e[0]
    }
}

/// A primitive as the builder moves it about.
#[derive(Clone, Copy, Debug)]
struct Item {
    bounds: Bounds,
    index: u32,
}

fn bounds_of(items: &[Item]) -> Bounds {
    items.iter().fold(Bounds::EMPTY, |all, item| all.union(&item.bounds))
}

/// What a range of items is to become.
#[derive(Clone, Copy)]
struct Range {
    /// Where the range begins among all items.
    first: usize,
    /// How many primitives make a block.
    block: usize,
    /// How many nodes a path from here may have.
    levels: usize,
}

impl Range {
    /// Whether the heuristic may split `count` items as it likes.
    fn is_free(&self, count: usize) -> bool {
        let room = self.levels.saturating_sub(1) as u32;
        (WIDTH as u128).pow(room) * self.block as u128 >= count as u128
    }
}

/// Nodes in depth-first order, and the blocks (first item, count) in the order of the nodes that hold them.
#[derive(Default)]
struct Tree {
    nodes: Vec<Node>,
    blocks: Vec<(u32, u32)>,
}

impl Tree {
    /// Adds the node over `items` and all that is below it.
    fn add_node(&mut self, items: &mut [Item], range: Range) {
        let at = self.nodes.len();
        let parts = divide(items, &range);
        self.nodes.push(Node::over(&parts));
        for (slot, part) in parts.iter().enumerate() {
            if part.count() <= range.block {
                self.nodes[at].children[slot] = Child::block(self.blocks.len());
                self.blocks.push(((range.first + part.start) as u32, part.count() as u32));
            }
        }
        if items.len() > PARALLEL {
            self.add_below_in_parallel(at, items, &parts, range);
        } else {
            for (slot, part) in parts.iter().enumerate().filter(|(_, part)| part.count() > range.block) {
                self.nodes[at].children[slot] = Child::node(self.nodes.len());
                self.add_node(&mut items[part.start..part.end], range.below(part));
            }
        }
    }

    /// Builds the subtrees apart and appends them in the order in which one thread would have made them.
    fn add_below_in_parallel(&mut self, at: usize, items: &mut [Item], parts: &[Part], range: Range) {
        let mut rest = items;
        let mut taken = 0;
        let mut jobs = Vec::with_capacity(WIDTH);
        for (slot, part) in parts.iter().enumerate() {
            let (own, after) = rest.split_at_mut(part.end - taken);
            (rest, taken) = (after, part.end);
            if part.count() > range.block {
                jobs.push((slot, part, own));
            }
        }
        let build = |(slot, part, own): (usize, &Part, &mut [Item])| {
            let mut tree = Self::default();
            tree.add_node(own, range.below(part));
            (slot, tree)
        };
        let subtrees: Vec<(usize, Self)> = jobs.into_par_iter().map(build).collect();
        for (slot, subtree) in subtrees {
            self.nodes[at].children[slot] = Child::node(self.nodes.len());
            self.append(subtree);
        }
    }

    fn append(&mut self, subtree: Self) {
        let (nodes, blocks) = (self.nodes.len(), self.blocks.len());
        self.nodes.extend(subtree.nodes.into_iter().map(|mut node| {
            node.children = node.children.map(|child| child.shifted(nodes, blocks));
            node
        }));
        self.blocks.extend(subtree.blocks);
    }

    /// The indices of the items, block after block, and where each block begins.
    fn order(&self, items: &[Item]) -> (Vec<u32>, Vec<u32>) {
        let mut order = Vec::with_capacity(items.len());
        let mut starts = Vec::with_capacity(self.blocks.len() + 1);
        for &(first, count) in &self.blocks {
            starts.push(order.len() as u32);
            order.extend(items[first as usize..][..count as usize].iter().map(|item| item.index));
        }
        starts.push(order.len() as u32);
        (order, starts)
    }
}

impl Range {
    fn below(&self, part: &Part) -> Self {
        Self { first: self.first + part.start, levels: self.levels - 1, ..*self }
    }
}

impl Node {
    /// A node with these boxes and children yet to be set.
    fn over(parts: &[Part]) -> Self {
        let mut node = Self {
            planes: [[Lanes([f32::INFINITY; WIDTH]), Lanes([f32::NEG_INFINITY; WIDTH])]; 3],
            children: Default::default(),
        };
        for (slot, part) in parts.iter().enumerate() {
            for (axis, planes) in node.planes.iter_mut().enumerate() {
                planes[0].0[slot] = part.bounds.min[axis];
                planes[1].0[slot] = part.bounds.max[axis];
            }
        }
        node
    }
}

/// A range of the items of a node that is to become one child.
#[derive(Clone, Copy)]
struct Part {
    start: usize,
    end: usize,
    bounds: Bounds,
}

impl Part {
    fn new(start: usize, end: usize, items: &[Item]) -> Self {
        Self { start, end, bounds: bounds_of(&items[start..end]) }
    }

    fn count(&self) -> usize {
        self.end - self.start
    }
}

/// Divides the items of a node among up to eight children, in order.
fn divide(items: &mut [Item], range: &Range) -> Vec<Part> {
    let free = range.is_free(items.len());
    let mut parts = Vec::with_capacity(WIDTH);
    parts.push(Part::new(0, items.len(), items));
    while parts.len() < WIDTH {
        // The widest child is the likeliest to be entered in vain, the fullest the one to keep the depth bounded.
        let weight = |part: &Part| if free { part.bounds.half_area() } else { part.count() as f64 };
        let open = parts.iter().enumerate().filter(|(_, part)| part.count() > range.block);
        let Some((slot, _)) = open.max_by(|(_, a), (_, b)| weight(a).total_cmp(&weight(b))) else {
            break;
        };
        let Part { start, end, .. } = parts[slot];
        let own = &mut items[start..end];
        let middle = start + if free { split(own, range.block) } else { split_evenly(own) };
        parts[slot] = Part::new(start, middle, items);
        parts.insert(slot + 1, Part::new(middle, end, items));
    }
    parts
}

/// Sorts at least two items into two ranges at the least cost by the heuristic, and returns where the second begins.
fn split(items: &mut [Item], block: usize) -> usize {
    let Some((axis, bin, scale)) = best_plane(items, block) else {
        return split_evenly(items);
    };
    let mut middle = 0;
    for i in 0..items.len() {
        if scale.bin(axis, &items[i].bounds) < bin {
            items.swap(middle, i);
            middle += 1;
        }
    }
    middle
}

/// Halves the items by count along the axis on which their centres spread most.
fn split_evenly(items: &mut [Item]) -> usize {
    let (low, high) = centre_range(items);
    let spread: [f32; 3] = std::array::from_fn(|i| high[i] - low[i]);
    let axis = (0..3).fold(0, |best, i| if spread[i] > spread[best] { i } else { best });
    let middle = items.len() / 2;
    // The index decides between equal centres, so that the order is a total one.
    items.select_nth_unstable_by(middle, |a, b| {
        let (p, q) = (a.bounds.centre2()[axis], b.bounds.centre2()[axis]);
        p.total_cmp(&q).then(a.index.cmp(&b.index))
    });
    middle
}

/// The box around the (doubled) centres.
fn centre_range(items: &[Item]) -> ([f32; 3], [f32; 3]) {
    let centres = items.iter().map(|item| item.bounds.centre2());
    let all = centres.fold(Bounds::EMPTY, |all, c| all.union(&Bounds { min: c, max: c }));
    (all.min, all.max)
}

/// Maps centres to bins.
struct Scale {
    low: [f32; 3],
    bins_per_length: [f32; 3],
}

impl Scale {
    fn new(items: &[Item]) -> Self {
        let (low, high) = centre_range(items);
        // An axis without extent gets all its centres into the first bin and so offers no split.
        let factor = |i: usize| if high[i] > low[i] { BINS as f32 / (high[i] - low[i]) } else { 0.0 };
        Self { low, bins_per_length: std::array::from_fn(factor) }
    }

    #[inline]
    fn bin(&self, axis: usize, bounds: &Bounds) -> usize {
        let centre = bounds.centre2()[axis];
        // The cast takes NaN (infinity times zero) to the first bin.
        (((centre - self.low[axis]) * self.bins_per_length[axis]) as usize).min(BINS - 1)
    }
}

/// What fell into a bin.
#[derive(Clone, Copy)]
struct Bin {
    bounds: Bounds,
    count: usize,
}

impl Bin {
    const EMPTY: Self = Self { bounds: Bounds::EMPTY, count: 0 };

    #[inline]
    fn merge(&mut self, bounds: &Bounds, count: usize) {
        self.bounds = self.bounds.union(bounds);
        self.count += count;
    }

    /// Chance of being entered times the tests that follow.
    fn cost(&self, block: usize) -> f64 {
        self.bounds.half_area() * self.count.div_ceil(block) as f64
    }
}

/// The axis, and the bin at which the second half begins, where the cost is least; `None` if no plane separates.
fn best_plane(items: &[Item], block: usize) -> Option<(usize, usize, Scale)> {
    let scale = Scale::new(items);
    let mut bins = [[Bin::EMPTY; BINS]; 3];
    for item in items {
        for (axis, bins) in bins.iter_mut().enumerate() {
            bins[scale.bin(axis, &item.bounds)].merge(&item.bounds, 1);
        }
    }
    let mut best = None;
    let mut least = f64::INFINITY;
    for (axis, bins) in bins.iter().enumerate() {
        let mut after = [f64::INFINITY; BINS];
        let mut right = Bin::EMPTY;
        for at in (1..BINS).rev() {
            right.merge(&bins[at].bounds, bins[at].count);
            after[at] = if right.count > 0 { right.cost(block) } else { f64::INFINITY };
        }
        let mut left = Bin::EMPTY;
        for at in 1..BINS {
            left.merge(&bins[at - 1].bounds, bins[at - 1].count);
            let cost = if left.count > 0 { left.cost(block) + after[at] } else { f64::INFINITY };
            if cost < least {
                (least, best) = (cost, Some((axis, at)));
            }
        }
    }
    best.map(|(axis, bin)| (axis, bin, scale))
}
