//! Ray against many triangles.
//!
//! **Test.** The watertight test of Woop, Benthin & Wald (2013), "Watertight ray/triangle intersection", JCGT 2(1):
//! with `z` the axis on which the direction is greatest, a shear takes the ray to the `z` axis, and the signs of the
//! three edge functions `P.x Q.y - P.y Q.x` of the sheared corners say whether the axis passes inside.
//!
//! **Watertight.** A sheared corner depends on the corner and the ray alone, so it is the same for all triangles that
//! share it; exchanging `P` and `Q` negates the edge function exactly. Rounding is monotone, so the difference of two
//! rounded products never has the wrong sign: it is right, or zero, and zero counts as inside for both neighbours. A
//! ray thus finds no gap at a shared edge or corner, and no fallback to higher precision is needed.
//!
//! **What does not count.** Triangles without area (exactly, as computed in `f64` from the `f32` corners), triangles
//! with a corner that is not finite, and hits on a triangle seen exactly edge-on, which its neighbours report. One seen
//! edge-on but for rounding is hit where the ray passes its longest edge, see `slim_weights`.

use glam::{DVec2, DVec3};

use crate::math::{Aabb, Ray};
use crate::shape::bvh::Bvh;

/// Triangles tested at once.
const LANES: usize = 4;

/// Triangles with a hierarchy over them. Both sides are hit.
///
/// Corners are stored as `f32`, all arithmetic on them is `f64`.
#[derive(Clone, Debug)]
pub struct Triangles {
    positions: Vec<[f32; 3]>,
    indices: Vec<[u32; 3]>,
    bvh: Bvh,
    /// The corners again, in the blocks of the hierarchy.
    blocks: Vec<Block>,
}

/// Where a ray meets a triangle: at `t`, and at `(1 - b1 - b2) a + b1 b + b2 c` of its corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleHit {
    /// The parameter of the ray.
    pub t: f64,
    /// The triangle, as numbered in `indices`.
    pub triangle: u32,
    /// The weight of the second corner.
    pub b1: f64,
    /// The weight of the third corner.
    pub b2: f64,
}

impl Triangles {
    /// Triangles with these corners; panics if an index is not one of a position.
    #[must_use]
    pub fn new(positions: Vec<[f32; 3]>, indices: Vec<[u32; 3]>) -> Self {
        let corners = |i: &[u32; 3]| i.map(|k| positions[k as usize]);
        let bounds = indices.iter().map(|i| bounds(&corners(i)));
        let bvh = Bvh::build_in_blocks(bounds, LANES);
        let fill = |block| Block::new(bvh.block(block).iter().map(|&i| (i, corners(&indices[i as usize]))));
        let blocks = (0..bvh.block_count() as u32).map(fill).collect();
        Self { positions, indices, bvh, blocks }
    }

    /// The corners that triangles share.
    #[must_use]
    pub fn positions(&self) -> &[[f32; 3]] {
        &self.positions
    }

    /// For each triangle, which positions are its corners.
    #[must_use]
    pub fn indices(&self) -> &[[u32; 3]] {
        &self.indices
    }

    /// The corners of a triangle.
    #[inline]
    #[must_use]
    pub fn triangle(&self, triangle: u32) -> [DVec3; 3] {
        self.indices[triangle as usize].map(|i| wide(self.positions[i as usize]))
    }

    /// The box around all triangles that can be hit.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bvh.bounds()
    }

    /// The memory of it all.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.positions) + size_of_val(&*self.indices) + size_of_val(&*self.blocks) + self.bvh.bytes()
    }

    /// The first triangle that the ray meets.
    #[must_use]
    pub fn closest(&self, ray: &Ray) -> Option<TriangleHit> {
        let shear = Shear::new(ray);
        let mut best = None;
        self.bvh.closest_block(ray, |block: u32, ray: &Ray| {
            let hit = self.closest_in_block(block, ray, &shear)?;
            best = Some(hit);
            Some(hit.t)
        });
        best
    }

    /// Whether the ray meets any triangle.
    #[must_use]
    pub fn occluded(&self, ray: &Ray) -> bool {
        let shear = Shear::new(ray);
        self.bvh.any_block(ray, |block: u32, ray: &Ray| Some(self.closest_in_block(block, ray, &shear)?.t))
    }

    /// Visits every triangle that the ray meets, in no order.
    pub fn for_each(&self, ray: &Ray, mut visit: impl FnMut(TriangleHit)) {
        let shear = Shear::new(ray);
        self.bvh.closest_block(ray, |block: u32, ray: &Ray| {
            self.blocks[block as usize].for_each(&shear, ray, &mut visit);
            // As if nothing had been hit, so that the search goes on.
            None
        });
    }

    /// The hierarchy, in whose blocks [`Triangles::closest_in_block`] looks.
    #[must_use]
    pub fn bvh(&self) -> &Bvh {
        &self.bvh
    }

    /// The first triangle of one block that the ray meets, given the ray's shear.
    #[inline(always)]
    #[must_use]
    pub fn closest_in_block(&self, block: u32, ray: &Ray, shear: &Shear) -> Option<TriangleHit> {
        self.blocks[block as usize].closest(shear, ray)
    }
}

fn wide(p: [f32; 3]) -> DVec3 {
    DVec3::from_array(p.map(f64::from))
}

/// The box around a triangle; empty if it cannot be hit.
fn bounds(corners: &[[f32; 3]; 3]) -> Aabb {
    let [a, b, c] = corners.map(wide);
    let area = (b - a).cross(c - a).abs().max_element();
    // False for NaN too.
    if area > 0.0 && area < f64::INFINITY { Aabb::around([a, b, c]) } else { Aabb::EMPTY }
}

/// The map that takes a ray to the unit of the `z` axis.
#[derive(Clone, Copy, Debug)]
pub struct Shear {
    /// Which axes become `x, y, z`.
    axes: [usize; 3],
    /// The origin of the ray, on those axes.
    origin: [f64; 3],
    /// `d_x / d_z, d_y / d_z, 1 / d_z`.
    factor: [f64; 3],
}

impl Shear {
    /// The shear of a ray, whatever part of it counts.
    #[inline]
    #[must_use]
    pub fn new(ray: &Ray) -> Self {
        let [x, y, z] = ray.direction.abs().to_array();
        let axes = if x > y && x > z {
            [1, 2, 0]
        } else if y > z {
            [2, 0, 1]
        } else {
            [0, 1, 2]
        };
        let [i, j, k] = axes;
        let (d, o) = (ray.direction, ray.origin);
        let inverse = 1.0 / d[k];
        Self { axes, origin: [o[i], o[j], o[k]], factor: [d[i] * inverse, d[j] * inverse, inverse] }
    }
}

/// One number for each triangle of a block.
type Lanes = [f64; LANES];

/// Up to [`LANES`] triangles; absent ones have all corners in the origin and so no area.
#[derive(Clone, Debug)]
#[repr(C, align(16))]
struct Block {
    /// `corners[corner][axis][lane]`
    corners: [[[f32; LANES]; 3]; 3],
    /// The number of the triangle in each lane.
    triangles: [u32; LANES],
}

/// The sheared corner of each triangle of a block, and its edge functions.
#[derive(Clone, Copy)]
struct Sheared {
    corners: [[Lanes; 3]; 3],
    edges: [Lanes; 3],
}

impl Block {
    fn new(triangles: impl Iterator<Item = (u32, [[f32; 3]; 3])>) -> Self {
        let mut block = Self { corners: [[[0.0; LANES]; 3]; 3], triangles: [0; LANES] };
        for (lane, (number, corners)) in triangles.enumerate() {
            block.triangles[lane] = number;
            for (corner, position) in corners.iter().enumerate() {
                for (axis, &x) in position.iter().enumerate() {
                    block.corners[corner][axis][lane] = x;
                }
            }
        }
        block
    }

    #[inline(always)]
    fn closest(&self, shear: &Shear, ray: &Ray) -> Option<TriangleHit> {
        let mut best: Option<TriangleHit> = None;
        self.for_each(shear, ray, |hit| {
            if best.is_none_or(|best| hit.t < best.t) {
                best = Some(hit);
            }
        });
        best
    }

    /// Visits the triangles that the ray meets.
    #[inline(always)]
    fn for_each(&self, shear: &Shear, ray: &Ray, mut visit: impl FnMut(TriangleHit)) {
        let sheared = self.sheared(shear);
        let mut candidates = sheared.candidates();
        while candidates != 0 {
            let lane = candidates.trailing_zeros() as usize % LANES;
            candidates &= candidates - 1;
            if let Some(hit) = sheared.hit(lane, shear).filter(|hit| ray.contains(hit.t)) {
                visit(TriangleHit { triangle: self.triangles[lane], ..hit });
            }
        }
    }

    #[inline(always)]
    fn sheared(&self, shear: &Shear) -> Sheared {
        let mut corners = [[[0.0; LANES]; 3]; 3];
        for (to, from) in corners.iter_mut().zip(&self.corners) {
            for i in 0..LANES {
                let [x, y, z] = std::array::from_fn(|axis| f64::from(from[shear.axes[axis]][i]) - shear.origin[axis]);
                to[0][i] = x - shear.factor[0] * z;
                to[1][i] = y - shear.factor[1] * z;
                to[2][i] = z;
            }
        }
        let edge = |p: usize, q: usize| -> Lanes {
            let (p, q) = (&corners[p], &corners[q]);
            std::array::from_fn(|i| p[0][i] * q[1][i] - p[1][i] * q[0][i])
        };
        let edges = [edge(1, 2), edge(2, 0), edge(0, 1)];
        Sheared { corners, edges }
    }
}

/// The lesser number, as one instruction.
#[inline(always)]
fn less(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The greater number, as one instruction.
#[inline(always)]
fn more(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

impl Sheared {
    /// The set of lanes, as bits, on none of whose edges the ray is outside.
    #[inline(always)]
    fn candidates(&self) -> u32 {
        let [u, v, w] = &self.edges;
        // Not negative if all three are on the one side or all on the other.
        let inside: Lanes = std::array::from_fn(|i| {
            let least = less(less(u[i], v[i]), w[i]);
            let greatest = more(more(u[i], v[i]), w[i]);
            more(least, -greatest)
        });
        inside.iter().enumerate().fold(0, |set, (lane, &inside)| set | u32::from(inside >= 0.0) << lane)
    }

    /// The hit of a candidate, whose number is yet to be set, unless it is seen exactly edge-on.
    #[inline(always)]
    fn hit(&self, lane: usize, shear: &Shear) -> Option<TriangleHit> {
        let (u, v, w) = (self.edges[0][lane], self.edges[1][lane], self.edges[2][lane]);
        let determinant = u + v + w;
        if determinant == 0.0 {
            return None;
        }
        let at = |corner: usize, axis: usize| self.corners[corner][axis][lane];
        let extent = |corner: usize| at(corner, 0).abs() + at(corner, 1).abs();
        let size = extent(0) + extent(1) + extent(2);
        let mut weights = Weights { a: u / determinant, b: v / determinant, c: w / determinant };
        if determinant.abs() < SLIM * size * size {
            weights = slim_weights([0, 1, 2].map(|corner| DVec2::new(at(corner, 0), at(corner, 1))), weights)?;
        }
        let Weights { a, b, c } = weights;
        let z = a * at(0, 2) + b * at(1, 2) + c * at(2, 2);
        // Adding zero takes the sign from a negative zero.
        Some(TriangleHit { t: z * shear.factor[2] + 0.0, triangle: 0, b1: b + 0.0, b2: c + 0.0 })
    }
}

/// What the corners contribute to a point of the triangle.
#[derive(Clone, Copy)]
struct Weights {
    a: f64,
    b: f64,
    c: f64,
}

/// Below this ratio of (twice) the area to the square of the size, as seen along the ray, the weights of the corners
/// are found with more care: from the edge functions they have errors of some `2^-51` over the ratio.
const SLIM: f64 = 1.0 / 4096.0;

/// The weights of the corners of a triangle that is nearly seen edge-on, given those from the edge functions. `None` if
/// the ray passes in the plane of the triangle but beyond its ends, where the edge functions are noise.
///
/// How far the hit is across the longest edge `pq` then is ill-conditioned (and hardly matters), how far it is along
/// the edge is not: with `h` the fraction of the edge that the ray passes, and `r_along` that of the third corner `r`,
/// the weight of `r` is first brought into the range that the triangle has at `h`, and that of `q` then follows as
/// `h - weight(r) r_along`. The hit is a point of the triangle, and on the ray but for some roundings of its size.
#[cold]
fn slim_weights(corners: [DVec2; 3], Weights { a, b, c }: Weights) -> Option<Weights> {
    let [p, q, r] = corners;
    let (pq, qr, rp) = ((q - p).length_squared(), (r - q).length_squared(), (p - r).length_squared());
    if pq < qr || pq < rp {
        // Turn the triangle until its longest edge comes first.
        let turned = slim_weights([q, r, p], Weights { a: b, b: c, c: a })?;
        return Some(Weights { a: turned.c, b: turned.a, c: turned.b });
    }
    let along = |v: DVec2| v.dot(q - p) / pq;
    let h = along(-p);
    if !(-1e-13..=1.0 + 1e-13).contains(&h) {
        return None;
    }
    let (h, r_along) = (h.clamp(0.0, 1.0), along(r - p).clamp(0.0, 1.0));
    let most = if h < r_along { h / r_along } else { (1.0 - h) / (1.0 - r_along) };
    // Not a number if the ray and `r` are both at the end: then any weight will do.
    let c = c.clamp(0.0, most.min(1.0));
    let b = (h - c * r_along).max(0.0);
    Some(Weights { a: (1.0 - b - c).max(0.0), b, c })
}

#[cfg(test)]
mod tests;
