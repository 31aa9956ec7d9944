//! The caustics that half a mirror cylinder casts on its floor.

use std::f64::consts::TAU;

use glam::DVec2;

use super::{Lots, column};
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

/// These laws.
pub const LAWS: &[Law] = &[
    Law {
        name: "caustic/nephroid",
        claim: "Parallel light that half a mirror cylinder reflects once has the power of the closed form within four discs on its \
                floor, and none beyond the nephroid that its rays touch, up to which it comes.",
        source: "E = E0 sin ε ρ Σ 1 / |1 - 2t / (R cos a)|, integrated; the envelope R/4 (3 cos a - cos 3a, 3 sin a - sin 3a)",
        check: Check::Analytic(nephroid),
    },
    Law {
        name: "caustic/cardioid",
        claim: "Light of a point above the cylinder has so too, and the curve is a cardioid.",
        source: "the power per angle and distance over |3t/2 - R cos (a/2)|; the envelope R/3 (2 cos a - cos 2a, 2 sin a - sin 2a)",
        check: Check::Analytic(cardioid),
    },
];

const RADIUS: f64 = 1.3;
const WALL: f64 = 0.9;
const REFLECTANCE: Rgb = Rgb::new(0.9, 0.6, 0.3);
/// What a light has, in units of what it has in the theory.
const COLOUR: Rgb = Rgb::new(4.0, 2.0, 1.0);

/// Lots of photons, and the bound that their noise allows.
const LOTS: u32 = 48;
const BOUND: f64 = 0.02;

fn nephroid(effort: Effort) -> Vec<Finding> {
    let (irradiance, elevation) = (1.0, 0.6_f64);
    let (sin, cos) = elevation.sin_cos();
    let sun = format!(
        r#"<emitter type="directional"><vector name="direction" x="{cos}" y="0" z="{}"/><rgb name="irradiance" value="{}"/></emitter>"#,
        -sin,
        triple(COLOUR)
    );
    let lots = Lots { kind: PhotonMapKind::Caustic, emitted: 100_000, count: effort.samples(LOTS), seed: 71 };
    let bound = effort.bound(LOTS, BOUND);
    Case { room: room(Light::Collimated { irradiance, elevation }), turn: 2.0, channel: 0, lots, bound }.check(&sun)
}

fn cardioid(effort: Effort) -> Vec<Finding> {
    let (intensity, height) = (1.0, 2.2);
    let lamp = format!(
        r#"<emitter type="point"><point name="position" x="{}" y="0" z="{height}"/><rgb name="intensity" value="{}"/></emitter>"#,
        -RADIUS,
        triple(COLOUR)
    );
    let lots = Lots { kind: PhotonMapKind::Caustic, emitted: 100_000, count: effort.samples(LOTS), seed: 72 };
    let bound = effort.bound(LOTS, BOUND);
    Case { room: room(Light::OnCircle { intensity, height }), turn: 1.5, channel: 1, lots, bound }.check(&lamp)
}

fn room(light: Light) -> HalfCylinder {
    HalfCylinder { radius: RADIUS, wall_height: WALL, reflectance: 1.0, light }
}

/// A light in half a cylinder.
struct Case {
    room: HalfCylinder,
    /// The angle of a reflected ray over the angle at which it met the wall.
    turn: f64,
    channel: usize,
    lots: Lots,
    /// How far the power within a disc may be from the closed form.
    bound: f64,
}

/// Angles at the wall of rays whose places on the caustic are looked at.
const ANGLES: [f64; 3] = [-0.9, 0.6, 1.2];
/// Rays and places that count as near to these.
const AROUND: f64 = 0.2;
const NEAR: f64 = 0.08;
/// The radius of discs.
const DISC: f64 = 0.2;
/// How many photons are expected where one must be: none is with a chance of e⁻²⁰.
const SURE: f64 = 20.0;
/// Of coordinates of about one, kept in f32.
const ROUNDING: f64 = 1e-6;

impl Case {
    fn check(&self, light: &str) -> Vec<Finding> {
        let Self { room, channel, lots, bound, .. } = self;
        // On the caustic, at its cusp, within it, and where the light of the upper rim of the wall ends.
        let discs = [room.caustic(0.5), room.caustic(0.0), DVec2::new(0.9, 0.1), DVec2::new(0.0, 0.3)];
        let found = lots.each(&half_cylinder(light), |_, emitted| {
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
            // The noise leaves it to be shown where there is much light.
            if i < 2 {
                let estimate = Estimate::from_moments(&moments).expect("there are two lots or more");
                findings.push(Finding::equivalent(subject, &estimate, &Estimate::exact(expected), *bound));
            }
        }
        let power = column(&found, discs.len() + ANGLES.len()).mean;
        // Roulette lets so many live.
        let survival = (REFLECTANCE * COLOUR).max_element() / COLOUR.max_element();
        let photons = survival * (lots.emitted * u64::from(lots.count)) as f64 / power;
        for (i, angle) in ANGLES.into_iter().enumerate() {
            let greatest = found.iter().map(|found| found[discs.len() + i]).fold(f64::NEG_INFINITY, f64::max);
            // In a disc on the caustic at least half of the light comes from rays that touch it there.
            let excess = |r| 0.5 * photons * room.reflected_power(room.caustic(angle), r) - SURE;
            let short = bisect(excess, [0.0, NEAR]);
            findings.push(Finding::value(format!("beyond the curve at {angle}"), greatest, 0.0, short + ROUNDING));
        }
        findings
    }

    /// How far the photons around a place of the caustic are beyond it at most, of those whose rays touch it there.
    fn beyond(&self, emitted: &EmittedPhotons, angle: f64) -> f64 {
        let middle = self.room.caustic(angle);
        let is_near = |place: DVec2, photon: &Photon| {
            let towards_wall = photon.direction().truncate().to_angle();
            let met = [-TAU, 0.0, TAU].map(|turn| ((towards_wall + turn) / self.turn - angle).abs());
            place.distance(middle) < NEAR && met.into_iter().fold(f64::INFINITY, f64::min) < AROUND
        };
        let near = reflected(emitted).filter(|(place, photon)| is_near(*place, photon));
        near.map(|(place, _)| self.signed_distance(place, angle)).fold(f64::NEG_INFINITY, f64::max)
    }

    /// The distance from the caustic near an angle, positive on the side that it bends to: rays that touch it pass on
    /// the other.
    fn signed_distance(&self, place: DVec2, angle: f64) -> f64 {
        const STEP: f64 = 1e-4;
        let tangent = |angle: f64| self.room.caustic(angle + STEP) - self.room.caustic(angle - STEP);
        let along = |angle: f64| (place - self.room.caustic(angle)).dot(tangent(angle));
        let foot = bisect(along, [angle - 2.0 * AROUND, angle + 2.0 * AROUND]);
        let bend = tangent(foot + STEP) - tangent(foot - STEP);
        let normal = bend.reject_from(tangent(foot)).normalize();
        (place - self.room.caustic(foot)).dot(normal)
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
    let place = |p: &[f32; 3]| DVec2::new(f64::from(p[0]), f64::from(p[1]));
    let photons = emitted.positions.iter().map(place).zip(&emitted.photons);
    photons.filter(|(_, photon)| photon.depth() == 2 && photon.class() == PathClass::Caustic)
}

/// The power of a channel within a disc.
fn within(emitted: &EmittedPhotons, disc: DVec2, channel: usize) -> f64 {
    let inside = reflected(emitted).filter(|(place, _)| place.distance(disc) < DISC);
    inside.map(|(_, photon)| photon.power()[channel]).sum()
}
