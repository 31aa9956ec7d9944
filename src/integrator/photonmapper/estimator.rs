use super::{
    maps::Maps,
    settings::{Direct, Settings},
};
use crate::{
    bsdf::{BsdfModel as _, BsdfSample},
    integrator::{CameraRay, Estimator, Notes, SampleOutput, photons::CAMERA_RR_DEPTH},
    math::{Ray, Rgb},
    photon::{EstimateParameters, MapLookup, Photon, PhotonMap, radiance_estimate},
    sampler::PathSampler,
    scene::Scene,
    transport::{CameraPath, ClassRadiance, PathClass, ShadingPoint},
};

/// The second step: traces camera paths to the first surface with a smooth lobe, and estimates its light from the maps.
#[derive(Debug)]
pub(super) struct PhotonMapping<'s> {
    pub(super) scene: &'s Scene,
    pub(super) settings: &'s Settings,
    pub(super) maps: Maps,
}

impl Estimator for PhotonMapping<'_> {
    fn radiance(&self, camera_ray: &CameraRay, sampler: &mut PathSampler, output: &mut SampleOutput<'_>) -> Rgb {
        let mut radiance = ClassRadiance::default();
        let raw = self.trace(&camera_ray.ray, sampler, &mut radiance);
        let (classes, rest) = output.layers.split_at_mut(output.layers.len().min(3 * PathClass::ALL.len()));
        radiance.write(classes);
        if self.settings.shows_raw && !rest.is_empty() {
            raw.write_to_slice(rest);
        }
        radiance.total
    }

    fn notes(&self) -> Notes {
        self.maps.notes()
    }
}

impl PhotonMapping<'_> {
    /// Traces a camera path and adds its radiance. Returns the estimate of the global map at the first surface.
    fn trace(&self, ray: &Ray, sampler: &mut PathSampler, radiance: &mut ClassRadiance) -> Rgb {
        let limits = self.settings.limits;
        let mut raw = Rgb::ZERO;
        if limits.max_depth == 0 {
            return raw;
        }
        let rr_depth = limits.rr_depth.max(CAMERA_RR_DEPTH);
        let mut path = CameraPath::along(self.scene, rr_depth, ray, self.settings.hide_emitters);
        loop {
            // Emission: emitters that the camera sees directly, in mirrors or through glass.
            radiance.add(path.class.if_emitter(), path.emission(1.0));

            // End the path where it left the scene, or at the maximum depth.
            let Some(point) = path.shading_point() else { break };
            if path.depth >= limits.max_depth {
                break;
            }
            if path.depth == 1 && self.settings.shows_raw {
                raw = path.throughput * self.estimate(&self.maps.global, &self.maps.global_lookup, &point, |_| true);
            }

            // Density estimates, emitter sampling and final gathering.
            let mut scattered = ClassRadiance::default();
            let delta_sample = self.scattered(&path, &point, sampler, &mut scattered);
            for class in PathClass::ALL {
                radiance.add(path.class.if_photon(class), path.throughput * scattered.of(class));
            }

            // Continue through mirrors and glass.
            let Some(sample) = delta_sample else { break };
            if !path.extend(&point, &sample, sampler) {
                break;
            }
        }
        raw
    }

    /// Adds the radiance that the smooth lobes of a point scatter, by class. Returns a sample of a delta lobe to
    /// continue with.
    fn scattered(
        &self,
        path: &CameraPath<'_>,
        point: &ShadingPoint<'_>,
        sampler: &mut PathSampler,
        scattered: &mut ClassRadiance,
    ) -> Option<BsdfSample> {
        if !point.bsdf.is_smooth() {
            return point.sample_bsdf(sampler);
        }
        let (maps, settings) = (&self.maps, self.settings);
        let depth_left = settings.limits.max_depth.saturating_sub(path.depth);
        let is_short = |photon: &Photon| photon.depth() <= depth_left;
        scattered.add(PathClass::Caustic, self.estimate(&maps.caustic, &maps.caustic_lookup, point, is_short));
        let from_global =
            |class| self.estimate(&maps.global, &maps.global_lookup, point, |p| is_short(p) && p.class() == class);
        if settings.direct == Direct::Map {
            scattered.add(PathClass::Direct, from_global(PathClass::Direct));
        }
        if settings.gather_samples.is_none() {
            scattered.add(PathClass::Indirect, from_global(PathClass::Indirect));
        }
        self.final_gather(path, point, sampler, scattered)
    }

    /// The radiance estimate from those photons of a map that `accepts` returns true for.
    pub(super) fn estimate(
        &self,
        map: &PhotonMap,
        parameters: &EstimateParameters,
        point: &ShadingPoint<'_>,
        accepts: impl Fn(&Photon) -> bool,
    ) -> Rgb {
        let mut radiance = Rgb::ZERO;
        if !map.is_empty() && point.bsdf.is_smooth() {
            let lookup = MapLookup { map, parameters };
            radiance_estimate(
                self.scene,
                point,
                &lookup,
                |nearby| accepts(nearby.photon),
                |_, light| radiance += light,
            );
        }
        radiance
    }
}
