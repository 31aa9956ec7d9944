//! Scenes of the laws, from their parts.
//!
//! No scene has a radius, an albedo or an angle that hides a factor: no unit distances, no equal channels, no light
//! that stands straight above.

use std::path::Path;

use glam::DVec3;

use crate::{
    integrator::{EyeRay, Integrator, IntegratorModel as _, Overrides},
    law::Finding,
    math::{Ray, Rgb, rng::Stream},
    sampler::PathSampler,
    scene::Scene,
    scene_file::xml,
    stats::Moments,
};

/// A scene with an integrator.
pub(super) struct Setup {
    pub(super) scene: Scene,
    pub(super) integrator: Integrator,
}

impl Setup {
    pub(super) fn new(integrator: &str, scene: &str) -> Self {
        Self::with_film(integrator, "", scene)
    }

    /// With a row of so many pixels, each with what an integrator remembers of it.
    pub(super) fn of_pixels(integrator: &str, pixels: u32, scene: &str) -> Self {
        let size = format!(r#"<integer name="width" value="{pixels}"/><integer name="height" value="1"/>"#);
        Self::with_film(integrator, &size, scene)
    }

    pub(super) fn with_film(integrator: &str, film: &str, scene: &str) -> Self {
        let sensor = format!(r#"<sensor type="perspective"><film type="hdrfilm">{film}</film></sensor>"#);
        let text = format!(r#"<scene version="3.0.0">{integrator}{sensor}{scene}</scene>"#);
        let document = xml::parse(&text, "law", Path::new(""), &[]).expect("the scene is valid XML");
        let scene = Scene::build(&document).expect("the scene is valid");
        Self {
            scene,
            integrator: Integrator::of_scene(&document, &Overrides::default()).expect("the integrator is valid"),
        }
    }

    /// One estimate of the radiance that comes from a point against a direction.
    pub(super) fn once(&self, origin: DVec3, direction: DVec3, address: &[u64]) -> Rgb {
        let mut sampler = PathSampler::Independent(Stream::at(address));
        let eye = EyeRay::alone(Ray::new(origin, direction.normalize()));
        self.integrator.radiance(&self.scene, &eye, &mut sampler, &mut [])
    }

    /// Many of them, by channel.
    pub(super) fn many(&self, origin: DVec3, direction: DVec3, samples: u32, seed: u64) -> [Moments; 3] {
        let mut moments = [Moments::default(); 3];
        for i in 0..samples {
            let radiance = self.once(origin, direction, &[seed, u64::from(i)]);
            moments.iter_mut().zip(radiance.to_array()).for_each(|(moments, x)| moments.push(x));
        }
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
        let found = self.once(origin, direction, &[30]);
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
