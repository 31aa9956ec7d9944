//! Builds the test scenes of the laws from XML fragments.
//!
//! The scenes avoid values that could hide a wrong factor: distances are not 1, channels are not equal, and lights are
//! not exactly overhead.

use std::path::Path;

use glam::DVec3;
use tempfile::TempDir;

use crate::{
    film::splats,
    integrator::Overrides,
    law::Finding,
    math::Rgb,
    render::{Renderer, Replicate},
    scene::Scene,
    scene_file::{Document, xml},
    stats::Moments,
};

/// A camera whose samples all lie within about 1e-12 pixels of their pixel's centre.
pub(super) struct PixelCentres {
    /// The camera's position. Rays start at the near plane, at a depth of [`PixelCentres::NEAR`].
    pub(super) position: DVec3,
    /// The point that the optical axis passes through.
    pub(super) target: DVec3,
    /// The horizontal field of view, in degrees.
    pub(super) fov: f64,
    pub(super) columns: u32,
    pub(super) rows: u32,
}

impl PixelCentres {
    /// The depth of the near plane along the optical axis.
    pub(super) const NEAR: f64 = 0.001;

    pub(super) fn xml(&self) -> String {
        let Self { position, target, fov, columns, rows } = self;
        let is_steep = (*target - *position).normalize().z.abs() > 0.99;
        let up = triple(if is_steep { DVec3::X } else { DVec3::Z });
        let (position, target) = (triple(*position), triple(*target));
        format!(
            r#"<sensor type="perspective"><float name="fov" value="{fov}"/><float name="near_clip" value="{}"/>
               <transform name="to_world"><lookat origin="{position}" target="{target}" up="{up}"/></transform>
               <film type="hdrfilm"><integer name="width" value="{columns}"/><integer name="height" value="{rows}"/>
               <rfilter type="gaussian"><float name="stddev" value="1e-12"/></rfilter></film></sensor>"#,
            Self::NEAR
        )
    }
}

/// A picture in a temporary file, which lasts as long as this value.
pub(super) struct Picture(TempDir);

impl Picture {
    /// Writes a linear picture.
    pub(super) fn new([width, height]: [usize; 2], texel: impl Fn(usize, usize) -> Rgb + Sync) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        exr::prelude::write_rgb_file(folder.path().join("picture.exr"), width, height, |x, y| {
            let [r, g, b] = texel(x, y).as_vec3().to_array();
            (r, g, b)
        })
        .expect("a temporary file");
        Self(folder)
    }

    /// The parameter that names the file.
    pub(super) fn xml(&self) -> String {
        format!(r#"<string name="filename" value="{}"/>"#, self.0.path().join("picture.exr").display())
    }
}

fn parsed(parts: &[&str]) -> Document {
    let text = format!(r#"<scene version="3.0.0">{}</scene>"#, parts.concat());
    xml::parse(&text, "law", Path::new(""), &[]).expect("the scene is valid XML")
}

/// A renderer of a scene made of these XML fragments.
pub(super) fn renderer(integrator: &str, sensor: &str, scene: &str) -> Renderer {
    renderer_with(&Overrides::default(), &[integrator, sensor, scene])
}

/// A renderer of a scene made of these XML fragments, with overridden integrator parameters.
pub(super) fn renderer_with(overrides: &Overrides, parts: &[&str]) -> Renderer {
    Renderer::new(&parsed(parts), overrides).expect("the scene is valid")
}

/// A scene for queries only: it gets a default camera and is never rendered.
pub(super) fn scene(parts: &str) -> Scene {
    let sensor = r#"<sensor type="perspective"/>"#;
    Scene::build(&parsed(&[sensor, parts])).expect("the scene is valid")
}

/// A scene and an integrator, evaluated along single rays. Each ray has a camera of one pixel.
pub(super) struct Setup {
    integrator: String,
    scene: String,
}

impl Setup {
    pub(super) fn new(integrator: &str, scene: &str) -> Self {
        Self { integrator: integrator.to_owned(), scene: scene.to_owned() }
    }

    /// Visits each of a replicate's estimates of the radiance along the ray from `origin` towards `direction`.
    fn samples(&self, (origin, direction): (DVec3, DVec3), replicate: Replicate, mut visit: impl FnMut(Rgb)) {
        let direction = direction.normalize();
        let position = origin - PixelCentres::NEAR * direction;
        let sensor = PixelCentres { position, target: position + direction, fov: 1.0, columns: 1, rows: 1 };
        let renderer = renderer(&self.integrator, &sensor.xml(), &self.scene);
        let mut rendering = renderer.begin(replicate);
        let mut values = vec![0.0; rendering.film().stride()];
        for i in 0..replicate.samples {
            visit(rendering.sample((0, 0), i, &mut values, &mut splats::Path::default()));
        }
    }

    /// One estimate of the radiance along the ray from `origin` towards `direction`.
    pub(super) fn once(&self, origin: DVec3, direction: DVec3, seed: u64) -> Rgb {
        let mut found = Rgb::ZERO;
        self.samples((origin, direction), Replicate { seed, number: 0, samples: 1 }, |radiance| found = radiance);
        found
    }

    /// The moments, by channel, of many estimates of the radiance along a ray.
    pub(super) fn many(&self, origin: DVec3, direction: DVec3, samples: u32, seed: u64) -> [Moments; 3] {
        let mut moments = [Moments::default(); 3];
        self.samples((origin, direction), Replicate { seed, number: 0, samples }, |radiance| {
            moments.iter_mut().zip(radiance.to_array()).for_each(|(moments, x)| moments.push(x));
        });
        moments
    }

    /// Tests the mean radiance of each channel against its expectation.
    pub(super) fn test(
        &self,
        subject: &str,
        (origin, direction): (DVec3, DVec3),
        samples: u32,
        expected: Rgb,
    ) -> Vec<Finding> {
        let found = self.many(origin, direction, samples, 31);
        (0..3).map(|i| Finding::mean(format!("{subject}, {}", CHANNELS[i]), &found[i], expected[i])).collect()
    }

    /// Compares the radiance of each channel with its expectation to a relative 1e-9, for estimators without variance.
    pub(super) fn compare(&self, subject: &str, (origin, direction): (DVec3, DVec3), expected: Rgb) -> Vec<Finding> {
        let found = self.once(origin, direction, 30);
        let bound = |i: usize| 1e-9 * expected[i];
        (0..3).map(|i| Finding::value(format!("{subject}, {}", CHANNELS[i]), found[i], expected[i], bound(i))).collect()
    }
}

pub(super) const CHANNELS: [&str; 3] = ["red", "green", "blue"];

pub(super) fn path(max_depth: i32, rr_depth: u32) -> String {
    format!(
        r#"<integrator type="path"><integer name="max_depth" value="{max_depth}"/>
           <integer name="rr_depth" value="{rr_depth}"/></integrator>"#
    )
}

pub(super) fn direct(emitter_samples: u32, bsdf_samples: u32) -> String {
    format!(
        r#"<integrator type="direct"><integer name="emitter_samples" value="{emitter_samples}"/>
           <integer name="bsdf_samples" value="{bsdf_samples}"/></integrator>"#
    )
}

pub(super) fn diffuse(albedo: Rgb) -> String {
    format!(r#"<bsdf type="diffuse"><rgb name="reflectance" value="{}"/></bsdf>"#, triple(albedo))
}

pub(super) fn area(radiance: Rgb) -> String {
    format!(r#"<emitter type="area"><rgb name="radiance" value="{}"/></emitter>"#, triple(radiance))
}

pub(super) fn triple(v: DVec3) -> String {
    format!("{}, {}, {}", v.x, v.y, v.z)
}

/// A diffuse square of edge 200 in the plane `z = 0`, large enough to act as infinite.
pub(super) fn ground(albedo: Rgb) -> String {
    let scale = r#"<transform name="to_world"><scale value="100"/></transform>"#;
    format!(r#"<shape type="rectangle">{scale}{}</shape>"#, diffuse(albedo))
}

/// A diffuse disk of radius 0.001 at `p` with the normal `n`.
pub(super) fn small_disk(p: DVec3, n: DVec3, albedo: Rgb) -> String {
    let (target, up) = (triple(p + n), triple(n.any_orthonormal_vector()));
    format!(
        r#"<shape type="disk"><transform name="to_world"><scale value="0.001"/>
           <lookat origin="{}" target="{target}" up="{up}"/></transform>{}</shape>"#,
        triple(p),
        diffuse(albedo)
    )
}

/// An oblique ray to the point `p` from the side of the normal `n`.
pub(super) fn towards(p: DVec3, n: DVec3) -> (DVec3, DVec3) {
    let origin = p + 0.1 * n + 0.04 * n.any_orthonormal_vector();
    (origin, p - origin)
}

pub(super) const ALBEDO: Rgb = Rgb::new(0.8, 0.5, 0.2);
pub(super) const RADIANCE: Rgb = Rgb::new(0.7, 2.0, 5.0);

pub(super) fn environment(radiance: Rgb) -> String {
    format!(r#"<emitter type="constant"><rgb name="radiance" value="{}"/></emitter>"#, triple(radiance))
}

/// A closed room of the given shape, whose walls emit and reflect diffusely.
pub(super) fn room(shape: &str, emission: Rgb, albedo: Rgb) -> String {
    let flip = r#"<boolean name="flip_normals" value="true"/>"#;
    format!(
        r#"<shape type="{shape}"><transform name="to_world"><scale value="1.7"/></transform>{flip}{}{}</shape>"#,
        diffuse(albedo),
        area(emission)
    )
}

/// The origin and direction of a ray that starts inside a room.
pub(super) const RAY_INSIDE: (DVec3, DVec3) = (DVec3::new(0.3, -0.5, 0.2), DVec3::new(0.5, 0.3, -0.8));

pub(super) const GLASS: &str =
    r#"<bsdf type="dielectric"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf>"#;
