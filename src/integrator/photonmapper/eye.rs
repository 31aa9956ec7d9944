use glam::DVec3;

use super::{
    Parts,
    maps::Maps,
    settings::{Direct, Settings},
};
use crate::{
    bsdf::{Model as _, Sample},
    integrator::first_vertex,
    math::{Ray, Rgb},
    photon::{Lookup, Map, Photon, Site},
    sampler::{Numbers as _, PathNumbers},
    scene::{Scene, Vertex},
    transport::{FromEye, Junction, PathClass, survival},
};

/// The second pass.
pub(super) struct Eye<'s> {
    pub(super) scene: &'s Scene,
    pub(super) settings: &'s Settings,
    pub(super) maps: &'s Maps,
}

/// A path from the eye up to where it is.
pub(super) struct Walk {
    /// What it carries.
    pub(super) throughput: Rgb,
    /// The index of refraction where it is over that where it began.
    eta: f64,
    pub(super) state: FromEye,
    direction: DVec3,
    /// Where it is; None if it has left the scene.
    pub(super) met: Option<Vertex>,
}

/// Paths from the eye are rolled for from this segment on at the earliest: photons are many, and alike in power if they are
/// rolled for at once, but each path of these is seen.
const FIRST_ROULETTE: u32 = 5;

impl Walk {
    /// A path that has met nothing.
    pub(super) const START: Self =
        Self { throughput: Rgb::ONE, eta: 1.0, state: FromEye::START, direction: DVec3::ZERO, met: None };

    /// A path along a camera's ray.
    fn begin(scene: &Scene, ray: &Ray, met: Option<Vertex>) -> Self {
        let throughput = if scene.absorbs() { scene.transmittance(None, ray, met.as_ref()) } else { Rgb::ONE };
        Self { throughput, direction: ray.direction, met, ..Self::START }
    }
}

impl Eye<'_> {
    /// Follows a camera's ray and adds what it shows; returns what the global map shows of the first surface.
    pub(super) fn look(&self, ray: &Ray, numbers: &mut PathNumbers, parts: &mut Parts) -> Rgb {
        let (scene, depths) = (self.scene, self.settings.depths);
        let mut raw = Rgb::ZERO;
        if depths.max == 0 {
            return raw;
        }
        let mut walk = Walk::begin(scene, ray, first_vertex(scene, ray, self.settings.hide_emitters));
        for depth in 1.. {
            // Lights are seen from the camera, and in mirrors and glass.
            let is_hidden = depth == 1 && self.settings.hide_emitters;
            let seen = if is_hidden { Rgb::ZERO } else { self.shining(&walk) };
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
            if !self.advance(&mut walk, &vertex, &sample, depth, numbers) {
                break;
            }
        }
        raw
    }

    /// The radiance of the light that a walk has met, be it the sky.
    pub(super) fn shining(&self, walk: &Walk) -> Rgb {
        walk.met.map_or_else(|| self.scene.sky(walk.direction), |vertex| self.scene.emitted(&vertex))
    }

    /// Goes on from a vertex, if the walk survives: with what it carries there, less what the medium absorbs on the way.
    pub(super) fn advance(
        &self,
        walk: &mut Walk,
        from: &Vertex,
        sample: &Sample,
        depth: u32,
        numbers: &mut PathNumbers,
    ) -> bool {
        walk.throughput *= sample.weight;
        walk.eta *= sample.eta;
        if depth >= self.settings.depths.roulette.max(FIRST_ROULETTE) {
            let survival = survival(walk.throughput, walk.eta);
            if numbers.next_1d() >= survival {
                return false;
            }
            walk.throughput /= survival;
        }
        if walk.throughput == Rgb::ZERO {
            return false;
        }
        walk.state = walk.state.scattered(sample.lobe);
        walk.direction = from.surface.shading.to_world(sample.wo);
        let ray = Ray::leaving(from.surface.p, walk.direction);
        walk.met = self.scene.intersect(&ray);
        if self.scene.absorbs() {
            walk.throughput *= self.scene.transmittance(Some(from), &ray, walk.met.as_ref());
        }
        true
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
