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

use glam::DVec3;
use smallvec::SmallVec;

use super::Hit;
use crate::math::Ray;

/// Where a line enters a solid and leaves it, in turn: an even number, in order. It may enter at minus infinity and
/// leave at infinity.
pub type Crossings = SmallVec<[Hit; 4]>;

/// A whole line, in the space of a solid, with the same parameter as in the world.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// The line in the solid's space; all of it counts.
    pub ray: Ray,
    /// Its origin in the world.
    origin: DVec3,
    /// Its direction in the world.
    direction: DVec3,
    /// One over the length of that.
    inverse_length: f64,
}

impl Line {
    /// The line of a ray of the world.
    #[must_use]
    pub fn new(ray: &Ray) -> Self {
        let Ray { origin, direction, .. } = *ray;
        let whole = Ray { t_min: f64::NEG_INFINITY, t_max: f64::INFINITY, ..*ray };
        Self { ray: whole, origin, direction, inverse_length: direction.length_recip() }
    }

    /// The same line in a space within this one.
    #[must_use]
    pub fn within(&self, map: impl FnOnce(&Ray) -> Ray) -> Self {
        Self { ray: map(&self.ray), ..*self }
    }

    /// The step of the parameter below which two crossings near `t` happen at once.
    #[inline]
    #[must_use]
    pub fn margin(&self, t: f64) -> f64 {
        if t.is_infinite() {
            return 0.0;
        }
        Ray::leaving_distance(self.origin + t * self.direction) * self.inverse_length
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
    #[must_use]
    pub fn holds(self, first: bool, second: bool) -> bool {
        match self {
            Self::Union => first || second,
            Self::Intersection => first && second,
            Self::Difference => first && !second,
        }
    }
}

/// The crossings of a line with the result of an operation, from those with both operands.
#[inline]
#[must_use]
pub(super) fn combine(operation: Operation, first: &[Hit], second: &[Hit], line: &Line) -> Crossings {
    let mut result = Crossings::new();
    let (mut i, mut j) = (0, 0);
    let mut inside = false;
    while i < first.len() || j < second.len() {
        let next = |hits: &[Hit], at: usize| hits.get(at).map_or(f64::INFINITY, |hit| hit.t);
        let t = next(first, i).min(next(second, j));
        let end = t + line.margin(t);
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
            result.push(if (i - before) % 2 == 1 { first[i - 1] } else { second[j - 1] });
            inside = now;
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;

    fn hits(ts: &[f64], leaf: u32) -> Crossings {
        ts.iter().map(|&t| Hit { leaf, ..Hit::new(t, 0, DVec2::ZERO) }).collect()
    }

    fn combined(operation: Operation, first: &[f64], second: &[f64]) -> Vec<(f64, u32)> {
        let line = Line::new(&Ray::new(DVec3::ZERO, DVec3::X));
        let found = combine(operation, &hits(first, 0), &hits(second, 1), &line);
        found.into_iter().map(|hit| (hit.t, hit.leaf)).collect()
    }

    const INF: f64 = f64::INFINITY;

    #[test]
    fn intervals_that_overlap() {
        assert_eq!(combined(Operation::Union, &[1.0, 3.0], &[2.0, 4.0]), [(1.0, 0), (4.0, 1)]);
        assert_eq!(combined(Operation::Intersection, &[1.0, 3.0], &[2.0, 4.0]), [(2.0, 1), (3.0, 0)]);
        assert_eq!(combined(Operation::Difference, &[1.0, 3.0], &[2.0, 4.0]), [(1.0, 0), (2.0, 1)]);
        assert_eq!(combined(Operation::Difference, &[1.0, 4.0], &[2.0, 3.0]), [(1.0, 0), (2.0, 1), (3.0, 1), (4.0, 0)]);
    }

    #[test]
    fn half_spaces_reach_to_infinity() {
        assert_eq!(combined(Operation::Intersection, &[-INF, 2.0], &[1.0, INF]), [(1.0, 1), (2.0, 0)]);
        assert_eq!(combined(Operation::Union, &[-INF, 2.0], &[1.0, INF]), [(-INF, 0), (INF, 1)]);
        assert_eq!(
            combined(Operation::Difference, &[-INF, INF], &[1.0, 2.0]),
            [(-INF, 0), (1.0, 1), (2.0, 1), (INF, 0)]
        );
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
        assert!((long.margin(0.0) - 1e-15).abs() < 1e-24);
        assert!((long.margin(1e-6) - 2e-15).abs() < 1e-24);
    }
}
