use super::{
    photon_pass::PhotonPass,
    settings::{Schedule, Settings},
};
use crate::{
    bsdf::{BsdfModel as _, BsdfSample, Lobe},
    integrator::{CameraRay, Estimator, IntegratorState, Notes, SampleOutput, photons::CAMERA_RR_DEPTH},
    math::Rgb,
    photon::{
        radiance_estimate,
        radius::{PassCounts, PixelRadius},
    },
    sampler::PathSampler,
    scene::Scene,
    sensor::SensorModel as _,
    transport::{CameraPath, ClassRadiance, PathClass, SampleCounts, ShadingPoint, Shadows},
};

/// The camera paths of a pass, which gather its photons.
#[derive(Debug)]
pub(super) struct ProgressiveEstimator<'s> {
    pub(super) scene: &'s Scene,
    pub(super) settings: &'s Settings,
    pub(super) pass: PhotonPass,
}

impl Estimator for ProgressiveEstimator<'_> {
    fn radiance(&self, camera_ray: &CameraRay, sampler: &mut PathSampler, output: &mut SampleOutput<'_>) -> Rgb {
        let mut radiance = ClassRadiance::default();
        self.trace(camera_ray, sampler, &mut radiance, &mut output.photons);
        if self.settings.shows_classes {
            radiance.write(output.layers);
        }
        radiance.total
    }

    fn next_state(&self, found: &[PassCounts]) -> IntegratorState {
        let Some(radii) = self.pass.pixel_radii() else { return IntegratorState::Empty };
        let next = |(radius, found): (&PixelRadius, &PassCounts)| match self.settings.schedule {
            Schedule::ErrorDriven => radius.after_test(*found),
            Schedule::PerPixel | Schedule::PerPass => radius.after(found.photons, self.settings.alpha),
        };
        IntegratorState::PixelRadii(radii.iter().zip(found).map(next).collect())
    }

    fn notes(&self) -> Notes {
        self.pass.notes()
    }
}

impl ProgressiveEstimator<'_> {
    /// Traces a camera path through mirrors, glass and glossy surfaces to a surface where photons are gathered. Adds
    /// its radiance and the photons that it finds.
    fn trace(
        &self,
        camera_ray: &CameraRay,
        sampler: &mut PathSampler,
        radiance: &mut ClassRadiance,
        found: &mut PassCounts,
    ) {
        let (scene, settings) = (self.scene, self.settings);
        let limits = settings.limits;
        if limits.max_depth == 0 {
            return;
        }
        let rr_depth = limits.rr_depth.max(CAMERA_RR_DEPTH);
        let mut path = CameraPath::along(scene, rr_depth, &camera_ray.ray, settings.hide_emitters);
        let mut footprint = Footprint { previous: camera_ray.ray.origin, length: 0.0, per_length: 0.0 };
        loop {
            // Emission, weighted against emitter sampling where that is used.
            let weight = if settings.connects { path.emission_weight(SampleCounts::ONE_EACH) } else { 1.0 };
            radiance.add(path.class.if_emitter(), path.emission(weight));

            // End the path where it left the scene, or at the maximum depth.
            let Some(point) = path.shading_point() else { return };
            if path.depth >= limits.max_depth {
                return;
            }
            footprint.extend(scene, &path, &point);

            // Emitter sampling. Where paths end, no other strategy finds emitters.
            let is_glossy = point.bsdf.is_glossy();
            if settings.connects && point.bsdf.is_smooth() {
                let counts = if is_glossy { SampleCounts::ONE_EACH } else { SampleCounts::EMITTER_ONLY };
                let direct = point.sample_direct(scene, sampler, counts, Shadows::Opaque);
                radiance.add(path.class.if_direct(), path.throughput * direct);
            }

            // Density estimate.
            if point.bsdf.is_smooth() && !is_glossy {
                let radius = settings.first_radius(footprint.size()) * self.pass.relative_radius(camera_ray.pixel);
                self.estimate(&path, &point, radius, radiance, found);
            }

            // BSDF sampling: any direction if the surface is glossy, else the direction of a delta lobe.
            let Some(sample) = further(&point, sampler) else { return };
            if !path.extend(&point, &sample, sampler) {
                return;
            }
        }
    }

    /// Adds the radiance estimate of the photons around a point, and counts them.
    fn estimate(
        &self,
        path: &CameraPath<'_>,
        point: &ShadingPoint<'_>,
        radius: f64,
        radiance: &mut ClassRadiance,
        found: &mut PassCounts,
    ) {
        let depth_left = self.settings.limits.max_depth - path.depth;
        let photons = self.pass.photons.within(radius, self.settings.kernel);
        let accepts = |nearby: &crate::photon::NearbyPhoton<'_>| {
            let is_direct = nearby.photon.class() == PathClass::Direct;
            let is_accepted = nearby.photon.depth() <= depth_left && !(self.settings.connects && is_direct);
            if is_accepted {
                found.photons += 1;
                found.squared_distances += nearby.squared_distance;
            }
            is_accepted
        };
        radiance_estimate(self.scene, point, &photons, accepts, |class, light| {
            radiance.add(path.class.if_photon(class), path.throughput * light);
        });
    }
}

/// The width of a pixel's footprint along a path. A mirror does not change the footprint: it grows with the length of
/// the path.
struct Footprint {
    previous: glam::DVec3,
    length: f64,
    per_length: f64,
}

impl Footprint {
    fn extend(&mut self, scene: &Scene, path: &CameraPath<'_>, point: &ShadingPoint<'_>) {
        self.length += (point.p() - self.previous).length();
        self.previous = point.p();
        if path.depth == 1 {
            self.per_length = scene.sensor.camera.footprint(point.p()).abs() / self.length;
        }
    }

    /// The size in m.
    fn size(&self) -> f64 {
        self.per_length * self.length
    }
}

/// A direction in which a path continues.
fn further(point: &ShadingPoint<'_>, sampler: &mut PathSampler) -> Option<BsdfSample> {
    let is_glossy = point.bsdf.is_glossy();
    if !point.bsdf.has_delta() && !is_glossy {
        return None;
    }
    let sample = point.sample_bsdf(sampler)?;
    (sample.lobe != Lobe::Smooth || is_glossy).then_some(sample)
}
