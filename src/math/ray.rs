use glam::{DAffine3, DVec3};

/// A half-line `origin + t * direction`, restricted to `t_min < t < t_max`.
///
/// The direction may have any length but 0, so that an affine map of a ray into a shape's own space keeps its parameter `t`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// The point at `t = 0`.
    pub origin: DVec3,
    /// The direction; finite and not zero.
    pub direction: DVec3,
    /// Hits at or before this parameter are ignored.
    pub t_min: f64,
    /// Hits at or beyond this parameter are ignored.
    pub t_max: f64,
}

impl Ray {
    /// The whole half-line from `origin`.
    #[must_use]
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        Self { origin, direction, t_min: 0.0, t_max: f64::INFINITY }
    }

    /// A ray that leaves a surface at `origin`. It starts at a relative offset of [`Ray::LEAVING`] along its direction, so that
    /// it does not hit the surface itself, which rounding may put a few ulp away.
    #[must_use]
    pub fn leaving(origin: DVec3, direction: DVec3) -> Self {
        Self { t_min: Self::leaving_distance(origin), ..Self::new(origin, direction) }
    }

    /// The segment between two surface points without its ends, for visibility tests. The parameter is the fraction of the
    /// distance.
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

    /// The ray in the space that an affine map leads to, with the same parameter `t`.
    #[inline(always)]
    #[must_use]
    pub fn transformed(&self, map: &DAffine3) -> Self {
        Self { origin: map.transform_point3(self.origin), direction: map.transform_vector3(self.direction), ..*self }
    }

    /// Whether `t` lies between `t_min` and `t_max`.
    #[inline(always)]
    #[must_use]
    pub fn contains(&self, t: f64) -> bool {
        self.t_min < t && t < self.t_max
    }

    /// [`Ray::leaving_distance`] divided by the largest coordinate. Rounding moves a computed hit by about 1e-15 of the scene's
    /// coordinates; 1e-9 covers rays that graze at 1e-6 radians.
    pub const LEAVING: f64 = 1e-9;

    /// The distance along a ray from `p` within which a hit is taken for the surface that the ray leaves.
    #[inline]
    #[must_use]
    pub fn leaving_distance(p: DVec3) -> f64 {
        Self::LEAVING * (1.0 + p.abs().max_element())
    }
}
