//! Intersection of a ray with many triangles.
//!
//! **Test.** The watertight test of Woop, Benthin & Wald (2013), "Watertight ray/triangle intersection", JCGT 2(1). Let
//! `z` be the axis on which the direction is greatest. A shear maps the ray to the `z` axis. The signs of the three
//! edge functions `P.x Q.y - P.y Q.x` of the sheared corners determine whether the axis passes through the triangle.
//!
//! **Watertightness.** A sheared corner depends only on the corner and the ray, so it is the same for all triangles
//! that share the corner. Exchanging `P` and `Q` negates the edge function exactly. Rounding is monotone, so the
//! difference of two rounded products never has the wrong sign: its sign is right or it is zero, and zero counts as
//! inside for both neighbours. Hence there is no gap at a shared edge or corner, and no fallback to higher precision is
//! needed.
//!
//! **Exclusions.** Triangles of exactly zero area, as computed in `f64` from the `f32` corners, and triangles with a
//! corner that is not finite cannot be hit. A hit on a triangle that is exactly edge-on is left to its neighbours. A
//! triangle that is edge-on up to rounding is hit where the ray passes its longest edge, see `slim_weights`.

use glam::{DVec2, DVec3};

use crate::math::{Aabb, Ray};
use crate::shape::bvh::Bvh;

/// The number of triangles that are tested at once.
const LANES: usize = 4;

/// Triangles with a hierarchy over them. Rays hit them from both sides.
///
/// Corners are stored as `f32`. All arithmetic is `f64`.
#[derive(Clone, Debug)]
pub struct Triangles {
    positions: Vec<[f32; 3]>,
    indices: Vec<[u32; 3]>,
    bvh: Bvh,
    /// Copies of the corners, in the blocks of the hierarchy.
    blocks: Vec<Block>,
}

/// The intersection of a ray with a triangle, at the point `(1 - b1 - b2) a + b1 b + b2 c` of its corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleHit {
    /// The parameter of the ray.
    pub t: f64,
    /// The index of the triangle in [`Triangles::indices`].
    pub triangle: u32,
    /// The barycentric coordinate of the second corner.
    pub b1: f64,
    /// The barycentric coordinate of the third corner.
    pub b2: f64,
}

impl Triangles {
    /// Builds the hierarchy. Each triangle is given by the indices of its corners in `positions`.
    ///
    /// # Panics
    /// An index is out of range.
    #[must_use]
    pub fn new(positions: Vec<[f32; 3]>, indices: Vec<[u32; 3]>) -> Self {
        let corners = |i: &[u32; 3]| i.map(|k| positions[k as usize]);
        let bounds = indices.iter().map(|i| bounds(&corners(i)));
        let bvh = Bvh::build_in_blocks(bounds, LANES);
        let fill = |block| Block::new(bvh.block(block).iter().map(|&i| (i, corners(&indices[i as usize]))));
        let blocks = (0..bvh.block_count() as u32).map(fill).collect();
        Self { positions, indices, bvh, blocks }
    }

    /// The positions of the corners.
    #[must_use]
    pub fn positions(&self) -> &[[f32; 3]] {
        &self.positions
    }

    /// The indices of the corners of each triangle.
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

    /// The bounding box of all triangles that can be hit.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bvh.bounds()
    }

    /// The memory of the triangles and their hierarchy, in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.positions) + size_of_val(&*self.indices) + size_of_val(&*self.blocks) + self.bvh.bytes()
    }

    /// The closest hit of the ray.
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

    /// Whether the ray hits any triangle.
    #[must_use]
    pub fn occluded(&self, ray: &Ray) -> bool {
        let shear = Shear::new(ray);
        self.bvh.any_block(ray, |block: u32, ray: &Ray| Some(self.closest_in_block(block, ray, &shear)?.t))
    }

    /// Visits every hit of the ray, in no particular order.
    pub fn for_each(&self, ray: &Ray, mut visit: impl FnMut(TriangleHit)) {
        let shear = Shear::new(ray);
        self.bvh.closest_block(ray, |block: u32, ray: &Ray| {
            self.blocks[block as usize].for_each(&shear, ray, &mut visit);
            // Report no hit, so that the traversal continues.
            None
        });
    }

    /// The hierarchy, whose blocks [`Triangles::closest_in_block`] intersects.
    #[must_use]
    pub fn bvh(&self) -> &Bvh {
        &self.bvh
    }

    /// The closest hit of the ray with one block, given the ray's shear.
    #[inline(always)]
    #[must_use]
    pub fn closest_in_block(&self, block: u32, ray: &Ray, shear: &Shear) -> Option<TriangleHit> {
        self.blocks[block as usize].closest(shear, ray)
    }
}

fn wide(p: [f32; 3]) -> DVec3 {
    DVec3::from_array(p.map(f64::from))
}

/// The bounding box of a triangle, empty if it cannot be hit.
fn bounds(corners: &[[f32; 3]; 3]) -> Aabb {
    let [a, b, c] = corners.map(wide);
    let area = (b - a).cross(c - a).abs().max_element();
    // The comparison is false for NaN.
    if area > 0.0 && area < f64::INFINITY { Aabb::around([a, b, c]) } else { Aabb::EMPTY }
}

/// The map that takes the origin of a ray to 0 and its direction to the unit vector of the `z` axis.
#[derive(Clone, Copy, Debug)]
pub struct Shear {
    /// The axes that become `x, y, z`.
    axes: [usize; 3],
    /// The origin of the ray on those axes.
    origin: [f64; 3],
    /// `d_x / d_z, d_y / d_z, 1 / d_z`.
    factor: [f64; 3],
}

impl Shear {
    /// The shear of a ray. It does not depend on `t_min` and `t_max`.
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

/// A number for each triangle of a block.
type Lanes = [f64; LANES];

/// Up to [`LANES`] triangles. In unused lanes all corners are at the origin, so that their area is zero.
#[derive(Clone, Debug)]
#[repr(C, align(16))]
struct Block {
    /// `corners[corner][axis][lane]`
    corners: [[[f32; LANES]; 3]; 3],
    /// The index of the triangle in each lane.
    triangles: [u32; LANES],
}

/// The sheared corners of the triangles of a block, and their edge functions.
#[derive(Clone, Copy)]
struct Sheared {
    /// `corners[corner][axis][lane]`
    corners: [[Lanes; 3]; 3],
    /// The edge opposite to each corner.
    edges: [Lanes; 3],
}

impl Block {
    fn new(triangles: impl Iterator<Item = (u32, [[f32; 3]; 3])>) -> Self {
        let mut block = Self { corners: [[[0.0; LANES]; 3]; 3], triangles: [0; LANES] };
        for (lane, (index, corners)) in triangles.enumerate() {
            block.triangles[lane] = index;
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

    /// Visits the hits of the ray.
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

/// The minimum, as a single instruction.
#[inline(always)]
fn min(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The maximum, as a single instruction.
#[inline(always)]
fn max(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

impl Sheared {
    /// The set of lanes, as bits, whose triangle the ray may hit: it is outside of no edge.
    #[inline(always)]
    fn candidates(&self) -> u32 {
        let [u, v, w] = &self.edges;
        // Not negative if no two edge functions have opposite signs.
        let inside: Lanes = std::array::from_fn(|i| {
            let least = min(min(u[i], v[i]), w[i]);
            let greatest = max(max(u[i], v[i]), w[i]);
            max(least, -greatest)
        });
        inside.iter().enumerate().fold(0, |set, (lane, &inside)| set | u32::from(inside >= 0.0) << lane)
    }

    /// The hit of a candidate, or `None` if it is exactly edge-on. The caller sets the index of the triangle.
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
        // Adding zero turns -0 into +0.
        Some(TriangleHit { t: z * shear.factor[2] + 0.0, triangle: 0, b1: b + 0.0, b2: c + 0.0 })
    }
}

/// The barycentric coordinates of a point of the triangle.
#[derive(Clone, Copy)]
struct Weights {
    a: f64,
    b: f64,
    c: f64,
}

/// If the ratio of twice the area to the square of the size, both projected along the ray, is below this,
/// `slim_weights` computes the barycentric coordinates: from the edge functions they would have errors of about `2^-51`
/// over the ratio.
const SLIM: f64 = 1.0 / 4096.0;

/// The barycentric coordinates for a triangle that is nearly edge-on, given those from the edge functions. `None` if
/// the ray passes in the plane of the triangle but beyond its ends, where the edge functions are noise.
///
/// The position of the hit across the longest edge `pq` is ill-conditioned (and hardly matters); its position along the
/// edge is not. Let `h` be the fraction of the edge at which the ray passes it, and `r_along` the fraction of the third
/// corner `r`. The weight of `r` is first clamped to the range that the triangle has at `h`. The weight of `q` is then
/// `h - weight(r) r_along`. The hit is a point of the triangle, and on the ray up to a few roundings of the triangle's
/// size.
#[cold]
fn slim_weights(corners: [DVec2; 3], Weights { a, b, c }: Weights) -> Option<Weights> {
    let [p, q, r] = corners;
    let (pq, qr, rp) = ((q - p).length_squared(), (r - q).length_squared(), (p - r).length_squared());
    if pq < qr || pq < rp {
        // Rotate the corners until the longest edge comes first.
        let rotated = slim_weights([q, r, p], Weights { a: b, b: c, c: a })?;
        return Some(Weights { a: rotated.c, b: rotated.a, c: rotated.b });
    }
    let along = |v: DVec2| v.dot(q - p) / pq;
    let h = along(-p);
    if !(-1e-13..=1.0 + 1e-13).contains(&h) {
        return None;
    }
    let (h, r_along) = (h.clamp(0.0, 1.0), along(r - p).clamp(0.0, 1.0));
    let max_c = if h < r_along { h / r_along } else { (1.0 - h) / (1.0 - r_along) };
    // `max_c` is NaN if the ray and `r` are both at the end of the edge: then any weight is correct.
    let c = c.clamp(0.0, max_c.min(1.0));
    let b = (h - c * r_along).max(0.0);
    Some(Weights { a: (1.0 - b - c).max(0.0), b, c })
}

#[cfg(test)]
mod tests;
