use glam::{DAffine3, DVec3};

use super::Ray;

/// An axis-aligned bounding box. It is closed, and empty if `min > max` on an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// The corner with the least coordinates.
    pub min: DVec3,
    /// The corner with the greatest coordinates.
    pub max: DVec3,
}

impl Aabb {
    /// The box without points: the neutral element of [`Aabb::union`].
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// All of space.
    pub const EVERYTHING: Self = Self { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY };

    /// The smallest box that contains all of the points.
    pub fn around(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::including)
    }

    /// The smallest box that contains this box and the point `p`.
    #[must_use]
    pub fn including(self, p: DVec3) -> Self {
        Self { min: self.min.min(p), max: self.max.max(p) }
    }

    /// The smallest box that contains both boxes.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The points that both boxes contain.
    #[must_use]
    pub fn intersection(self, other: Self) -> Self {
        Self { min: self.min.max(other.min), max: self.max.min(other.max) }
    }

    /// Whether the box contains no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// The centre of the box.
    #[must_use]
    pub fn centre(&self) -> DVec3 {
        0.5 * (self.min + self.max)
    }

    /// The edge lengths along x, y and z.
    #[must_use]
    pub fn extent(&self) -> DVec3 {
        self.max - self.min
    }

    /// The eight corners.
    #[must_use]
    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            let pick = |bit: usize, axis: usize| if i >> bit & 1 == 1 { self.max[axis] } else { self.min[axis] };
            DVec3::new(pick(0, 0), pick(1, 1), pick(2, 2))
        })
    }

    /// A box around the image of this box under an affine map. An infinite box gives [`Aabb::EVERYTHING`].
    #[must_use]
    pub fn transformed(&self, map: &DAffine3) -> Self {
        if !self.min.is_finite() || !self.max.is_finite() {
            return Self::EVERYTHING;
        }
        Self::around(self.corners().map(|c| map.transform_point3(c)))
    }

    /// The centre and the radius of the sphere through the corners.
    #[must_use]
    pub fn bounding_sphere(&self) -> (DVec3, f64) {
        (self.centre(), 0.5 * self.extent().length())
    }

    /// Whether the box contains the point `p`.
    #[inline]
    #[must_use]
    pub fn contains(&self, p: DVec3) -> bool {
        (self.min.cmple(p) & p.cmple(self.max)).all()
    }

    /// The parameters at which the line of a ray enters and leaves the box, each with the face that it crosses there.
    /// The face index is `2 axis + side`; `side` is 0 at `min` and 1 at `max`. The ray's `t_min` and `t_max` are
    /// ignored.
    ///
    /// A line is inside the box between the last entry into one of the three slabs and the first exit from one.
    #[inline]
    #[must_use]
    pub fn cross(&self, ray: &Ray) -> Option<[(f64, usize); 2]> {
        let (mut entry, mut exit) = ((f64::NEG_INFINITY, 0), (f64::INFINITY, 0));
        for axis in 0..3 {
            let (o, d) = (ray.origin[axis], ray.direction[axis]);
            let (min, max) = (self.min[axis], self.max[axis]);
            if d == 0.0 {
                if o < min || o > max {
                    return None;
                }
                continue;
            }
            // A line along +axis enters the slab through its lower face.
            let down = usize::from(d < 0.0);
            let [near, far] = if d < 0.0 { [max, min] } else { [min, max] };
            let (t_near, t_far) = ((near - o) / d, (far - o) / d);
            if t_near > entry.0 {
                entry = (t_near, 2 * axis + down);
            }
            if t_far < exit.0 {
                exit = (t_far, 2 * axis + 1 - down);
            }
        }
        (entry.0 <= exit.0).then_some([entry, exit])
    }
}
