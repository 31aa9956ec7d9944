//! Lenses and mirrors: axis crossings and foci of traced rays.

use std::f64::consts::FRAC_PI_6;

use glam::{DAffine3, DVec3};

use crate::{
    bsdf::{BsdfModel as _, TransportMode},
    law::{Check, Effort, Finding, Law, worst},
    math::Ray,
    scene::Scene,
    transport::ShadingPoint,
    validation::setup::{self, GLASS, triple},
};

/// The laws of lenses and mirrors.
pub const LAWS: &[Law] = &[
    Law {
        name: "optics/ball-lens",
        claim: "A parallel ray at the height h on a glass sphere of radius 1 and index n = 1.5 crosses the axis at h / sin δ with \
                δ = 2 (asin h - asin h/n). This is before the paraxial focus 1.5 by the longitudinal aberration, at six heights.",
        source: "Snell's law; 0.00417294, 0.01676798, 0.03802156, 0.10842705, 0.22221298, 0.39555443",
        check: Check::Analytic(ball_lens),
    },
    Law {
        name: "optics/lenses",
        claim: "Rays through CSG lenses, a plano-convex one in both orientations and a biconvex one, cross the axis where a trace of \
                angles predicts it.",
        source: "Snell's law at spheres and planes; from the si 1.97740058, 1.78872483, 1.35257112; 1.79428975, 1.64606230; \
                 0.91568875, 0.79996801, 0.41350583",
        check: Check::Analytic(lenses),
    },
    Law {
        name: "optics/mirrors",
        claim: "A paraboloid reflects rays parallel to its axis through its focus. An ellipsoid reflects rays from one focus through the \
                other, on paths of equal length. Both hold for the named shapes and for rotated quadrics.",
        source: "definition of the conics; distances in units of the focal length or of the semi-axis",
        check: Check::Analytic(mirrors),
    },
];

/// Traces a ray through a number of surfaces. Each surface refracts the ray, or reflects it if it does not transmit.
///
/// Returns the outgoing ray and the path length up to the last surface.
fn traced(scene: &Scene, mut ray: Ray, surfaces: usize) -> Option<(Ray, f64)> {
    let mut length = 0.0;
    for _ in 0..surfaces {
        let si = scene.intersect(&ray)?;
        let shading_point = ShadingPoint::new(scene, si, TransportMode::Radiance);
        // The largest random number selects refraction.
        let sample = shading_point.bsdf.sample(&shading_point.query, 1.0 - 1e-16, glam::DVec2::splat(0.5))?;
        length += si.t * ray.direction.length();
        ray = Ray::leaving(si.surface.p, si.surface.shading.to_world(sample.wo));
    }
    Some((ray, length))
}

/// Where a ray in the plane y = 0 crosses the z axis.
fn axis_crossing(ray: &Ray) -> f64 {
    ray.at(-ray.origin.x / ray.direction.x).z
}

/// A ray at the height `h` that travels along +z and starts before the lens.
fn parallel(h: f64) -> Ray {
    Ray::new(DVec3::new(h, 0.0, -7.0), DVec3::Z)
}

fn ball_lens(_: Effort) -> Vec<Finding> {
    const TABLE: [(f64, f64); 6] = [
        (0.1, 0.004_172_94),
        (0.2, 0.016_767_98),
        (0.3, 0.038_021_56),
        (0.5, 0.108_427_05),
        (0.7, 0.222_212_98),
        (0.9, 0.395_554_43),
    ];
    // The sphere is not at the origin and its radius is not 1.
    let (centre, radius) = (DVec3::new(0.3, -0.2, 0.5), 1.7);
    let to_world = format!(
        r#"<transform name="to_world"><scale value="{radius}"/><translate value="{}"/></transform>"#,
        triple(centre)
    );
    let scene = setup::scene(&format!(r#"<shape type="sphere">{to_world}{GLASS}</shape>"#));
    let mut findings = Vec::new();
    for (h, aberration) in TABLE {
        let delta = 2.0 * (h.asin() - (h / 1.5).asin());
        let expected = h / delta.sin();
        findings.push(Finding::value(format!("h = {h}, the closed form"), 1.5 - expected, aberration, 1e-8));
        let start = parallel(h);
        let ray = Ray::new(centre + radius * start.origin, start.direction);
        let found = traced(&scene, ray, 2).map_or(f64::NAN, |(ray, _)| {
            let local = Ray::new((ray.origin - centre) / radius, ray.direction);
            axis_crossing(&local)
        });
        findings.push(Finding::value(format!("h = {h}, crossing"), found, expected, 1e-9));
        findings.push(Finding::value(format!("h = {h}, aberration"), 1.5 - found, aberration, 1e-8));
    }
    findings
}

fn half_space(turn: &str, z: f64) -> String {
    format!(r#"<shape type="plane"><transform name="to_world">{turn}<translate z="{z}"/></transform></shape>"#)
}

fn unit_sphere(z: f64) -> String {
    format!(r#"<shape type="sphere"><point name="center" x="0" y="0" z="{z}"/></shape>"#)
}

fn lens(one: &str, other: &str) -> Scene {
    let operation = r#"<string name="operation" value="intersection"/>"#;
    setup::scene(&format!(r#"<shape type="csg">{operation}{one}{other}{GLASS}</shape>"#))
}

/// Refracts a ray, given as its axis crossing `z` and its angle to the axis, where it leaves a sphere of radius 1 whose
/// centre is on the axis at `centre`. Returns the new crossing and angle.
///
/// Refraction at a sphere conserves the product of the index and the ray's distance from the centre.
fn after_sphere((z, angle): (f64, f64), centre: f64, [before, after]: [f64; 2]) -> (f64, f64) {
    // At radius 1, distances from the centre are sines of the angles to the normal.
    let distance = (z - centre) * angle.sin();
    let refracted = distance * before / after;
    // A ray that leaves glass is bent away from the normal.
    let angle = angle + refracted.asin() - distance.asin();
    (centre + refracted / angle.sin(), angle)
}

/// Refracts a ray, given as its axis crossing and its angle, at a plane perpendicular to the axis.
fn after_plane((z, angle): (f64, f64), plane: f64, [before, after]: [f64; 2]) -> (f64, f64) {
    let height = (z - plane) * angle.tan();
    let angle = (angle.sin() * before / after).asin();
    (plane + height / angle.tan(), angle)
}

/// The axis crossing and the angle of a parallel ray of height `h` after it enters the sphere with the centre `centre`.
fn after_first(h: f64, centre: f64) -> (f64, f64) {
    let angle = h.asin() - (h / 1.5).asin();
    (centre + h / 1.5 / angle.sin(), angle)
}

fn lenses(_: Effort) -> Vec<Finding> {
    let turned = r#"<rotate x="1" angle="180"/>"#;
    let mut findings = Vec::new();
    let mut check = |name: &str, scene: &Scene, si: f64, h: f64, (expected, table): (f64, f64)| {
        let found = traced(scene, parallel(h), 2).map_or(f64::NAN, |(ray, _)| axis_crossing(&ray) - si);
        findings.push(Finding::value(format!("{name}, h = {h}, the closed form"), expected - si, table, 1e-8));
        findings.push(Finding::value(format!("{name}, h = {h}"), found, expected - si, 1e-9));
    };
    // The part of a sphere above z = 0.2: rays hit the plane first.
    let plane_first = lens(&unit_sphere(0.0), &half_space(turned, 0.2));
    for (h, table) in [(0.1_f64, 1.977_400_58), (0.3, 1.788_724_83), (0.5, 1.352_571_12)] {
        let bend: f64 = (1.5 * h).asin() - h.asin();
        check("plane first", &plane_first, 1.0, h, ((1.0 - h * h).sqrt() + h / bend.tan(), table));
    }
    let curved_first = lens(&unit_sphere(0.0), &half_space("", -0.7));
    for (h, table) in [(0.1, 1.794_289_75), (0.5, 1.646_062_30)] {
        let (z, _) = after_plane(after_first(h, 0.0), -0.7, [1.5, 1.0]);
        check("curved first", &curved_first, -0.7, h, (z, table));
    }
    let biconvex = lens(&unit_sphere(1.6), &unit_sphere(0.0));
    for (h, table) in [(0.1, 0.915_688_75), (0.3, 0.799_968_01), (0.5, 0.413_505_83)] {
        let (z, _) = after_sphere(after_first(h, 1.6), 0.0, [1.5, 1.0]);
        check("biconvex", &biconvex, 1.0, h, (z, table));
    }
    findings
}

const MIRROR: &str = r#"<bsdf type="twosided"><bsdf type="conductor"/></bsdf>"#;

/// The ten coefficients of a quadric `pᵀ M p + v·p + k` after a rotation and a translation.
fn coefficients(diagonal: DVec3, linear: DVec3, constant: f64, map: &DAffine3) -> String {
    let r = map.matrix3;
    let m = r * glam::DMat3::from_diagonal(diagonal) * r.transpose();
    let (v, t) = (r * linear, map.translation);
    let (v, k) = (v - 2.0 * (m * t), constant - v.dot(t) + t.dot(m * t));
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis];
    let numbers = [x.x, y.y, z.z, 2.0 * x.y, 2.0 * x.z, 2.0 * y.z, v.x, v.y, v.z, k];
    numbers.map(|number| number.to_string()).join(", ")
}

fn quadric(coefficients: &str) -> String {
    format!(
        r#"<shape type="quadric"><string name="coefficients" value="{coefficients}"/>
           <point name="bbox_min" value="-5"/><point name="bbox_max" value="5"/>{MIRROR}</shape>"#
    )
}

/// A rotation about an oblique axis and a translation, as a map and as XML.
fn oblique() -> (DAffine3, String) {
    let (axis, t) = (DVec3::new(2.0, 1.0, 2.0) / 3.0, DVec3::new(0.4, -0.3, 0.2));
    let map = DAffine3::from_translation(t) * DAffine3::from_axis_angle(axis, FRAC_PI_6);
    let DVec3 { x, y, z } = axis;
    let text = format!(
        r#"<transform name="to_world"><rotate x="{x}" y="{y}" z="{z}" angle="30"/><translate value="{}"/></transform>"#,
        triple(t)
    );
    (map, text)
}

/// The distance of a point from the line of a ray.
fn miss(ray: &Ray, point: DVec3) -> f64 {
    let offset = point - ray.origin;
    (offset - offset.dot(ray.direction) * ray.direction).length()
}

fn mirrors(_: Effort) -> Vec<Finding> {
    let (map, to_world) = oblique();
    // z = r² / 4f with a rim of radius 1.6 at the height 0.8.
    let f = 0.8;
    let bowl = format!(
        r#"<shape type="paraboloid"><float name="radius" value="1.6"/><float name="height" value="0.8"/>{to_world}{MIRROR}</shape>"#
    );
    let bowl_quadric = quadric(&coefficients(DVec3::new(1.0, 1.0, 0.0), DVec3::new(0.0, 0.0, -4.0 * f), 0.0, &map));
    let (a, b) = (1.5, 0.9_f64);
    let focus = DVec3::X * (a * a - b * b).sqrt();
    let egg =
        format!(r#"<shape type="ellipsoid"><vector name="radii" x="{a}" y="{b}" z="{b}"/>{to_world}{MIRROR}</shape>"#);
    let inverse_squares = DVec3::new(a, b, b).powf(-2.0);
    let egg_quadric = quadric(&coefficients(inverse_squares, DVec3::ZERO, -1.0, &map));
    worst(1e-12, |note| {
        for (name, scene) in [("paraboloid", &bowl), ("paraboloid as a quadric", &bowl_quadric)] {
            let scene = setup::scene(scene);
            for (x, y) in [(0.1, 0.0), (0.5, -0.7), (-1.1, 0.4), (0.0, 1.5)] {
                let ray = Ray::new(DVec3::new(x, y, 3.0), -DVec3::Z).transformed(&map);
                let found = traced(&scene, ray, 1)
                    .map_or(f64::NAN, |(ray, _)| miss(&ray, map.transform_point3(f * DVec3::Z)) / f);
                note(name, found);
            }
        }
        for (name, scene) in [("ellipsoid", &egg), ("ellipsoid as a quadric", &egg_quadric)] {
            let scene = setup::scene(scene);
            let (from, to) = (map.transform_point3(-focus), map.transform_point3(focus));
            for direction in [DVec3::new(0.3, 1.0, 0.2), DVec3::new(-1.0, 0.4, 0.1), DVec3::new(0.2, -0.3, 2.0)] {
                let found = traced(&scene, Ray::new(from, direction.normalize()), 1);
                note(name, found.map_or(f64::NAN, |(ray, _)| miss(&ray, to) / a));
                let length = found.map_or(f64::NAN, |(ray, length)| length + ray.origin.distance(to));
                note(&format!("{name}, path length"), (length / (2.0 * a) - 1.0).abs());
            }
        }
    })
}
