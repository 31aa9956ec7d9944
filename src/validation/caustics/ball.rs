//! The caustic of a glass sphere of arbitrary position, radius and light axis.

use std::f64::consts::TAU;

use glam::DVec3;

use super::{PhotonSets, column};
use crate::{
    law::{Check, Effort, Finding, Law},
    math::{Ray, Rgb, rng::Stream},
    photon::{EmittedPhotons, EstimateParameters, GatherPoint, Kernel, Photon, PhotonMap, PhotonMapKind},
    scene::Scene,
    stats::Estimate,
    transport::PathClass,
    validation::{
        setup::{CHANNELS, GLASS, diffuse, scene, triple},
        theory::ball::{BallLens, Light},
    },
};

/// The laws of the glass sphere's caustic.
pub const LAWS: &[Law] = &[
    Law {
        name: "caustic/ball",
        claim: "Parallel light that a glass sphere of radius 1 and index 1.5 refracts twice has the power of the closed form within six \
                distances of the axis, on planes at 1 to 3 behind the centre. The power is equivalent within 0.5 % where most of the \
                light lands.",
        source: "E = E0 Σ (1-R)² |h / (r r'(h))| over the branches of r(h) = (h - L sin δ) / cos δ, integrated; \
                 1.63620304 (L = 1.2), .59630467 (L = 2), .10913284 (L = 3) and so on, as in the tables of theory/ball",
        check: Check::Analytic(encircled),
    },
    Law {
        name: "caustic/orders",
        claim: "Light that leaves a glass sphere after p - 1 internal reflections has the power of the order p of Airy's series, for p from 0 \
                to 4, for a distant and for a near point light.",
        source: "∫ R, (1-R)² R^(p-1) over the sphere's cross-section: .09177796, .83554440, .06118322, .00799338, .00196821 for distant light",
        check: Check::Analytic(orders),
    },
    Law {
        name: "caustic/ball-map",
        claim: "The caustic map's estimates with each kernel, integrated over discs, give the power of the closed form.",
        source: "the closed form of caustic/ball; a kernel of a tenth of the disc's radius blurs only its rim",
        check: Check::Analytic(from_map),
    },
    Law {
        name: "caustic/folds",
        claim: "Light that has not yet crossed the axis lands inside the fold of a sphere's caustic and reaches up to it. From the paraxial \
                focus on there is no such light.",
        source: "the maximum of r(h): 0.18298115 (L = 1), .12088521, .07402315, .03840370, .02441992, .01303210, .00452285 (L = 1.45)",
        check: Check::Analytic(folds),
    },
    Law {
        name: "caustic/point-source",
        claim: "The caustic of a point light at three radii from a sphere has the power of the closed form within four distances of the \
                axis. The light that passes the sphere leaves a shadow of the geometric radius.",
        source: "refraction as for parallel light, tilted: .158847, .231553, .260749, .286472; the shadow 1.76776695",
        check: Check::Analytic(point_source),
    },
];

const CENTRE: DVec3 = DVec3::new(0.3, -0.2, 0.5);
const RADIUS: f64 = 1.7;
/// The unit direction of the light.
const AXIS: DVec3 = DVec3::new(0.48, -0.6, 0.64);
/// The irradiance of parallel light; of a point light, the radiant intensity over the square of its distance in radii.
const LIGHT: Rgb = Rgb::new(1.0, 2.5, 0.4);

/// A sphere of radius 1 in parallel light. In its units, powers are smaller than the scene's by the factor `RADIUS²`.
pub(super) const SUN: BallLens = BallLens { radius: 1.0, index: 1.5, light: Light::Collimated { irradiance: 1.0 } };

fn lamp(distance: f64) -> BallLens {
    BallLens { radius: 1.0, index: 1.5, light: Light::Point { intensity: 1.0, distance } }
}

fn light(ball: &BallLens) -> String {
    match ball.light {
        Light::Collimated { .. } => format!(
            r#"<emitter type="directional"><vector name="direction" value="{}"/><rgb name="irradiance" value="{}"/></emitter>"#,
            triple(AXIS),
            triple(LIGHT)
        ),
        Light::Point { distance, .. } => format!(
            r#"<emitter type="point"><point name="position" value="{}"/><rgb name="intensity" value="{}"/></emitter>"#,
            triple(CENTRE - distance * RADIUS * AXIS),
            triple(distance * distance * LIGHT)
        ),
    }
}

/// The factor from the theory's unit of power to the scene's, for a channel.
pub(super) fn unit(ball: &BallLens, channel: usize) -> f64 {
    match ball.light {
        Light::Collimated { .. } => LIGHT[channel] * RADIUS * RADIUS,
        Light::Point { distance, .. } => LIGHT[channel] * distance * distance,
    }
}

fn glass_sphere() -> String {
    format!(
        r#"<shape type="sphere"><transform name="to_world"><scale value="{RADIUS}"/><translate value="{}"/></transform>{GLASS}</shape>"#,
        triple(CENTRE)
    )
}

/// The intersection of the axis with a plane at `plane` radii behind the centre.
fn foot(plane: f64) -> DVec3 {
    CENTRE + plane * RADIUS * AXIS
}

/// A glass sphere with its light and a black floor at `plane` radii behind the centre.
pub(super) fn over_floor(ball: &BallLens, plane: f64) -> Scene {
    let (origin, up) = (foot(plane), AXIS.any_orthonormal_vector());
    let floor = format!(
        r#"<shape type="rectangle"><transform name="to_world"><scale value="100"/>
           <lookat origin="{}" target="{}" up="{}"/></transform>{}</shape>"#,
        triple(origin),
        triple(origin - AXIS),
        triple(up),
        diffuse(Rgb::ZERO)
    );
    scene(&(light(ball) + &glass_sphere() + &floor))
}

/// Photons of the order 1 with their landing points, as offsets from the axis in radii.
pub(super) fn landed(emitted: &EmittedPhotons, plane: f64) -> impl Iterator<Item = (DVec3, &Photon)> {
    let offset = move |p: &[f32; 3]| {
        let offset = (DVec3::from_array(p.map(f64::from)) - foot(plane)) / RADIUS;
        offset.reject_from_normalized(AXIS)
    };
    let photons = emitted.positions.iter().map(offset).zip(&emitted.photons);
    photons.filter(|(_, photon)| photon.depth() == 3 && photon.class() == PathClass::Caustic)
}

/// The power of one channel within each radius.
fn within(emitted: &EmittedPhotons, plane: f64, channel: usize, radii: &[f64]) -> Vec<f64> {
    let mut powers = vec![0.0; radii.len()];
    for (offset, photon) in landed(emitted, plane) {
        let (distance, power) = (offset.length(), photon.power()[channel]);
        powers.iter_mut().zip(radii).for_each(|(sum, r)| *sum += if distance < *r { power } else { 0.0 });
    }
    powers
}

/// The plane that almost touches the sphere.
const TOUCHING: f64 = 1.0 + 1e-6;

fn encircled(effort: Effort) -> Vec<Finding> {
    const RADII: [f64; 6] = [0.05, 0.1, 0.2, 0.4, 0.8, 1.0];
    /// Equivalence is tested where more power than this lands: there the noise is low enough.
    const MIN_POWER: f64 = 2.2;
    const SETS: u32 = 32;
    let sets = PhotonSets { kind: PhotonMapKind::Caustic, emitted: 100_000, count: effort.samples(SETS), seed: 41 };
    let mut findings = Vec::new();
    for (i, plane) in [TOUCHING, 1.2, 1.35, 1.5, 2.0, 3.0].into_iter().enumerate() {
        let (channel, scene) = (i % 3, over_floor(&SUN, plane));
        let sets = PhotonSets { seed: sets.seed + 100 * i as u64, ..sets };
        let found = sets.each(&scene, |_, emitted| within(&emitted, plane, channel, &RADII));
        for (j, r) in RADII.into_iter().enumerate() {
            let (moments, power) = (column(&found, j), SUN.encircled_power(plane, r));
            let expected = unit(&SUN, channel) * power;
            let subject = format!("L = {plane}, r = {r}, {}", CHANNELS[channel]);
            findings.push(Finding::mean(&*subject, &moments, expected));
            if power > MIN_POWER {
                let estimate = Estimate::from_moments(&moments).expect("there are two sets or more");
                let bound = effort.bound(SETS, 0.005);
                findings.push(Finding::equivalent(subject, &estimate, &Estimate::exact(expected), bound));
            }
        }
    }
    findings
}

fn orders(effort: Effort) -> Vec<Finding> {
    const TABLE: [f64; 5] = [0.091_777_96, 0.835_544_40, 0.061_183_22, 0.007_993_38, 0.001_968_21];
    const FAR: f64 = 1000.0;
    let sets = PhotonSets { kind: PhotonMapKind::Caustic, emitted: 20_000, count: effort.samples(32), seed: 42 };
    let mut findings = Vec::new();
    for (i, distance) in [3.0, FAR].into_iter().enumerate() {
        let (ball, channel) = (lamp(distance), i + 1);
        let sphere = format!(
            r#"<shape type="sphere"><float name="radius" value="{}"/><boolean name="flip_normals" value="true"/>{}</shape>"#,
            4.0 * distance,
            diffuse(Rgb::ZERO)
        );
        let scene = scene(&(light(&ball) + &glass_sphere() + &sphere));
        let found = sets.each(&scene, |_, emitted| {
            let of_order = |order: u32| {
                let photons = emitted.photons.iter().filter(|photon| photon.depth() == order + 2);
                photons.map(|photon| photon.power()[channel]).sum::<f64>()
            };
            [0, 1, 2, 3, 4].map(of_order)
        });
        for (order, fraction) in (0..).zip(TABLE) {
            let power = ball.order_power(order);
            if distance == FAR {
                let subject = format!("p = {order}, fraction in the closed form");
                // Light from a point at the distance s is parallel to within (R / s)².
                findings.push(Finding::value(subject, power / ball.received(), fraction, 1e-5 * fraction));
            }
            let subject = format!("p = {order}, s = {distance}, {}", CHANNELS[channel]);
            findings.push(Finding::mean(subject, &column(&found, order as usize), unit(&ball, channel) * power));
        }
    }
    findings
}

fn from_map(effort: Effort) -> Vec<Finding> {
    const DISCS: [(f64, &[f64]); 5] = [
        (1.2, &[0.1, 0.2, 0.4]),
        (1.35, &[0.1, 0.2, 0.4]),
        (1.5, &[0.1, 0.2, 0.4, 0.8]),
        (2.0, &[0.4, 0.8, 1.0]),
        (3.0, &[1.0]),
    ];
    const SETS: u32 = 24;
    let sets = PhotonSets { kind: PhotonMapKind::Caustic, emitted: 100_000, count: effort.samples(SETS), seed: 43 };
    let mut findings = Vec::new();
    for (i, (plane, radii)) in DISCS.into_iter().enumerate() {
        let (channel, scene) = (i % 3, over_floor(&SUN, plane));
        let kernel = |j: usize| Kernel::ALL[(i + j) % 3];
        let found = sets.each(&scene, |set, emitted| {
            let map = PhotonMap::new(&emitted.positions, emitted.photons);
            let mean = |(j, &r): (usize, &f64)| {
                let lookup = EstimateParameters { nearest: None, radius: 0.1 * r * RADIUS, kernel: kernel(j).1 };
                let mut sampler = Stream::at(&[44, set, i as u64, j as u64]);
                mean_irradiance(&scene, &map, &lookup, (plane, r), &mut sampler)[channel]
            };
            radii.iter().enumerate().map(mean).collect::<Vec<_>>()
        });
        for (j, r) in radii.iter().enumerate() {
            let area = 0.5 * TAU * (r * RADIUS).powi(2);
            let estimate = Estimate::from_moments(&column(&found, j)).expect("there are two sets or more");
            let expected = Estimate::exact(unit(&SUN, channel) * SUN.encircled_power(plane, *r) / area);
            let subject = format!("L = {plane}, r = {r}, {}", kernel(j).0);
            findings.push(Finding::equivalent(subject, &estimate, &expected, effort.bound(SETS, 0.01)));
        }
    }
    findings
}

/// The mean irradiance estimate over a disc of the floor, stratified by sector and by distance from the axis.
///
/// The strata are uniform in the distance, which puts more points near the axis, where most of the light is.
fn mean_irradiance(
    scene: &Scene,
    map: &PhotonMap,
    lookup: &EstimateParameters,
    disc: (f64, f64),
    sampler: &mut Stream,
) -> Rgb {
    const STEPS: u32 = 48;
    const SECTORS: u32 = 6;
    let (plane, r) = disc;
    let across = AXIS.any_orthonormal_vector();
    let along = AXIS.cross(across);
    let mut sum = Rgb::ZERO;
    for (step, sector) in (0..STEPS).flat_map(|step| (0..SECTORS).map(move |sector| (step, sector))) {
        let u = sampler.next_2d();
        let fraction = (f64::from(step) + u.x) / f64::from(STEPS);
        let (sin, cos) = (TAU * (f64::from(sector) + u.y) / f64::from(SECTORS)).sin_cos();
        let p = foot(plane) + fraction * r * RADIUS * (cos * across + sin * along);
        let si = scene.intersect(&Ray::new(p - 0.01 * AXIS, AXIS)).expect("there is a floor");
        // The weight corrects the stratification for the area of each ring.
        let weight = 2.0 * fraction / f64::from(STEPS * SECTORS);
        map.for_each_nearby(&GatherPoint::new(scene, &si), lookup, |nearby| {
            sum += nearby.photon.power() * (nearby.density * weight);
        });
    }
    sum
}

/// The expected number of photons in a region that must contain one. It is empty with probability e⁻²⁰.
const SURE: f64 = 20.0;
/// The error of coordinates of a few units stored in f32.
const ROUNDING: f64 = 1e-6;

fn folds(effort: Effort) -> Vec<Finding> {
    let emitted = u64::from(effort.samples(300_000));
    let sets = PhotonSets { kind: PhotonMapKind::Caustic, emitted, count: 1, seed: 45 };
    // The landing distances of photons that come from farther off the axis than they land: they have not crossed it
    // yet.
    let before_axis = |plane: f64| {
        let is_before = |(offset, photon): &(DVec3, &Photon)| {
            offset.length() > ROUNDING && photon.direction().dot(offset.normalize()) > 1e-3
        };
        let distances = |_, emitted| {
            landed(&emitted, plane).filter(is_before).map(|(offset, _)| offset.length()).collect::<Vec<_>>()
        };
        sets.each(&over_floor(&SUN, plane), distances).concat()
    };
    let mut findings = Vec::new();
    for plane in [TOUCHING, 1.1, 1.2, 1.3, 1.35, 1.4, 1.45] {
        let fold = SUN.folds(plane)[0];
        // `SURE` photons are expected with offsets within `near` of the fold's, if at least a quarter of the emitted
        // photons is refracted twice.
        let near = SURE / (0.25 * emitted as f64 * 4.0 * fold.offset);
        let land = |offset| SUN.landing(plane, offset).expect("offsets near a fold land");
        let short = fold.radius - land(fold.offset - near).min(land(fold.offset + near));
        let farthest = before_axis(plane).into_iter().fold(0.0, f64::max);
        findings.push(Finding::value(format!("L = {plane}, radius"), farthest, fold.radius, short + ROUNDING));
    }
    for plane in [1.5, 2.0, 3.0] {
        findings.push(Finding::value(
            format!("L = {plane}, before the axis"),
            before_axis(plane).len() as f64,
            0.0,
            0.0,
        ));
    }
    findings
}

fn point_source(effort: Effort) -> Vec<Finding> {
    const RADII: [f64; 4] = [0.1, 0.2, 0.4, 0.8];
    /// The radius within which direct light is tested.
    const RIM: f64 = 3.5;
    let (ball, plane, channel) = (lamp(3.0), 2.0, 0);
    let scene = over_floor(&ball, plane);
    let sets = PhotonSets { kind: PhotonMapKind::Caustic, emitted: 50_000, count: effort.samples(32), seed: 46 };
    let found = sets.each(&scene, |_, emitted| within(&emitted, plane, channel, &RADII));
    let mut findings = Vec::new();
    for (j, r) in RADII.into_iter().enumerate() {
        let expected = unit(&ball, channel) * ball.encircled_power(plane, r);
        findings.push(Finding::mean(format!("caustic, r = {r}"), &column(&found, j), expected));
    }
    let sets = PhotonSets { kind: PhotonMapKind::Global, seed: 47, ..sets };
    let found = sets.each(&scene, |_, emitted| direct(&emitted, plane, channel, RIM));
    let expected = unit(&ball, channel) * ball.direct_power(plane, RIM);
    findings.push(Finding::mean(format!("direct, r = {RIM}"), &column(&found, 0), expected));
    // Within `gap` beyond the shadow's edge, `SURE` direct photons are expected.
    let emitted = (sets.emitted * u64::from(sets.count)) as f64;
    let shadow = ball.shadow_radius(plane);
    let fraction = |gap: f64| ball.direct_power(plane, shadow + gap) / (2.0 * TAU);
    let gap = SURE / (emitted * fraction(1e-3)) * 1e-3;
    let nearest = found.iter().map(|found| found[1]).fold(f64::INFINITY, f64::min);
    findings.push(Finding::value("radius of the shadow", nearest, shadow, gap + ROUNDING));
    findings
}

/// The power of direct light within a radius, and the smallest distance of a direct photon from the axis.
fn direct(emitted: &EmittedPhotons, plane: f64, channel: usize, rim: f64) -> [f64; 2] {
    let mut found = [0.0, f64::INFINITY];
    for (p, photon) in emitted.positions.iter().zip(&emitted.photons) {
        let distance = DVec3::from_array(p.map(f64::from)).distance(foot(plane)) / RADIUS;
        if photon.class() == PathClass::Direct && distance < rim {
            found = [found[0] + photon.power()[channel], found[1].min(distance)];
        }
    }
    found
}
