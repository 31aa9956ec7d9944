use glam::DVec3;

use super::{CameraPathClass, SampleCounts, ShadingPoint, survival};
use crate::{
    bsdf::{BsdfSample, Lobe, TransportMode},
    math::{PerSolidAngle, Ray, Rgb},
    sampler::SampleStream,
    scene::{Scene, SurfaceInteraction},
};

/// A path from the camera, up to its current point.
///
/// An integrator treats each point in the order of Mitsuba's `path`: emission, emitter sampling, BSDF sampling and
/// Russian roulette. [`CameraPath::extend`] applies Russian roulette and traces the ray to the next point.
#[derive(Clone)]
pub struct CameraPath<'s> {
    scene: &'s Scene,
    /// The depth from which Russian roulette may end the path.
    rr_depth: u32,
    /// Whether emitters and the environment are invisible to the camera.
    hides_emitters: bool,
    /// The radiance at the camera for each unit of radiance that arrives at the current point.
    pub throughput: Rgb,
    /// The index of refraction at the current point, over that at the camera.
    eta: f64,
    /// The class, from the lobes of the points so far.
    pub class: CameraPathClass,
    /// The depth of the current point: 1 for the first surface from the camera.
    pub depth: u32,
    direction: DVec3,
    /// The current point; None if the path has left the scene.
    pub si: Option<SurfaceInteraction>,
    /// The point at which BSDF sampling sampled the last direction, and its pdf. None at the camera and after a delta
    /// lobe, where emitter sampling cannot sample the direction.
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

    /// A path that starts at a point of this one in a direction sampled there. Its throughput and its class count from
    /// that point. None if its throughput is zero.
    pub fn branch(&self, point: &ShadingPoint<'s>, sample: &BsdfSample) -> Option<Self> {
        let mut branch = Self { throughput: Rgb::ONE, eta: 1.0, class: CameraPathClass::START, ..self.clone() };
        branch.scatter(point, sample);
        if branch.throughput == Rgb::ZERO {
            return None;
        }
        branch.trace(point);
        Some(branch)
    }

    /// The shading point at the current point; None if the path has left the scene.
    #[inline]
    pub fn shading_point(&self) -> Option<ShadingPoint<'s>> {
        self.si.map(|si| ShadingPoint::new(self.scene, si, TransportMode::Radiance))
    }

    /// The radiance that the current point, or the environment, adds to the image by its emission. Emitters count with
    /// the given weight; the self-emission of materials, which emitter sampling never finds, counts in full.
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

    /// The radiance that the current point's material adds to the image by its self-emission.
    #[inline]
    pub fn self_emission(&self) -> Rgb {
        match &self.si {
            Some(si) if self.scene.has_self_emission() => self.throughput * self.scene.self_emission(si),
            _ => Rgb::ZERO,
        }
    }

    /// The multiple importance sampling weight of the emission: 1 where emitter sampling cannot sample the last
    /// direction.
    #[inline]
    pub fn emission_weight(&self, counts: SampleCounts) -> f64 {
        let Some((from, pdf)) = self.sampled else { return 1.0 };
        counts.bsdf_weight(pdf, self.scene.pdf_emitter_direction(from, self.direction, self.si.as_ref()))
    }

    /// Whether the last direction came from a smooth lobe, so that emitter sampling could have sampled it.
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

/// The first intersection of a camera ray, behind all emitters if they are hidden.
fn first_surface(scene: &Scene, ray: &Ray, hide_emitters: bool) -> Option<SurfaceInteraction> {
    let mut si = scene.intersect(ray)?;
    while hide_emitters && scene.is_emitter(&si) {
        let beyond = Ray { t_max: ray.t_max - si.t, ..Ray::leaving(si.surface.p, ray.direction) };
        let next = scene.intersect(&beyond)?;
        si = SurfaceInteraction { t: si.t + next.t, ..next };
    }
    Some(si)
}
