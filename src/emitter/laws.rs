//! Laws of emitters, checked with every example of every plugin: light traced from an emitter equals the light that
//! emitter sampling finds where it arrives.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

use super::{BoundingSphere, Emission, EmissionTarget, Emitter, EmitterModel as _, EnvMap};
use crate::{
    law::{Check, Effort, Finding, Law},
    math::{Frame, Ray, Rgb, rng::Stream, warp},
    scene_file::xml,
    shape::Shape,
    stats::Moments,
};

/// The laws of emitters.
pub const LAWS: &[Law] = &[
    Law {
        name: "emitter/emission",
        claim: "The power that an emitter emits through a small disc equals an estimate by emitter sampling from the disc.",
        source: "both estimate ∫∫ L cos θ dω dA, with independent samples",
        check: Check::Analytic(emission),
    },
    Law {
        name: "emitter/power",
        claim: "The mean emitted flux equals the emitter's power. Directions have unit length.",
        source: "closed forms: 4π I, 2π I ∫ falloff sin θ dθ, π L A, and π r² E and 4π² r² L through a sphere of radius r",
        check: Check::Analytic(power),
    },
    Law {
        name: "emitter/aim",
        claim: "Emission aimed at a sphere carries the same flux as all emitted light that crosses it. Every aimed ray hits the sphere.",
        source: "importance sampling does not change the mean",
        check: Check::Analytic(aim),
    },
];

/// An emitter, and the shape of an area light.
struct Subject {
    name: String,
    emitter: Emitter,
    shape: Option<Shape>,
}

/// The bounding sphere of the scene.
const SCENE_BOUNDS: BoundingSphere = BoundingSphere { centre: DVec3::new(0.3, 0.2, -0.1), radius: 2.5 };

const SHAPES: [&str; 4] = [
    r#"<shape type="rectangle"><transform name="to_world"><scale x="0.5" y="0.3"/><rotate y="1" angle="70"/>
       <translate x="-1.7" y="0.4"/></transform></shape>"#,
    r#"<shape type="sphere"><point name="center" x="1" y="1.2" z="-1"/><float name="radius" value="0.3"/></shape>"#,
    r#"<shape type="disk"><transform name="to_world"><scale x="0.7" y="0.4"/><rotate x="1" angle="95"/>
       <translate x="0.2" y="1.6"/></transform></shape>"#,
    r#"<shape type="cylinder"><point name="p0" x="1" y="-1" z="1"/><point name="p1" x="1.3" y="1" z="1"/>
       <float name="radius" value="0.2"/></shape>"#,
];

/// An area light with a checkerboard, whose squares a regular grid of points samples evenly.
const CHECKERED: &str = r#"<emitter type="area"><texture type="checkerboard" name="radiance"><rgb name="color0" value="0, 2, 3"/>
    <rgb name="color1" value="4, 1, 0.5"/></texture></emitter>"#;

fn emitter(element: &str) -> Emitter {
    let document = xml::parse_element(element).expect("examples are valid XML");
    Emitter::read(&document, document.root).expect("examples are valid emitters")
}

fn shape(element: &str) -> Shape {
    let document = xml::parse_element(element).expect("the element is valid XML");
    let params = Shape::params(&document, document.root).expect("the element is a shape");
    Shape::read_from(&params).expect("the element is a shape")
}

/// The examples of all emitters, each area light with several shapes.
fn subjects() -> Vec<Subject> {
    let mut subjects = Vec::new();
    let examples = Emitter::PLUGINS.iter().flat_map(|plugin| plugin.examples);
    for example in examples.copied().chain([CHECKERED]) {
        let name = emitter(example).plugin().name;
        let shapes = if name == "area" { SHAPES.map(Some).to_vec() } else { vec![None] };
        for (i, element) in shapes.into_iter().enumerate() {
            let name = if example == CHECKERED { "checkered area" } else { name };
            subjects.push(Subject {
                name: format!("{name} #{}", i + 1),
                emitter: emitter(example),
                shape: element.map(shape),
            });
        }
    }
    subjects.push(Subject { name: "envmap".into(), emitter: Emitter::EnvMap(uneven_map()), shape: None });
    subjects
}

/// A turned and mirrored environment with black texels, a bright one beside the seam, and coloured poles.
fn uneven_map() -> EnvMap {
    let texel = |i: u16| [f32::from(i % 7), f32::from(i * i % 11), if i == 16 { 60.0 } else { f32::from(i % 3) }];
    let turn = DMat3::from_axis_angle(DVec3::new(0.3, 0.9, -0.2).normalize(), 2.0);
    EnvMap::new([8, 5], (0..40).map(texel).collect(), turn * DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0)))
}

impl Subject {
    fn emit(&self, target: &EmissionTarget, stream: &mut Stream) -> Option<Emission> {
        self.emitter.emit(self.shape.as_ref(), target, [stream.next_2d(), stream.next_2d()])
    }
}

/// Emission in all directions.
const UNAIMED: EmissionTarget = EmissionTarget { sphere: SCENE_BOUNDS, before: SCENE_BOUNDS.radius, is_aimed: false };

/// The moments of a sum of light, for each channel.
#[derive(Default)]
struct Channels([Moments; 3]);

impl Channels {
    fn push(&mut self, light: Rgb) {
        self.0.iter_mut().zip(light.to_array()).for_each(|(moments, x)| moments.push(x));
    }

    fn compare(&self, name: &str, other: &Self) -> Vec<Finding> {
        let channels = self.0.iter().zip(&other.0).zip(["R", "G", "B"]);
        channels.map(|((one, other), c)| Finding::equal_means(format!("{name}, {c}"), one, other)).collect()
    }
}

/// A disc that receives light on the side of its normal.
struct Receiver {
    centre: DVec3,
    frame: Frame,
    radius: f64,
}

impl Receiver {
    fn all() -> [Self; 3] {
        let receiver =
            |centre, normal: DVec3| Self { centre, frame: Frame::from_normal(normal.normalize()), radius: 0.5 };
        [
            receiver(DVec3::ZERO, DVec3::new(0.3, 0.8, -0.4)),
            receiver(DVec3::new(0.4, -0.5, 0.3), DVec3::new(-0.5, 0.8, 0.1)),
            receiver(DVec3::new(-0.3, 0.2, 0.6), DVec3::new(0.2, 0.1, -1.0)),
        ]
    }

    /// Whether a ray hits its front.
    fn is_hit(&self, ray: &Ray) -> bool {
        let cos = -self.frame.n.dot(ray.direction);
        let t = self.frame.n.dot(ray.origin - self.centre) / cos;
        cos > 0.0 && t > 0.0 && (ray.at(t) - self.centre).length() < self.radius
    }

    /// An estimate by emitter sampling of the power in W that it receives.
    fn sampled_flux(&self, subject: &Subject, stream: &mut Stream) -> Rgb {
        let p = self.centre + self.frame.to_world((self.radius * warp::square_to_disc(stream.next_2d())).extend(0.0));
        let area = PI * self.radius * self.radius;
        let Some(emitter_sample) = subject.emitter.sample_direction(subject.shape.as_ref(), p, stream.next_2d()) else {
            return Rgb::ZERO;
        };
        let cos = emitter_sample.direction.dot(self.frame.n).max(0.0);
        emitter_sample.value * (area * cos / emitter_sample.pdf.map_or(1.0, |pdf| pdf.0))
    }
}

fn emission(effort: Effort) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (number, subject) in subjects().iter().enumerate() {
        let mut stream = Stream::at(&[70, number as u64]);
        let receivers = Receiver::all();
        let (mut emitted, mut sampled) =
            (receivers.each_ref().map(|_| Channels::default()), receivers.each_ref().map(|_| Channels::default()));
        for _ in 0..effort.samples(60_000) {
            let emission = subject.emit(&UNAIMED, &mut stream);
            for (receiver, light) in receivers.iter().zip(&mut emitted) {
                light.push(emission.filter(|e| receiver.is_hit(&e.ray)).map_or(Rgb::ZERO, |e| e.flux));
            }
        }
        for (receiver, light) in receivers.iter().zip(&mut sampled) {
            (0..effort.samples(20_000)).for_each(|_| light.push(receiver.sampled_flux(subject, &mut stream)));
        }
        for (i, (emitted, sampled)) in emitted.iter().zip(&sampled).enumerate() {
            findings.extend(emitted.compare(&format!("{}, disc {}", subject.name, i + 1), sampled));
        }
    }
    findings
}

fn power(effort: Effort) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (number, subject) in subjects().iter().enumerate() {
        let mut stream = Stream::at(&[71, number as u64]);
        let (mut emitted, mut length_error) = (Channels::default(), 0.0_f64);
        for _ in 0..effort.samples(20_000) {
            let emission = subject.emit(&UNAIMED, &mut stream);
            emitted.push(emission.map_or(Rgb::ZERO, |e| e.flux));
            length_error = length_error.max(emission.map_or(0.0, |e| (e.ray.direction.length() - 1.0).abs()));
        }
        let stated = subject.emitter.power(subject.shape.as_ref(), &UNAIMED);
        for ((moments, expected), channel) in emitted.0.iter().zip(stated.to_array()).zip(["R", "G", "B"]) {
            findings.push(Finding::mean(format!("{}, {channel}", subject.name), moments, expected));
        }
        findings.push(Finding::error(format!("{}, length of directions", subject.name), length_error, 1e-12));
    }
    findings.extend(distant_powers());
    findings
}

/// The power of distant emitters through the bounding sphere of a scene, compared with closed forms.
fn distant_powers() -> [Finding; 2] {
    let power = |element: &str| {
        let document = xml::parse_element(element).expect("the element is valid XML");
        let emitter = Emitter::read(&document, document.root).expect("the element is an emitter");
        emitter.power(None, &UNAIMED).y
    };
    let section = PI * SCENE_BOUNDS.radius * SCENE_BOUNDS.radius;
    let sun = power(r#"<emitter type="directional"><rgb name="irradiance" value="1, 0.7, 2"/></emitter>"#);
    let environment = power(r#"<emitter type="constant"><rgb name="radiance" value="1, 0.3, 2"/></emitter>"#);
    [
        Finding::value("directional, closed form", sun, 0.7 * section, 1e-9),
        Finding::value("constant, closed form", environment, 0.3 * 4.0 * PI * section, 1e-9),
    ]
}

/// Spheres that light is aimed at; the third contains some emitters.
const SPHERES: [BoundingSphere; 3] = [
    BoundingSphere { centre: DVec3::new(-0.2, 0.3, 0.1), radius: 0.6 },
    BoundingSphere { centre: DVec3::new(0.5, -1.0, 0.4), radius: 0.4 },
    BoundingSphere { centre: DVec3::new(0.6, 1.4, -0.6), radius: 0.9 },
];

fn crosses(sphere: &BoundingSphere, ray: &Ray) -> bool {
    let ahead = (sphere.centre - ray.origin).dot(ray.direction).max(0.0);
    (ray.at(ahead) - sphere.centre).length() < sphere.radius * (1.0 + 1e-9)
}

fn aim(effort: Effort) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (number, subject) in subjects().iter().enumerate() {
        for (i, sphere) in SPHERES.iter().enumerate() {
            let mut stream = Stream::at(&[72, number as u64, i as u64]);
            let target = EmissionTarget { sphere: *sphere, before: 5.0, is_aimed: true };
            let surrounded = sphere.centre.distance(SCENE_BOUNDS.centre) + sphere.radius < SCENE_BOUNDS.radius;
            assert!(surrounded, "distant emitters illuminate the entire sphere");
            let (mut all, mut aimed, mut missed) = (Channels::default(), Channels::default(), 0_u32);
            for _ in 0..effort.samples(40_000) {
                let through = |e: &Emission| crosses(sphere, &e.ray);
                all.push(subject.emit(&UNAIMED, &mut stream).filter(through).map_or(Rgb::ZERO, |e| e.flux));
                let emission = subject.emit(&target, &mut stream);
                // Rays from a light within the sphere always cross it.
                missed += u32::from(emission.is_some_and(|e| !through(&e)));
                aimed.push(emission.map_or(Rgb::ZERO, |e| e.flux));
            }
            let name = format!("{}, sphere {}", subject.name, i + 1);
            findings.extend(all.compare(&name, &aimed));
            findings.push(Finding::error(format!("{name}, missed"), f64::from(missed), 0.0));
        }
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    #[test]
    fn narrow_cones_contain_their_samples() {
        for distance in [1.0, 1e3, 1e6, 1e9, 1e12] {
            let sphere = BoundingSphere { centre: DVec3::new(0.6, -0.7, 0.4).normalize() * distance, radius: 0.5 };
            let target = EmissionTarget { sphere, before: 0.0, is_aimed: true };
            let mut stream = Stream::at(&[73]);
            let is_contained = |u: DVec2| {
                let (direction, pdf) = target.towards(DVec3::ZERO, u);
                target.pdf(&Ray::new(DVec3::ZERO, direction), false) == pdf.0
            };
            let contained = (0..1000).filter(|_| is_contained(stream.next_2d())).count();
            assert!(contained >= 998, "{distance}: {contained} of 1000");
        }
    }

    #[test]
    fn the_power_of_narrow_spots_matches_small_angles() {
        for degrees in [1.0, 0.01, 1e-4, 1e-8] {
            let spot =
                emitter(&format!(r#"<emitter type="spot"><float name="cutoff_angle" value="{degrees}"/></emitter>"#));
            let angle = f64::to_radians(degrees);
            // ∫ falloff(θ) θ dθ in units of the cutoff angle: up to 3/4, and from 3/4 to 1.
            let flat = 2.0 * PI * angle * angle * (0.281_25 + 0.104_166_666_667);
            let power = spot.power(None, &UNAIMED).x;
            assert!((power / flat - 1.0).abs() < 1e-4, "{degrees}: {power} {flat}");
        }
    }

    #[test]
    fn a_light_that_emits_only_between_grid_points_has_power() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let file = folder.path().join("spark.png");
        let mut pixels = vec![0; 256 * 256];
        pixels[0] = 255;
        let encoder = png::Encoder::new(std::fs::File::create(&file).expect("a file"), 256, 256);
        encoder.write_header().and_then(|mut writer| writer.write_image_data(&pixels)).expect("a picture");
        let element = format!(
            r#"<emitter type="area"><texture type="bitmap" name="radiance"><string name="filename" value="{}"/></texture></emitter>"#,
            file.display()
        );
        let (spark, shape) = (emitter(&element), shape(SHAPES[0]));
        let target = EmissionTarget { sphere: SCENE_BOUNDS, before: 1.0, is_aimed: false };
        assert!(spark.power(Some(&shape), &target).min_element() > 0.0);
    }
}
