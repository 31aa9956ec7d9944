//! The crossings of a line with solids, on which constructive solid geometry is built.
//!
//! A solid returns the intervals of a line, not its first hit, so that union, intersection and difference are
//! operations on sorted lists. Roth 1982, "Ray Casting for Modeling Solids", Computer Graphics and Image Processing
//! 18(2).
//!
//! **Faces that coincide or touch.** Details thinner than the offset of spawned rays (about 1e-9 of the coordinates)
//! vanish: crossings of a line that are closer together are treated as simultaneous, and only the difference between
//! the states before and after all of them counts. Hence solids that share a face have no gap between them, subtracting
//! a solid up to the face of another leaves no skin, and two solids that touch do not overlap. Where the faces of two
//! operands coincide on the surface of the result, the surface belongs to the first operand.

use glam::DVec2;
use smallvec::SmallVec;

use super::Hit;
use crate::math::Ray;

/// A point at which a line enters or leaves a solid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Crossing {
    /// The parameter of the line.
    pub t: f64,
    /// The index of the face or triangle, as in [`Hit`].
    pub primitive: u32,
    /// The index of the operand of a csg, as in [`Hit`].
    pub operand_index: u32,
}

impl Crossing {
    /// A crossing with a solid that is not a csg.
    #[must_use]
    pub fn new(t: f64, primitive: u32) -> Self {
        Self { t, primitive, operand_index: 0 }
    }
}

impl From<Crossing> for Hit {
    fn from(Crossing { t, primitive, operand_index }: Crossing) -> Self {
        Self { t, primitive, operand_index, coordinates: DVec2::ZERO }
    }
}

/// All crossings of a line with a solid, sorted by parameter. Their number is even, and they alternate between entering
/// and leaving. The first may be at minus infinity, the last at infinity.
pub type Crossings = SmallVec<[Crossing; 4]>;

/// The two crossings of a line with a convex solid: it enters at the first and leaves at the second.
pub type Span = [Crossing; 2];

/// An infinite line in the space of a solid, with the same parameter as in the world.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// The line in the solid's space, with infinite `t_min` and `t_max`.
    pub ray: Ray,
    /// The offset of rays that are spawned at the line's origin in the world, as an interval of the parameter.
    margin: f64,
}

impl Line {
    /// The line of a ray in world space.
    #[inline]
    #[must_use]
    pub fn new(ray: &Ray) -> Self {
        let whole = Ray { t_min: f64::NEG_INFINITY, t_max: f64::INFINITY, ..*ray };
        // The greatest component of the direction approximates its length, which is at most √3 times as great.
        Self { ray: whole, margin: Ray::leaving_distance(ray.origin) / ray.direction.abs().max_element() }
    }

    /// The same line in a nested space, where its ray is `ray`.
    #[inline]
    #[must_use]
    pub fn within(&self, ray: Ray) -> Self {
        Self { ray, ..*self }
    }

    /// The interval of the parameter after `t` within which crossings are simultaneous with a crossing at `t`. It is at
    /// least the offset of rays spawned there, since no coordinate changes faster than the greatest component of the
    /// direction. It is 0 if `t` is infinite.
    #[inline]
    #[must_use]
    pub fn margin(&self, t: f64) -> f64 {
        if t.abs() < f64::INFINITY { self.margin + Ray::LEAVING * t.abs() } else { 0.0 }
    }
}

/// A set operation on two solids.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    /// The points in either solid.
    Union,
    /// The points in both solids.
    Intersection,
    /// The points in the first solid but not in the second.
    Difference,
}

impl Operation {
    /// Whether a point is in the result, given whether it is in the first and in the second operand.
    #[inline]
    #[must_use]
    pub fn contains(self, first: bool, second: bool) -> bool {
        match self {
            Self::Union => first || second,
            Self::Intersection => first && second,
            Self::Difference => first && !second,
        }
    }
}

/// Visits the crossings of a line with the result of an operation, in order, until `visit` returns true. `first` and
/// `second` are the crossings with the two operands.
#[inline]
pub(super) fn combine(
    operation: Operation,
    first: &[Crossing],
    second: &[Crossing],
    line: &Line,
    mut visit: impl FnMut(Crossing) -> bool,
) {
    let at = |crossings: &[Crossing], i: usize| crossings.get(i).map_or(f64::INFINITY, |crossing| crossing.t);
    let (mut i, mut j) = (0, 0);
    let mut was_inside = false;
    while i < first.len() || j < second.len() {
        let t = at(first, i).min(at(second, j));
        let end = t + line.margin(t);
        let i_before = i;
        while i < first.len() && first[i].t <= end {
            i += 1;
        }
        while j < second.len() && second[j].t <= end {
            j += 1;
        }
        let is_inside = operation.contains(i % 2 == 1, j % 2 == 1);
        if is_inside != was_inside {
            // The last crossing with an operand that the line has entered or left, preferably the first operand.
            let crossing = if (i - i_before) % 2 == 1 { first[i - 1] } else { second[j - 1] };
            if visit(crossing) {
                return;
            }
            was_inside = is_inside;
        }
    }
}

/// [`combine`] for two convex solids: without loops, and without branches that are hard to predict.
#[inline(always)]
pub(super) fn combine_spans(
    operation: Operation,
    first: Option<Span>,
    second: Option<Span>,
    line: &Line,
    mut visit: impl FnMut(Crossing) -> bool,
) {
    let (Some(a), Some(b)) = (first, second) else {
        let kept = match operation {
            Operation::Union => first.or(second),
            Operation::Intersection => None,
            Operation::Difference => first,
        };
        kept.into_iter().flatten().any(visit);
        return;
    };
    let is_before = |one: Crossing, other: Crossing| one.t + line.margin(one.t) < other.t;
    // Indexing instead of a branch.
    let pick = |other: bool, end: usize| [a[end], b[end]][usize::from(other)];
    match operation {
        Operation::Intersection => {
            let (entry, exit) = (pick(is_before(a[0], b[0]), 0), pick(is_before(b[1], a[1]), 1));
            let _ = is_before(entry, exit) && (visit(entry) || visit(exit));
        }
        Operation::Union if is_before(a[1], b[0]) => drop([a, b].into_iter().flatten().any(visit)),
        Operation::Union if is_before(b[1], a[0]) => drop([b, a].into_iter().flatten().any(visit)),
        Operation::Union => {
            let _ = visit(pick(is_before(b[0], a[0]), 0)) || visit(pick(is_before(a[1], b[1]), 1));
        }
        Operation::Difference if !is_before(b[0], a[1]) || !is_before(a[0], b[1]) => {
            let _ = visit(a[0]) || visit(a[1]);
        }
        Operation::Difference => {
            let _ = is_before(a[0], b[0]) && (visit(a[0]) || visit(b[0]))
                || is_before(b[1], a[1]) && (visit(b[1]) || visit(a[1]));
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;

    fn crossings(ts: &[f64], operand_index: u32) -> Crossings {
        ts.iter().map(|&t| Crossing { t, primitive: 0, operand_index }).collect()
    }

    fn combined(operation: Operation, first: &[f64], second: &[f64]) -> Vec<(f64, u32)> {
        let line = Line::new(&Ray::new(DVec3::ZERO, DVec3::X));
        let mut found = Vec::new();
        combine(operation, &crossings(first, 0), &crossings(second, 1), &line, |crossing| {
            found.push((crossing.t, crossing.operand_index));
            false
        });
        found
    }

    proptest! {
        /// Integer ends, so that many coincide, exactly or up to rounding; some spans are half-spaces.
        #[test]
        fn spans_combine_as_lists_do(
            first in prop::option::of((-8..7_i32, 2..9_i32)),
            second in prop::option::of((-8..7_i32, 2..9_i32)),
            error in prop::sample::select(vec![-1e-12, 0.0, 1e-12]),
        ) {
            let end = |t: i32| match t { ..-7 => -INF, 8.. => INF, t => f64::from(t) };
            let of = |span: Option<(i32, i32)>, operand_index, error: f64| {
                span.map(|(from, length)| [end(from) + error, end(from + length)].map(|t| Crossing { t, primitive: 0, operand_index }))
            };
            let (a, b) = (of(first, 0, 0.0), of(second, 1, error));
            let line = Line::new(&Ray::new(DVec3::ZERO, DVec3::X));
            let list = |span: Option<Span>| span.map_or(Vec::new(), |span| span.to_vec());
            for operation in [Operation::Union, Operation::Intersection, Operation::Difference] {
                let mut expected = Vec::new();
                combine(operation, &list(a), &list(b), &line, |crossing| {
                    expected.push(crossing);
                    false
                });
                let mut found = Vec::new();
                combine_spans(operation, a, b, &line, |crossing| {
                    found.push(crossing);
                    false
                });
                prop_assert_eq!(found, expected, "{:?}", operation);
            }
        }
    }

    /// Such a crossing comes from a plane that is parallel to the line up to rounding.
    #[test]
    fn a_distant_crossing_does_not_widen_the_margin_of_others() {
        assert_eq!(combined(Operation::Intersection, &[1.0, 2.0], &[-INF, 1e16]), [(1.0, 0), (2.0, 0)]);
        let line = Line::new(&Ray::new(DVec3::ZERO, DVec3::X));
        let span = |from: f64, to: f64| Some([Crossing::new(from, 0), Crossing::new(to, 0)]);
        let mut found = Vec::new();
        combine_spans(Operation::Intersection, span(1.0, 2.0), span(-1e16, 1e16), &line, |crossing| {
            found.push(crossing.t);
            false
        });
        assert_eq!(found, [1.0, 2.0]);
    }

    const INF: f64 = f64::INFINITY;

    #[test]
    fn overlapping_intervals_are_combined() {
        assert_eq!(combined(Operation::Union, &[1.0, 3.0], &[2.0, 4.0]), [(1.0, 0), (4.0, 1)]);
        assert_eq!(combined(Operation::Intersection, &[1.0, 3.0], &[2.0, 4.0]), [(2.0, 1), (3.0, 0)]);
        assert_eq!(combined(Operation::Difference, &[1.0, 3.0], &[2.0, 4.0]), [(1.0, 0), (2.0, 1)]);
        let drilled = combined(Operation::Difference, &[1.0, 4.0], &[2.0, 3.0]);
        assert_eq!(drilled, [(1.0, 0), (2.0, 1), (3.0, 1), (4.0, 0)]);
    }

    #[test]
    fn half_spaces_extend_to_infinity() {
        assert_eq!(combined(Operation::Intersection, &[-INF, 2.0], &[1.0, INF]), [(1.0, 1), (2.0, 0)]);
        assert_eq!(combined(Operation::Union, &[-INF, 2.0], &[1.0, INF]), [(-INF, 0), (INF, 1)]);
        let without = combined(Operation::Difference, &[-INF, INF], &[1.0, 2.0]);
        assert_eq!(without, [(-INF, 0), (1.0, 1), (2.0, 1), (INF, 0)]);
    }

    /// Rounding may put coincident faces in either order.
    #[test]
    fn coincident_faces_leave_neither_gap_nor_skin() {
        for error in [-1e-12, 0.0, 1e-12] {
            assert_eq!(combined(Operation::Union, &[1.0, 2.0], &[2.0 + error, 3.0]), [(1.0, 0), (3.0, 1)]);
            assert_eq!(combined(Operation::Intersection, &[1.0, 2.0], &[2.0 + error, 3.0]), []);
            assert_eq!(combined(Operation::Difference, &[1.0, 2.0], &[1.0 + error, 2.0 - error]), []);
            assert_eq!(combined(Operation::Difference, &[1.0, 3.0], &[2.0, 3.0 + error]), [(1.0, 0), (2.0, 1)]);
            // A face that both operands share belongs to the first.
            assert_eq!(combined(Operation::Union, &[1.0, 2.0], &[1.0 + error, 3.0]), [(1.0, 0), (3.0, 1)]);
        }
    }

    #[test]
    fn the_margin_is_a_world_distance() {
        let ray = Ray::new(DVec3::new(3.0, -7.0, 5.0), 1e6 * DVec3::X);
        assert_eq!(Line::new(&ray).margin(INF), 0.0);
        for t in [0.0, 1e-6, -3e-5] {
            let leaving = Ray::leaving_distance(ray.at(t)) / 1e6;
            let margin = Line::new(&ray).margin(t);
            assert!((leaving..4.0 * leaving).contains(&margin), "{margin} at {t}, not {leaving}");
        }
    }
}
