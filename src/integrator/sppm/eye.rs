use super::{photon_pass::PhotonPass, settings::Settings};
use crate::{
    bsdf::{BsdfModel as _, Lobe, Sample},
    integrator::{EyeRay, eye_walk::EyeWalk, photons::ClassRadiance},
    math::PerSolidAngle,
    photon::{GatherPoint, radius::PassCounts},
    sampler::{PathSampler, SampleStream as _},
    scene::Scene,
    sensor::SensorModel as _,
    transport::{CameraPathClass, PathClass, ShadingPoint, Shadows, power_heuristic},
};

/// The paths from the eye of a pass.
pub(super) struct Eye<'s> {
    pub(super) scene: &'s Scene,
    pub(super) settings: &'s Settings,
    pub(super) photon_pass: &'s PhotonPass,
}

impl Eye<'_> {
    /// Follows a camera's ray by way of mirrors, glass and glossy surfaces up to one where photons are gathered, and adds
    /// what it shows.
    pub(super) fn look(&self, eye: &EyeRay, sampler: &mut PathSampler, parts: &mut ClassRadiance) {
        let (scene, settings) = (self.scene, self.settings);
        if settings.limits.max_depth == 0 {
            return;
        }
        let mut walk = EyeWalk::along(scene, settings.limits, &eye.ray, settings.hide_emitters);
        // A pixel sees as much of a mirror's picture as of a surface that is as far.
        let mut seen_per_length = 0.0;
        let mut length = 0.0;
        let mut before = eye.ray.origin;
        let mut weight = if settings.hide_emitters { 0.0 } else { 1.0 };
        for depth in 1.. {
            parts.add(walk.state.if_emitter(), weight * walk.throughput * walk.emitted());
            let Some(si) = walk.met else { return };
            parts.add(walk.state.if_emitter(), walk.throughput * scene.self_emission(&si));
            if depth >= settings.limits.max_depth {
                return;
            }
            let p = si.surface.p;
            length += (p - before).length();
            before = p;
            if depth == 1 {
                seen_per_length = scene.sensor.camera.footprint(p).abs() / length;
            }
            let shading_point = ShadingPoint::new(scene, si);
            if shading_point.bsdf.is_smooth() {
                if settings.connects {
                    // Where paths end, no other strategy looks for lights.
                    let sample_counts = if shading_point.bsdf.is_glossy() { [1.0, 1.0] } else { [1.0, 0.0] };
                    let light = shading_point.sample_direct(scene, sampler, sample_counts, Shadows::Opaque);
                    parts.add(walk.state.if_direct(), walk.throughput * light);
                }
                if !shading_point.bsdf.is_glossy() {
                    let radius =
                        settings.first_radius(seen_per_length * length) * self.photon_pass.shrinkage(eye.pixel);
                    let found = self.estimate(&shading_point, radius, settings.limits.max_depth - depth, &walk, parts);
                    self.photon_pass.count(eye.pixel, found);
                }
            }
            let Some(sample) = further(&shading_point, sampler) else { return };
            if !walk.advance(&si, &sample, depth, sampler) {
                return;
            }
            weight = 1.0;
            if settings.connects && sample.lobe == Lobe::Smooth {
                let by_light: PerSolidAngle = scene.pdf_emitter_direction(p, walk.met.as_ref());
                weight = power_heuristic(sample.pdf, by_light);
            }
        }
    }

    /// Adds the radiance that the photons around a vertex send back along the path, of those that have at most so many
    /// segments; returns what was found.
    fn estimate(
        &self,
        shading_point: &ShadingPoint<'_>,
        radius: f64,
        longest: u32,
        walk: &EyeWalk<'_>,
        parts: &mut ClassRadiance,
    ) -> PassCounts {
        let point = GatherPoint::new(self.scene, &shading_point.si);
        let shading = &shading_point.si.surface.shading;
        let mut found = PassCounts::default();
        self.photon_pass.photons.gather(&point, radius, self.settings.kernel, |photon, pdf, way| {
            let class = photon.class();
            if photon.depth() > longest || self.settings.connects && class == PathClass::Direct {
                return;
            }
            found.photons += 1;
            found.squared_distances += way;
            let direction = photon.direction();
            // Photons are counted per area: the true surface's cosine is in their density already.
            let cos = direction.dot(point.n);
            if cos > 0.0 {
                let scattered = shading_point.bsdf.eval_cos(&shading_point.query, shading.to_local(direction));
                parts.add(shown(walk.state, class), walk.throughput * scattered * photon.power() * (pdf / cos));
            }
        });
        found
    }
}

/// The class of a path from the eye that ends where a photon of a class is found.
fn shown(eye: CameraPathClass, class: PathClass) -> PathClass {
    match eye.if_emitter() {
        _ if eye == CameraPathClass::START => class,
        PathClass::Specular => PathClass::Specular,
        _ => PathClass::Indirect,
    }
}

/// The direction in which a path goes on: any where the surface is glossy, else only single ones.
fn further(shading_point: &ShadingPoint<'_>, sampler: &mut PathSampler) -> Option<Sample> {
    if !shading_point.bsdf.has_delta() && !shading_point.bsdf.is_glossy() {
        return None;
    }
    let sample = shading_point.bsdf.sample(&shading_point.query, sampler.next_1d(), sampler.next_2d())?;
    (sample.lobe != Lobe::Smooth || shading_point.bsdf.is_glossy()).then_some(sample)
}
