//! The caustic of a glass sphere: light that is refracted twice and never reflected, the order 1 of Airy's series.
//! The order 0 is the light reflected outside.
//!
//! The sphere is centred at the origin and lit along the z axis. A ray with the offset `b` from the centre and the tilt
//! `α` away from the axis leaves the sphere with the same offset and the tilt `β = δ - α` towards the axis,
//! `δ = 2 (θi - θt)`. Born and Wolf 1999, *Principles of Optics*, section 4.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::numeric::{bisect, crossing, integral, monotone, root};
use crate::bsdf::fresnel;

/// A glass sphere in air, with its light.
#[derive(Clone, Copy, Debug)]
pub struct BallLens {
    /// The radius of the sphere.
    pub radius: f64,
    /// The index of refraction of the glass, above 1.
    pub index: f64,
    /// The light that illuminates the sphere.
    pub light: Light,
}

/// A light that illuminates the sphere along the z axis.
#[derive(Clone, Copy, Debug)]
pub enum Light {
    /// A parallel beam towards positive z.
    Collimated {
        /// The irradiance across the beam.
        irradiance: f64,
    },
    /// A point on the negative z axis.
    Point {
        /// The radiant intensity.
        intensity: f64,
        /// The distance from the centre of the sphere, greater than its radius.
        distance: f64,
    },
}

/// A fold of the caustic on a plane: a circle where the landing distance has an extremum and the irradiance is
/// infinite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fold {
    /// The offset, from the sphere's centre, of the rays that land on the fold.
    pub offset: f64,
    /// The distance of the fold from the axis.
    pub radius: f64,
}

/// A ray that leaves the sphere, with derivatives with respect to the angle of incidence.
struct Leaving {
    offset: f64,
    offset_slope: f64,
    tilt: f64,
    tilt_slope: f64,
}

impl Leaving {
    /// The ray's distance from the axis on a plane, negative once the ray has crossed the axis.
    fn landing(&self, plane: f64) -> f64 {
        (self.offset - plane * self.tilt.sin()) / self.tilt.cos()
    }

    /// The derivative of the landing distance with respect to the angle of incidence, times cos² of the tilt.
    fn turning(&self, plane: f64) -> f64 {
        let (sin, cos) = self.tilt.sin_cos();
        self.offset_slope * cos + self.tilt_slope * (self.offset * sin - plane)
    }
}

impl BallLens {
    /// The power that the sphere receives.
    #[must_use]
    pub fn received(&self) -> f64 {
        match self.light {
            Light::Collimated { irradiance } => irradiance * PI * self.radius.powi(2),
            Light::Point { intensity, distance } => {
                TAU * intensity * (1.0 - (1.0 - (self.radius / distance).powi(2)).sqrt())
            }
        }
    }

    /// The power that leaves the sphere in one order. The order 0 is reflected outside, the order `p` is internally
    /// reflected `p - 1` times.
    #[must_use]
    pub fn order_power(&self, order: u32) -> f64 {
        integral(|theta| self.power_per_angle(theta) * self.power_fraction(theta, order), [0.0, FRAC_PI_2])
    }

    /// The power of the order 1 that lands within a distance `r` of the axis on the plane at `z = plane`, which must be
    /// at least the radius. Rays deflected by 90 degrees or more never land.
    #[must_use]
    pub fn encircled_power(&self, plane: f64, r: f64) -> f64 {
        let power = |branch| {
            let edge = |r: f64| crossing(|theta| self.leaving(theta).landing(plane) - r, branch);
            integral(|theta| self.power_per_angle(theta) * self.power_fraction(theta, 1), [edge(r), edge(-r)]).abs()
        };
        self.branches(plane).into_iter().map(power).sum()
    }

    /// The irradiance of the order 1 at a distance `r > 0` from the axis on the plane at `z = plane`.
    #[must_use]
    pub fn irradiance(&self, plane: f64, r: f64) -> f64 {
        let mut sum = 0.0;
        for branch in self.branches(plane) {
            for side in [r, -r] {
                if let Some(theta) = root(|theta| self.leaving(theta).landing(plane) - side, branch) {
                    let ray = self.leaving(theta);
                    let slope = ray.turning(plane) / ray.tilt.cos().powi(2);
                    sum += self.power_per_angle(theta) * self.power_fraction(theta, 1) / (TAU * r * slope.abs());
                }
            }
        }
        sum
    }

    /// The point where the ray of an offset, from 0 to the radius, meets the plane at `z = plane`, as a distance from
    /// the axis. The distance is negative if the ray has crossed the axis. `None` if the ray is deflected by 90 degrees
    /// or more.
    #[must_use]
    pub fn landing(&self, plane: f64, offset: f64) -> Option<f64> {
        let theta = (offset / self.radius).asin();
        (theta < self.last()).then(|| self.leaving(theta).landing(plane))
    }

    /// The folds on the plane at `z = plane`, in order of their offset.
    #[must_use]
    pub fn folds(&self, plane: f64) -> Vec<Fold> {
        let turns = self.branches(plane).into_iter().skip(1).map(|[theta, _]| self.leaving(theta));
        turns.map(|ray| Fold { offset: ray.offset, radius: ray.landing(plane).abs() }).collect()
    }

    /// The radius of the sphere's shadow on the plane at `z = plane`.
    #[must_use]
    pub fn shadow_radius(&self, plane: f64) -> f64 {
        match self.light {
            Light::Collimated { .. } => self.radius,
            Light::Point { distance, .. } => (distance + plane) * (self.radius / distance).asin().tan(),
        }
    }

    /// The power of light that has not hit the sphere, within a distance `r` of the axis on the plane at `z = plane`.
    #[must_use]
    pub fn direct_power(&self, plane: f64, r: f64) -> f64 {
        let shadow = self.shadow_radius(plane);
        match self.light {
            _ if r < shadow => 0.0,
            Light::Collimated { irradiance } => irradiance * PI * (r * r - shadow * shadow),
            Light::Point { intensity, distance } => {
                let h = distance + plane;
                TAU * intensity * h * ((h * h + shadow * shadow).sqrt().recip() - (h * h + r * r).sqrt().recip())
            }
        }
    }

    /// The intervals of the angle of incidence in which the landing distance is monotone.
    fn branches(&self, plane: f64) -> Vec<[f64; 2]> {
        monotone(|theta| self.leaving(theta).turning(plane), [0.0, self.last()])
    }

    /// The greatest angle of incidence whose ray lands.
    fn last(&self) -> f64 {
        // The tilt is convex: with the angle, deflection grows faster and the spread of a point light's rays slower.
        let spare = |theta| FRAC_PI_2 - self.leaving(theta).tilt;
        if spare(FRAC_PI_2) >= 0.0 { FRAC_PI_2 } else { bisect(spare, [0.0, FRAC_PI_2]) }
    }

    fn leaving(&self, theta: f64) -> Leaving {
        let (sin, cos) = theta.sin_cos();
        let deviation = 2.0 * (theta - (sin / self.index).asin());
        let deviation_slope = 2.0 * (1.0 - cos / (self.index.powi(2) - sin * sin).sqrt());
        let [away, away_slope] = self.tilt_of_light(theta);
        Leaving {
            offset: self.radius * sin,
            offset_slope: self.radius * cos,
            tilt: deviation - away,
            tilt_slope: deviation_slope - away_slope,
        }
    }

    /// The angle between an incident ray and the axis, with its derivative.
    fn tilt_of_light(&self, theta: f64) -> [f64; 2] {
        match self.light {
            Light::Collimated { .. } => [0.0, 0.0],
            Light::Point { distance, .. } => {
                let sin = self.radius / distance * theta.sin();
                [sin.asin(), self.radius / distance * theta.cos() / (1.0 - sin * sin).sqrt()]
            }
        }
    }

    /// The power that hits the sphere per angle of incidence.
    fn power_per_angle(&self, theta: f64) -> f64 {
        match self.light {
            Light::Collimated { irradiance } => TAU * irradiance * self.radius.powi(2) * theta.sin() * theta.cos(),
            Light::Point { intensity, .. } => {
                let [tilt, slope] = self.tilt_of_light(theta);
                TAU * intensity * tilt.sin() * slope
            }
        }
    }

    /// The fraction of a ray's power in an order. All reflections have the same angle and are treated as unpolarised.
    fn power_fraction(&self, theta: f64, order: u32) -> f64 {
        let r = fresnel::dielectric(theta.cos(), self.index).reflectance;
        match order.checked_sub(1) {
            None => r,
            Some(inside) => (1.0 - r).powi(2) * r.powf(f64::from(inside)),
        }
    }
}

#[cfg(test)]
mod tests;
