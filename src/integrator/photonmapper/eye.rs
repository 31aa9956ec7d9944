use super::{
    maps::Maps,
    settings::{Direct, Settings},
};
use crate::{
    bsdf::{BsdfModel as _, Sample},
    integrator::{eye_walk::EyeWalk, photons::ClassRadiance},
    math::{Ray, Rgb},
    photon::{EstimateParameters, GatherPoint, Map, Photon},
    sampler::{PathSampler, SampleStream as _},
    scene::Scene,
    transport::{CameraPathClass, PathClass, ShadingPoint},
};

/// The second pass.
pub(super) struct Eye<'s> {
    pub(super) scene: &'s Scene,
    pub(super) settings: &'s Settings,
    pub(super) maps: &'s Maps,
}

impl Eye<'_> {
    /// Follows a camera's ray and adds what it shows; returns what the global map shows of the first surface.
    pub(super) fn look(&self, ray: &Ray, sampler: &mut PathSampler, parts: &mut ClassRadiance) -> Rgb {
        let (scene, limits) = (self.scene, self.settings.limits);
        let mut raw = Rgb::ZERO;
        if limits.max_depth == 0 {
            return raw;
        }
        let mut walk = EyeWalk::along(scene, limits, ray, self.settings.hide_emitters);
        for depth in 1.. {
            // Lights are seen from the camera, and in mirrors and glass.
            let is_hidden = depth == 1 && self.settings.hide_emitters;
            let seen = if is_hidden { Rgb::ZERO } else { walk.emitted() };
            let Some(si) = walk.met else {
                parts.add(walk.state.if_emitter(), walk.throughput * seen);
                break;
            };
            parts.add(walk.state.if_emitter(), walk.throughput * (seen + scene.self_emission(&si)));
            if depth >= limits.max_depth {
                break;
            }
            let shading_point = ShadingPoint::new(scene, si);
            if depth == 1 && self.settings.shows_raw {
                raw = walk.throughput
                    * self.estimate(&self.maps.global, &self.maps.global_lookup, &shading_point, |_| true);
            }
            let mut found = ClassRadiance::default();
            let further = self.part(&shading_point, depth, sampler, &mut found);
            for class in PathClass::ALL {
                let shown = if walk.state == CameraPathClass::START { class } else { PathClass::Specular };
                parts.add(shown, walk.throughput * found.0[class as usize]);
            }

            // Go on through mirrors and glass.
            let Some(sample) = further else { break };
            if !walk.advance(&si, &sample, depth, sampler) {
                break;
            }
        }
        raw
    }

    /// Adds the parts of the light that a vertex shows apart from single directions, and returns one of those to go on in.
    fn part(
        &self,
        shading_point: &ShadingPoint<'_>,
        depth: u32,
        sampler: &mut PathSampler,
        found: &mut ClassRadiance,
    ) -> Option<Sample> {
        if !shading_point.bsdf.is_smooth() {
            return shading_point.bsdf.sample(&shading_point.query, sampler.next_1d(), sampler.next_2d());
        }
        let (maps, settings) = (self.maps, self.settings);
        let left = settings.limits.max_depth.saturating_sub(depth);
        let is_short = |photon: &Photon| photon.depth() <= left;
        found.add(PathClass::Caustic, self.estimate(&maps.caustic, &maps.caustic_lookup, shading_point, is_short));
        let from_global = |class| {
            self.estimate(&maps.global, &maps.global_lookup, shading_point, |p| is_short(p) && p.class() == class)
        };
        if settings.direct == Direct::Map {
            found.add(PathClass::Direct, from_global(PathClass::Direct));
        }
        if settings.gather.is_none() {
            found.add(PathClass::Indirect, from_global(PathClass::Indirect));
        }
        self.gather(shading_point, depth, sampler, found)
    }

    /// The radiance that the photons of a map around a vertex send back along the path, of those that are accepted.
    pub(super) fn estimate(
        &self,
        map: &Map,
        lookup: &EstimateParameters,
        shading_point: &ShadingPoint<'_>,
        accepts: impl Fn(&Photon) -> bool,
    ) -> Rgb {
        if map.is_empty() || !shading_point.bsdf.is_smooth() {
            return Rgb::ZERO;
        }
        let point = GatherPoint::new(self.scene, &shading_point.si);
        let shading = &shading_point.si.surface.shading;
        let mut radiance = Rgb::ZERO;
        map.gather(&point, lookup, |photon, pdf| {
            if !accepts(photon) {
                return;
            }
            let direction = photon.direction();
            let scattered = shading_point.bsdf.eval_cos(&shading_point.query, shading.to_local(direction));
            // Photons are counted per area: the true surface's cosine is in their density already.
            let cos = direction.dot(point.n);
            if cos > 0.0 {
                radiance += scattered * photon.power() * (pdf / cos);
            }
        });
        radiance
    }
}
