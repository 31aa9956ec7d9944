//! Scenes of the laws, from their parts.
//!
//! No scene has a radius, an albedo or an angle that hides a factor: no unit distances, no equal channels, no light
//! that stands straight above.

use std::path::Path;

use glam::DVec3;

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

/// A camera whose samples all lie in the centres of their pixels, but for a millionth of a millionth of a pixel.
pub(super) struct PixelCentres {
    /// Where rays start, at a distance of [`PixelCentres::NEAR`] or more.
    pub(super) eye: DVec3,
    pub(super) target: DVec3,
    /// Degrees across the width.
    pub(super) fov: f64,
    pub(super) columns: u32,
    pub(super) rows: u32,
}

impl PixelCentres {
    /// How far before the eye rays start, along the axis of view.
    pub(super) const NEAR: f64 = 0.001;

    pub(super) fn xml(&self) -> String {
        let Self { eye, target, fov, columns, rows } = self;
        let is_steep = (*target - *eye).normalize().z.abs() > 0.99;
        let up = triple(if is_steep { DVec3::X } else { DVec3::Z });
        let (eye, target) = (triple(*eye), triple(*target));
        format!(
            r#"<sensor type="perspective"><float name="fov" value="{fov}"/><float name="near_clip" value="{}"/>
               <transform name="to_world"><lookat origin="{eye}" target="{target}" up="{up}"/></transform>
               <film type="hdrfilm"><integer name="width" value="{columns}"/><integer name="height" value="{rows}"/>
               <rfilter type="gaussian"><float name="stddev" value="1e-12"/></rfilter></film></sensor>"#,
            Self::NEAR
        )
    }
}

fn parsed(parts: &[&str]) -> Document {
    let text = format!(r#"<scene version="3.0.0">{}</scene>"#, parts.concat());
    xml::parse(&text, "law", Path::new(""), &[]).expect("the scene is valid XML")
}

/// A renderer of these parts.
pub(super) fn renderer(integrator: &str, sensor: &str, scene: &str) -> Renderer {
    renderer_with(&Overrides::default(), &[integrator, sensor, scene])
}

/// A renderer of these parts, with changes to its integrator.
pub(super) fn renderer_with(overrides: &Overrides, parts: &[&str]) -> Renderer {
    Renderer::new(&parsed(parts), overrides).expect("the scene is valid")
}

/// A scene that nobody renders.
pub(super) fn scene(parts: &str) -> Scene {
    let sensor = r#"<sensor type="perspective"/>"#;
    Scene::build(&parsed(&[sensor, parts])).expect("the scene is valid")
}

/// A scene with an integrator, seen along single rays, by a camera of one pixel for each.
pub(super) struct Setup {
    integrator: String,
    scene: String,
}

impl Setup {
    pub(super) fn new(integrator: &str, scene: &str) -> Self {
        Self { integrator: integrator.to_owned(), scene: scene.to_owned() }
    }

    /// The estimates of a replicate of the radiance that comes from a point against a direction.
    fn samples(&self, (origin, direction): (DVec3, DVec3), replicate: Replicate, mut visit: impl FnMut(Rgb)) {
        let direction = direction.normalize();
        let eye = origin - PixelCentres::NEAR * direction;
        let sensor = PixelCentres { eye, target: eye + direction, fov: 1.0, columns: 1, rows: 1 };
        let renderer = renderer(&self.integrator, &sensor.xml(), &self.scene);
        let mut rendering = renderer.begin(replicate);
        let mut values = vec![0.0; rendering.film().stride()];
        for i in 0..replicate.samples {
            visit(rendering.sample((0, 0), i, &mut values, &mut splats::Path::default()));
        }
    }

    /// One estimate of the radiance that comes from a point against a direction.
    pub(super) fn once(&self, origin: DVec3, direction: DVec3, seed: u64) -> Rgb {
        let mut found = Rgb::ZERO;
        self.samples((origin, direction), Replicate { seed, number: 0, samples: 1 }, |radiance| found = radiance);
        found
    }

    /// Many of them, by channel.
    pub(super) fn many(&self, origin: DVec3, direction: DVec3, samples: u32, seed: u64) -> [Moments; 3] {
        let mut moments = [Moments::default(); 3];
        self.samples((origin, direction), Replicate { seed, number: 0, samples }, |radiance| {
            moments.iter_mut().zip(radiance.to_array()).for_each(|(moments, x)| moments.push(x));
        });
        moments
    }

    /// Tests the radiance of each channel.
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

    /// Compares the radiance of each channel where it has no variance, relative to the expectation.
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

/// A plane `z = 0` that is large enough.
pub(super) fn ground(albedo: Rgb) -> String {
    let scale = r#"<transform name="to_world"><scale value="100"/></transform>"#;
    format!(r#"<shape type="rectangle">{scale}{}</shape>"#, diffuse(albedo))
}

/// A small disk with a normal.
pub(super) fn patch(p: DVec3, n: DVec3, albedo: Rgb) -> String {
    let (target, up) = (triple(p + n), triple(n.any_orthonormal_vector()));
    format!(
        r#"<shape type="disk"><transform name="to_world"><scale value="0.001"/>
           <lookat origin="{}" target="{target}" up="{up}"/></transform>{}</shape>"#,
        triple(p),
        diffuse(albedo)
    )
}

/// A ray to a point from its front, obliquely.
pub(super) fn towards(p: DVec3, n: DVec3) -> (DVec3, DVec3) {
    let origin = p + 0.1 * n + 0.04 * n.any_orthonormal_vector();
    (origin, p - origin)
}

pub(super) const ALBEDO: Rgb = Rgb::new(0.8, 0.5, 0.2);
pub(super) const RADIANCE: Rgb = Rgb::new(0.7, 2.0, 5.0);

pub(super) fn sky(radiance: Rgb) -> String {
    format!(r#"<emitter type="constant"><rgb name="radiance" value="{}"/></emitter>"#, triple(radiance))
}

/// A closed room of some shape whose walls shine and reflect.
pub(super) fn room(shape: &str, emission: Rgb, albedo: Rgb) -> String {
    let flip = r#"<boolean name="flip_normals" value="true"/>"#;
    format!(
        r#"<shape type="{shape}"><transform name="to_world"><scale value="1.7"/></transform>{flip}{}{}</shape>"#,
        diffuse(albedo),
        area(emission)
    )
}

/// A ray from inside a room.
pub(super) const WITHIN: (DVec3, DVec3) = (DVec3::new(0.3, -0.5, 0.2), DVec3::new(0.5, 0.3, -0.8));

pub(super) const GLASS: &str =
    r#"<bsdf type="dielectric"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf>"#;
