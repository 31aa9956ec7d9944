use glam::DVec3;

use super::power_heuristic;
use crate::{
    bsdf::{self, Bsdf, BsdfModel as _, Query, TransportMode},
    emitter::EmitterSample,
    math::{PerSolidAngle, Rgb},
    sampler::SampleStream,
    scene::{Scene, SurfaceInteraction},
};

/// A point of a surface with its BSDF and the local direction from which a path arrives.
#[derive(Clone, Copy)]
pub struct ShadingPoint<'s> {
    /// The point.
    pub si: SurfaceInteraction,
    /// The BSDF.
    pub bsdf: &'s Bsdf,
    /// The arguments of BSDF queries, with the local direction back along the path and the transport mode.
    pub query: Query,
}

/// Which surfaces block shadow rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shadows {
    /// Every surface.
    Opaque,
    /// Opaque surfaces only. Light passes straight through transparent ones, weighted by their transmittance. Not
    /// physical.
    Transparent,
}

/// The numbers of samples that emitter sampling and BSDF sampling take at a point, for the weights of multiple
/// importance sampling. Only their ratio matters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleCounts {
    /// Samples of emitters.
    pub emitter: f64,
    /// Samples of the BSDF.
    pub bsdf: f64,
}

impl SampleCounts {
    /// One sample of each.
    pub const ONE_EACH: Self = Self { emitter: 1.0, bsdf: 1.0 };
    /// Emitter sampling alone.
    pub const EMITTER_ONLY: Self = Self { emitter: 1.0, bsdf: 0.0 };

    /// The weight of a direction from emitter sampling.
    #[must_use]
    pub fn emitter_weight(self, by_emitter: PerSolidAngle, by_bsdf: PerSolidAngle) -> f64 {
        power_heuristic(PerSolidAngle(self.emitter * by_emitter.0), PerSolidAngle(self.bsdf * by_bsdf.0))
    }

    /// The weight of a direction from BSDF sampling.
    #[must_use]
    pub fn bsdf_weight(self, by_bsdf: PerSolidAngle, by_emitter: PerSolidAngle) -> f64 {
        power_heuristic(PerSolidAngle(self.bsdf * by_bsdf.0), PerSolidAngle(self.emitter * by_emitter.0))
    }
}

/// A direction to an emitter from emitter sampling, before the visibility test.
#[derive(Clone, Copy, Debug)]
pub struct DirectSample {
    /// The sampled direction and the light from the emitter.
    pub emitter_sample: EmitterSample,
    /// The index of the emitter in the scene.
    pub emitter: usize,
    /// The direction to it in the shading frame.
    pub wo: DVec3,
    /// The radiance that is scattered back along the path, not yet divided by the pdf of the direction.
    pub scattered: Rgb,
}

impl<'s> ShadingPoint<'s> {
    /// The shading point at an interaction of a path that carries radiance or importance.
    #[inline]
    #[must_use]
    pub fn new(scene: &'s Scene, si: SurfaceInteraction, mode: TransportMode) -> Self {
        let wi = si.surface.shading.to_local(si.wi_world);
        let query = Query { wi, uv: si.surface.uv, mode };
        Self { bsdf: scene.bsdf(&si), si, query }
    }

    /// The position.
    #[must_use]
    pub fn p(&self) -> DVec3 {
        self.si.surface.p
    }

    /// Samples the BSDF: one number chooses a lobe, two the direction.
    #[inline]
    pub fn sample_bsdf(&self, sampler: &mut impl SampleStream) -> Option<bsdf::BsdfSample> {
        self.bsdf.sample(&self.query, sampler.next_1d(), sampler.next_2d())
    }

    /// Emitter sampling without visibility. None if the BSDF has only delta lobes, or the sample carries no light along
    /// the path.
    #[inline]
    pub fn sample_emitter(&self, scene: &Scene, sampler: &mut impl SampleStream) -> Option<DirectSample> {
        // A shadow ray cannot contribute through a delta lobe: only BSDF sampling samples its direction.
        if !self.bsdf.is_smooth() {
            return None;
        }
        let (emitter_sample, emitter) = scene.sample_emitter_direction(self.p(), sampler.next_2d())?;
        let wo = self.si.surface.shading.to_local(emitter_sample.direction);
        let scattered = self.bsdf.eval_cos(&self.query, wo) * emitter_sample.value;
        (scattered != Rgb::ZERO).then_some(DirectSample { emitter_sample, emitter, wo, scattered })
    }

    /// Next event estimation: the radiance of a sampled emitter that is scattered along the path, weighted against BSDF
    /// sampling by the power heuristic.
    #[inline]
    pub fn sample_direct(
        &self,
        scene: &Scene,
        sampler: &mut impl SampleStream,
        counts: SampleCounts,
        shadows: Shadows,
    ) -> Rgb {
        let Some(DirectSample { emitter_sample, wo, scattered, .. }) = self.sample_emitter(scene, sampler) else {
            return Rgb::ZERO;
        };
        let Some((transmittance, is_crossed)) = self.visibility(scene, &emitter_sample, shadows) else {
            return Rgb::ZERO;
        };
        let scattered = scattered * transmittance;
        match emitter_sample.pdf {
            None => scattered,
            // BSDF sampling does not sample directions straight through glass.
            Some(pdf) if is_crossed => scattered / pdf.0,
            Some(pdf) => {
                let weight = counts.emitter_weight(pdf, self.bsdf.pdf(&self.query, wo));
                scattered * (weight / pdf.0)
            }
        }
    }

    /// The transmittance of a shadow ray, and whether it crosses a transparent surface; None if it is blocked.
    #[inline]
    fn visibility(&self, scene: &Scene, emitter_sample: &EmitterSample, shadows: Shadows) -> Option<(Rgb, bool)> {
        let shadow_ray = &emitter_sample.shadow_ray;
        match shadows {
            Shadows::Opaque if scene.occluded(shadow_ray) => None,
            Shadows::Opaque if scene.absorbs() => Some((scene.transmittance(Some(&self.si), shadow_ray, None), false)),
            Shadows::Opaque => Some((Rgb::ONE, false)),
            Shadows::Transparent => Some(scene.straight_transmittance(&self.si, shadow_ray)),
        }
    }
}
