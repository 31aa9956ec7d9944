//! Probability densities whose types name their measure, so that densities of different measures cannot be mixed.

/// A probability density per unit of solid angle, in 1/sr.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct PerSolidAngle(pub f64);

/// A probability density per unit of area, in 1/m².
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct PerArea(pub f64);

impl PerArea {
    /// The density per solid angle at a point whose squared distance to the surface point is `distance_squared`:
    /// `dω = |cos| dA / d²`, with the cosine at the surface. `None` if `cos` is 0: the surface is then edge-on.
    #[must_use]
    pub fn to_solid_angle(self, cos: f64, distance_squared: f64) -> Option<PerSolidAngle> {
        (cos != 0.0).then(|| PerSolidAngle(self.0 * distance_squared / cos.abs()))
    }
}
