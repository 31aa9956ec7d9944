use glam::DVec3;

use super::{CameraPathClass, SampleCounts, ShadingPoint, survival};
use crate::{
    bsdf::{BsdfSample, Lobe, TransportMode},
    math::{PerSolidAngle, Ray, Rgb},
    sampler::SampleStream,
    scene::{Scene, SurfaceInteraction},
};

/// A path from the camera, up to the surface that it has reached.
///
/// An integrator looks at each of its points in the order of Mitsuba's `path`: emission, emitter sampling, BSDF
/// sampling, and Russian roulette, of which [`CameraPath::extend`] does the last with the ray to the next point.
#[derive(Clone)]
pub struct CameraPath<'s> {
    scene: &'s Scene,
    /// The depth from which on Russian roulette may end it.
    rr_depth: u32,
    /// Whether the camera sees no emitters and no environment.
    hides_emitters: bool,
    /// The radiance at the camera for each unit of radiance that arrives at the current point.
    pub throughput: Rgb,
    /// The index of refraction where the path is, over that where it began.
    eta: f64,
    /// The class, by the lobes of the points so far.
    pub class: CameraPathClass,
    /// The depth of the current point: 1 for what the camera sees first.
    pub depth: u32,
    direction: DVec3,
    /// The point that it has reached; None if it has left the scene.
    pub si: Option<SurfaceInteraction>,
    /// From where BSDF sampling drew the last direction, with its density; None from the camera and after a delta lobe, where
    /// emitter sampling could not have found it.
    sampled: Option<(DVec3, PerSolidAngle)>,
}

impl<'s> CameraPath<'s> {
    /// The path along a camera's ray to the first surface. With `hide_emitters` the ray passes through every emitter.
    pub fn along(scene: &'s Scene, rr_depth: u32, ray: &Ray, hide_emitters: bool) -> Self {
        let si = first_surface(scene, ray, hide_emitters);
        let throughput = if scene.absorbs() { scene.transmittance(None, ray, si.as_ref()) } else { Rgb::ONE };
        Self {
            scene,
            rr_depth,
            hides_emitters: hide_emitters,
            throughput,
            eta: 1.0,
            class: CameraPathClass::START,
            depth: 1,
            direction: ray.direction,
            si,
            sampled: None,
        }
    }

    /// A path that begins at a point of this one, in a direction that was sampled there: its throughput and its class are
    /// those from that point on. None if it carries nothing.
    pub fn branch(&self, point: &ShadingPoint<'s>, sample: &BsdfSample) -> Option<Self> {
        let mut branch = Self { throughput: Rgb::ONE, eta: 1.0, class: CameraPathClass::START, ..self.clone() };
        branch.scatter(point, sample);
        if branch.throughput == Rgb::ZERO {
            return None;
        }
        branch.trace(point);
        Some(branch)
    }

    /// The shading point that it has reached, if it has met a surface.
    #[inline]
    pub fn shading_point(&self) -> Option<ShadingPoint<'s>> {
        self.si.map(|si| ShadingPoint::new(self.scene, si, TransportMode::Radiance))
    }

    /// The radiance that the current point, or the environment, adds to the image by its emission. Emitters count with the
    /// given weight; the self-emission of materials, which emitter sampling never finds, counts in full.
    #[inline]
    pub fn emission(&self, emitter_weight: f64) -> Rgb {
        if self.hides_emitters && self.depth == 1 {
            return self.self_emission();
        }
        let emitted = match &self.si {
            Some(si) => self.scene.emitted(si),
            None => self.scene.environment(self.direction),
        };
        self.throughput * emitter_weight * emitted + self.self_emission()
    }

    /// What the material of the current point adds to the image by its self-emission.
    #[inline]
    pub fn self_emission(&self) -> Rgb {
        match &self.si {
            Some(si) if self.scene.has_self_emission() => self.throughput * self.scene.self_emission(si),
            _ => Rgb::ZERO,
        }
    }

    /// The weight of the emission, by multiple importance sampling: one where emitter sampling could not have found the last
    /// direction.
    #[inline]
    pub fn emission_weight(&self, counts: SampleCounts) -> f64 {
        let Some((from, pdf)) = self.sampled else { return 1.0 };
        counts.bsdf_weight(pdf, self.scene.pdf_emitter_direction(from, self.si.as_ref()))
    }

    /// Whether the last direction came from a smooth lobe, so that emitter sampling could have found it.
    pub fn is_from_smooth_lobe(&self) -> bool {
        self.sampled.is_some()
    }

    /// Continues in a direction that was sampled at the current point; false if the path ends there.
    #[inline]
    pub fn extend(&mut self, point: &ShadingPoint<'s>, sample: &BsdfSample, sampler: &mut impl SampleStream) -> bool {
        self.scatter(point, sample);
        // Russian roulette.
        if self.depth >= self.rr_depth {
            let survival = survival(self.throughput, self.eta);
            if sampler.next_1d() >= survival {
                return false;
            }
            self.throughput /= survival;
        }
        if self.throughput == Rgb::ZERO {
            return false;
        }
        self.trace(point);
        true
    }

    #[inline]
    fn scatter(&mut self, point: &ShadingPoint<'s>, sample: &BsdfSample) {
        self.throughput *= sample.weight;
        self.eta *= sample.eta;
        self.class = self.class.scattered(sample.lobe);
        self.direction = point.si.surface.shading.to_world(sample.wo);
        self.sampled = (sample.lobe == Lobe::Smooth).then_some((point.p(), sample.pdf));
    }

    /// Traces the ray to the next point, through the medium between the two.
    #[inline]
    fn trace(&mut self, point: &ShadingPoint<'s>) {
        let ray = Ray::leaving(point.p(), self.direction);
        self.si = self.scene.intersect(&ray);
        self.depth += 1;
        if self.scene.absorbs() {
            self.throughput *= self.scene.transmittance(Some(&point.si), &ray, self.si.as_ref());
        }
    }
}

/// What a camera's ray meets first, past all emitters if they are hidden.
fn first_surface(scene: &Scene, ray: &Ray, hide_emitters: bool) -> Option<SurfaceInteraction> {
    let mut si = scene.intersect(ray)?;
    while hide_emitters && scene.is_emitter(&si) {
        let beyond = Ray { t_max: ray.t_max - si.t, ..Ray::leaving(si.surface.p, ray.direction) };
        let next = scene.intersect(&beyond)?;
        si = SurfaceInteraction { t: si.t + next.t, ..next };
    }
    Some(si)
}
