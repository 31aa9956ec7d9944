use glam::DVec3;

use super::{eye::Eye, guide::Guide, settings::Direct};
use crate::{
    bsdf::{Lobe, Model as _, Sample},
    integrator::{eye_walk::EyeWalk, photons::Parts},
    math::{PerSolidAngle, Ray, Rgb},
    photon::{Shade, Site},
    sampler::{Numbers as _, PathNumbers},
    transport::{Junction, PathClass, power_heuristic},
};

/// A direction to gather from.
struct Draw {
    sample: Sample,
    /// What the density of the direction is, whichever way it was drawn.
    density: PerSolidAngle,
}

impl Eye<'_> {
    /// Connects with a light, and sends out rays for the direct light that connections are bad at, and for indirect light.
    pub(super) fn gather(
        &self,
        junction: &Junction<'_>,
        depth: u32,
        numbers: &mut PathNumbers,
        found: &mut Parts,
    ) -> Option<Sample> {
        let settings = self.settings;
        // Without gathering, rays are only there to meet lights.
        let meets_lights =
            settings.direct != Direct::Map && (settings.gather.is_some() || settings.direct == Direct::Traced);
        let rays = settings.gather.unwrap_or(u32::from(meets_lights));
        let guide = self.guide(junction);
        if settings.direct != Direct::Map {
            let shares = [1.0, if meets_lights { f64::from(rays) } else { 0.0 }];
            found.add(PathClass::Direct, self.connect(junction, guide.as_ref(), shares, numbers));
        }
        let mut further = None;
        for number in 0..rays.max(u32::from(junction.bsdf.has_delta())) {
            let Some(Draw { sample, density }) = draw(junction, guide.as_ref(), numbers) else { continue };
            if sample.lobe != Lobe::Smooth {
                if number == 0 {
                    further = Some(sample);
                }
                continue;
            }
            if rays == 0 {
                continue;
            }
            let mut of_ray = Parts::default();
            let weight =
                |by_light: PerSolidAngle| power_heuristic(PerSolidAngle(f64::from(rays) * density.0), by_light);
            self.follow(junction, &sample, depth + 1, meets_lights.then_some(&weight), numbers, &mut of_ray);
            found.add_all(&of_ray, 1.0 / f64::from(rays));
        }
        further
    }

    fn guide(&self, junction: &Junction<'_>) -> Option<Guide> {
        if !self.settings.is_guided || self.settings.gather.is_none() || junction.bsdf.has_delta() {
            return None;
        }
        let site = Site::new(self.scene, &junction.vertex);
        Guide::new(&self.maps.global, &self.maps.global_lookup, &site, junction)
    }

    /// Next event estimation, as one of two strategies with so many samples.
    fn connect(
        &self,
        junction: &Junction<'_>,
        guide: Option<&Guide>,
        shares: [f64; 2],
        numbers: &mut PathNumbers,
    ) -> Rgb {
        let Some(mut connection) = junction.propose(self.scene, numbers) else { return Rgb::ZERO };
        let shadow_ray = &connection.incident.shadow_ray;
        if !self.is_seen(junction, connection.light, shadow_ray) {
            return Rgb::ZERO;
        }
        if self.scene.absorbs() {
            connection.scattered *= self.scene.transmittance(Some(&junction.vertex), shadow_ray, None);
        }
        let Some(density) = connection.incident.density else { return connection.scattered };
        let other = PerSolidAngle(shares[1] * density_of(junction, guide, connection.wo).0);
        connection.scattered * (power_heuristic(PerSolidAngle(shares[0] * density.0), other) / density.0)
    }

    /// Whether nothing stands between a vertex and a light, by the word of shadow photons where they are of one mind.
    fn is_seen(&self, junction: &Junction<'_>, light: usize, shadow_ray: &Ray) -> bool {
        let Some(shadow) = &self.maps.shadow else { return !self.scene.occluded(shadow_ray) };
        let shade = shadow.shade(&Site::new(self.scene, &junction.vertex), light);
        self.maps.shadow_rays.count(shade != Shade::Unknown);
        match shade {
            Shade::Lit => true,
            Shade::Dark => false,
            Shade::Unknown => !self.scene.occluded(shadow_ray),
        }
    }

    /// Follows a ray of gathering. `weight` tells the weight of lights that it meets; without, they are found otherwise.
    fn follow(
        &self,
        junction: &Junction<'_>,
        sample: &Sample,
        depth: u32,
        weight: Option<&dyn Fn(PerSolidAngle) -> f64>,
        numbers: &mut PathNumbers,
        found: &mut Parts,
    ) {
        let scene = self.scene;
        let mut walk = EyeWalk::new(scene, self.settings.depths);
        if !walk.advance(&junction.vertex, sample, 0, numbers) {
            return;
        }
        if let Some(weight) = weight {
            let weight = weight(scene.light_density(junction.p(), walk.met.as_ref()));
            found.add(PathClass::Direct, weight * walk.throughput * walk.shining());
        }
        for depth in depth.. {
            let Some(vertex) = walk.met else { return };
            found.add(walk.state.at_light(), walk.throughput * scene.glow(&vertex));
            if self.settings.gather.is_none() || depth >= self.settings.depths.max {
                return;
            }
            let next = Junction::new(scene, vertex);
            if next.bsdf.is_smooth() {
                let left = self.settings.depths.max.saturating_sub(depth);
                let light =
                    self.estimate(&self.maps.global, &self.maps.global_lookup, &next, |photon| photon.depth() <= left);
                found.add(PathClass::Indirect, walk.throughput * light);
            }
            if !next.bsdf.has_delta() {
                return;
            }
            let drawn = next.bsdf.sample(&next.query, numbers.next_1d(), numbers.next_2d());
            let Some(sample) = drawn.filter(|sample| sample.lobe != Lobe::Smooth) else { return };
            if !walk.advance(&vertex, &sample, depth, numbers) {
                return;
            }
        }
    }
}

/// Draws a direction from the BSDF or, every other time, from the guide.
fn draw(junction: &Junction<'_>, guide: Option<&Guide>, numbers: &mut PathNumbers) -> Option<Draw> {
    let (u1, u2) = (numbers.next_1d(), numbers.next_2d());
    let Some(guide) = guide else {
        let sample = junction.bsdf.sample(&junction.query, u1, u2)?;
        return Some(Draw { sample, density: sample.density });
    };
    let wo = if u1 < 0.5 { guide.sample(u2) } else { junction.bsdf.sample(&junction.query, 2.0 * u1 - 1.0, u2)?.wo };
    let density = density_of(junction, Some(guide), wo);
    let scattered = junction.bsdf.eval_cos(&junction.query, wo);
    if scattered == Rgb::ZERO || density.0 == 0.0 {
        return None;
    }
    let sample = Sample { wo, weight: scattered / density.0, density, lobe: Lobe::Smooth, eta: 1.0 };
    Some(Draw { sample, density })
}

/// The density with which [`draw`] draws a direction, without single ones.
fn density_of(junction: &Junction<'_>, guide: Option<&Guide>, wo: DVec3) -> PerSolidAngle {
    let by_bsdf = junction.bsdf.density(&junction.query, wo);
    // Balance heuristic for one sample, Veach 1997, eq. (9.15).
    guide.map_or(by_bsdf, |guide| PerSolidAngle(0.5 * (by_bsdf.0 + guide.density(wo).0)))
}
