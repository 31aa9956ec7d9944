//! Irradiance estimates from photons, with predictions for finitely many photons.

use std::{
    f64::consts::{PI, TAU},
    num::NonZeroUsize,
};

use glam::{DVec2, DVec3};

use super::{PhotonSets, column};
use crate::{
    law::{Check, Effort, Finding, Law},
    math::{Ray, Rgb},
    photon::{EmittedPhotons, EstimateParameters, GatherPoint, Kernel, PhotonMap, PhotonMapKind},
    scene::Scene,
    stats::Moments,
    validation::{
        setup::{ground, scene},
        slope::{Point, slope},
        theory::{
            density::{self, Photons, Prediction, point_light},
            numeric::integral,
        },
    },
};

/// The laws of density estimation.
pub const LAWS: &[Law] = &[
    Law {
        name: "photon-map/kernels",
        claim: "Each kernel integrates to 1. The second moments of the constant, cone and Epanechnikov kernels give the bias r² ∇²E times \
                1/8, 3/40 and 1/12. Their mean squares give the variance E φ / πr² times 1, 3/2 and 4/3.",
        source: "∫ K = 1, ∫ K d²/4, ∫ K²; Silverman 1986, section 4.3",
        check: Check::Analytic(kernels),
    },
    Law {
        name: "photon-map/bias",
        claim: "Estimates of the irradiance below a point light have the mean and the variance that are predicted for finitely many \
                photons: within a radius and from the k nearest, with each kernel, for several radii, k and photon counts.",
        source: "N independent photons: the mean is E blurred by the kernel, the variance is (Φ ∫ E K² - mean²) / N; for the k nearest, \
                 averaged over Beta(k, N-k+1); Silverman 1986, chapters 4 and 5",
        check: Check::Analytic(moments),
    },
    Law {
        name: "photon-map/convergence",
        claim: "With a radius proportional to N^(-1/6), the mean square error falls like N^(-2/3). At each of five N it has the \
                predicted value.",
        source: "the squared bias (r²/8 ∇²E)² and the variance EΦ / (πr²N) shrink at the same rate; Silverman 1986, section 4.3",
        check: Check::Analytic(convergence),
    },
];

const INTENSITY: f64 = 3.0;
const HEIGHT: f64 = 0.8;
/// The distance of the test points from the point below the light.
const DISTANCE: f64 = 0.5;
/// The number of test points, which have equal irradiance.
const POINTS: u32 = 8;

fn floor() -> Scene {
    let light = format!(
        r#"<emitter type="point"><point name="position" x="0" y="0" z="{HEIGHT}"/><rgb name="intensity" value="{INTENSITY}"/></emitter>"#
    );
    scene(&(light + &ground(Rgb::ZERO)))
}

fn photons(count: u32) -> Photons<impl Fn(DVec2) -> f64> {
    Photons { irradiance: point_light(INTENSITY, HEIGHT), power: 4.0 * PI * INTENSITY, count }
}

/// The irradiance at the test points.
fn truth() -> f64 {
    point_light(INTENSITY, HEIGHT)(DISTANCE * DVec2::X)
}

/// The predicted moments of an estimate if `count` photons are emitted.
fn predicted(count: u32, lookup: &EstimateParameters) -> Prediction {
    let point = DISTANCE * DVec2::X;
    match lookup.nearest {
        Some(k) => photons(count).nearest(lookup.kernel, point, k.get() as u32),
        None => photons(count).within(lookup.kernel, point, lookup.radius),
    }
}

/// Estimates of the irradiance, by lookup and then by test point.
fn estimates(points: &[GatherPoint], emitted: EmittedPhotons, lookups: &[EstimateParameters]) -> Vec<Vec<f64>> {
    let map = PhotonMap::new(&emitted.positions, emitted.photons);
    let estimate = |point: &GatherPoint, lookup| {
        let mut sum = 0.0;
        map.for_each_nearby(point, lookup, |nearby| sum += nearby.photon.power().y * nearby.density);
        sum
    };
    lookups.iter().map(|lookup| points.iter().map(|point| estimate(point, lookup)).collect()).collect()
}

fn points(scene: &Scene) -> Vec<GatherPoint> {
    let point = |i: u32| DISTANCE * DVec2::from_angle(TAU * f64::from(i) / f64::from(POINTS));
    let above = |point: DVec2| Ray::new(point.extend(0.1), -DVec3::Z);
    let point = |i| GatherPoint::new(scene, &scene.intersect(&above(point(i))).expect("there is a floor"));
    (0..POINTS).map(point).collect()
}

/// For each lookup, the mean over the test points of `(estimate - centre)^exponent`.
fn means(estimates: &[Vec<f64>], centres: &[f64], exponent: i32) -> Vec<f64> {
    let mean = |(estimates, centre): (&Vec<f64>, &f64)| {
        estimates.iter().map(|x| (x - centre).powi(exponent)).sum::<f64>() / estimates.len() as f64
    };
    estimates.iter().zip(centres).map(mean).collect()
}

fn kernels(_: Effort) -> Vec<Finding> {
    const RADIUS: f64 = 1.7;
    let mut findings = Vec::new();
    for (name, kernel) in Kernel::ALL {
        let density = |r: f64| kernel.density(r * r, RADIUS * RADIUS);
        let over_disc = |f: &dyn Fn(f64) -> f64| integral(|r| TAU * r * f(r), [0.0, RADIUS]);
        // The mean of E over a circle of radius d is E + d²/4 ∇²E.
        let bias = over_disc(&|r| density(r) * 0.25 * r * r) / RADIUS.powi(2);
        let variance = over_disc(&|r| density(r).powi(2)) * PI * RADIUS.powi(2);
        for (what, found, expected) in [
            ("sum", over_disc(&density), 1.0),
            ("bias", bias, density::bias(kernel)),
            ("variance", variance, density::variance(kernel)),
        ] {
            findings.push(Finding::value(format!("{name}, {what}"), found, expected, 1e-12));
        }
    }
    findings
}

fn moments(effort: Effort) -> Vec<Finding> {
    let scene = floor();
    let points = points(&scene);
    let mut findings = Vec::new();
    for (emitted, sets, radii, nearest) in [(2000, 2500, [0.2, 0.4], [10, 40]), (20_000, 250, [0.1, 0.3], [20, 200])] {
        let within = |radius, kernel| EstimateParameters { nearest: None, radius, kernel };
        let nearest_of = |k, kernel| EstimateParameters { nearest: NonZeroUsize::new(k), radius: 100.0, kernel };
        let mut lookups = Vec::new();
        for (name, kernel) in Kernel::ALL {
            lookups.extend(radii.map(|radius| (format!("within {radius}, {name}"), within(radius, kernel))));
            lookups.extend(nearest.map(|k| (format!("{k} nearest, {name}"), nearest_of(k, kernel))));
        }
        let (names, lookups): (Vec<_>, Vec<_>) = lookups.into_iter().unzip();
        let predictions: Vec<_> = lookups.iter().map(|lookup| predicted(emitted as u32, lookup)).collect();
        let expected: Vec<_> = predictions.iter().map(|prediction| prediction.mean).collect();
        let sets = PhotonSets { kind: PhotonMapKind::Global, emitted, count: effort.samples(sets), seed: 61 };
        let found = sets.each(&scene, |_, emitted| {
            let estimates = estimates(&points, emitted, &lookups);
            [means(&estimates, &expected, 1), means(&estimates, &expected, 2)].concat()
        });
        for (i, (name, prediction)) in names.iter().zip(predictions).enumerate() {
            let subject = format!("{emitted} photons, {name}");
            let errors = column(&found, i);
            let bias = prediction.mean - truth();
            let biases = Moments { mean: errors.mean + bias, ..errors };
            findings.push(Finding::mean(format!("{subject}, bias"), &biases, bias));
            let squares = column(&found, lookups.len() + i);
            findings.push(Finding::mean(format!("{subject}, variance"), &squares, prediction.variance));
        }
    }
    findings
}

fn convergence(effort: Effort) -> Vec<Finding> {
    /// The radius for a single photon.
    const RADIUS: f64 = 1.1;
    let scene = floor();
    let points = points(&scene);
    let mut findings = Vec::new();
    let mut measured = Vec::new();
    for emitted in [250, 1000, 4000, 16_000, 64_000_u64] {
        let radius = RADIUS * (emitted as f64).powf(-1.0 / 6.0);
        let lookup = EstimateParameters { nearest: None, radius, kernel: Kernel::Constant };
        let count = effort.samples(3_200_000 / emitted as u32).min(effort.samples(1600)).max(2);
        let sets = PhotonSets { kind: PhotonMapKind::Global, emitted, count, seed: 62 };
        let found = sets.each(&scene, |_, emitted| means(&estimates(&points, emitted, &[lookup]), &[truth()], 2));
        let (errors, prediction) = (column(&found, 0), predicted(emitted as u32, &lookup));
        let expected = (prediction.mean - truth()).powi(2) + prediction.variance;
        findings.push(Finding::mean(format!("{emitted} photons, mean square error"), &errors, expected));
        measured.push(Point { count: emitted as f64, found: errors, expected });
    }
    findings.push(slope("slope of the mean square error", &measured, -2.0 / 3.0));
    findings
}
