//! The caustic of a glass ball: the light that goes through it with two refractions and no reflection, which is the
//! order 1 of Airy's series; the order 0 is what its outside reflects.
//!
//! The ball is centred at the origin and lit along the z axis. A ray with the offset `b` from the centre and the tilt
//! `α` away from the axis leaves the ball with the same offset and the tilt `β = δ - α` towards the axis,
//! `δ = 2 (θi - θt)`. Born and Wolf 1999, *Principles of Optics*, section 4.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::numeric::{bisect, crossing, integral, monotone, root};
use crate::bsdf::fresnel;

/// A glass ball in air, with the light that falls on it.
#[derive(Clone, Copy, Debug)]
pub struct BallLens {
    /// Its radius.
    pub radius: f64,
    /// Its index of refraction, above 1.
    pub index: f64,
    /// What shines on it.
    pub light: Light,
}

/// A light that shines on a ball along the z axis.
#[derive(Clone, Copy, Debug)]
pub enum Light {
    /// A parallel beam towards positive z.
    Collimated {
        /// The irradiance across the beam.
        irradiance: f64,
    },
    /// A point on the negative z axis.
    Point {
        /// The power per solid angle.
        intensity: f64,
        /// The distance from the centre of the ball, more than its radius.
        distance: f64,
    },
}

/// A place on a plane where the rays turn back: a circle on which the irradiance is infinite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fold {
    /// The offset from the ball's centre of the rays that land there.
    pub offset: f64,
    /// The distance from the axis.
    pub radius: f64,
}

/// A ray that leaves the ball, with its derivatives by the angle of incidence.
struct Leaving {
    offset: f64,
    offset_slope: f64,
    tilt: f64,
    tilt_slope: f64,
}

impl Leaving {
    /// Where the ray meets a plane: its distance from the axis, negative beyond it.
    fn landing(&self, plane: f64) -> f64 {
        (self.offset - plane * self.tilt.sin()) / self.tilt.cos()
    }

    /// The derivative of the landing by the angle of incidence, times cos² of the tilt.
    fn turning(&self, plane: f64) -> f64 {
        let (sin, cos) = self.tilt.sin_cos();
        self.offset_slope * cos + self.tilt_slope * (self.offset * sin - plane)
    }
}

impl BallLens {
    /// The power that the ball receives.
    #[must_use]
    pub fn received(&self) -> f64 {
        match self.light {
            Light::Collimated { irradiance } => irradiance * PI * self.radius.powi(2),
            Light::Point { intensity, distance } => {
                TAU * intensity * (1.0 - (1.0 - (self.radius / distance).powi(2)).sqrt())
            }
        }
    }

    /// The power that leaves the ball in one order: 0 is reflected outside, `p` is reflected `p - 1` times inside.
    #[must_use]
    pub fn order_power(&self, order: u32) -> f64 {
        integral(|theta| self.power_per_angle(theta) * self.share(theta, order), [0.0, FRAC_PI_2])
    }

    /// The power of the order 1 that lands within a distance `r` of the axis on the plane at `z = plane`, which is at
    /// least the radius. Rays that are bent by 90 degrees and more never land.
    #[must_use]
    pub fn encircled_power(&self, plane: f64, r: f64) -> f64 {
        let power = |branch| {
            let edge = |r: f64| crossing(|theta| self.leaving(theta).landing(plane) - r, branch);
            integral(|theta| self.power_per_angle(theta) * self.share(theta, 1), [edge(r), edge(-r)]).abs()
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
                    sum += self.power_per_angle(theta) * self.share(theta, 1) / (TAU * r * slope.abs());
                }
            }
        }
        sum
    }

    /// Where the ray of an offset from 0 up to the radius meets the plane at `z = plane`, as a distance from the axis
    /// that is negative beyond it; `None` if it is bent by 90 degrees and more.
    #[must_use]
    pub fn landing(&self, plane: f64, offset: f64) -> Option<f64> {
        let theta = (offset / self.radius).asin();
        (theta < self.last()).then(|| self.leaving(theta).landing(plane))
    }

    /// The folds on the plane at `z = plane`, by their offset.
    #[must_use]
    pub fn folds(&self, plane: f64) -> Vec<Fold> {
        let turns = self.branches(plane).into_iter().skip(1).map(|[theta, _]| self.leaving(theta));
        turns.map(|ray| Fold { offset: ray.offset, radius: ray.landing(plane).abs() }).collect()
    }

    /// The radius of the ball's shadow on the plane at `z = plane`.
    #[must_use]
    pub fn shadow_radius(&self, plane: f64) -> f64 {
        match self.light {
            Light::Collimated { .. } => self.radius,
            Light::Point { distance, .. } => (distance + plane) * (self.radius / distance).asin().tan(),
        }
    }

    /// The power of light that has not met the ball, within a distance `r` of the axis on the plane at `z = plane`.
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

    /// The intervals of the angle of incidence in which the landing is monotone.
    fn branches(&self, plane: f64) -> Vec<[f64; 2]> {
        monotone(|theta| self.leaving(theta).turning(plane), [0.0, self.last()])
    }

    /// The greatest angle of incidence whose ray lands.
    fn last(&self) -> f64 {
        // The tilt is convex: refraction bends ever more, and a point's rays spread ever less.
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

    /// The angle between a ray of the light and the axis, with its derivative.
    fn tilt_of_light(&self, theta: f64) -> [f64; 2] {
        match self.light {
            Light::Collimated { .. } => [0.0, 0.0],
            Light::Point { distance, .. } => {
                let sin = self.radius / distance * theta.sin();
                [sin.asin(), self.radius / distance * theta.cos() / (1.0 - sin * sin).sqrt()]
            }
        }
    }

    /// The power that meets the ball per angle of incidence.
    fn power_per_angle(&self, theta: f64) -> f64 {
        match self.light {
            Light::Collimated { irradiance } => TAU * irradiance * self.radius.powi(2) * theta.sin() * theta.cos(),
            Light::Point { intensity, .. } => {
                let [tilt, slope] = self.tilt_of_light(theta);
                TAU * intensity * tilt.sin() * slope
            }
        }
    }

    /// The share of a ray's power in an order. Every reflection is at the same angle, and counts as unpolarised.
    fn share(&self, theta: f64, order: u32) -> f64 {
        let r = fresnel::dielectric(theta.cos(), self.index).reflectance;
        match order.checked_sub(1) {
            None => r,
            Some(inside) => (1.0 - r).powi(2) * r.powf(f64::from(inside)),
        }
    }
}

#[cfg(test)]
mod tests;
