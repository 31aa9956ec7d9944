use glam::{DAffine3, DVec3};

/// A ray `origin + t * direction`. Hits count if `t_min < t < t_max`.
///
/// The direction need not have unit length: a ray keeps its parameter `t` when an affine map takes it to a shape's
/// local space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// The point at `t = 0`.
    pub origin: DVec3,
    /// The direction: finite and not zero.
    pub direction: DVec3,
    /// The lower bound of the parameter, excluded.
    pub t_min: f64,
    /// The upper bound of the parameter, excluded.
    pub t_max: f64,
}

impl Ray {
    /// The ray from `origin` with `0 < t < ∞`.
    #[must_use]
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        Self { origin, direction, t_min: 0.0, t_max: f64::INFINITY }
    }

    /// A ray that is spawned on a surface at `origin`. It starts at [`Ray::leaving_distance`], so that it does not hit
    /// the surface again, although rounding puts `origin` a few ulp off that surface.
    #[must_use]
    pub fn leaving(origin: DVec3, direction: DVec3) -> Self {
        Self { t_min: Self::leaving_distance(origin), ..Self::new(origin, direction) }
    }

    /// The shadow ray from one surface point to another. Both ends are excluded. The parameter is the fraction of the
    /// distance: 0 at `origin`, 1 at `target`.
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

    /// The image of the ray under an affine map, with the same parameter `t`.
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

    /// The ratio of [`Ray::leaving_distance`] to the greatest coordinate. Rounding displaces a computed hit by about
    /// 1e-15 of the scene's coordinates. 1e-9 is enough for rays that graze a surface at 1e-6 radians.
    pub const LEAVING: f64 = 1e-9;

    /// The offset of spawned rays: the distance along a ray from `p` within which hits are taken as hits on the surface
    /// that contains `p`.
    #[inline]
    #[must_use]
    pub fn leaving_distance(p: DVec3) -> f64 {
        Self::LEAVING * (1.0 + p.abs().max_element())
    }
}
