//! Front-to-back traversal with a conservative slab test in `f32`.

use arrayvec::ArrayVec;
use glam::{BVec3, DVec3, Vec3};

use super::{Child, Lanes, MAX_LEVELS, Node, SLACK, Test, Tree, WIDTH};
use crate::math::Ray;

/// Every node on the path to the current one leaves at most seven others behind; a forest has paths twice as long.
pub(super) const STACK: usize = 2 * MAX_LEVELS as usize * (WIDTH - 1) + 1;

/// The unit roundoff of `f32`.
const ROUNDOFF: f64 = 1.0 / (1 << 24) as f64;

/// A ray made ready for the slab test in `f32`, such that no box is missed that the `f64` ray, or a point within the
/// slack of it, meets.
///
/// 1. *Scale.* The direction is divided by the power of two that brings its greatest component into `[1, 2)`, and
///    parameters are multiplied by it: exact, and the scaled parameter is a distance in the scene, whatever the length
///    of the direction.
/// 2. *Origin.* With direction `d > 0` on an axis, the box is entered at `(min - o) / d` and left at `(max - o) / d`.
///    The first is taken with `o` moved up, the second with `o` moved down, by the slack and what the rounding to `f32`
///    may take from it: the interval can only grow. For `d < 0` likewise with the planes exchanged.
/// 3. *Arithmetic.* `(b - o) * (1/d)` has three roundings of at most `u = 2^-24` each: that of the difference, the
///    product and of `1/d`. So entry and exit carry relative errors below `3.01 u`, and an interval that is not empty
///    fulfils `entry <= exit + 6.1 u |exit|`. As far as `exit >= 0` it is enough to take `1/d` greater by `8 u` for the
///    exit. Where exits below zero count (`t_min < 0`) the slack grows by `16 u (M + |o|)` instead, which no error
///    exceeds, since `|b - o| <= M + |o|`. (Ize 2013, "Robust BVH ray traversal", bounds the same by a factor.)
/// 4. *Underflow.* An error of a product below the normal numbers is less than the `1e-30` that the slack has on top.
/// 5. *Zero components.* If `d = 0`, `1/d` is infinite: outside the slab the interval becomes empty. On its very face
///    `0 * inf` is NaN, and minimum and maximum are written so that NaN loses: a face belongs to its box. If `1/d` is
///    infinite only in `f32` it is replaced by NaN, which drops the axis.
pub(super) struct Slabs {
    /// The origin for the entry planes.
    pub(super) near_origin: [f32; 3],
    /// The origin for the exit planes.
    pub(super) far_origin: [f32; 3],
    /// `1/d` after scaling, for the entry.
    pub(super) near_inverse: [f32; 3],
    /// The same for the exit, a little greater.
    pub(super) far_inverse: [f32; 3],
    /// Whether the ray runs down the axis: then it enters through the upper planes.
    pub(super) is_down: [bool; 3],
    /// The scaled `t_min`.
    pub(super) start: f32,
    /// What `t` is multiplied by.
    scale: f64,
}

impl Slabs {
    #[inline(always)]
    pub(super) fn new(ray: &Ray, magnitude: f64) -> Self {
        let (scale, inverse_scale) = power_of_two_below(ray.direction.abs().max_element());
        let reach = magnitude + ray.origin.abs().max_element();
        let slack = 1e-30 + reach * if ray.t_min < 0.0 { SLACK + 16.0 * ROUNDOFF } else { SLACK };
        // Twice the rounding of what comes out.
        let slack = DVec3::splat(slack) + 2.0 * ROUNDOFF * (ray.origin.abs() + slack);
        let (up, down) = ((ray.origin + slack).as_vec3(), (ray.origin - slack).as_vec3());
        let inverse = (ray.direction * inverse_scale).recip();
        let is_lost = inverse.abs().cmpge(DVec3::splat(f64::from(f32::MAX))) & ray.direction.cmpne(DVec3::ZERO);
        let near_inverse = if is_lost.any() { drop_axes(inverse, is_lost) } else { inverse.as_vec3() };
        // A zero has an infinite inverse of the same sign.
        let is_down = inverse.cmplt(DVec3::ZERO);
        Self {
            near_origin: std::array::from_fn(|axis| [up, down][usize::from(is_down.test(axis))][axis]),
            far_origin: std::array::from_fn(|axis| [down, up][usize::from(is_down.test(axis))][axis]),
            near_inverse: near_inverse.to_array(),
            far_inverse: (near_inverse * (1.0 + 8.0 * ROUNDOFF) as f32).to_array(),
            is_down: is_down.into(),
            start: with_room((ray.t_min * scale) as f32, -1.0),
            scale,
        }
    }

    /// The scaled parameter beyond which no box matters if hits at `t_max` and beyond do not.
    #[inline(always)]
    fn limit(&self, t_max: f64) -> f32 {
        with_room((t_max * self.scale) as f32, 1.0)
    }
}

/// The inverses in `f32`, and NaN for those that are infinite only there.
#[cold]
fn drop_axes(inverse: DVec3, is_lost: BVec3) -> Vec3 {
    Vec3::select(is_lost, Vec3::NAN, inverse.as_vec3())
}

/// The power of two with the exponent of a positive number, and its inverse.
#[inline(always)]
fn power_of_two_below(x: f64) -> (f64, f64) {
    const EXPONENT: u64 = 0x7ff << 52;
    // The exponents of a number and its inverse add up to 2046; 0 and 2047 are not those of powers of two.
    let exponent = (x.to_bits() & EXPONENT).clamp(1 << 52, 2045 << 52);
    (f64::from_bits(exponent), f64::from_bits((2046 << 52) - exponent))
}

/// A parameter moved up or down by more than the errors of the slab test.
#[inline(always)]
fn with_room(parameter: f32, sign: f32) -> f32 {
    parameter + sign * (parameter.abs() * (8.0 * ROUNDOFF) as f32 + f32::MIN_POSITIVE)
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
        let mut exit = [limit; WIDTH];
        for axis in 0..3 {
            let down = slabs.is_down[axis] as usize;
            let near = &node.planes[axis][down].0;
            let far = &node.planes[axis][1 - down].0;
            for i in 0..WIDTH {
                let enters = (near[i] - slabs.near_origin[axis]) * slabs.near_inverse[axis];
                let leaves = (far[i] - slabs.far_origin[axis]) * slabs.far_inverse[axis];
                // NaN compares false and so changes nothing.
                entry[i] = if enters > entry[i] { enters } else { entry[i] };
                exit[i] = if leaves < exit[i] { leaves } else { exit[i] };
            }
        }
        let mut met = 0;
        for i in 0..WIDTH {
            met |= u32::from(entry[i] <= exit[i]) << i;
        }
        (Lanes(entry), met & node.present)
    }
}

/// A child to be visited, and where the ray enters it.
#[derive(Clone, Copy, Default)]
struct Visit {
    entry: f32,
    child: Child,
}

/// What is still to be visited, the next one last.
type Stack<T> = ArrayVec<T, STACK>;

/// Pushes the children in `met` but for the one that is entered first, which is returned, the nearest last.
#[inline(always)]
fn push_sorted(stack: &mut Stack<Visit>, node: &Node, entry: &Lanes, met: u32) -> Option<Child> {
    let mut rest = met;
    // Keys that sort like the parameters of entry, as far as these are not negative, and tell the lane.
    let mut key = || {
        let lane = rest.trailing_zeros();
        rest &= rest.wrapping_sub(1);
        entry.0[lane as usize % WIDTH].to_bits() & !7 | lane
    };
    let order = |a: u32, b: u32| (a.min(b), a.max(b));
    let child = |key: u32| node.children[key as usize % WIDTH];
    let visit = |key: u32| Visit { entry: entry.0[key as usize % WIDTH], child: child(key) };
    match met.count_ones() {
        0 => None,
        1 => Some(child(met.trailing_zeros())),
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

/// The next child that is entered no later than at `limit`.
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
                // The minimum changes nothing, but keeps the compiler from computing the limit anew for every node.
                limit = limit.min(slabs.limit(t));
            }
            next = pop(&mut stack, limit);
        } else {
            let node = &tree.nodes[child.0 as usize];
            let (entry, met) = kernel.meet(node, &slabs, limit);
            next = push_sorted(&mut stack, node, &entry, met).or_else(|| pop(&mut stack, limit));
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
            let (_, mut met) = kernel.meet(node, &slabs, limit);
            while met != 0 {
                stack.push(node.children[met.trailing_zeros() as usize % WIDTH]);
                met &= met - 1;
            }
        }
        next = stack.pop();
    }
    false
}
