//! The builder, in three steps: it builds a binary tree by the binned surface-area heuristic, finds the cheapest way to
//! collapse it to nodes with up to eight children, and creates these nodes.
//!
//! **Depth.** With `levels` nodes left on the path, a range of `n` primitives is split by the heuristic only if
//! `n <= block * 2^(levels - 1)`, so that any two parts of it fit into the remaining levels. Otherwise it is halved by
//! count. Hence `n <= block * 2^levels` holds for all ranges.

use glam::DVec3;

use super::{Bvh, Child, Lanes, MAX_LEVELS, Node, Tree, WIDTH};
use crate::math::Aabb;

/// The number of bins along each axis.
const BINS: usize = 16;

/// Ranges with more primitives than this are built by several threads.
const PARALLEL: usize = 8192;

/// Bounds of a lesser magnitude are rounded outwards to this one or to zero. Otherwise they or their products could be
/// subnormal numbers, which halve the speed of traversal.
const TINIEST: f32 = 1e-30;

/// Coordinates of a greater magnitude count as infinite.
const FAR: f32 = 1e37;

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
            magnitude = magnitude.max(if x.abs() < f64::from(FAR) { x.abs() } else { 0.0 });
        }
        items.push(Item { bounds: Bounds::around(&bounds), index: index as u32 });
    }
    assert!(items.len() < Child::BLOCK as usize, "at most 2^31 primitives");
    if items.is_empty() {
        return Bvh { tree: Tree { nodes: vec![], magnitude }, order: vec![], starts: vec![0], bounds: whole };
    }
    let mut binary = vec![];
    grow(&mut binary, &mut items, Range { first: 0, block, levels: MAX_LEVELS });
    let mut wide = Wide { costs: costs(&binary), binary, nodes: vec![], blocks: vec![] };
    wide.add_node(0);
    let (order, starts) = order(&wide.blocks, &items);
    Bvh { tree: Tree { nodes: wide.nodes, magnitude }, order, starts, bounds: whole }
}

/// The greatest `f32` at or below `x`, not subnormal.
fn round_down(x: f64) -> f32 {
    -round_up(-x)
}

/// The least `f32` at or above `x`, not subnormal.
fn round_up(x: f64) -> f32 {
    let near = x as f32;
    let up = if f64::from(near) < x { near.next_up() } else { near };
    match up.abs() < TINIEST {
        true if x > 0.0 => TINIEST,
        true => 0.0,
        false => up,
    }
}

/// A box in `f32`. Each corner fits a vector register; its fourth lane is always zero.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    min: [f32; 4],
    max: [f32; 4],
}

impl Bounds {
    const EMPTY: Self = Self {
        min: [f32::INFINITY, f32::INFINITY, f32::INFINITY, 0.0],
        max: [f32::NEG_INFINITY, f32::NEG_INFINITY, f32::NEG_INFINITY, 0.0],
    };

    /// The `f32` box around an `f64` box.
    fn around(bounds: &Aabb) -> Self {
        let down = |v: DVec3| [round_down(v.x), round_down(v.y), round_down(v.z), 0.0];
        let up = |v: DVec3| [round_up(v.x), round_up(v.y), round_up(v.z), 0.0];
        Self { min: down(bounds.min), max: up(bounds.max) }
    }

    #[inline]
    fn union(&self, other: &Self) -> Self {
        Self { min: min(self.min, other.min), max: max(self.max, other.max) }
    }

    /// Twice the centre, which is finite even for infinite boxes.
    #[inline]
    fn centre2(&self) -> [f32; 4] {
        let (low, high) = (max(self.min, [-FAR; 4]), min(self.max, [FAR; 4]));
        std::array::from_fn(|i| low[i] + high[i])
    }

    /// Half the surface area, in `f64` to avoid overflow and underflow.
    fn half_area(&self) -> f64 {
        let e: [f64; 3] = std::array::from_fn(|i| f64::from(self.max[i]) - f64::from(self.min[i]));
        e[0] * e[1] + e[1] * e[2] + e[2] * e[0]
    }
}

#[inline]
fn min(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    std::array::from_fn(|i| if a[i] < b[i] { a[i] } else { b[i] })
}

#[inline]
fn max(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    std::array::from_fn(|i| if a[i] > b[i] { a[i] } else { b[i] })
}

/// A primitive, as the builder sorts it.
#[derive(Clone, Copy, Debug)]
struct Item {
    bounds: Bounds,
    index: u32,
}

fn bounds_of(items: &[Item]) -> Bounds {
    items.iter().fold(Bounds::EMPTY, |all, item| all.union(&item.bounds))
}

/// A range of items that becomes a subtree.
#[derive(Clone, Copy)]
struct Range {
    /// The index of the range's first item among all items.
    first: usize,
    /// The maximum number of primitives in a block.
    block: usize,
    /// The maximum number of nodes on a path in the subtree.
    levels: u32,
}

impl Range {
    /// Whether the heuristic may split `count` items arbitrarily.
    fn is_free(&self, count: usize) -> bool {
        (self.block as u64) << (self.levels - 1) >= count as u64
    }

    /// The part of the range that begins at its item `start`, one level down.
    fn part(&self, start: usize) -> Self {
        Self { first: self.first + start, levels: self.levels - 1, ..*self }
    }
}

/// A node of the binary tree. Its first child follows it directly.
#[derive(Clone, Copy)]
struct Binary {
    bounds: Bounds,
    /// The first item of the subtree.
    first: u32,
    /// The number of items in the subtree.
    count: u32,
    /// The offset of the second child, or zero if the items form a block.
    second: u32,
}

/// Appends the binary tree over the items in depth-first order. It sorts the items.
fn grow(tree: &mut Vec<Binary>, items: &mut [Item], range: Range) {
    let at = tree.len();
    tree.push(Binary { bounds: bounds_of(items), first: range.first as u32, count: items.len() as u32, second: 0 });
    if items.len() <= range.block {
        return;
    }
    let middle = if range.is_free(items.len()) { split(items, range.block) } else { split_evenly(items) };
    let (left, right) = items.split_at_mut(middle);
    if left.len() + right.len() > PARALLEL {
        let mut second = vec![];
        rayon::join(|| grow(tree, left, range.part(0)), || grow(&mut second, right, range.part(middle)));
        tree[at].second = (tree.len() - at) as u32;
        tree.append(&mut second);
    } else {
        grow(tree, left, range.part(0));
        tree[at].second = (tree.len() - at) as u32;
        grow(tree, right, range.part(middle));
    }
}

/// The least cost of the subtree under each node of a binary tree if at most `1..=8` children of a wide node contain
/// it.
///
/// The cost of a wide node is the probability that a ray through the root's box enters its box. The cost of the blocks
/// does not depend on the collapse and is left out. (The dynamic programme of Ylitie, Karras & Laine 2017, "Efficient
/// incoherent ray traversal on GPUs through compressed wide BVHs", section 3.1.)
fn costs(tree: &[Binary]) -> Vec<[f32; WIDTH]> {
    let whole = tree[0].bounds.half_area();
    let mut costs = vec![[0.0; WIDTH]; tree.len()];
    for at in (0..tree.len()).rev() {
        let probability = tree[at].bounds.half_area() / whole;
        // The ratio is NaN if all areas are zero or infinite.
        let probability = if probability <= 1.0 { probability as f32 } else { 1.0 };
        costs[at] = match tree[at].second as usize {
            0 => [0.0; WIDTH],
            second => {
                let (left, right) = (&costs[at + 1], &costs[at + second]);
                let mut own = [f32::INFINITY; WIDTH];
                for children in 2..=WIDTH {
                    own[children - 1] = own[children - 2].min(cheapest(left, right, children).0);
                }
                own[0] = probability + own[WIDTH - 1];
                for children in 2..=WIDTH {
                    own[children - 1] = own[children - 1].min(own[children - 2]);
                }
                own
            }
        };
    }
    costs
}

/// The least cost of two subtrees in `children` children of a wide node, and the number of these for the first subtree.
fn cheapest(left: &[f32; WIDTH], right: &[f32; WIDTH], children: usize) -> (f32, usize) {
    let mut best = (f32::INFINITY, 1);
    for first in 1..children {
        let cost = left[first - 1] + right[children - first - 1];
        if cost < best.0 {
            best = (cost, first);
        }
    }
    best
}

/// The wide tree under construction.
struct Wide {
    binary: Vec<Binary>,
    costs: Vec<[f32; WIDTH]>,
    nodes: Vec<Node>,
    /// The first item and the number of items of each block, in the order of the nodes that contain them.
    blocks: Vec<(u32, u32)>,
}

impl Wide {
    /// Adds the wide node for a binary node, and its whole subtree.
    fn add_node(&mut self, binary: usize) {
        let mut children = Vec::with_capacity(WIDTH);
        match self.binary[binary].second {
            0 => children.push(binary),
            _ => self.divide(binary, WIDTH, &mut children),
        }
        let at = self.nodes.len();
        self.nodes.push(Node::over(children.iter().map(|&child| &self.binary[child].bounds)));
        for (slot, &child) in children.iter().enumerate() {
            let Binary { first, count, second, .. } = self.binary[child];
            if second == 0 {
                self.nodes[at].children[slot] = Child::block(self.blocks.len());
                self.blocks.push((first, count));
            }
        }
        for (slot, &child) in children.iter().enumerate() {
            if self.binary[child].second != 0 {
                self.nodes[at].children[slot] = Child::node(self.nodes.len());
                self.add_node(child);
            }
        }
    }

    /// Divides the subtree of an inner node into up to `count` children at the least cost.
    fn divide(&self, binary: usize, count: usize, children: &mut Vec<usize>) {
        let (left, right) = (binary + 1, binary + self.binary[binary].second as usize);
        let (_, first) = cheapest(&self.costs[left], &self.costs[right], count);
        self.collapse(left, first, children);
        self.collapse(right, count - first, children);
    }

    /// Adds up to `count` children that contain the subtree of a node at the least cost.
    fn collapse(&self, binary: usize, mut count: usize, children: &mut Vec<usize>) {
        let costs = &self.costs[binary];
        while count > 1 && costs[count - 1] == costs[count - 2] {
            count -= 1;
        }
        match count {
            1 => children.push(binary),
            _ => self.divide(binary, count, children),
        }
    }
}

/// The indices of the primitives, block after block, and the start of each block.
fn order(blocks: &[(u32, u32)], items: &[Item]) -> (Vec<u32>, Vec<u32>) {
    let mut order = Vec::with_capacity(items.len());
    let mut starts = Vec::with_capacity(blocks.len() + 1);
    for &(first, count) in blocks {
        starts.push(order.len() as u32);
        order.extend(items[first as usize..][..count as usize].iter().map(|item| item.index));
    }
    starts.push(order.len() as u32);
    (order, starts)
}

impl Node {
    /// A node with these boxes. The caller sets the children.
    fn over<'a>(bounds: impl Iterator<Item = &'a Bounds>) -> Self {
        let mut node = Self {
            planes: [[Lanes([f32::INFINITY; WIDTH]), Lanes([f32::NEG_INFINITY; WIDTH])]; 3],
            children: Default::default(),
            present: 0,
        };
        for (slot, bounds) in bounds.enumerate() {
            node.present |= 1 << slot;
            for (axis, planes) in node.planes.iter_mut().enumerate() {
                planes[0].0[slot] = bounds.min[axis];
                planes[1].0[slot] = bounds.max[axis];
            }
        }
        node
    }
}

/// Partitions at least two items at the least cost by the heuristic. Returns the start of the second part.
fn split(items: &mut [Item], block: usize) -> usize {
    let Some((axis, bin, scale)) = best_plane(items, block) else {
        return split_evenly(items);
    };
    let mut middle = 0;
    for i in 0..items.len() {
        if scale.bins(&items[i].bounds)[axis] < bin {
            items.swap(middle, i);
            middle += 1;
        }
    }
    middle
}

/// Halves the items by count along the axis with the greatest extent of their centres.
fn split_evenly(items: &mut [Item]) -> usize {
    let (low, high) = centre_range(items);
    let extent: [f32; 3] = std::array::from_fn(|i| high[i] - low[i]);
    let axis = (0..3).fold(0, |best, i| if extent[i] > extent[best] { i } else { best });
    let middle = items.len() / 2;
    // The index breaks ties between equal centres, so that the order is total.
    items.select_nth_unstable_by(middle, |a, b| {
        let (p, q) = (a.bounds.centre2()[axis], b.bounds.centre2()[axis]);
        p.total_cmp(&q).then(a.index.cmp(&b.index))
    });
    middle
}

/// The bounding box of the doubled centres.
fn centre_range(items: &[Item]) -> ([f32; 4], [f32; 4]) {
    let centres = items.iter().map(|item| item.bounds.centre2());
    let all = centres.fold(Bounds::EMPTY, |all, c| all.union(&Bounds { min: c, max: c }));
    (all.min, all.max)
}

/// Maps centres to bins.
struct Scale {
    low: [f32; 4],
    bins_per_length: [f32; 4],
}

impl Scale {
    fn new(items: &[Item]) -> Self {
        let (low, high) = centre_range(items);
        // On an axis without extent all centres fall into the first bin, so that there is no split.
        let factor = |i: usize| if high[i] > low[i] { BINS as f32 / (high[i] - low[i]) } else { 0.0 };
        Self { low, bins_per_length: std::array::from_fn(factor) }
    }

    /// The bin of a box along each axis.
    #[inline]
    fn bins(&self, bounds: &Bounds) -> [usize; 4] {
        let centre = bounds.centre2();
        let at: [f32; 4] = std::array::from_fn(|i| (centre[i] - self.low[i]) * self.bins_per_length[i]);
        // NaN (infinity times zero) is put into the first bin.
        min(max(at, [0.0; 4]), [(BINS - 1) as f32; 4]).map(|bin| bin as i32 as usize)
    }
}

/// The bounds and the number of the items in a bin.
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

    /// The cost up to a factor: the probability that a ray enters the box, times the number of blocks to test.
    fn cost(&self, block: usize) -> f64 {
        self.bounds.half_area() * self.count.div_ceil(block) as f64
    }
}

/// The axis and the first bin of the second part at which the cost is least. `None` if no plane separates the items.
fn best_plane(items: &[Item], block: usize) -> Option<(usize, usize, Scale)> {
    let scale = Scale::new(items);
    let mut bins = [[Bin::EMPTY; BINS]; 3];
    for item in items {
        let at = scale.bins(&item.bounds);
        for (bins, at) in bins.iter_mut().zip(at) {
            bins[at].merge(&item.bounds, 1);
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
