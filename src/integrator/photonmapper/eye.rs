use super::{
    maps::Maps,
    settings::{Direct, Settings},
};
use crate::{
    bsdf::{Model as _, Sample},
    integrator::{eye_walk::EyeWalk, photons::Parts},
    math::{Ray, Rgb},
    photon::{Lookup, Map, Photon, Site},
    sampler::{Numbers as _, PathNumbers},
    scene::Scene,
    transport::{FromEye, Junction, PathClass},
};

/// The second pass.
pub(super) struct Eye<'s> {
    pub(super) scene: &'s Scene,
    pub(super) settings: &'s Settings,
    pub(super) maps: &'s Maps,
}

impl Eye<'_> {
    /// Follows a camera's ray and adds what it shows; returns what the global map shows of the first surface.
    pub(super) fn look(&self, ray: &Ray, numbers: &mut PathNumbers, parts: &mut Parts) -> Rgb {
        let (scene, depths) = (self.scene, self.settings.depths);
        let mut raw = Rgb::ZERO;
        if depths.max == 0 {
            return raw;
        }
        let mut walk = EyeWalk::along(scene, depths, ray, self.settings.hide_emitters);
        for depth in 1.. {
            // Lights are seen from the camera, and in mirrors and glass.
            let is_hidden = depth == 1 && self.settings.hide_emitters;
            let seen = if is_hidden { Rgb::ZERO } else { walk.shining() };
            let Some(vertex) = walk.met else {
                parts.add(walk.state.at_light(), walk.throughput * seen);
                break;
            };
            parts.add(walk.state.at_light(), walk.throughput * (seen + scene.glow(&vertex)));
            if depth >= depths.max {
                break;
            }
            let junction = Junction::new(scene, vertex);
            if depth == 1 && self.settings.shows_raw {
                raw = walk.throughput * self.estimate(&self.maps.global, &self.maps.global_lookup, &junction, |_| true);
            }
            let mut found = Parts::default();
            let further = self.part(&junction, depth, numbers, &mut found);
            for class in PathClass::ALL {
                let shown = if walk.state == FromEye::START { class } else { PathClass::Specular };
                parts.add(shown, walk.throughput * found.0[class as usize]);
            }

            // Go on through mirrors and glass.
            let Some(sample) = further else { break };
            if !walk.advance(&vertex, &sample, depth, numbers) {
                break;
            }
        }
        raw
    }

    /// Adds the parts of the light that a vertex shows apart from single directions, and returns one of those to go on in.
    fn part(
        &self,
        junction: &Junction<'_>,
        depth: u32,
        numbers: &mut PathNumbers,
        found: &mut Parts,
    ) -> Option<Sample> {
        if !junction.bsdf.is_smooth() {
            return junction.bsdf.sample(&junction.query, numbers.next_1d(), numbers.next_2d());
        }
        let (maps, settings) = (self.maps, self.settings);
        let left = settings.depths.max.saturating_sub(depth);
        let is_short = |photon: &Photon| photon.depth() <= left;
        found.add(PathClass::Caustic, self.estimate(&maps.caustic, &maps.caustic_lookup, junction, is_short));
        let from_global =
            |class| self.estimate(&maps.global, &maps.global_lookup, junction, |p| is_short(p) && p.class() == class);
        if settings.direct == Direct::Map {
            found.add(PathClass::Direct, from_global(PathClass::Direct));
        }
        if settings.gather.is_none() {
            found.add(PathClass::Indirect, from_global(PathClass::Indirect));
        }
        self.gather(junction, depth, numbers, found)
    }

    /// The radiance that the photons of a map around a vertex send back along the path, of those that are accepted.
    pub(super) fn estimate(
        &self,
        map: &Map,
        lookup: &Lookup,
        junction: &Junction<'_>,
        accepts: impl Fn(&Photon) -> bool,
    ) -> Rgb {
        if map.is_empty() || !junction.bsdf.is_smooth() {
            return Rgb::ZERO;
        }
        let site = Site::new(self.scene, &junction.vertex);
        let shading = &junction.vertex.surface.shading;
        let mut radiance = Rgb::ZERO;
        map.gather(&site, lookup, |photon, density| {
            if !accepts(photon) {
                return;
            }
            let direction = photon.direction();
            let scattered = junction.bsdf.eval_cos(&junction.query, shading.to_local(direction));
            // Photons are counted per area: the true surface's cosine is in their density already.
            let cos = direction.dot(site.n);
            if cos > 0.0 {
                radiance += scattered * photon.power() * (density / cos);
            }
        });
        radiance
    }
}
