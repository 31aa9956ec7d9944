use std::f64::consts::PI;

/// How much a photon counts at a distance: radial densities over a disc, of integral 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// `1 / πr²`.
    Constant,
    /// `3 (1 - d/r) / πr²`.
    Cone,
    /// `2 (1 - d²/r²) / πr²`, which has the least mean square error of all for the same number of photons.
    Epanechnikov,
}

impl Kernel {
    /// All of them, by name.
    pub const ALL: [(&'static str, Self); 3] =
        [("constant", Self::Constant), ("cone", Self::Cone), ("epanechnikov", Self::Epanechnikov)];

    /// The density per m², at the square of a distance over the square of the radius, both in m².
    #[inline]
    #[must_use]
    pub fn density(self, distance_squared: f64, radius_squared: f64) -> f64 {
        self.height(radius_squared) * self.shape(distance_squared / radius_squared)
    }

    /// The density in the middle of the disc, per m².
    #[inline]
    pub(super) fn height(self, radius_squared: f64) -> f64 {
        let over_mean = match self {
            Self::Constant => 1.0,
            Self::Cone => 3.0,
            Self::Epanechnikov => 2.0,
        };
        over_mean / (PI * radius_squared)
    }

    /// The density over that in the middle, by the square of the distance over that of the radius.
    #[inline]
    pub(super) fn shape(self, share: f64) -> f64 {
        let share = share.min(1.0);
        match self {
            Self::Constant => 1.0,
            Self::Cone => 1.0 - share.sqrt(),
            Self::Epanechnikov => 1.0 - share,
        }
    }

    /// `∫ G(h / cos θ) dθ` from 0 on, for a line at the distance `h` and the tangent of θ, with `G(ρ)` the integral of the
    /// density times the distance up to ρ: what a triangle from the middle to the line holds.
    pub(super) fn within_triangle(self, h: f64, tangent: f64, radius: f64) -> f64 {
        let (x, disc) = (h / radius, 1.0 / PI);
        let square = 0.5 * x * x * tangent;
        match self {
            Self::Constant => disc * square,
            // The integral of 1/cos³ θ.
            Self::Cone => {
                let cube = 0.5 * (tangent * tangent.hypot(1.0) + tangent.asinh());
                3.0 * disc * (square - x * x * x * cube / 3.0)
            }
            // The integral of 1/cos⁴ θ.
            Self::Epanechnikov => {
                let fourth = tangent + tangent * tangent * tangent / 3.0;
                2.0 * disc * (square - 0.25 * x * x * x * x * fourth)
            }
        }
    }
}
