//! Laws of the light that an entire scene emits.

use std::path::Path;

use glam::DVec3;

use super::Scene;
use crate::{
    emitter::{BoundingSphere, Emission},
    law::{Check, Effort, Finding, Law},
    math::{Rgb, rng::Stream},
    scene_file::xml,
    stats::Moments,
};

/// The laws of scenes.
pub const LAWS: &[Law] = &[
    Law {
        name: "scene/emission",
        claim: "Emitters sampled in proportion to their unequal powers emit the sum of their powers.",
        source: "closed forms: 4π I and π L A",
        check: Check::Analytic(emission),
    },
    Law {
        name: "scene/aim",
        claim: "Emission aimed at overlapping spheres around mirrors and glass carries the same flux as all emitted light that crosses any of them.",
        source: "importance sampling does not change the mean",
        check: Check::Analytic(aim),
    },
];

const LIGHTS: [(&str, &str); 5] = [
    (
        "point",
        r#"<emitter type="point"><point name="position" x="-1.5" y="1" z="0.3"/><rgb name="intensity" value="3, 1, 2"/></emitter>"#,
    ),
    (
        "point in a sphere",
        r#"<emitter type="point"><point name="position" x="0.1" y="0.1" z="0"/><rgb name="intensity" value="1, 2, 3"/></emitter>"#,
    ),
    (
        "area",
        r#"<shape type="rectangle"><transform name="to_world"><scale x="0.5" y="0.3"/><rotate x="1" angle="100"/>
           <translate y="2"/></transform><emitter type="area"><rgb name="radiance" value="2, 4, 8"/></emitter></shape>"#,
    ),
    (
        "directional",
        r#"<emitter type="directional"><vector name="direction" x="1" y="-2" z="0.5"/><rgb name="irradiance" value="1, 2, 0"/></emitter>"#,
    ),
    ("environment", r#"<emitter type="constant"><rgb name="radiance" value="0.4, 0.5, 0.7"/></emitter>"#),
];

const SPHERES: [BoundingSphere; 3] = [
    BoundingSphere { centre: DVec3::ZERO, radius: 0.5 },
    BoundingSphere { centre: DVec3::new(0.4, 0.1, 0.2), radius: 0.4 },
    BoundingSphere { centre: DVec3::new(-0.8, -0.6, 0.5), radius: 0.3 },
];

fn scene(lights: &[&str]) -> Scene {
    let glass = |sphere: &BoundingSphere| {
        let DVec3 { x, y, z } = sphere.centre;
        format!(
            r#"<shape type="sphere"><point name="center" x="{x}" y="{y}" z="{z}"/><float name="radius" value="{}"/>
               <bsdf type="dielectric"/></shape>"#,
            sphere.radius
        )
    };
    let spheres = SPHERES.iter().map(glass).collect::<String>();
    let text = format!(r#"<scene version="3.0.0"><sensor type="perspective"/>{spheres}{}</scene>"#, lights.concat());
    let document = xml::parse(&text, "law", Path::new(""), &[]).expect("the scene is valid XML");
    Scene::build(&document).expect("the scene is valid")
}

fn push(light: &mut [Moments; 3], flux: Rgb) {
    light.iter_mut().zip(flux.to_array()).for_each(|(moments, x)| moments.push(x));
}

fn emission(effort: Effort) -> Vec<Finding> {
    let scene = scene(&[LIGHTS[0].1, LIGHTS[1].1, LIGHTS[2].1]);
    let mut stream = Stream::at(&[74]);
    let mut emitted = [Moments::default(); 3];
    for _ in 0..effort.samples(40_000) {
        push(&mut emitted, scene.emit(&mut stream).map_or(Rgb::ZERO, |(emission, _)| emission.flux));
    }
    let points = Rgb::new(4.0, 3.0, 5.0) * (4.0 * std::f64::consts::PI);
    let area = Rgb::new(2.0, 4.0, 8.0) * (0.6 * std::f64::consts::PI);
    let expected = (points + area).to_array();
    let channels = emitted.iter().zip(expected).zip(["R", "G", "B"]);
    channels.map(|((moments, expected), c)| Finding::mean(format!("three lights, {c}"), moments, expected)).collect()
}

/// Whether a ray crosses each of the spheres.
fn crossed(emission: &Emission) -> [bool; 3] {
    let ray = &emission.ray;
    SPHERES.map(|sphere| {
        let ahead = (sphere.centre - ray.origin).dot(ray.direction).max(0.0);
        (ray.at(ahead) - sphere.centre).length() < sphere.radius
    })
}

/// A condition on the spheres that a ray crosses, with its description.
type Condition = (&'static str, fn([bool; 3]) -> bool);

const CONDITIONS: [Condition; 4] = [
    ("any sphere", |through| through.contains(&true)),
    ("both of two", |through| through[0] && through[1]),
    ("the second alone", |through| through == [false, true, false]),
    ("the third", |through| through[2]),
];

fn aim(effort: Effort) -> Vec<Finding> {
    let alone = LIGHTS.iter().map(|(name, light)| ((*name).to_owned(), vec![*light]));
    let together = ("all".to_owned(), LIGHTS.map(|(_, light)| light).to_vec());
    let mut findings = Vec::new();
    for (number, (name, lights)) in alone.chain([together]).enumerate() {
        let (scene, mut stream) = (scene(&lights), Stream::at(&[75, number as u64]));
        let mut sums = CONDITIONS.map(|_| [[Moments::default(); 3]; 2]);
        for _ in 0..effort.samples(40_000) {
            let emitted = scene.emit(&mut stream).map(|(emission, _)| emission);
            for (i, emission) in [emitted, scene.emit_at_specular(&mut stream)].into_iter().enumerate() {
                for ((_, condition), sums) in CONDITIONS.iter().zip(&mut sums) {
                    push(&mut sums[i], emission.filter(|e| condition(crossed(e))).map_or(Rgb::ZERO, |e| e.flux));
                }
            }
        }
        for ((condition, _), [all, aimed]) in CONDITIONS.iter().zip(&sums) {
            for (channel, (all, aimed)) in ["R", "G", "B"].iter().zip(all.iter().zip(aimed)) {
                findings.push(Finding::equal_means(format!("{name}, {condition}, {channel}"), all, aimed));
            }
        }
    }
    findings
}
