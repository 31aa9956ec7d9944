//! Front-to-back traversal with a conservative slab test in `f32`.

use arrayvec::ArrayVec;
use glam::{BVec3, DVec3, Vec3};

use super::{Child, Lanes, MAX_LEVELS, Node, SLACK, Test, Tree, WIDTH};
use crate::math::Ray;

/// The size of the stack. Every node on the path to the current one leaves at most seven siblings on it. A forest has
/// paths of twice the length.
pub(super) const STACK: usize = 2 * MAX_LEVELS as usize * (WIDTH - 1) + 1;

/// The unit roundoff of `f32`.
const ROUNDOFF: f64 = 1.0 / (1 << 24) as f64;

/// A ray prepared for the `f32` slab test. The test does not miss a box that the `f64` ray, or a point within the slack
/// of it, intersects.
///
/// 1. *Scale.* The direction is divided by the power of two that brings its greatest component into `[1, 2)`, and
///    parameters are multiplied by it. This is exact, and the scaled parameter is a distance in the scene for
///    directions of any length.
/// 2. *Origin.* With direction `d > 0` on an axis, the ray enters the box at `(min - o) / d` and leaves it at
///    `(max - o) / d`. The entry is computed with `o` moved up, the exit with `o` moved down, each by the slack and the
///    possible rounding error of the conversion to `f32`, so that the interval can only grow. For `d < 0` the planes
///    are exchanged.
/// 3. *Arithmetic.* `(b - o) * (1/d)` has three roundings of at most `u = 2^-24` each: of the difference, of the
///    product and of `1/d`. Hence the relative errors of entry and exit are below `3.01 u`, and an interval that is not
///    empty satisfies `entry <= exit + 6.1 u |exit|`. If `exit >= 0`, it is sufficient to increase `1/d` by `8 u` for
///    the exit. If negative exits count (`t_min < 0`), the slack grows by `16 u (M + |o|)` instead, which bounds all
///    errors, since `|b - o| <= M + |o|`. (Ize 2013, "Robust BVH ray traversal", bounds these errors by a factor.)
/// 4. *Underflow.* If a product is subnormal, its error is less than the `1e-30` that is added to the slack.
/// 5. *Zero components.* If `d = 0`, `1/d` is infinite, and the interval is empty outside of the slab. Exactly on a
///    face `0 * inf` is NaN, and the minimum and the maximum ignore NaN, so that a face belongs to its box. If `1/d` is
///    infinite only in `f32`, it is replaced by NaN, so that the axis is ignored.
pub(super) struct Slabs {
    /// The origin for the entry planes.
    pub(super) near_origin: [f32; 3],
    /// The origin for the exit planes.
    pub(super) far_origin: [f32; 3],
    /// `1/d` after scaling, for the entry.
    pub(super) near_inverse: [f32; 3],
    /// `1/d` after scaling, slightly increased, for the exit.
    pub(super) far_inverse: [f32; 3],
    /// Whether the direction is negative on the axis, so that the ray enters through the upper plane.
    pub(super) is_down: [bool; 3],
    /// The scaled `t_min`.
    pub(super) start: f32,
    /// The factor from `t` to the scaled parameter.
    scale: f64,
}

impl Slabs {
    #[inline(always)]
    pub(super) fn new(ray: &Ray, magnitude: f64) -> Self {
        let (scale, inverse_scale) = power_of_two_below(ray.direction.abs().max_element());
        let size = magnitude + ray.origin.abs().max_element();
        let slack = 1e-30 + size * if ray.t_min < 0.0 { SLACK + 16.0 * ROUNDOFF } else { SLACK };
        // Add twice the rounding error of the conversion to `f32`.
        let slack = DVec3::splat(slack) + 2.0 * ROUNDOFF * (ray.origin.abs() + slack);
        let (up, down) = ((ray.origin + slack).as_vec3(), (ray.origin - slack).as_vec3());
        let inverse = (ray.direction * inverse_scale).recip();
        let overflows = inverse.abs().cmpge(DVec3::splat(f64::from(f32::MAX))) & ray.direction.cmpne(DVec3::ZERO);
        let near_inverse = if overflows.any() { drop_axes(inverse, overflows) } else { inverse.as_vec3() };
        // A zero has an infinite inverse of the same sign.
        let is_down = inverse.cmplt(DVec3::ZERO);
        Self {
            near_origin: std::array::from_fn(|axis| [up, down][usize::from(is_down.test(axis))][axis]),
            far_origin: std::array::from_fn(|axis| [down, up][usize::from(is_down.test(axis))][axis]),
            near_inverse: near_inverse.to_array(),
            far_inverse: (near_inverse * (1.0 + 8.0 * ROUNDOFF) as f32).to_array(),
            is_down: is_down.into(),
            start: widened((ray.t_min * scale) as f32, -1.0),
            scale,
        }
    }

    /// The scaled parameter beyond which boxes can be skipped if hits count only before `t_max`.
    #[inline(always)]
    fn limit(&self, t_max: f64) -> f32 {
        widened((t_max * self.scale) as f32, 1.0)
    }
}

/// The inverses in `f32`, with NaN for those that overflow in `f32` only.
#[cold]
fn drop_axes(inverse: DVec3, overflows: BVec3) -> Vec3 {
    Vec3::select(overflows, Vec3::NAN, inverse.as_vec3())
}

/// The greatest power of two that is at most the positive number `x`, and its inverse.
#[inline(always)]
fn power_of_two_below(x: f64) -> (f64, f64) {
    const EXPONENT: u64 = 0x7ff << 52;
    // The biased exponents of a power of two and its inverse add up to 2046. The exponents 0 and 2047 are excluded:
    // they belong to subnormal numbers, infinities and NaN.
    let exponent = (x.to_bits() & EXPONENT).clamp(1 << 52, 2045 << 52);
    (f64::from_bits(exponent), f64::from_bits((2046 << 52) - exponent))
}

/// A parameter moved up or down by more than the errors of the slab test.
#[inline(always)]
fn widened(parameter: f32, sign: f32) -> f32 {
    parameter + sign * (parameter.abs() * (8.0 * ROUNDOFF) as f32 + f32::MIN_POSITIVE)
}

/// An implementation of the slab test for the eight boxes of a node. All kernels give the same bits.
pub(super) trait Kernel: Copy {
    /// The scaled parameter at which the ray enters each child's box, and the set of boxes, as bits, that it enters
    /// before
    /// `limit`.
    fn intersect(self, node: &Node, slabs: &Slabs, limit: f32) -> (Lanes, u32);
}

/// The kernel for any machine, with which other kernels are compared in tests.
#[derive(Clone, Copy)]
pub(super) struct Portable;

impl Kernel for Portable {
    #[inline(always)]
    fn intersect(self, node: &Node, slabs: &Slabs, limit: f32) -> (Lanes, u32) {
        let mut entry = [slabs.start; WIDTH];
        let mut exit = [limit; WIDTH];
        for axis in 0..3 {
            let down = slabs.is_down[axis] as usize;
            let near = &node.planes[axis][down].0;
            let far = &node.planes[axis][1 - down].0;
            for i in 0..WIDTH {
                let enters = (near[i] - slabs.near_origin[axis]) * slabs.near_inverse[axis];
                let leaves = (far[i] - slabs.far_origin[axis]) * slabs.far_inverse[axis];
                // Comparisons with NaN are false, so that NaN is ignored.
                entry[i] = if enters > entry[i] { enters } else { entry[i] };
                exit[i] = if leaves < exit[i] { leaves } else { exit[i] };
            }
        }
        let mut hit = 0;
        for i in 0..WIDTH {
            hit |= u32::from(entry[i] <= exit[i]) << i;
        }
        (Lanes(entry), hit & node.present)
    }
}

/// A child to be visited, and the scaled parameter at which the ray enters its box.
#[derive(Clone, Copy, Default)]
struct Visit {
    entry: f32,
    child: Child,
}

/// The children that are still to be visited. The next one is on top.
type Stack<T> = ArrayVec<T, STACK>;

/// Returns the nearest of the children in `hit` and pushes the others, sorted so that the nearest is on top.
#[inline(always)]
fn push_sorted(stack: &mut Stack<Visit>, node: &Node, entry: &Lanes, hit: u32) -> Option<Child> {
    let mut rest = hit;
    // Keys that contain the lane and sort like the entry parameters, if these are not negative.
    let mut key = || {
        let lane = rest.trailing_zeros();
        rest &= rest.wrapping_sub(1);
        entry.0[lane as usize % WIDTH].to_bits() & !7 | lane
    };
    let order = |a: u32, b: u32| (a.min(b), a.max(b));
    let child = |key: u32| node.children[key as usize % WIDTH];
    let visit = |key: u32| Visit { entry: entry.0[key as usize % WIDTH], child: child(key) };
    match hit.count_ones() {
        0 => None,
        1 => Some(child(hit.trailing_zeros())),
        2 => {
            let (a, b) = order(key(), key());
            stack.push(visit(b));
            Some(child(a))
        }
        3 => {
            let (a, b) = order(key(), key());
            let (b, c) = order(b, key());
            let (a, b) = order(a, b);
            stack.push(visit(c));
            stack.push(visit(b));
            Some(child(a))
        }
        count => {
            let mut keys = [0; WIDTH];
            for i in 0..count as usize {
                let key = key();
                let mut at = i;
                while at > 0 && keys[at - 1] < key {
                    keys[at] = keys[at - 1];
                    at -= 1;
                }
                keys[at] = key;
            }
            for &key in &keys[..count as usize - 1] {
                stack.push(visit(key));
            }
            Some(child(keys[count as usize - 1]))
        }
    }
}

/// Pops the next child whose box the ray enters at or before `limit`.
#[inline(always)]
fn pop(stack: &mut Stack<Visit>, limit: f32) -> Option<Child> {
    while let Some(visit) = stack.pop() {
        if visit.entry <= limit {
            return Some(visit.child);
        }
    }
    None
}

/// `Bvh::closest_block` with a kernel.
#[inline(always)]
pub(super) fn closest<K: Kernel>(kernel: K, tree: &Tree, ray: &Ray, mut test: impl Test<u32>) -> Option<f64> {
    let mut ray = *ray;
    let mut found = None;
    let slabs = Slabs::new(&ray, tree.magnitude);
    let mut limit = slabs.limit(ray.t_max);
    let mut stack = Stack::new();
    let mut next = (!tree.nodes.is_empty()).then(|| Child::node(0));
    while let Some(child) = next {
        if let Some(block) = child.as_block() {
            if let Some(t) = test.test(block, &ray) {
                ray.t_max = t;
                found = Some(t);
                // The minimum changes nothing, but keeps the compiler from recomputing the limit for every node.
                limit = limit.min(slabs.limit(t));
            }
            next = pop(&mut stack, limit);
        } else {
            let node = &tree.nodes[child.0 as usize];
            let (entry, hit) = kernel.intersect(node, &slabs, limit);
            next = push_sorted(&mut stack, node, &entry, hit).or_else(|| pop(&mut stack, limit));
        }
    }
    found
}

/// `Bvh::any_block` with a kernel.
#[inline(always)]
pub(super) fn any<K: Kernel>(kernel: K, tree: &Tree, ray: &Ray, mut test: impl Test<u32>) -> bool {
    let slabs = Slabs::new(ray, tree.magnitude);
    let limit = slabs.limit(ray.t_max);
    let mut stack = Stack::<Child>::new();
    let mut next = (!tree.nodes.is_empty()).then(|| Child::node(0));
    while let Some(child) = next {
        if let Some(block) = child.as_block() {
            if test.test(block, ray).is_some() {
                return true;
            }
        } else {
            let node = &tree.nodes[child.0 as usize];
            let (_, mut hit) = kernel.intersect(node, &slabs, limit);
            while hit != 0 {
                stack.push(node.children[hit.trailing_zeros() as usize % WIDTH]);
                hit &= hit - 1;
            }
        }
        next = stack.pop();
    }
    false
}
