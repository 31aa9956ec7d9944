//! From a scene file to a scene that rays can meet.

mod build;
mod medium;

use glam::{DVec2, DVec3};

use crate::{
    bsdf::{Bsdf, Model as _, Query, Transport},
    emitter::{Emitter, Incident, Model as _},
    math::{PerSolidAngle, Ray, Rgb},
    sensor::{Model as _, Sensor},
    shape::{Model as _, Shape, Shapes, Surface},
};

/// Everything that light meets, and the sensor that looks at it.
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
    sky: Option<usize>,
    /// Whether any material shows radiance by itself.
    glows: bool,
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

/// A point of the scene that a ray met.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// The ray's parameter.
    pub t: f64,
    /// The point of the surface.
    pub surface: Surface,
    /// The unit direction back along the ray.
    pub back: DVec3,
    /// The number of the shape, in document order.
    pub part: usize,
}

impl Scene {
    /// The first point that a ray meets.
    #[inline]
    #[must_use]
    pub fn intersect(&self, ray: &Ray) -> Option<Vertex> {
        let (part, hit) = self.shapes.intersect(ray)?;
        let surface = self.shapes[part].surface(ray, &hit);
        Some(Vertex { t: hit.t, surface, back: -ray.direction.normalize(), part })
    }

    /// Whether anything stands in the way of a ray.
    #[inline]
    #[must_use]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.shapes.occlude(ray)
    }

    /// Whether a vertex that the sensor sees lies on an edge of a mesh, as seen in lines one pixel wide.
    #[must_use]
    pub fn is_on_edge(&self, vertex: &Vertex) -> bool {
        let distance = self.shapes[vertex.part].edge_distance(&vertex.surface);
        distance.is_some_and(|distance| distance <= 0.5 * self.sensor.camera.footprint(vertex.surface.p))
    }

    /// What gets through to the end of a ray from a vertex past surfaces that are transparent, without being bent, and
    /// whether there is any such surface.
    #[inline(never)]
    #[must_use]
    pub fn straight_transmittance(&self, from: &Vertex, ray: &Ray) -> (Rgb, bool) {
        let mut rest = *ray;
        let mut last = Vertex { t: 0.0, ..*from };
        let mut share = Rgb::ONE;
        let mut is_crossed = false;
        while let Some(vertex) = self.intersect(&rest) {
            let wi = vertex.surface.shading.to_local(vertex.back);
            let query = Query { wi, uv: vertex.surface.uv, transport: Transport::Radiance };
            let Some(transmittance) = self.bsdf(&vertex).straight_transmittance(&query) else {
                return (Rgb::ZERO, is_crossed);
            };
            share *= transmittance * self.transmittance_beyond(&last, ray, Some(&vertex));
            is_crossed = true;
            rest.t_min = vertex.t + Ray::leaving_distance(vertex.surface.p) / ray.direction.length();
            last = vertex;
        }
        (share * self.transmittance_beyond(&last, ray, None), is_crossed)
    }

    /// The material at a vertex.
    #[must_use]
    pub fn bsdf(&self, vertex: &Vertex) -> &Bsdf {
        let leaf = self.parts[vertex.part].first_material + vertex.surface.leaf as usize;
        &self.bsdfs[self.materials[leaf]]
    }

    /// The radiance that a vertex emits back along the ray that met it.
    #[inline]
    #[must_use]
    pub fn emitted(&self, vertex: &Vertex) -> Rgb {
        match self.parts[vertex.part].light {
            Some(light) => self.lights[light].emitter.surface_radiance(&vertex.surface, vertex.back),
            None => Rgb::ZERO,
        }
    }

    /// Whether any material shows radiance by itself.
    #[inline]
    #[must_use]
    pub fn glows(&self) -> bool {
        self.glows
    }

    /// The radiance that the material at a vertex shows by itself.
    #[must_use]
    pub fn glow(&self, vertex: &Vertex) -> Rgb {
        let is_front = vertex.surface.shading.n.dot(vertex.back) > 0.0;
        self.bsdf(vertex).glow(&vertex.surface, is_front)
    }

    /// Whether a vertex lies on a light.
    #[must_use]
    pub fn is_light(&self, vertex: &Vertex) -> bool {
        self.parts[vertex.part].light.is_some()
    }

    /// The radiance that a ray which meets nothing brings.
    #[must_use]
    pub fn sky(&self, direction: DVec3) -> Rgb {
        self.sky.map_or(Rgb::ZERO, |sky| self.lights[sky].emitter.sky_radiance(direction))
    }

    /// Draws a light, each with the same chance, and a direction to it; the value is divided by that chance for a
    /// light of a single direction, and the density multiplied by it for others.
    #[inline]
    #[must_use]
    pub fn sample_light(&self, from: DVec3, u: DVec2) -> Option<Incident> {
        let count = self.lights.len();
        if count == 0 {
            return None;
        }
        let scaled = u.x * count as f64;
        let index = (scaled as usize).min(count - 1);
        let light = &self.lights[index];
        let rest = DVec2::new(scaled - index as f64, u.y);
        let mut incident = light.emitter.sample_towards(self.shape_of(light), from, rest)?;
        match &mut incident.density {
            Some(density) => density.0 /= count as f64,
            None => incident.value *= count as f64,
        }
        Some(incident)
    }

    /// The density with which [`Scene::sample_light`] draws the direction to a vertex, or to the sky.
    #[inline]
    #[must_use]
    pub fn light_density(&self, from: DVec3, vertex: Option<&Vertex>) -> PerSolidAngle {
        let index = match vertex {
            Some(vertex) => self.parts[vertex.part].light,
            None => self.sky,
        };
        let density = index.map_or(0.0, |index| {
            let light = &self.lights[index];
            light.emitter.density_towards(self.shape_of(light), from, vertex.map(|v| &v.surface)).0
        });
        PerSolidAngle(density / self.lights.len().max(1) as f64)
    }

    /// Whether anything shines.
    #[must_use]
    pub fn has_lights(&self) -> bool {
        !self.lights.is_empty() || self.glows
    }

    /// What a careful user would want to know: dropped triangles.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    fn shape_of(&self, light: &Light) -> Option<&Shape> {
        light.part.map(|part| &self.shapes[part])
    }
}
