//! A diffuse floor lit and viewed through a pane of glass: paths light, glass, floor, glass, camera.
//!
//! The pane is parallel to the floor, which is z = 0. Its height does not matter. A ray of the order `p` is reflected
//! `2p` times inside the pane of thickness `d`. If it descends by a height `h` at the angle θ to the vertical, it is
//! displaced sideways by `(h - d) tan θ + (1 + 2p) d tan θt` and keeps the fraction `(1 - R)² R^2p` of its power.
//!
//! Light that the pane reflects back to the floor is left out. A path with the order `p` down and `q` up has the depth
//! `6 + 2 (p + q)`. A path that hits the floor twice has at least the depth 8. A `max_depth` of 6 or 7 therefore admits
//! only the orders 0.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_2};

use glam::{DVec2, DVec3};

use super::numeric::bisect;
use crate::bsdf::fresnel;

/// A point light over a floor with a pane of glass in between.
#[derive(Clone, Copy, Debug)]
pub struct Pane {
    /// The index of refraction of the glass.
    pub index: f64,
    /// The thickness of the pane, at least 0.
    pub thickness: f64,
    /// The height of the light above the origin of the floor, greater than the thickness.
    pub height: f64,
    /// The radiant intensity of the light.
    pub intensity: f64,
}

/// A point on the floor where a ray through the pane arrives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// The point on the floor.
    pub place: DVec2,
    /// The fraction of the point's radiance that returns along the ray, from 0 to 1.
    pub weight: f64,
}

impl Pane {
    /// The fraction of the power, at an angle to the vertical, that the pane transmits in an order.
    #[must_use]
    pub fn share(&self, angle: f64, order: u32) -> f64 {
        let r = fresnel::dielectric(angle.cos(), self.index).reflectance;
        (1.0 - r).powi(2) * r.powf(2.0 * f64::from(order))
    }

    /// The sideways displacement on the floor of a ray that starts at a height above it. The angle to the vertical is
    /// below π/2.
    #[must_use]
    pub fn aside(&self, height: f64, angle: f64, order: u32) -> f64 {
        angle.sin() * self.stretch(height, angle, order)
    }

    /// The irradiance of one order on the floor at a distance from the point below the light.
    ///
    /// `E = I sin θ / (x dx/dθ)` times the transmitted fraction: the power of a cone of directions over the area of its
    /// ring.
    #[must_use]
    pub fn irradiance(&self, distance: f64, order: u32) -> f64 {
        let angle = self.angle(distance, order);
        let (sin, cos) = angle.sin_cos();
        let cos_t = (1.0 - (sin / self.index).powi(2)).sqrt();
        let slope =
            (self.height - self.thickness) / cos.powi(2) + self.within(order) * cos / (self.index * cos_t.powi(3));
        self.intensity * self.share(angle, order) / (self.stretch(self.height, angle, order) * slope)
    }

    /// The footprints of a ray that descends from a camera above the pane, for the orders 0, 1, 2 and so on.
    pub fn footprints(&self, camera: DVec3, direction: DVec3) -> impl Iterator<Item = Footprint> {
        let angle = direction.truncate().length().atan2(-direction.z);
        let ahead = direction.truncate().normalize_or_zero();
        (0..).map(move |order| Footprint {
            place: camera.truncate() + self.aside(camera.z, angle, order) * ahead,
            weight: self.share(angle, order),
        })
    }

    /// The radiance along a ray to a camera above the pane, from a floor of the given albedo.
    ///
    /// The orders `p` of the light path and `q` of the camera path go up to `p + q = orders`. These are all paths up to
    /// the depth `6 + 2 orders`, except those that hit the floor twice.
    #[must_use]
    pub fn radiance(&self, camera: DVec3, direction: DVec3, albedo: f64, orders: u32) -> f64 {
        let reflected = |(q, Footprint { place, weight }): (u32, Footprint)| {
            let irradiance: f64 = (0..=orders - q).map(|p| self.irradiance(place.length(), p)).sum();
            weight * albedo * FRAC_1_PI * irradiance
        };
        (0..=orders).zip(self.footprints(camera, direction)).map(reflected).sum()
    }

    /// The angle at which light of an order must leave to land at a distance.
    fn angle(&self, distance: f64, order: u32) -> f64 {
        bisect(|angle| self.aside(self.height, angle, order) - distance, [0.0, FRAC_PI_2])
    }

    /// The sideways displacement divided by the sine of the angle, a ratio that is finite at 0.
    fn stretch(&self, height: f64, angle: f64, order: u32) -> f64 {
        let (sin, cos) = angle.sin_cos();
        let cos_t = (1.0 - (sin / self.index).powi(2)).sqrt();
        (height - self.thickness) / cos + self.within(order) / (self.index * cos_t)
    }

    /// The vertical distance that a ray of an order travels inside the glass.
    fn within(&self, order: u32) -> f64 {
        f64::from(1 + 2 * order) * self.thickness
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::{math::rng::Stream, validation::theory::numeric::integral};

    const PANE: Pane = Pane { index: 1.5, thickness: 0.4, height: 2.1, intensity: 3.0 };

    impl Pane {
        /// The power of one order within a distance of the point below the light.
        fn encircled_power(&self, distance: f64, order: u32) -> f64 {
            let within = |angle: f64| TAU * self.intensity * angle.sin() * self.share(angle, order);
            integral(within, [0.0, self.angle(distance, order)])
        }
    }

    #[test]
    fn the_orders_make_up_the_slab() {
        for (degrees, expected) in [(0.0, 0.92307692), (45.0, 0.90432679), (60.0, 0.83623246), (75.0, 0.59609205)] {
            let sum: f64 = (0..60).map(|order| PANE.share(f64::to_radians(degrees), order)).sum();
            assert!((sum - expected).abs() < 5.1e-9, "{degrees}: {sum}");
        }
    }

    #[test]
    fn a_thin_pane_only_takes_its_share() {
        let thin = Pane { thickness: 0.0, ..PANE };
        let bare = Pane { index: 1.0, ..PANE };
        for r in [0.0, 0.5, 2.0, 7.0_f64] {
            let free = 3.0 * 2.1 / (2.1 * 2.1 + r * r).powf(1.5);
            let found = thin.irradiance(r, 0) / thin.share((r / 2.1).atan(), 0);
            assert!((found / free - 1.0).abs() < 1e-14 && (bare.irradiance(r, 0) / free - 1.0).abs() < 1e-14, "{r}");
        }
    }

    #[test]
    fn the_irradiance_is_the_growth_of_the_power() {
        for (r, order) in [(0.3, 0), (2.0, 0), (2.0, 1), (5.0, 2)] {
            let ring = integral(|r| TAU * r * PANE.irradiance(r, order), [0.0, r]);
            assert!((ring / PANE.encircled_power(r, order) - 1.0).abs() < 1e-10, "{r}, {order}");
        }
    }

    #[test]
    fn radiance_sums_the_orders_of_light_and_camera_paths() {
        let (camera, direction) = (DVec3::new(0.3, -1.0, 3.0), DVec3::new(0.2, 0.6, -1.0).normalize());
        let places: Vec<Footprint> = PANE.footprints(camera, direction).take(2).collect();
        let sum = |q: usize, p| places[q].weight * 0.5 * FRAC_1_PI * PANE.irradiance(places[q].place.length(), p);
        let expected = sum(0, 0) + sum(0, 1) + sum(1, 0);
        assert!((PANE.radiance(camera, direction, 0.5, 1) - expected).abs() < 1e-15);
        // Each order is displaced by twice the pane's thickness more.
        let tan_t = (direction.truncate().length() / 1.5).asin().tan();
        assert!((places[0].place.distance(places[1].place) - 0.8 * tan_t).abs() < 1e-14);
        let straight: Vec<Footprint> = PANE.footprints(camera, -DVec3::Z).take(3).collect();
        assert!(straight.iter().all(|footprint| footprint.place == camera.truncate()));
    }

    /// The landing point of a ray that is randomly reflected or refracted at each surface, and its order.
    fn walk(pane: &Pane, stream: &mut Stream) -> Option<(DVec2, u32)> {
        let top = 0.7 + pane.thickness;
        let (z, phi) = (stream.next_1d(), TAU * stream.next_1d());
        let mut direction = (1.0 - z * z).sqrt() * DVec3::new(phi.cos(), phi.sin(), 0.0) - z * DVec3::Z;
        let mut p = pane.height * DVec3::Z + (pane.height - top) / z * direction;
        let enters = |stream: &mut Stream, direction: &mut DVec3, eta: f64| {
            let normal = -direction.z.signum() * DVec3::Z;
            let reflected = stream.next_1d() < fresnel::dielectric(direction.z.abs(), eta).reflectance;
            *direction = if reflected { direction.reflect(normal) } else { direction.refract(normal, 1.0 / eta) };
            !reflected
        };
        if !enters(stream, &mut direction, pane.index) {
            return None;
        }
        for crossings in 0.. {
            p += pane.thickness / direction.z.abs() * direction;
            if enters(stream, &mut direction, 1.0 / pane.index) {
                let order = crossings / 2;
                return (direction.z < 0.0).then(|| ((p - p.z / direction.z * direction).truncate(), order));
            }
        }
        None
    }

    #[test]
    fn rays_in_space_agree() {
        let (count, radii) = (400_000_u32, [0.5, 2.0, 6.0]);
        let mut hits = [[0_u32; 3]; 2];
        for i in 0..count {
            let mut stream = Stream::at(&[23, u64::from(i)]);
            if let Some((place, order @ 0..=1)) = walk(&PANE, &mut stream) {
                let hits = hits[order as usize].iter_mut().zip(radii);
                hits.for_each(|(hits, r)| *hits += u32::from(place.length() < r));
            }
        }
        for (order, hits) in (0..).zip(hits) {
            for (r, hits) in radii.into_iter().zip(hits) {
                let q = PANE.encircled_power(r, order) / (TAU * PANE.intensity);
                let error = (q * (1.0 - q) / f64::from(count)).sqrt();
                let found = f64::from(hits) / f64::from(count);
                assert!((found - q).abs() < 4.0 * error, "{order}, {r}: {found}, not {q} ± {error}");
            }
        }
    }
}
