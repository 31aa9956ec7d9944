//! The caustics of a mirror half cylinder on its floor.

use std::f64::consts::TAU;

use glam::DVec2;

use super::{PhotonSets, column};
use crate::{
    law::{Check, Effort, Finding, Law},
    math::Rgb,
    photon::{EmittedPhotons, Photon, PhotonMapKind},
    scene::Scene,
    stats::Estimate,
    transport::PathClass,
    validation::{
        setup::{CHANNELS, ground, scene, triple},
        theory::{
            cylinder::{HalfCylinder, Light},
            numeric::bisect,
        },
    },
};

/// The laws of the half cylinder's caustics.
pub const LAWS: &[Law] = &[
    Law {
        name: "caustic/nephroid",
        claim: "Parallel light that a mirror half cylinder reflects once has the power of the closed form within four discs on its \
                floor. Photons reach up to the nephroid, the envelope of the reflected rays, and none lie beyond it.",
        source: "E = E0 sin ε ρ Σ 1 / |1 - 2t / (R cos a)|, integrated; the envelope R/4 (3 cos a - cos 3a, 3 sin a - sin 3a)",
        check: Check::Analytic(nephroid),
    },
    Law {
        name: "caustic/cardioid",
        claim: "The same holds for a point light above the cylinder's circle, whose rays have a cardioid as envelope.",
        source: "the power per angle and distance divided by |3t/2 - R cos (a/2)|; the envelope R/3 (2 cos a - cos 2a, 2 sin a - sin 2a)",
        check: Check::Analytic(cardioid),
    },
];

const RADIUS: f64 = 1.3;
const WALL: f64 = 0.9;
const REFLECTANCE: Rgb = Rgb::new(0.9, 0.6, 0.3);
/// The power of the light in each channel, in units of the theory's light.
const COLOUR: Rgb = Rgb::new(4.0, 2.0, 1.0);

/// The number of photon sets at the standard effort.
const SETS: u32 = 48;
/// The relative equivalence bound that their noise allows.
const BOUND: f64 = 0.02;

fn nephroid(effort: Effort) -> Vec<Finding> {
    let (irradiance, elevation) = (1.0, 0.6_f64);
    let (sin, cos) = elevation.sin_cos();
    let sun = format!(
        r#"<emitter type="directional"><vector name="direction" x="{cos}" y="0" z="{}"/><rgb name="irradiance" value="{}"/></emitter>"#,
        -sin,
        triple(COLOUR)
    );
    let sets = PhotonSets { kind: PhotonMapKind::Caustic, emitted: 100_000, count: effort.samples(SETS), seed: 71 };
    let bound = effort.bound(SETS, BOUND);
    Case { room: room(Light::Collimated { irradiance, elevation }), turn: 2.0, channel: 0, sets, bound }.check(&sun)
}

fn cardioid(effort: Effort) -> Vec<Finding> {
    let (intensity, height) = (1.0, 2.2);
    let lamp = format!(
        r#"<emitter type="point"><point name="position" x="{}" y="0" z="{height}"/><rgb name="intensity" value="{}"/></emitter>"#,
        -RADIUS,
        triple(COLOUR)
    );
    let sets = PhotonSets { kind: PhotonMapKind::Caustic, emitted: 100_000, count: effort.samples(SETS), seed: 72 };
    let bound = effort.bound(SETS, BOUND);
    Case { room: room(Light::OnCircle { intensity, height }), turn: 1.5, channel: 1, sets, bound }.check(&lamp)
}

fn room(light: Light) -> HalfCylinder {
    HalfCylinder { radius: RADIUS, wall_height: WALL, reflectance: 1.0, light }
}

/// A test case: a light in a half cylinder.
struct Case {
    room: HalfCylinder,
    /// The angle of a reflected ray over the polar angle of its reflection point on the wall.
    turn: f64,
    channel: usize,
    sets: PhotonSets,
    /// The relative equivalence bound for the power within a disc.
    bound: f64,
}

/// Polar angles on the wall of the rays whose tangent points on the caustic are tested.
const ANGLES: [f64; 3] = [-0.9, 0.6, 1.2];
/// Rays within this angle of a tested ray count as near to it.
const AROUND: f64 = 0.2;
/// Photons within this distance of a tested point count as near to it.
const NEAR: f64 = 0.08;
/// The radius of the discs.
const DISC: f64 = 0.2;
/// The expected number of photons in a region that must contain one. It is empty with probability e⁻²⁰.
const SURE: f64 = 20.0;
/// The error of coordinates of about 1 stored in f32.
const ROUNDING: f64 = 1e-6;

impl Case {
    fn check(&self, light: &str) -> Vec<Finding> {
        let Self { room, channel, sets, bound, .. } = self;
        // The discs are on the caustic, at its cusp, inside it, and where the light from the wall's upper rim ends.
        let discs = [room.caustic(0.5), room.caustic(0.0), DVec2::new(0.9, 0.1), DVec2::new(0.0, 0.3)];
        let found = sets.each(&half_cylinder(light), |_, emitted| {
            let powers = discs.map(|disc| within(&emitted, disc, *channel));
            let beyond = ANGLES.map(|angle| self.beyond(&emitted, angle));
            [&powers[..], &beyond, &[emitted.power[*channel] / COLOUR[*channel]]].concat()
        });
        let unit = REFLECTANCE[*channel] * COLOUR[*channel];
        let mut findings = Vec::new();
        for (i, disc) in discs.into_iter().enumerate() {
            let (moments, expected) = (column(&found, i), unit * room.reflected_power(disc, DISC));
            let subject = format!("disc at {disc:.2}, {}", CHANNELS[*channel]);
            findings.push(Finding::mean(&*subject, &moments, expected));
            // Only the two bright discs have noise low enough to show equivalence.
            if i < 2 {
                let estimate = Estimate::from_moments(&moments).expect("there are two sets or more");
                findings.push(Finding::equivalent(subject, &estimate, &Estimate::exact(expected), *bound));
            }
        }
        let power = column(&found, discs.len() + ANGLES.len()).mean;
        // The probability that a photon survives Russian roulette at the wall.
        let survival = (REFLECTANCE * COLOUR).max_element() / COLOUR.max_element();
        let photons = survival * (sets.emitted * u64::from(sets.count)) as f64 / power;
        for (i, angle) in ANGLES.into_iter().enumerate() {
            let greatest = found.iter().map(|found| found[discs.len() + i]).fold(f64::NEG_INFINITY, f64::max);
            // In a disc on the caustic at least half of the light comes from rays that are tangent to it there.
            let excess = |r| 0.5 * photons * room.reflected_power(room.caustic(angle), r) - SURE;
            let short = bisect(excess, [0.0, NEAR]);
            findings.push(Finding::value(format!("beyond the curve at {angle}"), greatest, 0.0, short + ROUNDING));
        }
        findings
    }

    /// The largest distance beyond the caustic of photons near a point of it, among those whose rays are tangent there.
    fn beyond(&self, emitted: &EmittedPhotons, angle: f64) -> f64 {
        let middle = self.room.caustic(angle);
        let is_near = |point: DVec2, photon: &Photon| {
            let to_wall = photon.direction().truncate().to_angle();
            let angles = [-TAU, 0.0, TAU].map(|turn| ((to_wall + turn) / self.turn - angle).abs());
            point.distance(middle) < NEAR && angles.into_iter().fold(f64::INFINITY, f64::min) < AROUND
        };
        let near = reflected(emitted).filter(|(point, photon)| is_near(*point, photon));
        near.map(|(point, _)| self.signed_distance(point, angle)).fold(f64::NEG_INFINITY, f64::max)
    }

    /// The signed distance from the caustic near an angle, positive on the side that it bends to. Tangent rays pass on
    /// the other side.
    fn signed_distance(&self, point: DVec2, angle: f64) -> f64 {
        const STEP: f64 = 1e-4;
        let tangent = |angle: f64| self.room.caustic(angle + STEP) - self.room.caustic(angle - STEP);
        let along = |angle: f64| (point - self.room.caustic(angle)).dot(tangent(angle));
        let foot = bisect(along, [angle - 2.0 * AROUND, angle + 2.0 * AROUND]);
        let bend = tangent(foot + STEP) - tangent(foot - STEP);
        let normal = bend.reject_from(tangent(foot)).normalize();
        (point - self.room.caustic(foot)).dot(normal)
    }
}

fn half_cylinder(light: &str) -> Scene {
    let wall = format!(
        r#"<shape type="quadric"><string name="coefficients" value="1, 1, 0, 0, 0, 0, 0, 0, 0, {}"/>
           <point name="bbox_min" x="0" y="-2" z="0"/><point name="bbox_max" x="2" y="2" z="{WALL}"/>
           <bsdf type="twosided"><bsdf type="conductor"><rgb name="specular_reflectance" value="{}"/></bsdf></bsdf></shape>"#,
        -RADIUS * RADIUS,
        triple(REFLECTANCE)
    );
    scene(&format!("{light}{wall}{}", ground(Rgb::ZERO)))
}

/// Photons on the floor after a single reflection.
fn reflected(emitted: &EmittedPhotons) -> impl Iterator<Item = (DVec2, &Photon)> {
    let point = |p: &[f32; 3]| DVec2::new(f64::from(p[0]), f64::from(p[1]));
    let photons = emitted.positions.iter().map(point).zip(&emitted.photons);
    photons.filter(|(_, photon)| photon.depth() == 2 && photon.class() == PathClass::Caustic)
}

/// The power of one channel within a disc.
fn within(emitted: &EmittedPhotons, disc: DVec2, channel: usize) -> f64 {
    let inside = reflected(emitted).filter(|(point, _)| point.distance(disc) < DISC);
    inside.map(|(_, photon)| photon.power()[channel]).sum()
}
