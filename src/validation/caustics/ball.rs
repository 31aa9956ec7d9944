//! The caustic of a glass ball, that stands somewhere, has some radius, and is lit along some axis.

use std::f64::consts::TAU;

use glam::DVec3;

use super::{Lots, column};
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

/// These laws.
pub const LAWS: &[Law] = &[
    Law {
        name: "caustic/ball",
        claim: "Parallel light that a glass ball of radius 1 and index 1.5 refracts twice lands, on planes at 1 to 3 behind its centre, \
                within six distances of the axis with the power of the closed form; equivalent within 0.5 % where most of it does.",
        source: "E = E0 Σ (1-R)² |h / (r r'(h))| over the branches of r(h) = (h - L sin δ) / cos δ, integrated; \
                 1.63620304 (L = 1.2), .59630467 (L = 2), .10913284 (L = 3) and so on: see the tables of theory/ball",
        check: Check::Analytic(encircled),
    },
    Law {
        name: "caustic/orders",
        claim: "What a glass ball sends out after p - 1 inner reflections has the power of the order p of Airy's series, for p from 0 \
                to 4, in light from far away and from a near point.",
        source: "∫ R, (1-R)² R^(p-1) over the ball's cross-section: .09177796, .83554440, .06118322, .00799338, .00196821 from far away",
        check: Check::Analytic(orders),
    },
    Law {
        name: "caustic/ball-map",
        claim: "The caustic map's estimates, by each kernel, add up over discs to the power of the closed form.",
        source: "the closed form of caustic/ball; a kernel of a tenth of the disc's radius blurs its rim alone",
        check: Check::Analytic(from_map),
    },
    Law {
        name: "caustic/folds",
        claim: "Light that has not crossed the axis yet lands within the fold of a ball's caustic, and up to it; from the paraxial focus \
                on there is none.",
        source: "the greatest r(h): 0.18298115 (L = 1), .12088521, .07402315, .03840370, .02441992, .01303210, .00452285 (L = 1.45)",
        check: Check::Analytic(folds),
    },
    Law {
        name: "caustic/point-source",
        claim: "The caustic of a point light at three radii from a ball has the power of the closed form within four distances of the \
                axis, and the light that passes the ball leaves a shadow of the radius that geometry demands.",
        source: "refraction as for parallel light, tilted: .158847, .231553, .260749, .286472; the shadow 1.76776695",
        check: Check::Analytic(point_source),
    },
];

const CENTRE: DVec3 = DVec3::new(0.3, -0.2, 0.5);
const RADIUS: f64 = 1.7;
/// Along which the light comes.
const AXIS: DVec3 = DVec3::new(0.48, -0.6, 0.64);
/// The irradiance of parallel light; of a point light, the radiant intensity over the square of its distance in radii.
const LIGHT: Rgb = Rgb::new(1.0, 2.5, 0.4);

/// A ball of radius 1, in whose units powers are `RADIUS²` times as small as those of parallel light.
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

/// The power in the theory's units to that in the scene's, for a channel.
pub(super) fn unit(ball: &BallLens, channel: usize) -> f64 {
    match ball.light {
        Light::Collimated { .. } => LIGHT[channel] * RADIUS * RADIUS,
        Light::Point { distance, .. } => LIGHT[channel] * distance * distance,
    }
}

fn glass_ball() -> String {
    format!(
        r#"<shape type="sphere"><transform name="to_world"><scale value="{RADIUS}"/><translate value="{}"/></transform>{GLASS}</shape>"#,
        triple(CENTRE)
    )
}

/// Where the axis meets a plane.
fn foot(plane: f64) -> DVec3 {
    CENTRE + plane * RADIUS * AXIS
}

/// A ball with its light over a black floor.
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
    scene(&(light(ball) + &glass_ball() + &floor))
}

/// Photons of the order 1, with where they land: the way from the axis, in radii.
pub(super) fn landed(emitted: &EmittedPhotons, plane: f64) -> impl Iterator<Item = (DVec3, &Photon)> {
    let way = move |p: &[f32; 3]| {
        let way = (DVec3::from_array(p.map(f64::from)) - foot(plane)) / RADIUS;
        way.reject_from_normalized(AXIS)
    };
    let photons = emitted.positions.iter().map(way).zip(&emitted.photons);
    photons.filter(|(_, photon)| photon.depth() == 3 && photon.class() == PathClass::Caustic)
}

/// The power of a channel within each radius.
fn within(emitted: &EmittedPhotons, plane: f64, channel: usize, radii: &[f64]) -> Vec<f64> {
    let mut powers = vec![0.0; radii.len()];
    for (way, photon) in landed(emitted, plane) {
        let (distance, power) = (way.length(), photon.power()[channel]);
        powers.iter_mut().zip(radii).for_each(|(sum, r)| *sum += if distance < *r { power } else { 0.0 });
    }
    powers
}

/// The plane that touches the ball, but for a little.
const TOUCHING: f64 = 1.0 + 1e-6;

fn encircled(effort: Effort) -> Vec<Finding> {
    const RADII: [f64; 6] = [0.05, 0.1, 0.2, 0.4, 0.8, 1.0];
    /// Noise leaves the power to show equivalence where so much lands.
    const MAX_COUNT: f64 = 2.2;
    const LOTS: u32 = 32;
    let lots = Lots { kind: PhotonMapKind::Caustic, emitted: 100_000, count: effort.samples(LOTS), seed: 41 };
    let mut findings = Vec::new();
    for (i, plane) in [TOUCHING, 1.2, 1.35, 1.5, 2.0, 3.0].into_iter().enumerate() {
        let (channel, scene) = (i % 3, over_floor(&SUN, plane));
        let lots = Lots { seed: lots.seed + 100 * i as u64, ..lots };
        let found = lots.each(&scene, |_, emitted| within(&emitted, plane, channel, &RADII));
        for (j, r) in RADII.into_iter().enumerate() {
            let (moments, power) = (column(&found, j), SUN.encircled_power(plane, r));
            let expected = unit(&SUN, channel) * power;
            let subject = format!("L = {plane}, r = {r}, {}", CHANNELS[channel]);
            findings.push(Finding::mean(&*subject, &moments, expected));
            if power > MAX_COUNT {
                let estimate = Estimate::from_moments(&moments).expect("there are two lots or more");
                let bound = effort.bound(LOTS, 0.005);
                findings.push(Finding::equivalent(subject, &estimate, &Estimate::exact(expected), bound));
            }
        }
    }
    findings
}

fn orders(effort: Effort) -> Vec<Finding> {
    const TABLE: [f64; 5] = [0.091_777_96, 0.835_544_40, 0.061_183_22, 0.007_993_38, 0.001_968_21];
    const FAR: f64 = 1000.0;
    let lots = Lots { kind: PhotonMapKind::Caustic, emitted: 20_000, count: effort.samples(32), seed: 42 };
    let mut findings = Vec::new();
    for (i, distance) in [3.0, FAR].into_iter().enumerate() {
        let (ball, channel) = (lamp(distance), i + 1);
        let sphere = format!(
            r#"<shape type="sphere"><float name="radius" value="{}"/><boolean name="flip_normals" value="true"/>{}</shape>"#,
            4.0 * distance,
            diffuse(Rgb::ZERO)
        );
        let scene = scene(&(light(&ball) + &glass_ball() + &sphere));
        let found = lots.each(&scene, |_, emitted| {
            let of_order = |order: u32| {
                let photons = emitted.photons.iter().filter(|photon| photon.depth() == order + 2);
                photons.map(|photon| photon.power()[channel]).sum::<f64>()
            };
            [0, 1, 2, 3, 4].map(of_order)
        });
        for (order, share) in (0..).zip(TABLE) {
            let power = ball.order_power(order);
            if distance == FAR {
                let subject = format!("p = {order}, share in the closed form");
                // Light from a point so far away is parallel but for (R / s)².
                findings.push(Finding::value(subject, power / ball.received(), share, 1e-5 * share));
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
    const LOTS: u32 = 24;
    let lots = Lots { kind: PhotonMapKind::Caustic, emitted: 100_000, count: effort.samples(LOTS), seed: 43 };
    let mut findings = Vec::new();
    for (i, (plane, radii)) in DISCS.into_iter().enumerate() {
        let (channel, scene) = (i % 3, over_floor(&SUN, plane));
        let kernel = |j: usize| Kernel::ALL[(i + j) % 3];
        let found = lots.each(&scene, |lot, emitted| {
            let map = PhotonMap::new(&emitted.positions, emitted.photons);
            let mean = |(j, &r): (usize, &f64)| {
                let lookup = EstimateParameters { nearest: None, radius: 0.1 * r * RADIUS, kernel: kernel(j).1 };
                let mut numbers = Stream::at(&[44, lot, i as u64, j as u64]);
                mean_irradiance(&scene, &map, &lookup, (plane, r), &mut numbers)[channel]
            };
            radii.iter().enumerate().map(mean).collect::<Vec<_>>()
        });
        for (j, r) in radii.iter().enumerate() {
            let area = 0.5 * TAU * (r * RADIUS).powi(2);
            let estimate = Estimate::from_moments(&column(&found, j)).expect("there are two lots or more");
            let expected = Estimate::exact(unit(&SUN, channel) * SUN.encircled_power(plane, *r) / area);
            let subject = format!("L = {plane}, r = {r}, {}", kernel(j).0);
            findings.push(Finding::equivalent(subject, &estimate, &expected, effort.bound(LOTS, 0.01)));
        }
    }
    findings
}

/// The mean of estimates over a disc of the floor: one in each of its sectors, at each of even steps from the axis,
/// where most of the light is.
fn mean_irradiance(
    scene: &Scene,
    map: &PhotonMap,
    lookup: &EstimateParameters,
    disc: (f64, f64),
    numbers: &mut Stream,
) -> Rgb {
    const STEPS: u32 = 48;
    const SECTORS: u32 = 6;
    let (plane, r) = disc;
    let across = AXIS.any_orthonormal_vector();
    let along = AXIS.cross(across);
    let mut sum = Rgb::ZERO;
    for (step, sector) in (0..STEPS).flat_map(|step| (0..SECTORS).map(move |sector| (step, sector))) {
        let u = numbers.next_2d();
        let part = (f64::from(step) + u.x) / f64::from(STEPS);
        let (sin, cos) = (TAU * (f64::from(sector) + u.y) / f64::from(SECTORS)).sin_cos();
        let p = foot(plane) + part * r * RADIUS * (cos * across + sin * along);
        let si = scene.intersect(&Ray::new(p - 0.01 * AXIS, AXIS)).expect("there is a floor");
        // Even steps take more points near the axis than there is area.
        let weight = 2.0 * part / f64::from(STEPS * SECTORS);
        map.for_each_nearby(&GatherPoint::new(scene, &si), lookup, |nearby| {
            sum += nearby.photon.power() * (nearby.density * weight);
        });
    }
    sum
}

/// How many photons are expected where one must be: none is with a chance of e⁻²⁰.
const SURE: f64 = 20.0;
/// Of coordinates of a few units, kept in f32.
const ROUNDING: f64 = 1e-6;

fn folds(effort: Effort) -> Vec<Finding> {
    let emitted = u64::from(effort.samples(300_000));
    let lots = Lots { kind: PhotonMapKind::Caustic, emitted, count: 1, seed: 45 };
    // The landings of light that comes from farther away from the axis than it lands, which has not crossed it yet.
    let before_axis = |plane: f64| {
        let is_before = |(way, photon): &(DVec3, &Photon)| {
            way.length() > ROUNDING && photon.direction().dot(way.normalize()) > 1e-3
        };
        let distances =
            |_, emitted| landed(&emitted, plane).filter(is_before).map(|(way, _)| way.length()).collect::<Vec<_>>();
        lots.each(&over_floor(&SUN, plane), distances).concat()
    };
    let mut findings = Vec::new();
    for plane in [TOUCHING, 1.1, 1.2, 1.3, 1.35, 1.4, 1.45] {
        let fold = SUN.folds(plane)[0];
        // So many photons have offsets so near that of the fold; at least a quarter of those that are aimed at the ball
        // would be twice refracted.
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
    /// The radius within which direct light is looked at.
    const RIM: f64 = 3.5;
    let (ball, plane, channel) = (lamp(3.0), 2.0, 0);
    let scene = over_floor(&ball, plane);
    let lots = Lots { kind: PhotonMapKind::Caustic, emitted: 50_000, count: effort.samples(32), seed: 46 };
    let found = lots.each(&scene, |_, emitted| within(&emitted, plane, channel, &RADII));
    let mut findings = Vec::new();
    for (j, r) in RADII.into_iter().enumerate() {
        let expected = unit(&ball, channel) * ball.encircled_power(plane, r);
        findings.push(Finding::mean(format!("caustic, r = {r}"), &column(&found, j), expected));
    }
    let lots = Lots { kind: PhotonMapKind::Global, seed: 47, ..lots };
    let found = lots.each(&scene, |_, emitted| direct(&emitted, plane, channel, RIM));
    let expected = unit(&ball, channel) * ball.direct_power(plane, RIM);
    findings.push(Finding::mean(format!("direct, r = {RIM}"), &column(&found, 0), expected));
    // The radius by which so many direct photons are expected.
    let emitted = (lots.emitted * u64::from(lots.count)) as f64;
    let shadow = ball.shadow_radius(plane);
    let share = |gap: f64| ball.direct_power(plane, shadow + gap) / (2.0 * TAU);
    let gap = SURE / (emitted * share(1e-3)) * 1e-3;
    let nearest = found.iter().map(|found| found[1]).fold(f64::INFINITY, f64::min);
    findings.push(Finding::value("radius of the shadow", nearest, shadow, gap + ROUNDING));
    findings
}

/// The power of direct light within a radius, and the least radius at which there is any.
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
