//! What constructive solid geometry works with: where a line enters and leaves a solid.
//!
//! A solid answers with intervals, not with a first hit, so that union, intersection and difference are algebra on
//! sorted lists. Roth 1982, "Ray Casting for Modeling Solids", Computer Graphics and Image Processing 18(2).
//!
//! **Faces that coincide or touch.** What is thinner than the distance by which rays leave surfaces (some 1e-9 of the
//! coordinates) does not exist: crossings of one line that are closer together happen at once, and only what is
//! different behind all of them counts. So no gap is left between solids that share a face, no skin where one is cut
//! away up to the face of another, and two solids that touch stay apart. Where the faces of two operands coincide on
//! the surface of the result, it is that of the first operand.

use glam::{DVec2, DVec3};
use smallvec::SmallVec;

use super::Hit;
use crate::math::Ray;

/// Where a line enters or leaves a solid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Crossing {
    /// The parameter of the line.
    pub t: f64,
    /// Which face or triangle, as in [`Hit`].
    pub primitive: u32,
    /// Which operand of a csg, as in [`Hit`].
    pub leaf: u32,
}

impl Crossing {
    /// A crossing of a solid that is no csg.
    #[must_use]
    pub fn new(t: f64, primitive: u32) -> Self {
        Self { t, primitive, leaf: 0 }
    }
}

impl From<Crossing> for Hit {
    fn from(Crossing { t, primitive, leaf }: Crossing) -> Self {
        Self { t, primitive, leaf, coordinates: DVec2::ZERO }
    }
}

/// Where a line enters a solid and leaves it, in turn: an even number, in order. It may enter at minus infinity and
/// leave at infinity.
pub type Crossings = SmallVec<[Crossing; 4]>;

/// The crossings of a line that enters and leaves once.
#[inline]
pub(super) fn interval(entry: Crossing, exit: Crossing) -> Crossings {
    Crossings::from_buf_and_len([entry, exit, Crossing::default(), Crossing::default()], 2)
}

/// A whole line, in the space of a solid, with the same parameter as in the world.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// The line in the solid's space; all of it counts.
    pub ray: Ray,
    /// Its origin in the world.
    origin: DVec3,
    /// Its direction in the world.
    direction: DVec3,
}

impl Line {
    /// The line of a ray of the world.
    #[inline]
    #[must_use]
    pub fn new(ray: &Ray) -> Self {
        let Ray { origin, direction, .. } = *ray;
        Self { ray: Ray { t_min: f64::NEG_INFINITY, t_max: f64::INFINITY, ..*ray }, origin, direction }
    }

    /// The same line in a space within this one.
    #[must_use]
    pub fn within(&self, map: impl FnOnce(&Ray) -> Ray) -> Self {
        Self { ray: map(&self.ray), ..*self }
    }

    /// The step of the parameter below which crossings between two others happen at once: no less than rays leave surfaces
    /// by, anywhere between the two.
    #[inline]
    #[must_use]
    pub fn margin(&self, first: f64, last: f64) -> f64 {
        let reach = |t: f64| if t.is_finite() { (self.origin + t * self.direction).abs().max_element() } else { 0.0 };
        let farthest = DVec3::splat(reach(first).max(reach(last)));
        // The greatest component of the direction stands for its length, which is at most √3 times as great.
        Ray::leaving_distance(farthest) / self.direction.abs().max_element()
    }
}

/// What a solid is made of two others by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    /// What is in either.
    Union,
    /// What is in both.
    Intersection,
    /// What is in the first but not in the second.
    Difference,
}

impl Operation {
    /// Whether a point is in the result.
    #[inline]
    #[must_use]
    pub fn holds(self, first: bool, second: bool) -> bool {
        match self {
            Self::Union => first || second,
            Self::Intersection => first && second,
            Self::Difference => first && !second,
        }
    }
}

/// Finds the crossings of a line with the result of an operation, in order, from those with both operands, until `visit`
/// says that it has enough.
#[inline]
pub(super) fn combine(
    operation: Operation,
    first: &[Crossing],
    second: &[Crossing],
    line: &Line,
    mut visit: impl FnMut(Crossing) -> bool,
) {
    let at = |crossings: &[Crossing], i: usize| crossings.get(i).map_or(f64::INFINITY, |crossing| crossing.t);
    let end = |crossings: &[Crossing]| crossings.last().map_or(f64::NEG_INFINITY, |crossing| crossing.t);
    let margin = line.margin(at(first, 0).min(at(second, 0)), end(first).max(end(second)));
    let (mut i, mut j) = (0, 0);
    let mut inside = false;
    while i < first.len() || j < second.len() {
        let end = at(first, i).min(at(second, j)) + margin;
        let before = i;
        while i < first.len() && first[i].t <= end {
            i += 1;
        }
        while j < second.len() && second[j].t <= end {
            j += 1;
        }
        let now = operation.holds(i % 2 == 1, j % 2 == 1);
        if now != inside {
            // The last crossing of an operand of which the line has changed sides: of the first, if it is one.
            let crossing = if (i - before) % 2 == 1 { first[i - 1] } else { second[j - 1] };
            if visit(crossing) {
                return;
            }
            inside = now;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crossings(ts: &[f64], leaf: u32) -> Crossings {
        ts.iter().map(|&t| Crossing { t, primitive: 0, leaf }).collect()
    }

    fn combined(operation: Operation, first: &[f64], second: &[f64]) -> Vec<(f64, u32)> {
        let line = Line::new(&Ray::new(DVec3::ZERO, DVec3::X));
        let mut found = Vec::new();
        combine(operation, &crossings(first, 0), &crossings(second, 1), &line, |crossing| {
            found.push((crossing.t, crossing.leaf));
            false
        });
        found
    }

    const INF: f64 = f64::INFINITY;

    #[test]
    fn intervals_that_overlap() {
        assert_eq!(combined(Operation::Union, &[1.0, 3.0], &[2.0, 4.0]), [(1.0, 0), (4.0, 1)]);
        assert_eq!(combined(Operation::Intersection, &[1.0, 3.0], &[2.0, 4.0]), [(2.0, 1), (3.0, 0)]);
        assert_eq!(combined(Operation::Difference, &[1.0, 3.0], &[2.0, 4.0]), [(1.0, 0), (2.0, 1)]);
        let drilled = combined(Operation::Difference, &[1.0, 4.0], &[2.0, 3.0]);
        assert_eq!(drilled, [(1.0, 0), (2.0, 1), (3.0, 1), (4.0, 0)]);
    }

    #[test]
    fn half_spaces_reach_to_infinity() {
        assert_eq!(combined(Operation::Intersection, &[-INF, 2.0], &[1.0, INF]), [(1.0, 1), (2.0, 0)]);
        assert_eq!(combined(Operation::Union, &[-INF, 2.0], &[1.0, INF]), [(-INF, 0), (INF, 1)]);
        let without = combined(Operation::Difference, &[-INF, INF], &[1.0, 2.0]);
        assert_eq!(without, [(-INF, 0), (1.0, 1), (2.0, 1), (INF, 0)]);
    }

    /// Rounding puts what is meant to coincide on either side.
    #[test]
    fn coincident_faces_leave_neither_gap_nor_skin() {
        for error in [-1e-12, 0.0, 1e-12] {
            assert_eq!(combined(Operation::Union, &[1.0, 2.0], &[2.0 + error, 3.0]), [(1.0, 0), (3.0, 1)]);
            assert_eq!(combined(Operation::Intersection, &[1.0, 2.0], &[2.0 + error, 3.0]), []);
            assert_eq!(combined(Operation::Difference, &[1.0, 2.0], &[1.0 + error, 2.0 - error]), []);
            assert_eq!(combined(Operation::Difference, &[1.0, 3.0], &[2.0, 3.0 + error]), [(1.0, 0), (2.0, 1)]);
            // A face of the result that both operands have is the first one's.
            assert_eq!(combined(Operation::Union, &[1.0, 2.0], &[1.0 + error, 3.0]), [(1.0, 0), (3.0, 1)]);
        }
    }

    #[test]
    fn the_margin_is_a_distance_in_the_world() {
        let long = Line::new(&Ray::new(DVec3::ZERO, 1e6 * DVec3::X));
        assert!((long.margin(0.0, 0.0) - 1e-15).abs() < 1e-24);
        assert!((long.margin(0.0, 1e-6) - 2e-15).abs() < 1e-24);
        assert!((long.margin(-INF, INF) - 1e-15).abs() < 1e-24);
    }
}
