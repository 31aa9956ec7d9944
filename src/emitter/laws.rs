//! What must hold for every emitter of the list, over all its examples: that light which is followed from it is the
//! light that is sought from where it arrives.

use std::f64::consts::PI;

use glam::DVec3;

use super::{BoundingSphere, Emission, EmissionTarget, Emitter, EmitterModel as _};
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
        claim: "What an emitter sends through a small disc is what is found by seeking the emitter from the disc.",
        source: "both estimate ∫∫ L cos θ dω dA, by samples that have nothing in common",
        check: Check::Analytic(emission),
    },
    Law {
        name: "emitter/power",
        claim: "The mean of what is emitted is the stated power; directions have unit length.",
        source: "closed forms: 4π I, 2π I ∫ falloff sin θ dθ, π L A, and π r² E and 4π² r² L through a ball of radius r",
        check: Check::Analytic(power),
    },
    Law {
        name: "emitter/aim",
        claim: "Light that is aimed at a ball is all the light that goes through it; what is aimed hits it.",
        source: "importance sampling leaves means as they are",
        check: Check::Analytic(aim),
    },
];

/// An emitter, with the shape that it shines from if it does.
struct Subject {
    name: String,
    emitter: Emitter,
    shape: Option<Shape>,
}

/// Around all that light shines on.
const SURROUNDINGS: BoundingSphere = BoundingSphere { centre: DVec3::new(0.3, 0.2, -0.1), radius: 2.5 };

const SHAPES: [&str; 4] = [
    r#"<shape type="rectangle"><transform name="to_world"><scale x="0.5" y="0.3"/><rotate y="1" angle="70"/>
       <translate x="-1.7" y="0.4"/></transform></shape>"#,
    r#"<shape type="sphere"><point name="center" x="1" y="1.2" z="-1"/><float name="radius" value="0.3"/></shape>"#,
    r#"<shape type="disk"><transform name="to_world"><scale x="0.7" y="0.4"/><rotate x="1" angle="95"/>
       <translate x="0.2" y="1.6"/></transform></shape>"#,
    r#"<shape type="cylinder"><point name="p0" x="1" y="-1" z="1"/><point name="p1" x="1.3" y="1" z="1"/>
       <float name="radius" value="0.2"/></shape>"#,
];

/// A quarter of it is black, in squares that a grid of points meets evenly.
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

/// Every example of the list; those that shine from a shape, from several.
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
    subjects
}

impl Subject {
    fn emit(&self, target: &EmissionTarget, stream: &mut Stream) -> Option<Emission> {
        self.emitter.emit(self.shape.as_ref(), target, [stream.next_2d(), stream.next_2d()])
    }
}

/// All that is emitted, in whatever direction.
const UNAIMED: EmissionTarget = EmissionTarget { sphere: SURROUNDINGS, before: SURROUNDINGS.radius, is_aimed: false };

/// A sum of light by channel.
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

/// A disc that light falls on, from the side of its normal.
struct Patch {
    centre: DVec3,
    frame: Frame,
    radius: f64,
}

impl Patch {
    fn all() -> [Self; 3] {
        let patch = |centre, normal: DVec3| Self { centre, frame: Frame::from_normal(normal.normalize()), radius: 0.5 };
        [
            patch(DVec3::ZERO, DVec3::new(0.3, 0.8, -0.4)),
            patch(DVec3::new(0.4, -0.5, 0.3), DVec3::new(-0.5, 0.8, 0.1)),
            patch(DVec3::new(-0.3, 0.2, 0.6), DVec3::new(0.2, 0.1, -1.0)),
        ]
    }

    /// Whether a ray falls on it.
    fn meets(&self, ray: &Ray) -> bool {
        let cos = -self.frame.n.dot(ray.direction);
        let t = self.frame.n.dot(ray.origin - self.centre) / cos;
        cos > 0.0 && t > 0.0 && (ray.at(t) - self.centre).length() < self.radius
    }

    /// An estimate of the power in W that an emitter sends on it, seen from it.
    fn sought(&self, subject: &Subject, stream: &mut Stream) -> Rgb {
        let p = self.centre + self.frame.to_world((self.radius * warp::square_to_disc(stream.next_2d())).extend(0.0));
        let area = PI * self.radius * self.radius;
        let Some(incident) = subject.emitter.sample_direction(subject.shape.as_ref(), p, stream.next_2d()) else {
            return Rgb::ZERO;
        };
        let cos = incident.direction.dot(self.frame.n).max(0.0);
        incident.value * (area * cos / incident.pdf.map_or(1.0, |pdf| pdf.0))
    }
}

fn emission(effort: Effort) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (number, subject) in subjects().iter().enumerate() {
        let mut stream = Stream::at(&[70, number as u64]);
        let patches = Patch::all();
        let (mut emitted, mut sought) =
            (patches.each_ref().map(|_| Channels::default()), patches.each_ref().map(|_| Channels::default()));
        for _ in 0..effort.samples(60_000) {
            let emission = subject.emit(&UNAIMED, &mut stream);
            for (patch, light) in patches.iter().zip(&mut emitted) {
                light.push(emission.filter(|e| patch.meets(&e.ray)).map_or(Rgb::ZERO, |e| e.flux));
            }
        }
        for (patch, light) in patches.iter().zip(&mut sought) {
            (0..effort.samples(20_000)).for_each(|_| light.push(patch.sought(subject, &mut stream)));
        }
        for (i, (emitted, sought)) in emitted.iter().zip(&sought).enumerate() {
            findings.extend(emitted.compare(&format!("{}, disc {}", subject.name, i + 1), sought));
        }
    }
    findings
}

fn power(effort: Effort) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (number, subject) in subjects().iter().enumerate() {
        let mut stream = Stream::at(&[71, number as u64]);
        let (mut emitted, mut stretch) = (Channels::default(), 0.0_f64);
        for _ in 0..effort.samples(20_000) {
            let emission = subject.emit(&UNAIMED, &mut stream);
            emitted.push(emission.map_or(Rgb::ZERO, |e| e.flux));
            stretch = stretch.max(emission.map_or(0.0, |e| (e.ray.direction.length() - 1.0).abs()));
        }
        let stated = subject.emitter.power(subject.shape.as_ref(), &UNAIMED);
        for ((moments, expected), channel) in emitted.0.iter().zip(stated.to_array()).zip(["R", "G", "B"]) {
            findings.push(Finding::mean(format!("{}, {channel}", subject.name), moments, expected));
        }
        findings.push(Finding::error(format!("{}, length of directions", subject.name), stretch, 1e-12));
    }
    findings.extend(distant_powers());
    findings
}

/// What comes from far away through the ball around a scene, in closed form.
fn distant_powers() -> [Finding; 2] {
    let power = |element: &str| {
        let document = xml::parse_element(element).expect("the element is valid XML");
        let emitter = Emitter::read(&document, document.root).expect("the element is an emitter");
        emitter.power(None, &UNAIMED).y
    };
    let section = PI * SURROUNDINGS.radius * SURROUNDINGS.radius;
    let sun = power(r#"<emitter type="directional"><rgb name="irradiance" value="1, 0.7, 2"/></emitter>"#);
    let environment = power(r#"<emitter type="constant"><rgb name="radiance" value="1, 0.3, 2"/></emitter>"#);
    [
        Finding::value("directional, closed form", sun, 0.7 * section, 1e-9),
        Finding::value("constant, closed form", environment, 0.3 * 4.0 * PI * section, 1e-9),
    ]
}

/// A ball that light is aimed at, near and far, and one around the emitters that lie in it.
const BALLS: [BoundingSphere; 3] = [
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
        for (i, ball) in BALLS.iter().enumerate() {
            let mut stream = Stream::at(&[72, number as u64, i as u64]);
            let target = EmissionTarget { sphere: *ball, before: 5.0, is_aimed: true };
            let surrounded = ball.centre.distance(SURROUNDINGS.centre) + ball.radius < SURROUNDINGS.radius;
            assert!(surrounded, "light from far away falls on all of the ball");
            let (mut all, mut aimed, mut beside) = (Channels::default(), Channels::default(), 0_u32);
            for _ in 0..effort.samples(40_000) {
                let through = |e: &Emission| crosses(ball, &e.ray);
                all.push(subject.emit(&UNAIMED, &mut stream).filter(through).map_or(Rgb::ZERO, |e| e.flux));
                let emission = subject.emit(&target, &mut stream);
                // A light within the ball shines everywhere from there.
                beside += u32::from(emission.is_some_and(|e| !through(&e)));
                aimed.push(emission.map_or(Rgb::ZERO, |e| e.flux));
            }
            let name = format!("{}, ball {}", subject.name, i + 1);
            findings.extend(all.compare(&name, &aimed));
            findings.push(Finding::error(format!("{name}, missed"), f64::from(beside), 0.0));
        }
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    #[test]
    fn narrow_cones_hold_what_is_drawn_from_them() {
        for distance in [1.0, 1e3, 1e6, 1e9, 1e12] {
            let ball = BoundingSphere { centre: DVec3::new(0.6, -0.7, 0.4).normalize() * distance, radius: 0.5 };
            let target = EmissionTarget { sphere: ball, before: 0.0, is_aimed: true };
            let mut stream = Stream::at(&[73]);
            let is_held = |u: DVec2| {
                let (direction, drawn) = target.towards(DVec3::ZERO, u);
                target.pdf(&Ray::new(DVec3::ZERO, direction), false) == drawn.0
            };
            let held = (0..1000).filter(|_| is_held(stream.next_2d())).count();
            assert!(held >= 998, "{distance}: {held} of 1000");
        }
    }

    #[test]
    fn narrow_spots_have_the_power_of_their_discs() {
        for degrees in [1.0, 0.01, 1e-4, 1e-8] {
            let spot =
                emitter(&format!(r#"<emitter type="spot"><float name="cutoff_angle" value="{degrees}"/></emitter>"#));
            let angle = f64::to_radians(degrees);
            // ∫ θ dθ up to 3/4, and from there on times what is left.
            let flat = 2.0 * PI * angle * angle * (0.281_25 + 0.104_166_666_667);
            let power = spot.power(None, &UNAIMED).x;
            assert!((power / flat - 1.0).abs() < 1e-4, "{degrees}: {power} {flat}");
        }
    }

    #[test]
    fn a_light_that_shines_between_the_points_of_a_grid_has_power() {
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
        let target = EmissionTarget { sphere: SURROUNDINGS, before: 1.0, is_aimed: false };
        assert!(spark.power(Some(&shape), &target).min_element() > 0.0);
    }
}
