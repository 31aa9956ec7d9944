use glam::{DAffine3, DVec3};

/// A half-line `origin + t * direction`, of which the part `t_min < t < t_max` counts.
///
/// The direction need not have unit length: a ray keeps its parameter `t` when an affine map takes it into a shape's
/// own space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where `t = 0`.
    pub origin: DVec3,
    /// Where the ray goes; finite and not zero.
    pub direction: DVec3,
    /// Hits at or before this parameter do not count.
    pub t_min: f64,
    /// Hits at or beyond this parameter do not count.
    pub t_max: f64,
}

impl Ray {
    /// The whole half-line from `origin`.
    #[must_use]
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        Self { origin, direction, t_min: 0.0, t_max: f64::INFINITY }
    }

    /// A ray that leaves a surface at `origin`: the surface itself, which rounding puts up to a few ulp away, is not
    /// hit again.
    #[must_use]
    pub fn leaving(origin: DVec3, direction: DVec3) -> Self {
        Self { t_min: Self::leaving_distance(origin), ..Self::new(origin, direction) }
    }

    /// The ray from a surface point to another one, both of them left out: what a visibility test asks for.
    /// The parameter is the fraction of the way.
    #[must_use]
    pub fn between(origin: DVec3, target: DVec3) -> Self {
        let direction = target - origin;
        let margin = Self::leaving_distance(origin).max(Self::leaving_distance(target)) / direction.length();
        Self { origin, direction, t_min: margin, t_max: 1.0 - margin }
    }

    /// The point at parameter `t`.
    #[inline(always)]
    #[must_use]
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + t * self.direction
    }

    /// The same ray seen from another space, with the same parameter `t`.
    #[inline(always)]
    #[must_use]
    pub fn transformed(&self, map: &DAffine3) -> Self {
        Self { origin: map.transform_point3(self.origin), direction: map.transform_vector3(self.direction), ..*self }
    }

    /// Whether a hit at `t` counts.
    #[inline(always)]
    #[must_use]
    pub fn contains(&self, t: f64) -> bool {
        self.t_min < t && t < self.t_max
    }

    /// [`Ray::leaving_distance`] over the greatest coordinate. Rounding leaves a computed hit within some 1e-15 of the
    /// scene's coordinates of the true one; 1e-9 covers rays that graze at 1e-6 radians.
    pub const LEAVING: f64 = 1e-9;

    /// How far along a ray a hit must lie to be another surface than the one it left at `p`.
    #[inline]
    #[must_use]
    pub fn leaving_distance(p: DVec3) -> f64 {
        Self::LEAVING * (1.0 + p.abs().max_element())
    }
}
