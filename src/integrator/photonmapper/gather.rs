use glam::DVec3;

use super::{eye::Eye, histogram::DirectionHistogram, settings::Direct};
use crate::{
    bsdf::{BsdfModel as _, Lobe, Sample},
    integrator::{eye_walk::EyeWalk, photons::ClassRadiance},
    math::{PerSolidAngle, Ray, Rgb},
    photon::{GatherPoint, Visibility},
    sampler::{PathSampler, SampleStream as _},
    transport::{PathClass, ShadingPoint, power_heuristic},
};

/// A direction to gather from.
struct Draw {
    sample: Sample,
    /// What the density of the direction is, whichever way it was drawn.
    pdf: PerSolidAngle,
}

impl Eye<'_> {
    /// Connects with a light, and sends out rays for the direct light that connections are bad at, and for indirect light.
    pub(super) fn gather(
        &self,
        shading_point: &ShadingPoint<'_>,
        depth: u32,
        sampler: &mut PathSampler,
        found: &mut ClassRadiance,
    ) -> Option<Sample> {
        let settings = self.settings;
        // Without gathering, rays are only there to meet lights.
        let meets_lights =
            settings.direct != Direct::Map && (settings.gather.is_some() || settings.direct == Direct::Traced);
        let rays = settings.gather.unwrap_or(u32::from(meets_lights));
        let histogram = self.histogram(shading_point);
        if settings.direct != Direct::Map {
            let sample_counts = [1.0, if meets_lights { f64::from(rays) } else { 0.0 }];
            found.add(PathClass::Direct, self.connect(shading_point, histogram.as_ref(), sample_counts, sampler));
        }
        let mut further = None;
        for number in 0..rays.max(u32::from(shading_point.bsdf.has_delta())) {
            let Some(Draw { sample, pdf }) = draw(shading_point, histogram.as_ref(), sampler) else { continue };
            if sample.lobe != Lobe::Smooth {
                if number == 0 {
                    further = Some(sample);
                }
                continue;
            }
            if rays == 0 {
                continue;
            }
            let mut of_ray = ClassRadiance::default();
            let weight = |by_light: PerSolidAngle| power_heuristic(PerSolidAngle(f64::from(rays) * pdf.0), by_light);
            self.follow(shading_point, &sample, depth + 1, meets_lights.then_some(&weight), sampler, &mut of_ray);
            found.add_all(&of_ray, 1.0 / f64::from(rays));
        }
        further
    }

    fn histogram(&self, shading_point: &ShadingPoint<'_>) -> Option<DirectionHistogram> {
        if !self.settings.is_guided || self.settings.gather.is_none() || shading_point.bsdf.has_delta() {
            return None;
        }
        let point = GatherPoint::new(self.scene, &shading_point.si);
        DirectionHistogram::new(&self.maps.global, &self.maps.global_lookup, &point, shading_point)
    }

    /// Next event estimation, as one of two strategies with so many samples.
    fn connect(
        &self,
        shading_point: &ShadingPoint<'_>,
        histogram: Option<&DirectionHistogram>,
        sample_counts: [f64; 2],
        sampler: &mut PathSampler,
    ) -> Rgb {
        let Some(mut connection) = shading_point.sample_emitter(self.scene, sampler) else { return Rgb::ZERO };
        let shadow_ray = &connection.emitter_sample.shadow_ray;
        if !self.is_seen(shading_point, connection.light, shadow_ray) {
            return Rgb::ZERO;
        }
        if self.scene.absorbs() {
            connection.scattered *= self.scene.transmittance(Some(&shading_point.si), shadow_ray, None);
        }
        let Some(pdf) = connection.emitter_sample.pdf else { return connection.scattered };
        let other = PerSolidAngle(sample_counts[1] * pdf_of(shading_point, histogram, connection.wo).0);
        connection.scattered * (power_heuristic(PerSolidAngle(sample_counts[0] * pdf.0), other) / pdf.0)
    }

    /// Whether nothing stands between a vertex and a light, by the word of shadow photons where they are of one mind.
    fn is_seen(&self, shading_point: &ShadingPoint<'_>, light: usize, shadow_ray: &Ray) -> bool {
        let Some(shadow) = &self.maps.shadow else { return !self.scene.occluded(shadow_ray) };
        let shade = shadow.shade(&GatherPoint::new(self.scene, &shading_point.si), light);
        self.maps.shadow_rays.count(shade != Visibility::Unknown);
        match shade {
            Visibility::Lit => true,
            Visibility::Dark => false,
            Visibility::Unknown => !self.scene.occluded(shadow_ray),
        }
    }

    /// Follows a ray of gathering. `weight` tells the weight of lights that it meets; without, they are found otherwise.
    fn follow(
        &self,
        shading_point: &ShadingPoint<'_>,
        sample: &Sample,
        depth: u32,
        weight: Option<&dyn Fn(PerSolidAngle) -> f64>,
        sampler: &mut PathSampler,
        found: &mut ClassRadiance,
    ) {
        let scene = self.scene;
        let mut walk = EyeWalk::new(scene, self.settings.limits);
        if !walk.advance(&shading_point.si, sample, 0, sampler) {
            return;
        }
        if let Some(weight) = weight {
            let weight = weight(scene.pdf_emitter_direction(shading_point.p(), walk.met.as_ref()));
            found.add(PathClass::Direct, weight * walk.throughput * walk.emitted());
        }
        for depth in depth.. {
            let Some(si) = walk.met else { return };
            found.add(walk.state.if_emitter(), walk.throughput * scene.self_emission(&si));
            if self.settings.gather.is_none() || depth >= self.settings.limits.max_depth {
                return;
            }
            let next = ShadingPoint::new(scene, si);
            if next.bsdf.is_smooth() {
                let left = self.settings.limits.max_depth.saturating_sub(depth);
                let light =
                    self.estimate(&self.maps.global, &self.maps.global_lookup, &next, |photon| photon.depth() <= left);
                found.add(PathClass::Indirect, walk.throughput * light);
            }
            if !next.bsdf.has_delta() {
                return;
            }
            let drawn = next.bsdf.sample(&next.query, sampler.next_1d(), sampler.next_2d());
            let Some(sample) = drawn.filter(|sample| sample.lobe != Lobe::Smooth) else { return };
            if !walk.advance(&si, &sample, depth, sampler) {
                return;
            }
        }
    }
}

/// Draws a direction from the BSDF or, every other time, from the guide.
fn draw(
    shading_point: &ShadingPoint<'_>,
    histogram: Option<&DirectionHistogram>,
    sampler: &mut PathSampler,
) -> Option<Draw> {
    let (u1, u2) = (sampler.next_1d(), sampler.next_2d());
    let Some(histogram) = histogram else {
        let sample = shading_point.bsdf.sample(&shading_point.query, u1, u2)?;
        return Some(Draw { sample, pdf: sample.pdf });
    };
    let wo = if u1 < 0.5 {
        histogram.sample(u2)
    } else {
        shading_point.bsdf.sample(&shading_point.query, 2.0 * u1 - 1.0, u2)?.wo
    };
    let pdf = pdf_of(shading_point, Some(histogram), wo);
    let scattered = shading_point.bsdf.eval_cos(&shading_point.query, wo);
    if scattered == Rgb::ZERO || pdf.0 == 0.0 {
        return None;
    }
    let sample = Sample { wo, weight: scattered / pdf.0, pdf, lobe: Lobe::Smooth, eta: 1.0 };
    Some(Draw { sample, pdf })
}

/// The density with which [`draw`] draws a direction, without single ones.
fn pdf_of(shading_point: &ShadingPoint<'_>, histogram: Option<&DirectionHistogram>, wo: DVec3) -> PerSolidAngle {
    let by_bsdf = shading_point.bsdf.pdf(&shading_point.query, wo);
    // Balance heuristic for one sample, Veach 1997, eq. (9.15).
    histogram.map_or(by_bsdf, |histogram| PerSolidAngle(0.5 * (by_bsdf.0 + histogram.pdf(wo).0)))
}
