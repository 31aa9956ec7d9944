//! The scene: shapes, their materials, emitters and the sensor, built from a scene file for ray tracing.

mod build;
pub mod laws;
mod medium;

use glam::{DVec2, DVec3};

use crate::{
    bsdf::{Bsdf, BsdfModel as _, Query, TransportMode},
    emitter::{BoundingSphere, Emission, EmissionTarget, Emitter, EmitterModel as _, EmitterSample},
    math::{Distribution1D, PerSolidAngle, Ray, Rgb, luminance, rng::hash},
    sampler::SampleStream,
    sensor::{Sensor, SensorModel as _},
    shape::{Shape, ShapeModel as _, Shapes, Surface},
};

/// All shapes, materials and emitters, and the sensor.
#[derive(Debug)]
pub struct Scene {
    /// The camera, its film and its sampler.
    pub sensor: Sensor,
    shapes: Shapes,
    /// The first material and the emitter of each shape, by shape index.
    scene_shapes: Vec<SceneShape>,
    /// The indices of the BSDFs of all shapes' operands, shape after shape.
    materials: Vec<usize>,
    bsdfs: Vec<Bsdf>,
    emitters: Vec<SceneEmitter>,
    /// The index of the environment emitter.
    environment: Option<usize>,
    /// The emitters in proportion to their power; None if their total power is 0.
    emitter_powers: Option<Distribution1D>,
    /// The luminance of the emitters' total power, in W.
    power: f64,
    /// The bounding sphere of everything of finite size.
    scene_bounds: BoundingSphere,
    /// The bounding sphere of each shape with a delta lobe; None if one of them is infinite.
    specular: Option<Vec<BoundingSphere>>,
    /// Whether any material has self-emission.
    has_self_emission: bool,
    /// Whether any medium absorbs light.
    absorbs: bool,
    warnings: Vec<String>,
}

/// The materials and the emitter of a shape in the scene.
#[derive(Debug)]
struct SceneShape {
    /// The index in `materials` of its first operand.
    first_material: usize,
    /// The index of its area light.
    emitter: Option<usize>,
}

/// An emitter in the scene.
#[derive(Debug)]
struct SceneEmitter {
    model: Emitter,
    /// The index of the shape of an area light.
    shape_index: Option<usize>,
}

/// A ray-surface intersection.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceInteraction {
    /// The ray parameter of the intersection.
    pub t: f64,
    /// The point of the surface.
    pub surface: Surface,
    /// The unit direction back along the ray.
    pub wi_world: DVec3,
    /// The index of the shape, in document order.
    pub shape_index: usize,
}

impl SurfaceInteraction {
    /// The unit geometric normal, on the side from which the ray arrived.
    #[inline]
    #[must_use]
    pub fn facing(&self) -> DVec3 {
        let n = self.surface.n;
        if n.dot(self.wi_world) < 0.0 { -n } else { n }
    }
}

impl Scene {
    /// The first intersection along a ray.
    #[inline]
    #[must_use]
    pub fn intersect(&self, ray: &Ray) -> Option<SurfaceInteraction> {
        let (shape_index, hit) = self.shapes.intersect(ray)?;
        let surface = self.shapes[shape_index].surface(ray, &hit);
        Some(SurfaceInteraction { t: hit.t, surface, wi_world: -ray.direction.normalize(), shape_index })
    }

    /// Whether any surface blocks a ray.
    #[inline]
    #[must_use]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.shapes.occlude(ray)
    }

    /// Whether an intersection of a camera ray lies on an edge of a mesh that is drawn one pixel wide.
    #[must_use]
    pub fn is_on_edge(&self, si: &SurfaceInteraction) -> bool {
        let distance = self.shapes[si.shape_index].edge_distance(&si.surface);
        distance.is_some_and(|distance| distance <= 0.5 * self.sensor.camera.footprint(si.surface.p))
    }

    /// The transmittance from an interaction to the end of a ray, straight through transparent surfaces, and whether
    /// the ray crosses any such surface.
    #[inline(never)]
    #[must_use]
    pub fn straight_transmittance(&self, from: &SurfaceInteraction, ray: &Ray) -> (Rgb, bool) {
        let mut rest = *ray;
        let mut last = SurfaceInteraction { t: 0.0, ..*from };
        let mut total = Rgb::ONE;
        let mut is_crossed = false;
        while let Some(si) = self.intersect(&rest) {
            let wi = si.surface.shading.to_local(si.wi_world);
            let query = Query { wi, uv: si.surface.uv, mode: TransportMode::Radiance };
            let Some(transmittance) = self.bsdf(&si).straight_transmittance(&query) else {
                return (Rgb::ZERO, is_crossed);
            };
            total *= transmittance * self.transmittance_beyond(&last, ray, Some(&si));
            is_crossed = true;
            rest.t_min = si.t + Ray::leaving_distance(si.surface.p) / ray.direction.length();
            last = si;
        }
        (total * self.transmittance_beyond(&last, ray, None), is_crossed)
    }

    /// The BSDF at an interaction.
    #[must_use]
    pub fn bsdf(&self, si: &SurfaceInteraction) -> &Bsdf {
        let material = self.scene_shapes[si.shape_index].first_material + si.surface.operand_index as usize;
        &self.bsdfs[self.materials[material]]
    }

    /// The radiance that an area light emits from an interaction back along the ray.
    #[inline]
    #[must_use]
    pub fn emitted(&self, si: &SurfaceInteraction) -> Rgb {
        match self.scene_shapes[si.shape_index].emitter {
            Some(index) => self.emitters[index].model.surface_radiance(&si.surface, si.wi_world),
            None => Rgb::ZERO,
        }
    }

    /// Whether any material has self-emission.
    #[inline]
    #[must_use]
    pub fn has_self_emission(&self) -> bool {
        self.has_self_emission
    }

    /// The self-emission of the material at an interaction.
    #[must_use]
    pub fn self_emission(&self, si: &SurfaceInteraction) -> Rgb {
        let is_front = si.surface.shading.n.dot(si.wi_world) > 0.0;
        self.bsdf(si).self_emission(&si.surface, is_front)
    }

    /// Whether an interaction lies on an area light.
    #[must_use]
    pub fn is_emitter(&self, si: &SurfaceInteraction) -> bool {
        self.scene_shapes[si.shape_index].emitter.is_some()
    }

    /// The radiance of the environment along a ray that leaves the scene.
    #[must_use]
    pub fn environment(&self, direction: DVec3) -> Rgb {
        self.environment
            .map_or(Rgb::ZERO, |environment| self.emitters[environment].model.environment_radiance(direction))
    }

    /// Samples an emitter uniformly and a direction to it. The probability of the emitter divides the value of a delta
    /// emitter and multiplies the pdf of others. Also returns the index of the emitter.
    #[inline]
    #[must_use]
    pub fn sample_emitter_direction(&self, from: DVec3, u: DVec2) -> Option<(EmitterSample, usize)> {
        let count = self.emitters.len();
        if count == 0 {
            return None;
        }
        let scaled = u.x * count as f64;
        let index = (scaled as usize).min(count - 1);
        let emitter = &self.emitters[index];
        let rest = DVec2::new(scaled - index as f64, u.y);
        let mut emitter_sample = emitter.model.sample_direction(self.shape_of(emitter), from, rest)?;
        match &mut emitter_sample.pdf {
            Some(pdf) => pdf.0 /= count as f64,
            None => emitter_sample.value *= count as f64,
        }
        Some((emitter_sample, index))
    }

    /// The pdf with which [`Scene::sample_emitter_direction`] samples a unit direction, to an interaction or to the
    /// environment if `si` is None.
    #[inline]
    #[must_use]
    pub fn pdf_emitter_direction(
        &self,
        from: DVec3,
        direction: DVec3,
        si: Option<&SurfaceInteraction>,
    ) -> PerSolidAngle {
        let index = match si {
            Some(si) => self.scene_shapes[si.shape_index].emitter,
            None => self.environment,
        };
        let pdf = index.map_or(0.0, |index| {
            let emitter = &self.emitters[index];
            emitter.model.pdf_direction(self.shape_of(emitter), from, direction, si.map(|si| &si.surface)).0
        });
        PerSolidAngle(pdf / self.emitters.len().max(1) as f64)
    }

    /// Samples a ray of emitted light, and returns the index of its emitter. Emitters are sampled in proportion to
    /// their power. The flux represents the entire scene if this is the only sample. None if the emitters have no
    /// power, or the sample carries no light.
    #[inline]
    pub fn emit(&self, sampler: &mut impl SampleStream) -> Option<(Emission, usize)> {
        let target = EmissionTarget { sphere: self.scene_bounds, before: self.scene_bounds.radius, is_aimed: false };
        self.emit_through(&target, sampler)
    }

    fn emit_through(&self, target: &EmissionTarget, sampler: &mut impl SampleStream) -> Option<(Emission, usize)> {
        let u = sampler.next_1d();
        let position = [sampler.next_2d(), sampler.next_2d()];
        // Emitters without power are never sampled.
        let emitter_powers = self.emitter_powers.as_ref()?;
        let index = emitter_powers.sample(u).index;
        let (emitter, probability) = (&self.emitters[index], emitter_powers.probability(index));
        let emission = emitter.model.emit(self.shape_of(emitter), target, position)?;
        (emission.flux != Rgb::ZERO).then_some((Emission { flux: emission.flux / probability, ..emission }, index))
    }

    /// Like [`Scene::emit`], but aimed at the bounding spheres of the shapes with a delta lobe: only this light can
    /// reach mirrors or glass first.
    pub fn emit_at_specular(&self, sampler: &mut impl SampleStream) -> Option<Emission> {
        let Some(spheres) = &self.specular else { return self.emit(sampler).map(|(emission, _)| emission) };
        let section = |sphere: &BoundingSphere| sphere.radius * sphere.radius;
        let total: f64 = spheres.iter().map(section).sum();
        let mut rest = sampler.next_1d() * total;
        let chosen = spheres.iter().position(|sphere| {
            rest -= section(sphere);
            rest < 0.0
        });
        let target = self.target(spheres.get(chosen.unwrap_or(spheres.len().saturating_sub(1)))?);
        let (emission, emitter) = self.emit_through(&target, sampler)?;
        // The spheres may overlap: the pdf sums over all targets that could have produced this ray.
        let is_distant = self.emitters[emitter].model.is_distant();
        let pdf = |sphere| section(sphere) / total * self.target(sphere).pdf(&emission.ray, is_distant);
        let all: f64 = spheres.iter().map(pdf).sum();
        let fraction = target.pdf(&emission.ray, is_distant) / all;
        // By rounding, the ray may miss all spheres.
        fraction.is_finite().then(|| Emission { flux: emission.flux * fraction, ..emission })
    }

    fn target(&self, sphere: &BoundingSphere) -> EmissionTarget {
        let before = self.scene_bounds.radius + (sphere.centre - self.scene_bounds.centre).length();
        EmissionTarget { sphere: *sphere, before, is_aimed: true }
    }

    /// Whether any surface has a delta lobe.
    #[must_use]
    pub fn has_specular(&self) -> bool {
        self.specular.as_ref().is_none_or(|spheres| !spheres.is_empty())
    }

    /// Whether any surface has a smooth lobe.
    #[must_use]
    pub fn has_smooth(&self) -> bool {
        self.materials.iter().any(|&material| self.bsdfs[material].is_smooth())
    }

    /// The bounding sphere of everything of finite size.
    #[must_use]
    pub fn scene_bounds(&self) -> BoundingSphere {
        self.scene_bounds
    }

    /// The corners of the flat polygon that an interaction lies on, if it lies on one.
    #[must_use]
    pub fn polygon(&self, si: &SurfaceInteraction) -> Option<[DVec3; 4]> {
        self.shapes[si.shape_index].polygon(&si.surface)
    }

    /// An identifier of the surface that an interaction lies on: the face of a polyhedron, or the whole shape.
    #[must_use]
    pub fn surface_id(&self, si: &SurfaceInteraction) -> u32 {
        let face = if self.shapes[si.shape_index].is_polyhedron() { u64::from(si.surface.primitive) } else { 0 };
        hash(&[si.shape_index as u64, face]) as u32
    }

    /// Checks that light can be traced from the emitters.
    ///
    /// # Errors
    /// If a distant emitter illuminates an infinite plane, which a finite number of paths cannot sample.
    pub fn check_emission(&self) -> Result<(), String> {
        let is_distant = self.emitters.iter().any(|emitter| emitter.model.is_distant());
        if is_distant && self.shapes.is_unbounded() {
            return Err("a distant emitter illuminates an infinite plane; use a large rectangle instead".into());
        }
        Ok(())
    }

    /// Whether the scene has any emitter or self-emission, even a black emitter.
    #[must_use]
    pub fn has_emitters(&self) -> bool {
        !self.emitters.is_empty() || self.has_self_emission
    }

    /// Whether any emitter has power, or any material has self-emission.
    #[must_use]
    pub fn emits_light(&self) -> bool {
        // A sphere of arbitrary size, because the scene may contain nothing of finite size.
        let target = EmissionTarget {
            sphere: BoundingSphere { centre: DVec3::ZERO, radius: 1.0 },
            before: 1.0,
            is_aimed: false,
        };
        let has_power = |emitter: &SceneEmitter| emitter.model.power(self.shape_of(emitter), &target) != Rgb::ZERO;
        self.has_self_emission || self.emitters.iter().any(has_power)
    }

    /// The luminance of the total power that all emitters emit into the scene, in W.
    #[must_use]
    pub fn power(&self) -> f64 {
        self.power
    }

    /// Warnings about the scene, such as ignored triangles.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    fn shape_of(&self, emitter: &SceneEmitter) -> Option<&Shape> {
        emitter.shape_index.map(|index| &self.shapes[index])
    }

    /// Computes the powers of the emitters.
    fn with_emitter_powers(mut self) -> Self {
        let target = EmissionTarget { sphere: self.scene_bounds, before: self.scene_bounds.radius, is_aimed: false };
        let power = |emitter: &SceneEmitter| luminance(emitter.model.power(self.shape_of(emitter), &target));
        let powers = Distribution1D::new(self.emitters.iter().map(power).collect::<Vec<_>>());
        self.power = powers.total();
        self.emitter_powers = powers.normalized();
        self
    }
}
