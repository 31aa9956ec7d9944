//! The caustics on the floor of a mirror half cylinder: the nephroid and the cardioid.
//!
//! The mirror stands on the plane z = 0 around the z axis, at `R (cos a, sin a)` for `a` from -π/2 to π/2. A ray that
//! hits it at `a` with the angle of incidence `i` in the horizontal projection is reflected to `-(cos ψ, sin ψ)` with
//! `ψ = a + i`. It lands on the floor at the horizontal distance `t` from the wall. Second reflections are left out: a
//! ray ends at `t = 2 R cos i`, where it leaves the circle.
//!
//! Derivation: the map from (a, t) to the floor has the determinant `ψ' t - R cos i`, so the irradiance is the
//! power per angle and distance divided by its absolute value. It is infinite on the caustic, `t = R cos i / ψ'`.

use std::f64::consts::FRAC_PI_2;

use glam::DVec2;

use super::numeric::{crossing, integral, monotone};

/// A half cylinder on a floor, with a mirror on its inside.
#[derive(Clone, Copy, Debug)]
pub struct HalfCylinder {
    /// The radius of the cylinder.
    pub radius: f64,
    /// The height of the wall, possibly infinite.
    pub wall_height: f64,
    /// The fraction of the power that the mirror reflects, from 0 to 1.
    pub reflectance: f64,
    /// The light that illuminates the mirror.
    pub light: Light,
}

/// A light that illuminates the half cylinder towards positive x.
#[derive(Clone, Copy, Debug)]
pub enum Light {
    /// A parallel beam from above. The caustic is a nephroid.
    Collimated {
        /// The irradiance across the beam.
        irradiance: f64,
        /// The angle between the beam and the floor, above 0 and below π/2.
        elevation: f64,
    },
    /// A point on the cylinder at `(-R, 0)`, where there is no wall. The caustic is a cardioid.
    OnCircle {
        /// The radiant intensity.
        intensity: f64,
        /// The height above the floor.
        height: f64,
    },
}

impl HalfCylinder {
    /// The power that is reflected once and lands within a disc. The caustic may cross the disc.
    ///
    /// The integral over the distance along each ray is analytic, which leaves one integral over the angle.
    #[must_use]
    pub fn reflected_power(&self, centre: DVec2, r: f64) -> f64 {
        let within = |angle: f64| {
            let [aside, t] = self.offset_and_distance(angle, centre);
            let half = (r * r - aside * aside).max(0.0).sqrt();
            let reach = self.reach(angle);
            let ends = [t - half, t + half].map(|t| t.clamp(0.0, reach));
            self.power_between(angle, ends)
        };
        let mut power = 0.0;
        for piece in self.monotone_in(centre) {
            let edge = |r: f64| crossing(|angle| self.offset_and_distance(angle, centre)[0] - r, piece);
            let [a, b] = [edge(-r), edge(r)];
            // The integrand behaves like a square root at rays tangent to the disc. This substitution makes it smooth.
            let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
            power += integral(|s| within(middle + half * s.sin()) * half * s.cos(), [-FRAC_PI_2, FRAC_PI_2]).abs();
        }
        self.reflectance * power
    }

    /// The point where the ray reflected at a polar angle from -π/2 to π/2 is tangent to the caustic.
    #[must_use]
    pub fn caustic(&self, angle: f64) -> DVec2 {
        let [_, psi] = self.turn(angle);
        let t = self.radius * self.incidence(angle).cos() / self.turn(angle)[0];
        self.radius * DVec2::from_angle(angle) - t * DVec2::from_angle(psi)
    }

    /// The derivative of ψ, and ψ.
    fn turn(&self, angle: f64) -> [f64; 2] {
        match self.light {
            Light::Collimated { .. } => [2.0, 2.0 * angle],
            Light::OnCircle { .. } => [1.5, 1.5 * angle],
        }
    }

    fn incidence(&self, angle: f64) -> f64 {
        self.turn(angle)[1] - angle
    }

    /// The perpendicular distance of a point from the line of a ray, and its distance from the wall along the ray.
    fn offset_and_distance(&self, angle: f64, point: DVec2) -> [f64; 2] {
        let to_wall = self.radius * DVec2::from_angle(angle) - point;
        let against = DVec2::from_angle(self.turn(angle)[1]);
        [to_wall.perp_dot(against), to_wall.dot(against)]
    }

    /// The intervals of the angle in which the rays sweep over a point in one direction.
    fn monotone_in(&self, point: DVec2) -> Vec<[f64; 2]> {
        let sweep = |angle| self.determinant(angle, self.offset_and_distance(angle, point)[1]);
        monotone(sweep, [-FRAC_PI_2, FRAC_PI_2])
    }

    /// The area on the floor per angle and distance; its sign is the orientation.
    fn determinant(&self, angle: f64, distance: f64) -> f64 {
        self.turn(angle)[0] * distance - self.radius * self.incidence(angle).cos()
    }

    /// The largest landing distance of a ray from the wall, limited by the wall's height and by the opposite side of
    /// the circle.
    fn reach(&self, angle: f64) -> f64 {
        let chord = 2.0 * self.radius * self.incidence(angle).cos();
        let by_height = match self.light {
            Light::Collimated { elevation, .. } => self.wall_height / elevation.tan(),
            // The ray descends linearly: at the wall its height is t / (chord + t) of the light's.
            Light::OnCircle { height, .. } if height > self.wall_height => {
                chord * self.wall_height / (height - self.wall_height)
            }
            Light::OnCircle { .. } => f64::INFINITY,
        };
        chord.min(by_height)
    }

    /// The power that hits the wall, per angle and per landing distance.
    fn power_pdf(&self, angle: f64, distance: f64) -> f64 {
        match self.light {
            Light::Collimated { irradiance, elevation } => irradiance * elevation.sin() * self.radius * angle.cos(),
            // The angle at the light is a / 2. The path length to the floor is the same as without the mirror.
            Light::OnCircle { intensity, height } => {
                let u = 2.0 * self.radius * self.incidence(angle).cos() + distance;
                0.5 * u * intensity * height / height.hypot(u).powi(3)
            }
        }
    }

    /// The integral of the density over the distance.
    fn power_between(&self, angle: f64, [near, far]: [f64; 2]) -> f64 {
        match self.light {
            Light::Collimated { .. } => self.power_pdf(angle, near) * (far - near),
            Light::OnCircle { intensity, height } => {
                let chord = 2.0 * self.radius * self.incidence(angle).cos();
                let seen = |t: f64| height / height.hypot(chord + t);
                0.5 * intensity * (seen(near) - seen(far))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::{
        math::rng::Stream,
        validation::theory::{density::disc_power, numeric::root},
    };

    const SUN: HalfCylinder = HalfCylinder {
        radius: 1.0,
        wall_height: f64::INFINITY,
        reflectance: 1.0,
        light: Light::Collimated { irradiance: 2.0, elevation: std::f64::consts::FRAC_PI_6 },
    };

    fn room(light: Light) -> HalfCylinder {
        HalfCylinder { radius: 1.3, wall_height: 0.9, reflectance: 0.8, light }
    }

    fn rooms() -> [HalfCylinder; 2] {
        let sun = Light::Collimated { irradiance: 2.0, elevation: 0.6 };
        [sun, Light::OnCircle { intensity: 3.0, height: 2.2 }].map(room)
    }

    /// A ray that lands at a point on the floor.
    struct Branch {
        /// The polar angle `a` where it hits the wall.
        angle: f64,
        /// The horizontal distance from the wall to the point.
        distance: f64,
    }

    impl HalfCylinder {
        /// The irradiance of light that has not hit the mirror, within the circle.
        fn direct_irradiance(&self, point: DVec2) -> f64 {
            match self.light {
                Light::Collimated { irradiance, elevation } => irradiance * elevation.sin(),
                Light::OnCircle { intensity, height } => {
                    let u = point.distance(DVec2::new(-self.radius, 0.0));
                    intensity * height / height.hypot(u).powi(3)
                }
            }
        }

        /// The irradiance of light that the mirror has reflected once, within the circle and off the caustic.
        fn reflected_irradiance(&self, point: DVec2) -> f64 {
            let density =
                |Branch { angle, distance }| self.power_pdf(angle, distance) / self.determinant(angle, distance).abs();
            self.reflectance * self.branches(point).into_iter().map(density).sum::<f64>()
        }

        /// The rays that land at a point within the circle after one reflection.
        fn branches(&self, point: DVec2) -> Vec<Branch> {
            let meeting = |piece| {
                let angle = root(|angle| self.offset_and_distance(angle, point)[0], piece)?;
                let [_, distance] = self.offset_and_distance(angle, point);
                (distance > 0.0 && distance < self.reach(angle)).then_some(Branch { angle, distance })
            };
            self.monotone_in(point).into_iter().filter_map(meeting).collect()
        }
    }

    #[test]
    fn the_table_of_the_nephroid() {
        let table = [
            (0.3, 0.0, 2.5, 1),
            (0.6, 0.0, 9.54545455, 3),
            (0.6, 0.2, 0.84796808, 1),
            (0.8, 0.3, 2.77029310, 3),
            (0.2, 0.6, 0.51929878, 1),
        ];
        for (x, y, expected, branches) in table {
            let point = DVec2::new(x, y);
            let found = SUN.reflected_irradiance(point);
            assert!((found - expected).abs() < 5.1e-9, "{point}: {found:.10}, not {expected}");
            assert_eq!(SUN.branches(point).len(), branches, "{point}");
        }
        assert!((SUN.direct_irradiance(DVec2::ZERO) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn the_caustics_are_the_nephroid_and_the_cardioid() {
        let curve = |k: f64, a: f64| (k * DVec2::from_angle(a) - DVec2::from_angle(k * a)) / (k + 1.0);
        for ((room, k), a) in
            rooms().into_iter().zip([3.0, 2.0]).flat_map(|room| [-1.5, -0.4, 0.0, 1.1].map(|a| (room, a)))
        {
            assert!(room.caustic(a).distance(1.3 * curve(k, a)) < 1e-15, "{k}, {a}");
        }
    }

    #[test]
    fn the_power_in_a_disc_is_the_integral_of_the_irradiance() {
        // An infinite wall has no upper rim that would cast an edge on the floor. The quadrature needs smooth
        // irradiance.
        let endless = rooms().map(|room| HalfCylinder { wall_height: f64::INFINITY, ..room });
        for (room, point) in endless
            .into_iter()
            .flat_map(|room| [(0.2, 0.3), (0.3, 0.0), (0.9, 0.1), (1.1, -0.4)].map(|(x, y)| (room, DVec2::new(x, y))))
        {
            let power = room.reflected_power(point, 0.05);
            let expected = disc_power(|p| room.reflected_irradiance(p), point, 0.05);
            assert!((power / expected - 1.0).abs() < 1e-8, "{room:?}, {point}: {power}, not {expected}");
        }
    }

    /// The landing point of a ray that the mirror reflects once, computed with vectors.
    fn traced(room: &HalfCylinder, origin: DVec3, direction: DVec3) -> Option<DVec2> {
        let (o, d) = (origin.truncate(), direction.truncate());
        let (a, b, c) = (d.length_squared(), o.dot(d), o.length_squared() - room.radius.powi(2));
        let wall = origin + (-b + (b * b - a * c).max(0.0).sqrt()) / a * direction;
        let out = direction.reflect(wall.with_z(0.0) / room.radius);
        let point = (wall - wall.z / out.z * out).truncate();
        let reflected = wall.x > 0.0 && wall.z > 0.0 && wall.z < room.wall_height && out.z < 0.0;
        (reflected && point.length() < room.radius).then_some(point)
    }

    #[test]
    fn rays_in_space_agree() {
        let count = 1_600_000_u32;
        for room in rooms() {
            // The discs are on the caustic, at its cusp, inside it, and where the light from the wall's upper rim ends.
            let discs = [room.caustic(0.5), room.caustic(0.0), DVec2::new(0.9, 0.1), DVec2::new(0.0, 0.3)];
            let mut hits = [0_u32; 4];
            let mut power = 0.0;
            for i in 0..count {
                let mut stream = Stream::at(&[19, u64::from(i)]);
                let (origin, direction, all) = ray(&room, stream.next_2d());
                power = all;
                let point = traced(&room, origin, direction);
                let hit = |disc: DVec2| point.is_some_and(|point| point.distance(disc) < 0.15);
                hits.iter_mut().zip(discs).for_each(|(hits, disc)| *hits += u32::from(hit(disc)));
            }
            for (disc, hits) in discs.into_iter().zip(hits) {
                let q = room.reflected_power(disc, 0.15) / (room.reflectance * power);
                let error = (q * (1.0 - q) / f64::from(count)).sqrt();
                let found = f64::from(hits) / f64::from(count);
                assert!(hits > 1000 && (found - q).abs() < 4.0 * error, "{disc}: {found}, not {q} ± {error}");
            }
        }
    }

    /// A random ray of the light, with the power of all such rays.
    fn ray(room: &HalfCylinder, uv: DVec2) -> (DVec3, DVec3, f64) {
        let r = room.radius;
        match room.light {
            Light::Collimated { irradiance, elevation } => {
                let (sin, cos) = elevation.sin_cos();
                // The ray starts in a window at x = 0, which exceeds the wall's height by the beam's descent.
                let top = room.wall_height + r * elevation.tan();
                let origin = DVec3::new(0.0, r * (2.0 * uv.x - 1.0), top * uv.y);
                (origin, DVec3::new(cos, 0.0, -sin), irradiance * cos * 2.0 * r * top)
            }
            Light::OnCircle { intensity, height } => {
                // The directions cover a quarter of the sphere: down and forward.
                let (z, phi) = (uv.x, std::f64::consts::PI * (uv.y - 0.5));
                let flat = (1.0 - z * z).sqrt();
                let direction = DVec3::new(flat * phi.cos(), flat * phi.sin(), -z);
                (DVec3::new(-r, 0.0, height), direction, intensity * std::f64::consts::PI)
            }
        }
    }
}
