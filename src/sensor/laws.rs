//! Laws of cameras.

use std::f64::consts::FRAC_1_PI;

use glam::{DVec2, DVec3};

use super::{Camera, Sensor, SensorModel as _};
use crate::{
    law::{Check, Effort, Finding, Law},
    math::{Ray, rng::Stream},
    scene_file::xml,
    stats::{Ks, Moments},
};

/// The laws of cameras.
pub const LAWS: &[Law] = &[
    Law {
        name: "sensor/projection",
        claim: "For every axis of the field of view, the ray through the projection of a point onto the film passes through the point. \
               It extends from the near to the far clipping plane.",
        source: "similar triangles; a 35 mm film of 36 mm by 24 mm keeps its diagonal",
        check: Check::Analytic(projection),
    },
    Law {
        name: "sensor/blur-disc",
        claim: "Rays of one film position converge at one point of the plane in focus. At depth z they are uniform on a disc of \
               radius A |z - f| / f, on the axis and off it.",
        source: "similar triangles; the edge spread of a disc, ½ + (u √(1 - u²) + asin u) / π: 0.804499 at ½",
        check: Check::Analytic(blur_disc),
    },
    Law {
        name: "sensor/importance",
        claim: "A sensor projects a point onto the film position whose ray passes through the point. The importance is the film's \
               area per solid angle of directions, over the squared distance: pixels per area perpendicular to the ray.",
        source: "the derivative of the position on the film by finite differences; the cosines of Veach 1997, section 8.3.2",
        check: Check::Analytic(importance),
    },
];

const ORIGIN: DVec3 = DVec3::new(1.0, -2.0, 0.5);
const TARGET: DVec3 = DVec3::new(-0.4, 1.5, 0.1);

/// The coordinates of a point in camera space: left, up and forward.
fn to_camera(p: DVec3) -> DVec3 {
    let forward = (TARGET - ORIGIN).normalize();
    let left = DVec3::Z.cross(forward).normalize();
    let up = forward.cross(left);
    let offset = p - ORIGIN;
    DVec3::new(offset.dot(left), offset.dot(up), offset.dot(forward))
}

fn camera(plugin: &str, params: &str, size: (u32, u32)) -> Camera {
    turned_camera(plugin, "", params, size)
}

/// A camera with a transform `turn` before its look-at transform.
fn turned_camera(plugin: &str, turn: &str, params: &str, (width, height): (u32, u32)) -> Camera {
    let element = format!(
        r#"<sensor type="{plugin}"><transform name="to_world">{turn}<lookat origin="{}, {}, {}" target="{}, {}, {}" up="0, 0, 1"/></transform>
           <float name="near_clip" value="0.25"/><float name="far_clip" value="40"/>{params}
           <film type="hdrfilm"><integer name="width" value="{width}"/><integer name="height" value="{height}"/>
           <integer name="crop_offset_x" value="3"/><integer name="crop_width" value="5"/></film></sensor>"#,
        ORIGIN.x, ORIGIN.y, ORIGIN.z, TARGET.x, TARGET.y, TARGET.z
    );
    let document = xml::parse_element(&element).expect("the element is valid XML");
    Sensor::read(&document, document.root).expect("the element is a sensor").camera
}

/// The ways to specify a field of view, for a wide and a tall film, each with half the film's width at depth 1.
fn fields() -> Vec<(&'static str, (u32, u32), String, f64)> {
    let half = 20.0_f64.to_radians().tan();
    let (wide, tall) = ((64, 36), (30, 48));
    let diagonal = |(w, h): (u32, u32)| f64::from(w) / f64::from(w).hypot(f64::from(h));
    let aspect = |(w, h): (u32, u32)| f64::from(w) / f64::from(h);
    let axis = |axis| format!(r#"<float name="fov" value="40"/><string name="fov_axis" value="{axis}"/>"#);
    let lens = |millimetres| format!(r#"<string name="focal_length" value="{millimetres}mm"/>"#);
    let film_diagonal = 0.5 * (36.0_f64 * 36.0 + 24.0 * 24.0).sqrt();
    vec![
        ("x, wide", wide, axis("x"), half),
        ("x, tall", tall, axis("x"), half),
        ("y, wide", wide, axis("y"), half * aspect(wide)),
        ("y, tall", tall, axis("y"), half * aspect(tall)),
        ("smaller, wide", wide, axis("smaller"), half * aspect(wide)),
        ("smaller, tall", tall, axis("smaller"), half),
        ("larger, wide", wide, axis("larger"), half),
        ("larger, tall", tall, axis("larger"), half * aspect(tall)),
        ("diagonal, wide", wide, axis("diagonal"), half * diagonal(wide)),
        ("diagonal, tall", tall, axis("diagonal"), half * diagonal(tall)),
        ("85 mm, wide", wide, lens(85), film_diagonal / 85.0 * diagonal(wide)),
        ("28 mm, tall", tall, lens(28), film_diagonal / 28.0 * diagonal(tall)),
        ("nothing given, wide", wide, String::new(), film_diagonal / 50.0 * diagonal(wide)),
    ]
}

fn projection(_: Effort) -> Vec<Finding> {
    let lens = r#"<float name="aperture_radius" value="0.2"/><float name="focus_distance" value="3"/>"#;
    let mut findings = Vec::new();
    for (name, size, params, half_width) in fields() {
        for (plugin, more) in [("perspective", ""), ("thinlens", lens)] {
            let camera = camera(plugin, &(params.clone() + more), size);
            let error = projection_error(&camera, size, half_width, DVec2::splat(0.5));
            findings.push(Finding::error(format!("{plugin}, {name}"), error, 1e-12));
        }
    }
    findings
}

/// The maximum error of rays through projected points: the distance from the point, and the errors of their ends and
/// lengths. The optical axis crosses the film at `axis`, as fractions of its width and height.
fn projection_error(camera: &Camera, (width, height): (u32, u32), half_width: f64, axis: DVec2) -> f64 {
    let film = DVec2::new(f64::from(width), f64::from(height));
    let points = [DVec3::new(-0.2, 1.0, 0.3), DVec3::new(-0.4, 1.5, 0.1), DVec3::new(0.9, 1.8, -0.7)];
    let error = |p: DVec3| {
        let local = to_camera(p);
        // Left on the film is left in the world, rows count downwards, and pixels are square.
        let pixels = 0.5 * film.x / half_width;
        let position = axis * film - pixels * local.truncate() / local.z;
        let ray = camera.ray(position, DVec2::splat(0.5));
        let distance = ray.direction.cross(p - ray.origin).length();
        let (near, far) = (to_camera(ray.origin).z, to_camera(ray.at(ray.t_max)).z);
        let backwards = f64::from(ray.direction.dot(p - ray.origin) <= 0.0);
        distance + backwards + (near - 0.25).abs() + (far - 40.0).abs() / 40.0 + (ray.direction.length() - 1.0).abs()
    };
    points.into_iter().map(error).fold(0.0, f64::max)
}

const APERTURE: f64 = 0.3;
const FOCUS: f64 = 4.0;

/// The intersection of a ray with a plane perpendicular to the camera's axis.
fn on_plane(ray: &Ray, depth: f64) -> DVec2 {
    let (from, to) = (to_camera(ray.origin), to_camera(ray.origin + ray.direction));
    let slope = (to - from) / (to.z - from.z);
    (from + (depth - from.z) * slope).truncate()
}

fn edge_spread(u: f64) -> f64 {
    let u = u.clamp(-1.0, 1.0);
    0.5 + FRAC_1_PI * (u * (1.0 - u * u).sqrt() + u.asin())
}

fn blur_disc(effort: Effort) -> Vec<Finding> {
    let params = format!(
        r#"<float name="aperture_radius" value="{APERTURE}"/><float name="focus_distance" value="{FOCUS}"/>
           <float name="fov" value="40"/>"#
    );
    let camera = camera("thinlens", &params, (64, 36));
    // The 10 % and 90 % points lie 1.374098 radii apart.
    let mut findings = vec![
        Finding::value("edge spread at ½", edge_spread(0.5), 0.804_499, 1e-6),
        Finding::value("edge spread, 10 to 90 %", edge_spread(1.374_098 / 2.0), 0.9, 1e-6),
    ];
    for (position, film) in [("on the axis", DVec2::new(32.0, 18.0)), ("off the axis", DVec2::new(3.0, 31.0))] {
        for depth in [1.0, 2.5, 4.0, 9.0] {
            let name = format!("{position}, depth {depth}");
            findings.extend(blur(&camera, &name, film, depth, effort.samples(5000)));
        }
    }
    findings
}

fn blur(camera: &Camera, name: &str, film: DVec2, depth: f64, samples: u32) -> Vec<Finding> {
    let mut stream = Stream::at(&[60]);
    let centre = on_plane(&camera.ray(film, DVec2::splat(0.5)), depth);
    let mut lens = || on_plane(&camera.ray(film, stream.next_2d()), depth) - centre;
    let offsets: Vec<DVec2> = (0..samples).map(|_| lens()).collect();
    let radius = APERTURE * (depth - FOCUS).abs() / FOCUS;
    let widest = offsets.iter().map(|offset| offset.length()).fold(0.0, f64::max);
    if radius == 0.0 {
        return vec![Finding::error(format!("{name}, in focus"), widest, 1e-12)];
    }
    let mut findings = vec![Finding::error(format!("{name}, beyond the disc"), (widest - radius).max(0.0), 1e-12)];
    for (axis, direction) in [("across", DVec2::X), ("up", DVec2::Y), ("slanting", DVec2::ONE / 2.0_f64.sqrt())] {
        let along: Vec<f64> = offsets.iter().map(|offset| offset.dot(direction) / radius).collect();
        let test = Ks::one_sample(&along, edge_spread);
        findings.push(Finding::test(format!("{name}, {axis}"), format!("KS distance {:.4}", test.statistic), test.p));
    }
    let squares: Moments = offsets.iter().map(|offset| offset.length_squared()).collect();
    findings.push(Finding::mean(format!("{name}, mean square"), &squares, 0.5 * radius * radius));
    findings
}

/// The step of finite differences, relative to the distance; the error is of second order.
const STEP: f64 = 1e-4;

fn importance(effort: Effort) -> Vec<Finding> {
    let lens = r#"<float name="aperture_radius" value="0.2"/><float name="focus_distance" value="3"/>"#;
    let mut findings = Vec::new();
    for (name, size, params, _) in fields() {
        for (turned, turn) in [("", ""), (", mirrored", r#"<scale x="-1"/>"#)] {
            for (plugin, more) in [("perspective", ""), ("thinlens", lens)] {
                let camera = turned_camera(plugin, turn, &(params.clone() + more), size);
                let [position, density] = sample_errors(&camera, size, effort.samples(50));
                let name = format!("{plugin}, {name}{turned}");
                findings.push(Finding::error(format!("{name}: rays through points"), position, 1e-9));
                findings.push(Finding::error(format!("{name}: importance"), density, 1e-6));
            }
        }
    }
    findings
}

/// The maximum errors of `sample_direction` as the inverse of `ray`, and of the importance as the film's density.
fn sample_errors(camera: &Camera, (width, height): (u32, u32), points: u32) -> [f64; 2] {
    let film = DVec2::new(f64::from(width), f64::from(height));
    let mut stream = Stream::at(&[61]);
    let (mut position, mut density) = (0.0_f64, 0.0_f64);
    for _ in 0..points {
        // Film positions beyond the border are projected too.
        let (at, u) = ((1.4 * stream.next_2d() - 0.2) * film, stream.next_2d());
        let ray = camera.ray(at, u);
        let distance = 1.0 + 9.0 * stream.next_1d();
        let p = ray.at(distance);
        let sample = |p| camera.sample_direction(p, u).expect("the point lies between the clipping planes");
        let sensor_sample = sample(p);
        let start = sensor_sample.ray.origin + sensor_sample.ray.direction - ray.origin;
        position = position.max((sensor_sample.film - at).length() / film.length());
        position = position
            .max((sensor_sample.direction + ray.direction).length())
            .max((sensor_sample.ray.origin - p).length());
        position = position.max(start.length());

        let (a, b) = sensor_sample.direction.any_orthonormal_pair();
        let step = STEP * distance;
        let slope = |v: DVec3| (sample(p + step * v).film - sample(p - step * v).film) / (2.0 * step);
        let pixels_per_area = slope(a).perp_dot(slope(b)).abs();
        density = density.max((sensor_sample.importance / pixels_per_area - 1.0).abs());
    }
    [position, density]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_laws_hold_for_an_optical_axis_to_the_left_and_below() {
        let params = r#"<float name="fov" value="40"/><float name="principal_point_offset_x" value="0.2"/>
            <float name="principal_point_offset_y" value="-0.15"/>"#;
        let (size, half_width) = ((64, 36), 20.0_f64.to_radians().tan());
        let camera = camera("perspective", params, size);
        let error = projection_error(&camera, size, half_width, DVec2::new(0.3, 0.65));
        let [position, density] = sample_errors(&camera, size, 500);
        assert!(error < 1e-12 && position < 1e-9 && density < 1e-6, "{error}, {position}, {density}");
    }
}
