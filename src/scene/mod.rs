//! Scenes: shapes with their materials and emitters, and the sensor, ready for rays.

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

/// All shapes with their materials, all emitters, and the sensor.
#[derive(Debug)]
pub struct Scene {
    /// The camera, its film and its sampler.
    pub sensor: Sensor,
    shapes: Shapes,
    /// What else there is to know of each shape.
    parts: Vec<Part>,
    /// Which bsdf each leaf of each part has, part after part.
    materials: Vec<usize>,
    bsdfs: Vec<Bsdf>,
    lights: Vec<Light>,
    /// Which light is the sky.
    environment: Option<usize>,
    /// The lights by their power; None if they have none.
    light_powers: Option<Distribution1D>,
    power: f64,
    /// Around everything of finite size.
    scene_bounds: BoundingSphere,
    /// Around each shape that scatters into single directions; None if one of them has no end.
    specular: Option<Vec<BoundingSphere>>,
    /// Whether any material shows radiance by itself.
    has_self_emission: bool,
    /// Whether any medium absorbs light.
    absorbs: bool,
    warnings: Vec<String>,
}

/// The materials of a shape in the scene and what it emits.
#[derive(Debug)]
struct Part {
    /// Where those of its leaves begin.
    first_material: usize,
    light: Option<usize>,
}

/// A light in the scene.
#[derive(Debug)]
struct Light {
    emitter: Emitter,
    /// The part whose shape shines.
    part: Option<usize>,
}

/// A point where a ray meets the scene.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceInteraction {
    /// The ray's parameter.
    pub t: f64,
    /// The point of the surface.
    pub surface: Surface,
    /// The unit direction back along the ray, in world space.
    pub wi_world: DVec3,
    /// The number of the shape, from 0 in document order.
    pub shape_index: usize,
}

impl SurfaceInteraction {
    /// The unit normal of the geometric surface, on the side that the ray came from.
    #[inline]
    #[must_use]
    pub fn facing(&self) -> DVec3 {
        let n = self.surface.n;
        if n.dot(self.wi_world) < 0.0 { -n } else { n }
    }
}

impl Scene {
    /// The first point where a ray meets the scene; None if it meets nothing.
    #[inline]
    #[must_use]
    pub fn intersect(&self, ray: &Ray) -> Option<SurfaceInteraction> {
        let (part, hit) = self.shapes.intersect(ray)?;
        let surface = self.shapes[part].surface(ray, &hit);
        Some(SurfaceInteraction { t: hit.t, surface, wi_world: -ray.direction.normalize(), shape_index: part })
    }

    /// Whether a ray meets anything.
    #[inline]
    #[must_use]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.shapes.occlude(ray)
    }

    /// Whether a vertex that the sensor sees lies on an edge of a mesh, as seen in lines one pixel wide.
    #[must_use]
    pub fn is_on_edge(&self, si: &SurfaceInteraction) -> bool {
        let distance = self.shapes[si.shape_index].edge_distance(&si.surface);
        distance.is_some_and(|distance| distance <= 0.5 * self.sensor.camera.footprint(si.surface.p))
    }

    /// The transmittance along a ray from a vertex, from 0 to 1, through surfaces that let light pass straight on, and whether
    /// there is any such surface. It is 0 if an opaque surface blocks the ray.
    #[inline(never)]
    #[must_use]
    pub fn straight_transmittance(&self, from: &SurfaceInteraction, ray: &Ray) -> (Rgb, bool) {
        let mut rest = *ray;
        let mut last = SurfaceInteraction { t: 0.0, ..*from };
        let mut share = Rgb::ONE;
        let mut is_crossed = false;
        while let Some(si) = self.intersect(&rest) {
            let wi = si.surface.shading.to_local(si.wi_world);
            let query = Query { wi, uv: si.surface.uv, mode: TransportMode::Radiance };
            let Some(transmittance) = self.bsdf(&si).straight_transmittance(&query) else {
                return (Rgb::ZERO, is_crossed);
            };
            share *= transmittance * self.transmittance_beyond(&last, ray, Some(&si));
            is_crossed = true;
            rest.t_min = si.t + Ray::leaving_distance(si.surface.p) / ray.direction.length();
            last = si;
        }
        (share * self.transmittance_beyond(&last, ray, None), is_crossed)
    }

    /// The material at a vertex.
    #[must_use]
    pub fn bsdf(&self, si: &SurfaceInteraction) -> &Bsdf {
        let operand_index = self.parts[si.shape_index].first_material + si.surface.operand_index as usize;
        &self.bsdfs[self.materials[operand_index]]
    }

    /// The radiance that the emitter at a vertex sends back along the ray, in W/(m² sr); 0 if there is none.
    #[inline]
    #[must_use]
    pub fn emitted(&self, si: &SurfaceInteraction) -> Rgb {
        match self.parts[si.shape_index].light {
            Some(light) => self.lights[light].emitter.surface_radiance(&si.surface, si.wi_world),
            None => Rgb::ZERO,
        }
    }

    /// Whether any material shows radiance by itself.
    #[inline]
    #[must_use]
    pub fn has_self_emission(&self) -> bool {
        self.has_self_emission
    }

    /// The radiance that the material at a vertex emits without being an emitter.
    #[must_use]
    pub fn self_emission(&self, si: &SurfaceInteraction) -> Rgb {
        let is_front = si.surface.shading.n.dot(si.wi_world) > 0.0;
        self.bsdf(si).self_emission(&si.surface, is_front)
    }

    /// Whether a vertex lies on an area light.
    #[must_use]
    pub fn is_light(&self, si: &SurfaceInteraction) -> bool {
        self.parts[si.shape_index].light.is_some()
    }

    /// The radiance of the environment in a direction, in W/(m² sr), for a ray that meets nothing.
    #[must_use]
    pub fn environment(&self, direction: DVec3) -> Rgb {
        self.environment
            .map_or(Rgb::ZERO, |environment| self.lights[environment].emitter.environment_radiance(direction))
    }

    /// Samples an emitter, each with the same probability, and a direction to it; also returns the number of the emitter. For a
    /// delta emitter the value is divided by that probability, for others the density is multiplied by it.
    #[inline]
    #[must_use]
    pub fn sample_emitter_direction(&self, from: DVec3, u: DVec2) -> Option<(EmitterSample, usize)> {
        let count = self.lights.len();
        if count == 0 {
            return None;
        }
        let scaled = u.x * count as f64;
        let index = (scaled as usize).min(count - 1);
        let light = &self.lights[index];
        let rest = DVec2::new(scaled - index as f64, u.y);
        let mut emitter_sample = light.emitter.sample_direction(self.shape_of(light), from, rest)?;
        match &mut emitter_sample.pdf {
            Some(pdf) => pdf.0 /= count as f64,
            None => emitter_sample.value *= count as f64,
        }
        Some((emitter_sample, index))
    }

    /// The density with which [`Scene::sample_emitter_direction`] samples the direction to a vertex, or to the environment.
    #[inline]
    #[must_use]
    pub fn pdf_emitter_direction(&self, from: DVec3, si: Option<&SurfaceInteraction>) -> PerSolidAngle {
        let index = match si {
            Some(si) => self.parts[si.shape_index].light,
            None => self.environment,
        };
        let pdf = index.map_or(0.0, |index| {
            let light = &self.lights[index];
            light.emitter.pdf_direction(self.shape_of(light), from, si.map(|v| &v.surface)).0
        });
        PerSolidAngle(pdf / self.lights.len().max(1) as f64)
    }

    /// Samples an emitter with a probability proportional to its power, and a ray that leaves it; also returns the number of
    /// the emitter. The flux is an estimate of the power of the whole scene. None if there is no emitter or the sample carries
    /// no light.
    #[inline]
    pub fn emit(&self, sampler: &mut impl SampleStream) -> Option<(Emission, usize)> {
        let target = EmissionTarget { sphere: self.scene_bounds, before: self.scene_bounds.radius, is_aimed: false };
        self.emit_through(&target, sampler)
    }

    fn emit_through(&self, target: &EmissionTarget, sampler: &mut impl SampleStream) -> Option<(Emission, usize)> {
        let u = sampler.next_1d();
        let position = [sampler.next_2d(), sampler.next_2d()];
        // Without power no light is ever drawn.
        let light_powers = self.light_powers.as_ref()?;
        let index = light_powers.sample(u).index;
        let (light, chance) = (&self.lights[index], light_powers.chance(index));
        let emission = light.emitter.emit(self.shape_of(light), target, position)?;
        (emission.flux != Rgb::ZERO).then_some((Emission { flux: emission.flux / chance, ..emission }, index))
    }

    /// As [`Scene::emit`], restricted to rays towards the bounding spheres of mirrors and glass.
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
        let (emission, light) = self.emit_through(&target, sampler)?;
        // Balls may overlap: the density is that of all draws that could have given this ray.
        let is_distant = self.lights[light].emitter.is_distant();
        let pdf = |sphere| section(sphere) / total * self.target(sphere).pdf(&emission.ray, is_distant);
        let all: f64 = spheres.iter().map(pdf).sum();
        let share = target.pdf(&emission.ray, is_distant) / all;
        // Rounding may leave the ray beside all of them.
        share.is_finite().then(|| Emission { flux: emission.flux * share, ..emission })
    }

    fn target(&self, sphere: &BoundingSphere) -> EmissionTarget {
        let before = self.scene_bounds.radius + (sphere.centre - self.scene_bounds.centre).length();
        EmissionTarget { sphere: *sphere, before, is_aimed: true }
    }

    /// Whether any material has delta directions.
    #[must_use]
    pub fn has_specular(&self) -> bool {
        self.specular.as_ref().is_none_or(|spheres| !spheres.is_empty())
    }

    /// Whether any material scatters into more than delta directions.
    #[must_use]
    pub fn has_smooth(&self) -> bool {
        self.materials.iter().any(|&material| self.bsdfs[material].is_smooth())
    }

    /// A sphere around all shapes of finite size.
    #[must_use]
    pub fn scene_bounds(&self) -> BoundingSphere {
        self.scene_bounds
    }

    /// The corners of the parallelogram that a vertex lies on, in order; None if its surface is not one.
    #[must_use]
    pub fn polygon(&self, si: &SurfaceInteraction) -> Option<[DVec3; 4]> {
        self.shapes[si.shape_index].polygon(&si.surface)
    }

    /// The number of the piece of surface that a vertex lies on: the face of a polyhedron, or else the whole shape.
    #[must_use]
    pub fn surface_id(&self, si: &SurfaceInteraction) -> u32 {
        let face = if self.shapes[si.shape_index].is_polyhedron() { u64::from(si.surface.primitive) } else { 0 };
        hash(&[si.shape_index as u64, face]) as u32
    }

    /// Checks that light can be traced from its sources.
    ///
    /// # Errors
    /// If a distant emitter lights an infinite plane, which no finite number of light paths covers.
    pub fn check_emission(&self) -> Result<(), String> {
        let is_distant = self.lights.iter().any(|light| light.emitter.is_distant());
        if is_distant && self.shapes.is_unbounded() {
            return Err("light from infinitely far away falls on an infinite plane; make that a large rectangle".into());
        }
        Ok(())
    }

    /// Whether there is an emitter, with or without power.
    #[must_use]
    pub fn has_lights(&self) -> bool {
        !self.lights.is_empty() || self.has_self_emission
    }

    /// Whether an emitter has power or a material emits radiance.
    #[must_use]
    pub fn shines(&self) -> bool {
        // A ball of any size, for there may be nothing of finite size to shine on.
        let target = EmissionTarget {
            sphere: BoundingSphere { centre: DVec3::ZERO, radius: 1.0 },
            before: 1.0,
            is_aimed: false,
        };
        let shines = |light: &Light| light.emitter.power(self.shape_of(light), &target) != Rgb::ZERO;
        self.has_self_emission || self.lights.iter().any(shines)
    }

    /// The luminance of the power in W that all emitters send into the scene together.
    #[must_use]
    pub fn power(&self) -> f64 {
        self.power
    }

    /// Warnings for the user, such as triangles without area that were left out.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    fn shape_of(&self, light: &Light) -> Option<&Shape> {
        light.part.map(|part| &self.shapes[part])
    }

    /// Notes what the lights' powers are.
    fn weigh_lights(mut self) -> Self {
        let target = EmissionTarget { sphere: self.scene_bounds, before: self.scene_bounds.radius, is_aimed: false };
        let power = |light: &Light| luminance(light.emitter.power(self.shape_of(light), &target));
        let powers = Distribution1D::new(self.lights.iter().map(power).collect::<Vec<_>>());
        self.power = powers.total();
        self.light_powers = powers.normalized();
        self
    }
}
