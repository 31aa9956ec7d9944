use std::f64::consts::PI;

/// The weight of a photon by its distance: a radial density over a disc, with integral 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// `1 / πr²`.
    Constant,
    /// `3 (1 - d/r) / πr²`.
    Cone,
    /// `2 (1 - d²/r²) / πr²`, which has the least mean square error of all kernels for the same number of photons.
    Epanechnikov,
}

impl Kernel {
    /// All kernels, with their names.
    pub const ALL: [(&'static str, Self); 3] =
        [("constant", Self::Constant), ("cone", Self::Cone), ("epanechnikov", Self::Epanechnikov)];

    /// The density per m², from the squared distance and the squared radius, both in m².
    #[inline]
    #[must_use]
    pub fn density(self, distance_squared: f64, radius_squared: f64) -> f64 {
        self.height(radius_squared) * self.shape(distance_squared / radius_squared)
    }

    /// The density at the centre of the disc, per m².
    #[inline]
    pub(super) fn height(self, radius_squared: f64) -> f64 {
        let over_mean = match self {
            Self::Constant => 1.0,
            Self::Cone => 3.0,
            Self::Epanechnikov => 2.0,
        };
        over_mean / (PI * radius_squared)
    }

    /// The density relative to the centre, from the squared distance over the squared radius.
    #[inline]
    pub(super) fn shape(self, squared_ratio: f64) -> f64 {
        let squared_ratio = squared_ratio.min(1.0);
        match self {
            Self::Constant => 1.0,
            Self::Cone => 1.0 - squared_ratio.sqrt(),
            Self::Epanechnikov => 1.0 - squared_ratio,
        }
    }

    /// `∫ G(h / cos θ) dθ` from 0 to the angle θ with the given tangent, for a line at the distance `h`. `G(ρ)` is the
    /// integral of the density times the distance up to ρ. The result is the kernel's mass in a triangle from the
    /// centre to the line.
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
