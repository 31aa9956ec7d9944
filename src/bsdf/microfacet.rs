use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use crate::math::warp;

/// The distribution of microfacet normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DistributionKind {
    Beckmann,
    Ggx,
}

/// A microfacet distribution with Smith's masking function. All normals and directions lie above the surface. Walter et
/// al. 2007, "Microfacet Models for Refraction through Rough Surfaces"; anisotropic form after Heitz 2014,
/// "Understanding the Masking-Shadowing Function".
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MicrofacetDistribution {
    pub(super) kind: DistributionKind,
    /// Root mean square slopes (Beckmann) or their GGX counterparts, along x and y.
    pub(super) alpha: DVec2,
    /// Whether GGX normals are sampled from the distribution visible from `wi`, instead of from `D(m) cos θ(m)`.
    pub(super) visible: bool,
}

impl MicrofacetDistribution {
    /// The distribution function `D(m)`, normalised such that `∫ D(m) cos θ(m) dm = 1`.
    pub(super) fn distribution(&self, m: DVec3) -> f64 {
        if m.z <= 0.0 {
            return 0.0;
        }
        let cos2 = m.z * m.z;
        let slope2 = ((m.truncate() / self.alpha) / m.z).length_squared();
        let scale = PI * self.alpha.x * self.alpha.y * cos2 * cos2;
        match self.kind {
            DistributionKind::Beckmann => (-slope2).exp() / scale,
            DistributionKind::Ggx => 1.0 / (scale * (1.0 + slope2) * (1.0 + slope2)),
        }
    }

    /// Smith's masking function: the fraction of microfacets with normal `m` that are visible from `v`.
    pub(super) fn masking(&self, v: DVec3, m: DVec3) -> f64 {
        if v.dot(m) * v.z <= 0.0 {
            return 0.0;
        }
        let alpha_tan2 = (v.truncate() * self.alpha).length_squared() / (v.z * v.z);
        if alpha_tan2 == 0.0 {
            return 1.0;
        }
        match self.kind {
            DistributionKind::Ggx => 2.0 / (1.0 + (1.0 + alpha_tan2).sqrt()),
            // Walter et al.'s rational approximation, eq. (27), which Mitsuba uses too.
            DistributionKind::Beckmann => {
                let a = 1.0 / alpha_tan2.sqrt();
                if a >= 1.6 { 1.0 } else { (3.535 * a + 2.181 * a * a) / (1.0 + 2.276 * a + 2.577 * a * a) }
            }
        }
    }

    /// Samples a microfacet normal.
    pub(super) fn sample(&self, wi: DVec3, u: DVec2) -> DVec3 {
        match self.kind {
            DistributionKind::Ggx if self.visible => self.sample_visible_ggx(wi, u),
            _ => self.sample_distribution(u),
        }
    }

    /// The pdf of [`MicrofacetDistribution::sample`], per solid angle of `m`.
    pub(super) fn pdf(&self, wi: DVec3, m: DVec3) -> f64 {
        match self.kind {
            // Heitz 2014, eq. (2).
            DistributionKind::Ggx if self.visible => {
                self.distribution(m) * self.masking(wi, m) * wi.dot(m).abs() / wi.z
            }
            _ => self.distribution(m) * m.z,
        }
    }

    fn sample_distribution(&self, u: DVec2) -> DVec3 {
        let radius = match self.kind {
            DistributionKind::Beckmann => (-(1.0 - u.x).ln()).sqrt(),
            DistributionKind::Ggx => (u.x / (1.0 - u.x)).sqrt(),
        };
        let (sin, cos) = (TAU * u.y).sin_cos();
        (radius * self.alpha * DVec2::new(cos, sin)).extend(1.0).normalize()
    }

    /// Heitz 2018, "Sampling the GGX Distribution of Visible Normals", JCGT 7(4): in the stretched view, the visible
    /// normals form a hemisphere, whose projection is half a disc and half an ellipse.
    fn sample_visible_ggx(&self, wi: DVec3, u: DVec2) -> DVec3 {
        let view = (wi.truncate() * self.alpha).extend(wi.z).normalize();
        let across =
            if view.truncate() == DVec2::ZERO { DVec3::X } else { DVec3::new(-view.y, view.x, 0.0).normalize() };
        let up = view.cross(across);
        let disc = warp::square_to_disc(u);
        let half_width = (1.0 - disc.x * disc.x).max(0.0).sqrt();
        let lower_weight = 0.5 * (1.0 + view.z);
        let y = (1.0 - lower_weight) * half_width + lower_weight * disc.y;
        let depth = (1.0 - disc.x * disc.x - y * y).max(0.0).sqrt();
        let hemisphere = disc.x * across + y * up + depth * view;
        (hemisphere.truncate() * self.alpha).extend(hemisphere.z.max(0.0)).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `∫ D cos dm = 1` by quadrature over the cosine and the azimuth.
    #[test]
    fn the_projected_area_of_the_microfacets_is_one() {
        for kind in [DistributionKind::Beckmann, DistributionKind::Ggx] {
            let model = MicrofacetDistribution { kind, alpha: DVec2::new(0.2, 0.5), visible: true };
            let (n, mut sum) = (400, 0.0);
            for i in 0..n {
                for j in 0..n {
                    let cos = (i as f64 + 0.5) / n as f64;
                    let phi = TAU * (j as f64 + 0.5) / n as f64;
                    let sin = (1.0 - cos * cos).sqrt();
                    let m = DVec3::new(sin * phi.cos(), sin * phi.sin(), cos);
                    sum += model.distribution(m) * cos * TAU / (n * n) as f64;
                }
            }
            assert!((sum - 1.0).abs() < 2e-3, "{kind:?} {sum}");
        }
    }
}
