//! What is absorbed on the way from one surface to the next.

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

    /// The share of light that is left along a ray from its origin to what it meets, or to its own end. `from` is the
    /// vertex that it leaves, if it leaves one. Without an end, nothing is left where the medium absorbs.
    #[must_use]
    pub fn transmittance(&self, from: Option<&SurfaceInteraction>, ray: &Ray, to: Option<&SurfaceInteraction>) -> Rgb {
        let distance = to.map_or(ray.t_max, |to| to.t) * ray.direction.length();
        attenuation(self.absorption(from, ray.direction, to), distance)
    }

    /// The same from a vertex on the ray.
    pub(super) fn transmittance_beyond(
        &self,
        from: &SurfaceInteraction,
        ray: &Ray,
        to: Option<&SurfaceInteraction>,
    ) -> Rgb {
        let distance = (to.map_or(ray.t_max, |to| to.t) - from.t) * ray.direction.length();
        attenuation(self.absorption(Some(from), ray.direction, to), distance)
    }

    /// The absorption coefficient between neighbouring vertices: of the medium inside the interface where the way
    /// starts, or else of the one where it ends.
    fn absorption(&self, from: Option<&SurfaceInteraction>, direction: DVec3, to: Option<&SurfaceInteraction>) -> Rgb {
        let starts = from.filter(|from| direction.dot(from.surface.n) < 0.0);
        let ends = to.filter(|to| direction.dot(to.surface.n) > 0.0);
        let mut interfaces = [starts, ends].into_iter().flatten().map(|si| self.bsdf(si));
        interfaces.find(|bsdf| bsdf.is_interface()).map_or(Rgb::ZERO, |bsdf| bsdf.absorption())
    }
}

/// What a way through a medium leaves, after Beer and Lambert.
fn attenuation(absorption: Rgb, distance: f64) -> Rgb {
    // A channel that is not absorbed stays whole at any distance.
    absorption.map(|sigma| if sigma > 0.0 { (-sigma * distance).exp() } else { 1.0 })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use proptest::prelude::*;

    use super::*;
    use crate::scene_file::xml;

    /// A ball of radius 2 that absorbs, with a hollow of radius 1, and a grey ball beside it.
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

    /// How much of a line lies within the ball of a radius around the origin.
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
    fn a_way_without_end_leaves_nothing_but_what_is_not_absorbed() {
        let scene = scene(HOLLOW);
        let ray = Ray::new(DVec3::new(0.0, 0.0, -7.0), DVec3::Z);
        let si = scene.intersect(&ray).expect("the ray meets the ball");
        let inwards = Ray::leaving(si.surface.p, DVec3::Z);
        assert_eq!(scene.transmittance(Some(&si), &inwards, None), Rgb::new(0.0, 1.0, 0.0));
        let outwards = Ray::leaving(si.surface.p, -DVec3::Z);
        assert_eq!(scene.transmittance(Some(&si), &outwards, None), Rgb::ONE);
        assert_eq!(scene.transmittance(None, &ray, None), Rgb::ONE);
    }

    proptest! {
        /// All the way along a line, in either sense, whatever the length of the direction.
        #[test]
        fn a_line_is_absorbed_where_it_lies_in_the_medium(
            (x, y) in (-2.2..2.2, -2.2..2.2), slope in -0.1..0.1, length in 0.2..5.0, is_forth: bool,
        ) {
            let scene = scene(HOLLOW);
            let sign = if is_forth { 1.0 } else { -1.0 };
            let mut ray = Ray::new(DVec3::new(x, y, -7.0 * sign), length * DVec3::new(slope, 0.0, sign));
            let distance = chord(&ray, 2.0) - chord(&ray, 1.0);
            let (mut found, mut from) = (Rgb::ONE, None);
            loop {
                let to = scene.intersect(&ray);
                found *= scene.transmittance(from.as_ref(), &ray, to.as_ref());
                let Some(si) = to else { break };
                ray = Ray::leaving(si.surface.p, ray.direction);
                from = Some(si);
            }
            let expected = Rgb::new((-0.3 * distance).exp(), 1.0, (-1.1 * distance).exp());
            prop_assert!((found - expected).abs().max_element() < 1e-9, "{found} is not {expected}");
        }
    }
}
