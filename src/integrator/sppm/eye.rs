use super::{cast::Cast, settings::Settings};
use crate::{
    bsdf::{Lobe, Model as _, Sample},
    integrator::{EyeRay, eye_walk::EyeWalk, photons::Parts},
    math::PerSolidAngle,
    photon::{Site, radius::Found},
    sampler::{Numbers as _, PathNumbers},
    scene::Scene,
    sensor::Model as _,
    transport::{FromEye, Junction, PathClass, Shadows, power_heuristic},
};

/// The paths from the eye of a pass.
pub(super) struct Eye<'s> {
    pub(super) scene: &'s Scene,
    pub(super) settings: &'s Settings,
    pub(super) cast: &'s Cast,
}

impl Eye<'_> {
    /// Follows a camera's ray by way of mirrors, glass and glossy surfaces up to one where photons are gathered, and adds
    /// what it shows.
    pub(super) fn look(&self, eye: &EyeRay, numbers: &mut PathNumbers, parts: &mut Parts) {
        let (scene, settings) = (self.scene, self.settings);
        if settings.depths.max == 0 {
            return;
        }
        let mut walk = EyeWalk::along(scene, settings.depths, &eye.ray, settings.hide_emitters);
        // A pixel sees as much of a mirror's picture as of a surface that is as far.
        let mut seen_per_length = 0.0;
        let mut length = 0.0;
        let mut before = eye.ray.origin;
        let mut weight = if settings.hide_emitters { 0.0 } else { 1.0 };
        for depth in 1.. {
            parts.add(walk.state.at_light(), weight * walk.throughput * walk.shining());
            let Some(vertex) = walk.met else { return };
            parts.add(walk.state.at_light(), walk.throughput * scene.glow(&vertex));
            if depth >= settings.depths.max {
                return;
            }
            let p = vertex.surface.p;
            length += (p - before).length();
            before = p;
            if depth == 1 {
                seen_per_length = scene.sensor.camera.footprint(p).abs() / length;
            }
            let junction = Junction::new(scene, vertex);
            if junction.bsdf.is_smooth() {
                if settings.connects {
                    // Where paths end, no other strategy looks for lights.
                    let shares = if junction.bsdf.is_glossy() { [1.0, 1.0] } else { [1.0, 0.0] };
                    let light = junction.connect(scene, numbers, shares, Shadows::Opaque);
                    parts.add(walk.state.lit(), walk.throughput * light);
                }
                if !junction.bsdf.is_glossy() {
                    let radius = settings.first_radius(seen_per_length * length) * self.cast.shrinkage(eye.pixel);
                    let found = self.estimate(&junction, radius, settings.depths.max - depth, &walk, parts);
                    self.cast.count(eye.pixel, found);
                }
            }
            let Some(sample) = further(&junction, numbers) else { return };
            if !walk.advance(&vertex, &sample, depth, numbers) {
                return;
            }
            weight = 1.0;
            if settings.connects && sample.lobe == Lobe::Smooth {
                let by_light: PerSolidAngle = scene.light_density(p, walk.met.as_ref());
                weight = power_heuristic(sample.density, by_light);
            }
        }
    }

    /// Adds the radiance that the photons around a vertex send back along the path, of those that have at most so many
    /// segments; returns what was found.
    fn estimate(
        &self,
        junction: &Junction<'_>,
        radius: f64,
        longest: u32,
        walk: &EyeWalk<'_>,
        parts: &mut Parts,
    ) -> Found {
        let site = Site::new(self.scene, &junction.vertex);
        let shading = &junction.vertex.surface.shading;
        let mut found = Found::default();
        self.cast.photons.gather(&site, radius, self.settings.kernel, |photon, density, way| {
            let class = photon.class();
            if photon.depth() > longest || self.settings.connects && class == PathClass::Direct {
                return;
            }
            found.photons += 1;
            found.spread += way;
            let direction = photon.direction();
            // Photons are counted per area: the true surface's cosine is in their density already.
            let cos = direction.dot(site.n);
            if cos > 0.0 {
                let scattered = junction.bsdf.eval_cos(&junction.query, shading.to_local(direction));
                parts.add(shown(walk.state, class), walk.throughput * scattered * photon.power() * (density / cos));
            }
        });
        found
    }
}

/// The class of a path from the eye that ends where a photon of a class is found.
fn shown(eye: FromEye, class: PathClass) -> PathClass {
    match eye.at_light() {
        _ if eye == FromEye::START => class,
        PathClass::Specular => PathClass::Specular,
        _ => PathClass::Indirect,
    }
}

/// The direction in which a path goes on: any where the surface is glossy, else only single ones.
fn further(junction: &Junction<'_>, numbers: &mut PathNumbers) -> Option<Sample> {
    if !junction.bsdf.has_delta() && !junction.bsdf.is_glossy() {
        return None;
    }
    let sample = junction.bsdf.sample(&junction.query, numbers.next_1d(), numbers.next_2d())?;
    (sample.lobe != Lobe::Smooth || junction.bsdf.is_glossy()).then_some(sample)
}
