use glam::DVec3;

use super::*;
use crate::{math::rng::Stream, stats::Moments};

const SUN: BallLens = BallLens { radius: 1.0, index: 1.5, light: Light::Collimated { irradiance: 1.0 } };
const LAMP: BallLens = BallLens { radius: 1.0, index: 1.5, light: Light::Point { intensity: 1.0, distance: 3.0 } };

impl BallLens {
    /// The z coordinate and the axis distance of the point where the ray with an offset is tangent to the caustic
    /// surface.
    fn caustic(&self, offset: f64) -> [f64; 2] {
        let ray = self.leaving((offset / self.radius).asin());
        let (sin, cos) = ray.tilt.sin_cos();
        let lever = ray.offset_slope / ray.tilt_slope;
        [lever * cos + ray.offset * sin, (ray.offset * cos - lever * sin).abs()]
    }

    /// The irradiance of light that has not hit the sphere, at a distance `r` from the axis on the plane at
    /// `z = plane`.
    fn direct_irradiance(&self, plane: f64, r: f64) -> f64 {
        match self.light {
            _ if r < self.shadow_radius(plane) => 0.0,
            Light::Collimated { irradiance } => irradiance,
            Light::Point { intensity, distance } => {
                let h = distance + plane;
                intensity * h / (h * h + r * r).powf(1.5)
            }
        }
    }
}

/// Half a unit of the eighth decimal digit.
const ROUNDING: f64 = 5.1e-9;

#[test]
fn the_table_of_encircled_power() {
    let radii = [0.05, 0.1, 0.2, 0.4, 0.8, 1.0];
    let table = [
        (1.0, [0.10023513, 0.40375112, 2.62436476, 2.62445078, 2.62448647, 2.62449308]),
        (1.2, [0.84290291, 2.20545608, 2.38057856, 2.52617482, 2.59748449, 2.60743729]),
        (1.35, [1.42932522, 1.69739657, 2.02607482, 2.33871840, 2.53379012, 2.56657169]),
        (1.5, [0.80262023, 1.17218299, 1.62841745, 2.09459051, 2.43244962, 2.49795252]),
        (2.0, [0.06155130, 0.21384871, 0.59630467, 1.23617036, 1.93552093, 2.12174757]),
        (3.0, [0.00721022, 0.02851133, 0.10913284, 0.37503808, 0.99689039, 1.26333388]),
    ];
    for (plane, powers) in table {
        for (r, expected) in radii.into_iter().zip(powers) {
            let found = SUN.encircled_power(plane, r);
            assert!((found - expected).abs() < ROUNDING, "L = {plane}, r = {r}: {found:.10}, not {expected}");
        }
    }
}

#[test]
fn the_table_of_irradiance() {
    let table: [(f64, &[(f64, f64)]); 2] = [
        (2.0, &[(0.05, 7.415912), (0.1, 5.679307), (0.2, 3.013895), (0.4, 1.032466), (0.8, 0.223766)]),
        (3.0, &[(0.05, 0.914485), (0.1, 0.893761), (0.2, 0.819149), (0.4, 0.610555), (0.8, 0.285684)]),
    ];
    for (plane, values) in table {
        for &(r, expected) in values {
            let found = SUN.irradiance(plane, r);
            assert!((found - expected).abs() < 5.1e-7, "L = {plane}, r = {r}: {found:.8}, not {expected}");
        }
    }
}

#[test]
fn the_table_of_folds() {
    let table = [
        (1.0, 0.18298115),
        (1.1, 0.12088521),
        (1.2, 0.07402315),
        (1.3, 0.03840370),
        (1.35, 0.02441992),
        (1.4, 0.01303210),
        (1.45, 0.00452285),
    ];
    for (plane, expected) in table {
        let folds = SUN.folds(plane);
        assert!(folds.len() == 1 && (folds[0].radius - expected).abs() < ROUNDING, "L = {plane}: {folds:?}");
        let [z, r] = SUN.caustic(folds[0].offset);
        assert!((z - plane).abs() < 1e-12 && (r - folds[0].radius).abs() < 1e-12, "L = {plane}: {z}, {r}");
    }
    assert!((SUN.folds(1.0)[0].offset - 0.73696).abs() < 5.1e-6);
    assert!([1.5, 1.6, 2.0, 3.0].iter().all(|&plane| SUN.folds(plane).is_empty()));
}

#[test]
fn the_powers_of_the_orders() {
    let shares = [0.09177796, 0.83554440, 0.06118322, 0.00799338, 0.00196821];
    for (order, expected) in (0..).zip(shares) {
        let found = SUN.order_power(order) / SUN.received();
        assert!((found - expected).abs() < ROUNDING, "p = {order}: {found:.10}, not {expected}");
    }
    // Power is conserved: the order 60 has less than 1e-5 of the power.
    let sum: f64 = (0..60).map(|order| LAMP.order_power(order)).sum();
    assert!((sum / LAMP.received() - 1.0).abs() < 1e-5, "{sum}");
}

#[test]
fn the_numbers_of_a_point_light() {
    assert!((LAMP.order_power(1) - 0.299565).abs() < 5.1e-7);
    assert!((LAMP.shadow_radius(2.0) - 1.76776695).abs() < ROUNDING);
    for (r, expected) in [(0.1, 0.158847), (0.2, 0.231553), (0.4, 0.260749), (0.8, 0.286472)] {
        let found = LAMP.encircled_power(2.0, r);
        assert!((found - expected).abs() < 5.1e-7, "r = {r}: {found:.8}, not {expected}");
    }
}

#[test]
fn the_irradiance_is_the_growth_of_the_power() {
    for ball in [SUN, LAMP, BallLens { radius: 0.7, index: 1.3, ..SUN }] {
        for (plane, r) in [(1.2, 0.05), (1.2, 0.2), (2.0, 0.2), (3.0, 0.4)] {
            let rings = integral(|r| TAU * r * ball.irradiance(plane, r), [r, 1.2 * r]);
            let growth = ball.encircled_power(plane, 1.2 * r) - ball.encircled_power(plane, r);
            assert!((rings / growth - 1.0).abs() < 1e-7, "{ball:?}, L = {plane}, r = {r}: {rings}, not {growth}");
        }
    }
}

#[test]
fn direct_light_and_shadow_make_up_the_beam() {
    let (plane, r) = (2.0, 2.5_f64);
    let whole = TAU * (1.0 - 5.0 / (25.0 + r * r).sqrt());
    assert!((LAMP.direct_power(plane, r) + LAMP.received() - whole).abs() < 1e-14);
    assert!((SUN.direct_power(plane, r) + SUN.received() - PI * r * r).abs() < 1e-14);
    let ring = integral(|r| TAU * r * LAMP.direct_irradiance(plane, r), [LAMP.shadow_radius(plane), r]);
    assert!((ring - LAMP.direct_power(plane, r)).abs() < 1e-12);
}

/// Refracts a ray twice with vectors. Returns its intersection with a plane and the transmitted fraction of its power.
fn traced(ball: &BallLens, origin: DVec3, direction: DVec3, plane: f64) -> Option<(DVec3, f64)> {
    let along = -origin.dot(direction);
    let inside = along * along - origin.length_squared() + ball.radius.powi(2);
    let entry = origin + (along - inside.max(0.0).sqrt()) * direction;
    let within = direction.refract(entry / ball.radius, 1.0 / ball.index);
    let exit = entry - 2.0 * entry.dot(within) * within;
    let out = within.refract(-exit / ball.radius, ball.index);
    let share = |cos: f64, eta| 1.0 - fresnel::dielectric(cos, eta).reflectance;
    let cos_in = -direction.dot(entry / ball.radius);
    let cos_out = within.dot(exit / ball.radius);
    let point = exit + (plane - exit.z) / out.z * out;
    (inside > 0.0 && out.z > 0.0).then(|| (point, share(cos_in, ball.index) * share(cos_out, 1.0 / ball.index)))
}

#[test]
fn rays_in_space_agree() {
    let (radius, index, plane, r) = (0.8, 1.6, 1.1, 0.15);
    let sun = BallLens { radius, index, light: Light::Collimated { irradiance: 2.0 } };
    let lamp = BallLens { light: Light::Point { intensity: 3.0, distance: 2.4 }, ..sun };
    for (number, ball) in [(0, sun), (1, lamp)] {
        let mut moments = Moments::default();
        for i in 0..100_000 {
            let uv = Stream::at(&[17, number, i]).next_2d();
            let around = DVec3::new((TAU * uv.y).cos(), (TAU * uv.y).sin(), 0.0);
            let (origin, direction) = match ball.light {
                Light::Collimated { .. } => (radius * uv.x.sqrt() * around - 5.0 * DVec3::Z, DVec3::Z),
                Light::Point { distance, .. } => {
                    let cos = 1.0 - uv.x * (1.0 - (1.0 - (radius / distance).powi(2)).sqrt());
                    (-distance * DVec3::Z, (1.0 - cos * cos).sqrt() * around + cos * DVec3::Z)
                }
            };
            let landed = traced(&ball, origin, direction, plane).filter(|(point, _)| point.truncate().length() < r);
            moments.push(ball.received() * landed.map_or(0.0, |(_, share)| share));
        }
        let expected = ball.encircled_power(plane, r);
        let error = moments.std_error().expect("two and more");
        assert!((moments.mean - expected).abs() < 4.0 * error, "{}, not {expected}, ± {error}", moments.mean);
    }
}
