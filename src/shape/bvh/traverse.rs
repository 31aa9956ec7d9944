//! Front-to-back traversal with a conservative slab test in `f32`.

use super::build::{round_down, round_up};
use super::{Bvh, Child, Lanes, MAX_LEVELS, Node, SLACK, WIDTH};
use crate::math::Ray;

/// Every node on the path to the current one leaves at most seven others behind.
const STACK: usize = MAX_LEVELS * (WIDTH - 1) + 1;

/// `8 * 2^-24`: see [`Slabs`].
pub(super) const WIDENING: f32 = 8.0 / (1 << 24) as f32;

/// A ray made ready for the slab test in `f32`, such that no box is missed that the `f64` ray, or a point within the
/// slack of it, meets.
///
/// 1. *Scale.* Parameters are multiplied by the power of two that brings the greatest component of the direction into
///    `[1, 2)`: exact, and the scaled parameter `s` then is a distance in the scene, whatever the length of the
///    direction.
/// 2. *Origin.* With direction `d > 0` on an axis, the box is entered at `(min - o) / d` and left at `(max - o) / d`. The
///    first is taken with `o` rounded up, the second with `o` rounded down, after moving `o` by the slack either way: the
///    interval can only grow. For `d < 0` likewise with the planes exchanged.
/// 3. *Arithmetic.* `(b - o) * (1/d)` has three roundings of at most `u = 2^-24` each: that of the difference, the
///    product and of `1/d`. So entry and exit carry relative errors below `3.01 u`, and an interval that is not empty
///    fulfils `entry <= exit + 6.1 u |exit|`; the two roundings in evaluating the right side add `2 u`. [`WIDENING`] is
///    `8 u` of the rounded `|exit|`, and the limit from the closest hit, rounded up, is widened alike. Nothing
///    underflows, since [`round_up`] gives no magnitude below `1e-30` but zero, and so no difference below `2^-123`.
///    (Ize 2013, "Robust BVH ray traversal", bounds the same for a uniform factor.)
/// 4. *Zero components.* If `d = 0`, `1/d` is infinite: outside the slab the interval becomes empty. On its very face
///    `0 * inf` is NaN, and minimum and maximum are written so that NaN loses: a face belongs to its box. If `1/d` is
///    infinite only in `f32` it is replaced by NaN, which drops the axis.
pub(super) struct Slabs {
    /// The origin for the entry planes.
    pub(super) near_origin: [f32; 3],
    /// The origin for the exit planes.
    pub(super) far_origin: [f32; 3],
    /// `1/d` after scaling.
    pub(super) inverse: [f32; 3],
    /// Whether the ray runs down the axis: then it enters through the upper planes.
    pub(super) is_down: [bool; 3],
    /// The scaled `t_min`.
    pub(super) start: f32,
    /// What `t` is multiplied by.
    scale: f64,
}

impl Slabs {
    #[inline(always)]
    fn new(ray: &Ray, magnitude: f64) -> Self {
        let scale = 1.0 / power_of_two_below(ray.direction.abs().max_element());
        let slack = SLACK * (magnitude + ray.origin.abs().max_element());
        let mut slabs = Self { start: round_down(ray.t_min * scale), scale, near_origin: [0.0; 3], far_origin: [0.0; 3], inverse: [0.0; 3], is_down: [false; 3] };
        for axis in 0..3 {
            let up = round_up(ray.origin[axis] + slack);
            let down = round_down(ray.origin[axis] - slack);
            let is_down = ray.direction[axis] < 0.0;
            (slabs.near_origin[axis], slabs.far_origin[axis]) = if is_down { (down, up) } else { (up, down) };
            slabs.inverse[axis] = inverse(ray.direction[axis] * scale);
            slabs.is_down[axis] = is_down;
        }
        slabs
    }

    /// The scaled parameter beyond which no box matters if hits at `t_max` and beyond do not.
    fn limit(&self, t_max: f64) -> f32 {
        widened(round_up(t_max * self.scale))
    }
}

/// The power of two with the exponent of a positive number, kept within what has an inverse.
fn power_of_two_below(x: f64) -> f64 {
    const EXPONENT: u64 = 0x7ff << 52;
    f64::from_bits(x.to_bits() & EXPONENT).clamp(f64::MIN_POSITIVE, 1.0 / f64::MIN_POSITIVE)
}

/// `1/d` in `f32`: `+inf` for zero of either sign, NaN where only `f32` makes it infinite.
fn inverse(d: f64) -> f32 {
    let inverse = (1.0 / d) as f32;
    match inverse.is_infinite() {
        true if d == 0.0 => f32::INFINITY,
        true => f32::NAN,
        false => inverse,
    }
}

/// The exit parameter with room for the errors of the slab test.
#[inline(always)]
pub(super) fn widened(exit: f32) -> f32 {
    exit + exit.abs() * WIDENING
}

/// How the eight boxes of a node are tested. All kernels give the same bits.
pub(super) trait Kernel: Copy {
    /// Where the ray enters each child, and the set of children, as bits, that it meets before `limit`.
    fn meet(self, node: &Node, slabs: &Slabs, limit: f32) -> (Lanes, u32);
}

/// The kernel for any machine, and the twin that others are tested against.
#[derive(Clone, Copy)]
pub(super) struct Portable;

impl Kernel for Portable {
    #[inline(always)]
    fn meet(self, node: &Node, slabs: &Slabs, limit: f32) -> (Lanes, u32) {
        let mut entry = [slabs.start; WIDTH];
        let mut exit = [f32::INFINITY; WIDTH];
        for axis in 0..3 {
            let down = slabs.is_down[axis] as usize;
            let near = &node.planes[axis][down].0;
            let far = &node.planes[axis][1 - down].0;
            for i in 0..WIDTH {
                let enters = (near[i] - slabs.near_origin[axis]) * slabs.inverse[axis];
                let leaves = (far[i] - slabs.far_origin[axis]) * slabs.inverse[axis];
                // NaN compares false and so changes nothing.
                entry[i] = if enters > entry[i] { enters } else { entry[i] };
                exit[i] = if leaves < exit[i] { leaves } else { exit[i] };
            }
        }
        let mut met = 0;
        for i in 0..WIDTH {
            met |= u32::from((entry[i] <= widened(exit[i])) & (entry[i] <= limit)) << i;
        }
        (Lanes(entry), met)
    }
}

/// A child to be visited, and where the ray enters it.
#[derive(Clone, Copy, Default)]
struct Visit {
    entry: f32,
    child: Child,
}

/// The children still to be visited.
struct Stack {
    visits: [Visit; STACK],
    len: usize,
}

impl Stack {
    fn new() -> Self {
        Self { visits: [Visit::default(); STACK], len: 0 }
    }

    #[inline(always)]
    fn push(&mut self, visit: Visit) {
        self.visits[self.len] = visit;
        self.len += 1;
    }

    /// Pushes so that what lies above `floor` stays sorted, the nearest on top.
    #[inline(always)]
    fn push_sorted(&mut self, visit: Visit, floor: usize) {
        let mut at = self.len;
        while at > floor && self.visits[at - 1].entry < visit.entry {
            self.visits[at] = self.visits[at - 1];
            at -= 1;
        }
        self.visits[at] = visit;
        self.len += 1;
    }

    /// The next child that is entered no later than at `limit`.
    #[inline(always)]
    fn pop(&mut self, limit: f32) -> Option<Child> {
        while self.len > 0 {
            self.len -= 1;
            let visit = self.visits[self.len];
            if visit.entry <= limit {
                return Some(visit.child);
            }
        }
        None
    }
}

/// The lanes of a set of bits.
#[inline(always)]
fn lanes(mut set: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = (set != 0).then(|| set.trailing_zeros() as usize % WIDTH);
        set &= set.wrapping_sub(1);
        lane
    })
}

/// [`Bvh::closest_block`] with a kernel.
#[inline(always)]
pub(super) fn closest<K: Kernel>(
    kernel: K,
    bvh: &Bvh,
    ray: &Ray,
    mut test: impl FnMut(u32, &Ray) -> Option<f64>,
) -> Option<f64> {
    let mut ray = *ray;
    let mut found = None;
    let slabs = Slabs::new(&ray, bvh.magnitude);
    let mut limit = slabs.limit(ray.t_max);
    let mut stack = Stack::new();
    let mut next = (!bvh.nodes.is_empty()).then(|| Child::node(0));
    while let Some(child) = next {
        if let Some(block) = child.as_block() {
            if let Some(t) = test(block, &ray) {
                ray.t_max = t;
                found = Some(t);
                limit = slabs.limit(t);
            }
        } else {
            let node = &bvh.nodes[child.0 as usize];
            let (entry, met) = kernel.meet(node, &slabs, limit);
            let floor = stack.len;
            for lane in lanes(met) {
                stack.push_sorted(Visit { entry: entry.0[lane], child: node.children[lane] }, floor);
            }
        }
        next = stack.pop(limit);
    }
    found
}

/// [`Bvh::any_block`] with a kernel.
#[inline(always)]
pub(super) fn any<K: Kernel>(kernel: K, bvh: &Bvh, ray: &Ray, mut test: impl FnMut(u32, &Ray) -> bool) -> bool {
    let slabs = Slabs::new(ray, bvh.magnitude);
    let limit = slabs.limit(ray.t_max);
    let mut stack = Stack::new();
    let mut next = (!bvh.nodes.is_empty()).then(|| Child::node(0));
    while let Some(child) = next {
        if let Some(block) = child.as_block() {
            if test(block, ray) {
                return true;
            }
        } else {
            let node = &bvh.nodes[child.0 as usize];
            let (entry, met) = kernel.meet(node, &slabs, limit);
            for lane in lanes(met) {
                stack.push(Visit { entry: entry.0[lane], child: node.children[lane] });
            }
        }
        next = stack.pop(limit);
    }
    false
}
