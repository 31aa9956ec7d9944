//! Estimates of irradiance from photons against what finitely many photons must make of it.

use std::{
    f64::consts::{PI, TAU},
    num::NonZeroUsize,
};

use glam::{DVec2, DVec3};

use super::{Lots, column};
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

/// These laws.
pub const LAWS: &[Law] = &[
    Law {
        name: "photon-map/kernels",
        claim: "Kernels count a photon once in all, and have the second moments and the mean squares that give the bias r² ∇²E / 8, \
                3/40 and 1/12 and the variance E φ / πr² times 1, 3/2 and 4/3: constant, cone and Epanechnikov.",
        source: "∫ K = 1, ∫ K d²/4, ∫ K²; Silverman 1986, section 4.3",
        check: Check::Analytic(kernels),
    },
    Law {
        name: "photon-map/bias",
        claim: "Estimates of the irradiance below a point light have the mean and the variance that finitely many photons must give \
                them: within a radius and from the k nearest, by each kernel, for several radii, k and numbers of photons.",
        source: "N independent photons: the mean is E blurred by the kernel, the variance (Φ ∫ E K² - mean²) / N; for the k nearest \
                 over Beta(k, N-k+1); Silverman 1986, chapters 4 and 5",
        check: Check::Analytic(moments),
    },
    Law {
        name: "photon-map/convergence",
        claim: "With a radius that shrinks like N^(-1/6) the mean square error falls like N^(-2/3), at each of five N as much as is \
                predicted.",
        source: "squared bias (r²/8 ∇²E)² and variance EΦ / (πr²N) shrink alike; Silverman 1986, section 4.3",
        check: Check::Analytic(convergence),
    },
];

const INTENSITY: f64 = 3.0;
const HEIGHT: f64 = 0.8;
/// From the place below the light.
const DISTANCE: f64 = 0.5;
/// Places with the same irradiance.
const PLACES: u32 = 8;

fn floor() -> Scene {
    let light = format!(
        r#"<emitter type="point"><point name="position" x="0" y="0" z="{HEIGHT}"/><rgb name="intensity" value="{INTENSITY}"/></emitter>"#
    );
    scene(&(light + &ground(Rgb::ZERO)))
}

fn photons(count: u32) -> Photons<impl Fn(DVec2) -> f64> {
    Photons { irradiance: point_light(INTENSITY, HEIGHT), power: 4.0 * PI * INTENSITY, count }
}

/// The irradiance at the places.
fn truth() -> f64 {
    point_light(INTENSITY, HEIGHT)(DISTANCE * DVec2::X)
}

/// What an estimate of `count` photons must be.
fn predicted(count: u32, lookup: &EstimateParameters) -> Prediction {
    let place = DISTANCE * DVec2::X;
    match lookup.nearest {
        Some(k) => photons(count).nearest(lookup.kernel, place, k.get() as u32),
        None => photons(count).within(lookup.kernel, place, lookup.radius),
    }
}

/// Estimates of the irradiance at places around the light's foot, by each lookup.
fn estimates(sites: &[GatherPoint], emitted: EmittedPhotons, lookups: &[EstimateParameters]) -> Vec<Vec<f64>> {
    let map = PhotonMap::new(&emitted.positions, emitted.photons);
    let estimate = |point: &GatherPoint, lookup| {
        let mut sum = 0.0;
        map.for_each_nearby(point, lookup, |nearby| sum += nearby.photon.power().y * nearby.density);
        sum
    };
    lookups.iter().map(|lookup| sites.iter().map(|point| estimate(point, lookup)).collect()).collect()
}

fn sites(scene: &Scene) -> Vec<GatherPoint> {
    let place = |i: u32| DISTANCE * DVec2::from_angle(TAU * f64::from(i) / f64::from(PLACES));
    let above = |place: DVec2| Ray::new(place.extend(0.1), -DVec3::Z);
    let point = |i| GatherPoint::new(scene, &scene.intersect(&above(place(i))).expect("there is a floor"));
    (0..PLACES).map(point).collect()
}

/// The means over all places of the estimates less a number each, to some power.
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
        // E has the mean E + d²/4 ∇²E on a circle.
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
    let sites = sites(&scene);
    let mut findings = Vec::new();
    for (emitted, lots, radii, nearest) in [(2000, 2500, [0.2, 0.4], [10, 40]), (20_000, 250, [0.1, 0.3], [20, 200])] {
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
        let lots = Lots { kind: PhotonMapKind::Global, emitted, count: effort.samples(lots), seed: 61 };
        let found = lots.each(&scene, |_, emitted| {
            let estimates = estimates(&sites, emitted, &lookups);
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
    let sites = sites(&scene);
    let mut findings = Vec::new();
    let mut points = Vec::new();
    for emitted in [250, 1000, 4000, 16_000, 64_000_u64] {
        let radius = RADIUS * (emitted as f64).powf(-1.0 / 6.0);
        let lookup = EstimateParameters { nearest: None, radius, kernel: Kernel::Constant };
        let count = effort.samples(3_200_000 / emitted as u32).min(effort.samples(1600)).max(2);
        let lots = Lots { kind: PhotonMapKind::Global, emitted, count, seed: 62 };
        let found = lots.each(&scene, |_, emitted| means(&estimates(&sites, emitted, &[lookup]), &[truth()], 2));
        let (errors, prediction) = (column(&found, 0), predicted(emitted as u32, &lookup));
        let expected = (prediction.mean - truth()).powi(2) + prediction.variance;
        findings.push(Finding::mean(format!("{emitted} photons, mean square error"), &errors, expected));
        points.push(Point { count: emitted as f64, found: errors, expected });
    }
    findings.push(slope("slope of the mean square error", &points, -2.0 / 3.0));
    findings
}
