//! The irradiance behind a glass sphere, ring by ring. The report plots it.

use std::f64::consts::PI;

use super::{
    PhotonSets,
    ball::{SUN, landed, over_floor, unit},
};
use crate::{
    law::{Check, Curve, Effort, Finding, Law},
    photon::{EmittedPhotons, PhotonMapKind},
    stats::Chi2,
};

/// The law of the caustic's profile.
pub const LAWS: &[Law] = &[Law {
    name: "caustic/profile",
    claim: "Photon counts in 30 rings around the axis behind a glass sphere follow the closed form, both before the focus, where a fold \
            bounds the bright disc, and behind the focus.",
    source: "the closed form of caustic/ball, by Pearson's test; photons of parallel light have equal powers",
    check: Check::Analytic(profiles),
}];

const RINGS: u32 = 30;

fn profiles(effort: Effort) -> Vec<Finding> {
    [(1.2, 0.3), (2.0, 0.9)].map(|(plane, rim)| profile(effort, plane, rim)).into()
}

/// Tests the rings on one plane, up to the radius `rim`.
fn profile(effort: Effort, plane: f64, rim: f64) -> Finding {
    let emitted = u64::from(effort.samples(1_000_000));
    let sets = PhotonSets { kind: PhotonMapKind::Caustic, emitted, count: 1, seed: 48 };
    let (counts, power) = sets
        .each(&over_floor(&SUN, plane), |_, emitted| (counts(&emitted, plane, rim), emitted.power.x))
        .swap_remove(0);
    // The power of a photon in the units of the theory.
    let photon = power / unit(&SUN, 0) / emitted as f64;
    let edge = |i: u32| rim * f64::from(i) / f64::from(RINGS);
    let within = |i: u32| if i == 0 { 0.0 } else { SUN.encircled_power(plane, edge(i)) };
    let expected: Vec<f64> = (0..RINGS).map(|i| (within(i + 1) - within(i)) / photon).collect();
    let elsewhere = |in_rings: f64| emitted as f64 - in_rings;
    let all_counts = [&counts[..], &[elsewhere(counts.iter().sum::<u64>() as f64) as u64]].concat();
    let all_expected = [&expected[..], &[elsewhere(expected.iter().sum())]].concat();
    let test = Chi2::goodness_of_fit(&all_counts, &all_expected, 5.0, 1).expect("there are many rings");
    let statistic = format!("chi² = {:.1} for {} degrees of freedom", test.statistic, test.dof);
    let found = (0..RINGS).zip(&counts).map(|(i, &count)| {
        let (area, count) = (PI * (edge(i + 1).powi(2) - edge(i).powi(2)), count as f64);
        [0.5 * (edge(i) + edge(i + 1)), count * photon / area, count.sqrt() * photon / area]
    });
    let curve = Curve {
        axes: ["distance from the axis, in radii of the sphere", "irradiance over that of the light"],
        expected: line(plane, rim),
        found: found.collect(),
        mark: SUN.folds(plane).first().map(|fold| (fold.radius, "fold of the caustic")),
    };
    Finding::test(format!("L = {plane}"), statistic, test.p).drawn(curve)
}

fn counts(emitted: &EmittedPhotons, plane: f64, rim: f64) -> Vec<u64> {
    let mut counts = vec![0; RINGS as usize];
    for (offset, _) in landed(emitted, plane) {
        if let Some(count) = counts.get_mut((offset.length() / rim * f64::from(RINGS)) as usize) {
            *count += 1;
        }
    }
    counts
}

/// The closed form at points between the axis and the rim, none of which lies on the axis, where it is infinite.
fn line(plane: f64, rim: f64) -> Vec<[f64; 2]> {
    const POINTS: u32 = 300;
    let radius = |i: u32| rim * (f64::from(i) + 0.5) / f64::from(POINTS);
    (0..POINTS).map(|i| [radius(i), SUN.irradiance(plane, radius(i))]).collect()
}
