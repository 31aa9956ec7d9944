use glam::DVec3;

use super::{estimator::PhotonMapping, histogram::DirectionHistogram, settings::Direct};
use crate::{
    bsdf::{BsdfModel as _, BsdfSample, Lobe},
    math::{PerSolidAngle, Ray, Rgb},
    photon::{GatherPoint, MapLookup, Visibility},
    sampler::{PathSampler, SampleStream as _},
    transport::{CameraPath, ClassRadiance, DirectSample, PathClass, SampleCounts, ShadingPoint},
};

impl PhotonMapping<'_> {
    /// Emitter sampling and gather rays. Gather rays find indirect light, and direct light that emitter sampling
    /// samples poorly. Returns a sample of a delta lobe, if one was sampled first.
    pub(super) fn final_gather(
        &self,
        path: &CameraPath<'_>,
        point: &ShadingPoint<'_>,
        sampler: &mut PathSampler,
        scattered: &mut ClassRadiance,
    ) -> Option<BsdfSample> {
        let settings = self.settings;
        // Without final gathering, gather rays only find emitters.
        let meets_emitters =
            settings.direct != Direct::Map && (settings.gather_samples.is_some() || settings.direct == Direct::Traced);
        let rays = settings.gather_samples.unwrap_or(u32::from(meets_emitters));
        let counts = SampleCounts { emitter: 1.0, bsdf: if meets_emitters { f64::from(rays) } else { 0.0 } };
        let histogram = self.histogram(point);

        // Emitter sampling.
        if settings.direct != Direct::Map {
            scattered.add(PathClass::Direct, self.sample_direct(point, histogram.as_ref(), counts, sampler));
        }

        // BSDF sampling.
        let mut delta_sample = None;
        for number in 0..rays.max(u32::from(point.bsdf.has_delta())) {
            let Some(sample) = sample_direction(point, histogram.as_ref(), sampler) else { continue };
            if sample.lobe != Lobe::Smooth {
                if number == 0 {
                    delta_sample = Some(sample);
                }
                continue;
            }
            if rays == 0 {
                continue;
            }
            let Some(ray) = path.branch(point, &sample) else { continue };
            let mut gathered = ClassRadiance::default();
            self.gather_along(ray, meets_emitters.then_some(counts), sampler, &mut gathered);
            scattered.add_scaled(&gathered, 1.0 / f64::from(rays));
        }
        delta_sample
    }

    fn histogram(&self, point: &ShadingPoint<'_>) -> Option<DirectionHistogram> {
        if !self.settings.is_guided || self.settings.gather_samples.is_none() || point.bsdf.has_delta() {
            return None;
        }
        let lookup = MapLookup { map: &self.maps.global, parameters: &self.maps.global_lookup };
        DirectionHistogram::new(&lookup, &GatherPoint::new(self.scene, &point.si), point)
    }

    /// Next event estimation, weighted against gather rays.
    fn sample_direct(
        &self,
        point: &ShadingPoint<'_>,
        histogram: Option<&DirectionHistogram>,
        counts: SampleCounts,
        sampler: &mut PathSampler,
    ) -> Rgb {
        let Some(DirectSample { emitter_sample, emitter, wo, mut scattered }) =
            point.sample_emitter(self.scene, sampler)
        else {
            return Rgb::ZERO;
        };
        if !self.is_visible(point, emitter, &emitter_sample.shadow_ray) {
            return Rgb::ZERO;
        }
        if self.scene.absorbs() {
            scattered *= self.scene.transmittance(Some(&point.si), &emitter_sample.shadow_ray, None);
        }
        let Some(pdf) = emitter_sample.pdf else { return scattered };
        scattered * (counts.emitter_weight(pdf, pdf_of_direction(point, histogram, wo)) / pdf.0)
    }

    /// Whether an emitter is visible from a point: from shadow photons where all nearby ones agree, else from a shadow
    /// ray.
    fn is_visible(&self, point: &ShadingPoint<'_>, emitter: usize, shadow_ray: &Ray) -> bool {
        let Some(shadow) = &self.maps.shadow else { return !self.scene.occluded(shadow_ray) };
        let visibility = shadow.visibility(&GatherPoint::new(self.scene, &point.si), emitter);
        self.maps.shadow_rays.count(visibility != Visibility::Unknown);
        match visibility {
            Visibility::Lit => true,
            Visibility::Dark => false,
            Visibility::Unknown => !self.scene.occluded(shadow_ray),
        }
    }

    /// Follows a gather ray through mirrors and glass to a surface where the global map gives the light. `counts`
    /// weights the emitters that the ray hits directly. Without it, other estimates account for emitters.
    fn gather_along(
        &self,
        mut path: CameraPath<'_>,
        counts: Option<SampleCounts>,
        sampler: &mut PathSampler,
        gathered: &mut ClassRadiance,
    ) {
        // Emission.
        match counts {
            Some(counts) => gathered.add(PathClass::Direct, path.emission(path.emission_weight(counts))),
            None => gathered.add(path.class.if_emitter(), path.self_emission()),
        }
        loop {
            let Some(point) = path.shading_point() else { return };
            if self.settings.gather_samples.is_none() || path.depth >= self.settings.limits.max_depth {
                return;
            }

            // Density estimate.
            if point.bsdf.is_smooth() {
                let depth_left = self.settings.limits.max_depth.saturating_sub(path.depth);
                let light = self.estimate(&self.maps.global, &self.maps.global_lookup, &point, |photon| {
                    photon.depth() <= depth_left
                });
                gathered.add(PathClass::Indirect, path.throughput * light);
            }

            // Continue through mirrors and glass.
            if !point.bsdf.has_delta() {
                return;
            }
            let sample = point.sample_bsdf(sampler).filter(|sample| sample.lobe != Lobe::Smooth);
            let Some(sample) = sample else { return };
            if !path.extend(&point, &sample, sampler) {
                return;
            }
            gathered.add(path.class.if_emitter(), path.self_emission());
        }
    }
}

/// Samples a direction from the BSDF. With a histogram, the BSDF or the histogram is chosen with equal probability.
fn sample_direction(
    point: &ShadingPoint<'_>,
    histogram: Option<&DirectionHistogram>,
    sampler: &mut PathSampler,
) -> Option<BsdfSample> {
    let (u1, u2) = (sampler.next_1d(), sampler.next_2d());
    let Some(histogram) = histogram else { return point.bsdf.sample(&point.query, u1, u2) };
    let wo = if u1 < 0.5 { histogram.sample(u2) } else { point.bsdf.sample(&point.query, 2.0 * u1 - 1.0, u2)?.wo };
    let pdf = pdf_of_direction(point, Some(histogram), wo);
    let scattered = point.bsdf.eval_cos(&point.query, wo);
    if scattered == Rgb::ZERO || pdf.0 == 0.0 {
        return None;
    }
    Some(BsdfSample { wo, weight: scattered / pdf.0, pdf, lobe: Lobe::Smooth, eta: 1.0 })
}

/// The density with which [`sample_direction`] samples a direction of a smooth lobe.
fn pdf_of_direction(point: &ShadingPoint<'_>, histogram: Option<&DirectionHistogram>, wo: DVec3) -> PerSolidAngle {
    let by_bsdf = point.bsdf.pdf(&point.query, wo);
    // Balance heuristic for one sample, Veach 1997, eq. (9.15).
    histogram.map_or(by_bsdf, |histogram| PerSolidAngle(0.5 * (by_bsdf.0 + histogram.pdf(wo).0)))
}
