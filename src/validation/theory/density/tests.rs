use super::*;
use crate::{math::rng::Stream, stats::Moments};

/// The Laplacian of the irradiance of a point light: `I h (9 r² - 6 h²) / (h² + r²)^(7/2)`.
fn laplacian(intensity: f64, height: f64, r: f64) -> f64 {
    let h2 = height * height;
    intensity * height * (9.0 * r * r - 6.0 * h2) / (h2 + r * r).powf(3.5)
}

fn uniform(count: u32) -> Photons<impl Fn(DVec2) -> f64> {
    Photons { irradiance: |_| 2.0, power: 50.0, count }
}

fn lamp(count: u32) -> Photons<impl Fn(DVec2) -> f64> {
    Photons { irradiance: point_light(3.0, 0.8), power: 4.0 * PI * 3.0, count }
}

#[test]
fn small_radii_have_the_bias_and_the_variance_of_the_expansion() {
    let (photons, point) = (lamp(1000), DVec2::new(0.3, 0.4));
    let irradiance = (photons.irradiance)(point);
    for (_, kernel) in Kernel::ALL {
        let r = 0.01;
        let found = photons.within(kernel, point, r);
        let bias = (found.mean - irradiance) / (r * r * laplacian(3.0, 0.8, 0.5));
        let variance = found.variance * 1000.0 * PI * r * r / (irradiance * photons.power);
        // The next terms are of the order r² / h² and of the fraction of photons in the disc.
        assert!((bias / super::bias(kernel) - 1.0).abs() < 1e-3, "{kernel:?}: {bias}");
        assert!((variance / super::variance(kernel) - 1.0).abs() < 1e-3, "{kernel:?}: {variance}");
    }
}

#[test]
fn the_power_in_a_disc_below_the_light() {
    let exact = |r: f64| TAU * 3.0 * (1.0 - 0.8 / 0.8_f64.hypot(r));
    for r in [0.1, 1.0, 20.0] {
        let found = disc_power(point_light(3.0, 0.8), DVec2::ZERO, r);
        assert!((found / exact(r) - 1.0).abs() < 1e-12, "{r}");
    }
    // A disc whose edge reaches the point below the light, integrated over strips.
    let (x, r, h2) = (0.5, 0.5, 0.64);
    let strip = |u: f64| {
        let (half, s) = ((r * r - u * u).sqrt(), h2 + (x + u) * (x + u));
        2.0 * 3.0 * 0.8 * half / (s * (s + half * half).sqrt())
    };
    let expected = integral(strip, [-r, r]);
    let found = disc_power(point_light(3.0, 0.8), DVec2::new(0.3, 0.4), r);
    assert!((found / expected - 1.0).abs() < 1e-9, "{found}, not {expected}");
}

#[test]
fn a_constant_kernel_counts_a_binomial_number() {
    let (photons, point, r) = (lamp(500), DVec2::new(0.3, 0.4), 0.6);
    let q = disc_power(&photons.irradiance, point, r) / photons.power;
    let variance = q * (1.0 - q) / 500.0 * (photons.power / (PI * r * r)).powi(2);
    let found = photons.within(Kernel::Constant, point, r);
    assert!((found.variance / variance - 1.0).abs() < 1e-12);
    assert!((found.mean / (q * photons.power / (PI * r * r)) - 1.0).abs() < 1e-12);
}

#[test]
fn nearest_photons_under_uniform_irradiance_have_no_bias() {
    for k in [5, 20, 50, 200] {
        let n = 100_000;
        let found = uniform(n).nearest(Kernel::Constant, DVec2::ZERO, k);
        assert!((found.mean / 2.0 - 1.0).abs() < 1e-9, "{k}: {}", found.mean);
        // From the moments of 1 / q for a Beta variable: (k - 1)(N - 1) / ((k - 2) N) - 1, about 1 / (k - 2).
        let (k, n) = (f64::from(k), f64::from(n));
        let expected = (k - 1.0) * (n - 1.0) / ((k - 2.0) * n) - 1.0;
        assert!((found.variance / 4.0 / expected - 1.0).abs() < 1e-6, "{k}: {}", found.variance);
    }
    for (_, kernel) in Kernel::ALL {
        assert!((uniform(1000).nearest(kernel, DVec2::ZERO, 10).mean / 2.0 - 1.0).abs() < 1e-9, "{kernel:?}");
    }
}

/// Distances from a point of the landed photons of a point light.
fn distances(photons: &Photons<impl Fn(DVec2) -> f64>, point: DVec2, address: [u64; 2]) -> Vec<f64> {
    let mut stream = Stream::at(&address);
    let one = |_| {
        // Half of the photons travel up and never land.
        let (z, phi) = (2.0 * stream.next_1d() - 1.0, TAU * stream.next_1d());
        let landed = 0.8 * (1.0 - z * z).sqrt() / z * DVec2::from_angle(phi);
        (z > 0.0).then(|| landed.distance(point))
    };
    (0..photons.count).filter_map(one).collect()
}

fn agrees(subject: &str, moments: &Moments, expected: Prediction) {
    let error = moments.std_error().expect("two and more");
    assert!((moments.mean - expected.mean).abs() < 4.0 * error, "{subject}: {}, {expected:?} ± {error}", moments.mean);
    // The relative standard error of a variance is √(2 / n) for normal numbers; the estimates have a kurtosis below 9.
    let variance = moments.variance().expect("two and more");
    let bound = 4.0 * (8.0 / moments.n as f64).sqrt();
    assert!((variance / expected.variance - 1.0).abs() < bound, "{subject}: {variance}, {expected:?}");
}

#[test]
fn simulated_photons_agree() {
    let (photons, point, radius, k) = (lamp(400), DVec2::new(0.3, 0.4), 0.5, 30_u32);
    let photon = photons.power / f64::from(photons.count);
    let mut found = [[Moments::default(); 3]; 2];
    for i in 0..20_000 {
        let mut distances = distances(&photons, point, [29, i]);
        distances.sort_by(f64::total_cmp);
        let nearest = distances[k as usize - 1];
        let inside = distances.partition_point(|&d| d < radius);
        for (j, (_, kernel)) in Kernel::ALL.into_iter().enumerate() {
            let sum = |radius, many| {
                distances[..many].iter().map(|&d| photon * kernel.density(d * d, radius * radius)).sum::<f64>()
            };
            found[0][j].push(sum(radius, inside));
            found[1][j].push(sum(nearest, k as usize - 1));
        }
    }
    for (j, (_, kernel)) in Kernel::ALL.into_iter().enumerate() {
        agrees(&format!("within, {kernel:?}"), &found[0][j], photons.within(kernel, point, radius));
        agrees(&format!("nearest, {kernel:?}"), &found[1][j], photons.nearest(kernel, point, k));
    }
    // The test has the power to distinguish the mean from the irradiance itself.
    let bias = photons.nearest(Kernel::Constant, point, k).mean - (photons.irradiance)(point);
    assert!(bias.abs() > 8.0 * found[1][0].std_error().expect("two and more"), "{bias}");
}
