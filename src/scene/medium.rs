//! Absorption along a ray between two surfaces.

use glam::DVec3;

use super::{Scene, SurfaceInteraction};
use crate::{
    bsdf::BsdfModel as _,
    math::{Ray, Rgb},
};

impl Scene {
    /// Whether any medium absorbs light.
    #[inline]
    #[must_use]
    pub fn absorbs(&self) -> bool {
        self.absorbs
    }

    /// The transmittance along a ray from its origin to the interaction `to`, or to the end of the ray. `from` is the
    /// interaction at which the ray starts, if it starts on a surface. An infinite ray in an absorbing medium has a
    /// transmittance of 0.
    #[must_use]
    pub fn transmittance(&self, from: Option<&SurfaceInteraction>, ray: &Ray, to: Option<&SurfaceInteraction>) -> Rgb {
        let distance = to.map_or(ray.t_max, |to| to.t) * ray.direction.length();
        attenuation(self.absorption(from, ray.direction, to), distance)
    }

    /// The transmittance along a ray from an interaction on it to `to`, or to the end of the ray.
    pub(super) fn transmittance_beyond(
        &self,
        from: &SurfaceInteraction,
        ray: &Ray,
        to: Option<&SurfaceInteraction>,
    ) -> Rgb {
        let distance = (to.map_or(ray.t_max, |to| to.t) - from.t) * ray.direction.length();
        attenuation(self.absorption(Some(from), ray.direction, to), distance)
    }

    /// The absorption coefficient between consecutive interactions: of the medium inside the interface at the
    /// start, or else inside the interface at the end.
    fn absorption(&self, from: Option<&SurfaceInteraction>, direction: DVec3, to: Option<&SurfaceInteraction>) -> Rgb {
        let starts = from.filter(|from| direction.dot(from.surface.n) < 0.0);
        let ends = to.filter(|to| direction.dot(to.surface.n) > 0.0);
        let mut interfaces = [starts, ends].into_iter().flatten().map(|si| self.bsdf(si));
        interfaces.find(|bsdf| bsdf.is_interface()).map_or(Rgb::ZERO, |bsdf| bsdf.absorption())
    }
}

/// The transmittance of a distance in a medium, by the Beer-Lambert law.
fn attenuation(absorption: Rgb, distance: f64) -> Rgb {
    // A channel without absorption has transmittance 1 even at infinite distance.
    absorption.map(|sigma| if sigma > 0.0 { (-sigma * distance).exp() } else { 1.0 })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use proptest::prelude::*;

    use super::*;
    use crate::scene_file::xml;

    /// An absorbing sphere of radius 2 with a hollow of radius 1, and a grey sphere beside it.
    const HOLLOW: &str = r#"<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm"/></sensor>
        <bsdf type="dielectric" id="glass"><float name="int_ior" value="1.3"/><float name="ext_ior" value="1"/>
            <rgb name="absorption" value="0.3, 0, 1.1"/></bsdf>
        <shape type="sphere"><float name="radius" value="2"/><ref id="glass"/></shape>
        <shape type="sphere"><boolean name="flip_normals" value="true"/><ref id="glass"/></shape>
        <shape type="sphere"><point name="center" x="0" y="0" z="5"/></shape></scene>"#;

    fn scene(text: &str) -> Scene {
        let document = xml::parse(text, "test", Path::new(""), &[]).expect("the scene is valid XML");
        Scene::build(&document).expect("the scene is valid")
    }

    /// The length of a line within the sphere of a radius around the origin.
    fn chord(ray: &Ray, radius: f64) -> f64 {
        let d = ray.direction.normalize();
        let square = radius * radius - (ray.origin - ray.origin.dot(d) * d).length_squared();
        2.0 * square.max(0.0).sqrt()
    }

    #[test]
    fn only_scenes_with_an_absorbing_medium_absorb() {
        assert!(scene(HOLLOW).absorbs());
        assert!(!scene(&HOLLOW.replace("0.3, 0, 1.1", "0, 0, 0")).absorbs());
    }

    #[test]
    fn an_infinite_ray_in_a_medium_keeps_only_channels_without_absorption() {
        let scene = scene(HOLLOW);
        let ray = Ray::new(DVec3::new(0.0, 0.0, -7.0), DVec3::Z);
        let si = scene.intersect(&ray).expect("the ray hits the sphere");
        let inwards = Ray::leaving(si.surface.p, DVec3::Z);
        assert_eq!(scene.transmittance(Some(&si), &inwards, None), Rgb::new(0.0, 1.0, 0.0));
        let outwards = Ray::leaving(si.surface.p, -DVec3::Z);
        assert_eq!(scene.transmittance(Some(&si), &outwards, None), Rgb::ONE);
        assert_eq!(scene.transmittance(None, &ray, None), Rgb::ONE);
    }

    proptest! {
        /// Checks the whole line, in both directions, with ray directions of any length.
        #[test]
        fn a_line_is_attenuated_where_it_lies_in_the_medium(
            (x, y) in (-2.2..2.2, -2.2..2.2), slope in -0.1..0.1, length in 0.2..5.0, is_forward: bool,
        ) {
            let scene = scene(HOLLOW);
            let sign = if is_forward { 1.0 } else { -1.0 };
            let mut ray = Ray::new(DVec3::new(x, y, -7.0 * sign), length * DVec3::new(slope, 0.0, sign));
            let distance = chord(&ray, 2.0) - chord(&ray, 1.0);
            let (mut transmittance, mut from) = (Rgb::ONE, None);
            loop {
                let to = scene.intersect(&ray);
                transmittance *= scene.transmittance(from.as_ref(), &ray, to.as_ref());
                let Some(si) = to else { break };
                ray = Ray::leaving(si.surface.p, ray.direction);
                from = Some(si);
            }
            let expected = Rgb::new((-0.3 * distance).exp(), 1.0, (-1.1 * distance).exp());
            prop_assert!((transmittance - expected).abs().max_element() < 1e-9, "{transmittance} is not {expected}");
        }
    }
}
