mod guide;
mod maps;
mod settings;

use std::sync::Arc;

use guide::Guide;
use maps::Maps;
use settings::{Direct, PARAMS, Settings};

use super::{Model, Notes, first_vertex};
use crate::{
    bsdf::{Lobe, Model as _, Sample},
    film::LayerSpec,
    math::{PerSolidAngle, Ray, Rgb},
    node::{Category, Described, Params, Plugin, SceneError},
    photon::{Lookup, Map, Photon, Shade, Site},
    sampler::{Numbers as _, PathNumbers},
    scene::{Scene, Vertex},
    transport::{FromEye, Junction, PathClass, power_heuristic, survival},
};

/// Jensen's photon mapping in two passes. The first emits photons: some for a *global* map of all light on surfaces that
/// scatter over more than single directions, `L(S|D)*D`, others, aimed at mirrors and glass, for a map of *caustics*,
/// `LS+D`. The second follows paths from the camera through mirrors and glass, by chance where there is a choice, and
/// finds what the first other surface shows in three parts. So the image has four layers, which add up to it:
///
/// | layer | paths | found |
/// |---|---|---|
/// | `direct` | `LE`, `LDE` | by connections with lights, and by the rays of gathering that meet a light, weighted by the power heuristic; or from the global map; or like the first, but asking shadow photons before a ray is traced |
/// | `specular` | `L(S\|D)*SE` | the other three, seen in a mirror or through glass |
/// | `caustic` | `LS+DE` | from the caustic map alone |
/// | `indirect` | `L(S\|D)*DS*DE` | by final gathering: rays that go on through mirrors and glass up to a surface that the global map tells the light of; or from the global map alone |
///
/// Each path belongs to one part alone. A surface that is not there (`null`) counts as `S`.
///
/// Estimates are biased: they are means over discs. With `lookup_size` k the disc is that of the k nearest photons, and
/// the k - 1 within it count, up to the greatest radius; with 0 it is always that radius. Photons count only on their own
/// side of their own shape, and near the border of a rectangle or of a cube's face the disc is what lies within it; other
/// shapes look dark within a radius of their border. In Mitsuba 0.6 the numbers of photons are those that are stored;
/// here they are those that are emitted, which powers are divided by.
///
/// Within an image the samples of a pixel share their photons, and so do all pixels: there are no variances.
///
/// Jensen 2001, *Realistic Image Synthesis Using Photon Mapping*, chapters 5 to 9.
#[derive(Clone, Debug)]
pub struct PhotonMapper {
    settings: Settings,
    /// The maps of a pass.
    maps: Option<Arc<Maps>>,
}

impl Described for PhotonMapper {
    const PLUGIN: Plugin = Plugin {
        category: Category::Integrator,
        name: "photonmapper",
        summary: "Photon mapping in two passes, with a map of its own for caustics.",
        params: PARAMS,
        examples: &[
            r#"<integrator type="photonmapper"><integer name="max_depth" value="8"/></integrator>"#,
            r#"<integrator type="photonmapper"><string name="direct" value="map"/><string name="indirect" value="map"/>
                <integer name="global_photons" value="100000"/><integer name="lookup_size" value="0"/>
                <float name="global_lookup_radius" value="0.1"/></integrator>"#,
        ],
        evidence: &["photon-map/*", "caustic/*"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self { settings: Settings::read(params)?, maps: None })
    }
}

/// The four parts of what a path shows.
#[derive(Default)]
struct Parts([Rgb; 4]);

impl Parts {
    fn add(&mut self, class: PathClass, light: Rgb) {
        self.0[class as usize] += light;
    }
}

impl Model for PhotonMapper {
    fn layers(&self) -> Vec<LayerSpec> {
        let parts = PathClass::ALL.iter().map(|class| class.name());
        parts.chain(self.settings.shows_raw.then_some("raw")).map(LayerSpec::sampled).collect()
    }

    fn check(&self, scene: &Scene) -> Result<(), String> {
        if !scene.has_smooth() {
            return Err("no surface can keep a photon, for all scatter into single directions".into());
        }
        scene.check_emission()
    }

    fn prepared(&self, scene: &Scene, seed: u64, pass: u64) -> Option<Self> {
        let maps = Maps::new(scene, &self.settings, seed, pass);
        Some(Self { settings: self.settings.clone(), maps: Some(Arc::new(maps)) })
    }

    fn notes(&self) -> Notes {
        self.maps.as_ref().map(|maps| maps.notes()).unwrap_or_default()
    }

    fn has_variance(&self) -> bool {
        false
    }

    fn radiance(&self, scene: &Scene, ray: &Ray, numbers: &mut PathNumbers, layers: &mut [f64]) -> Rgb {
        let maps = self.maps.as_ref().expect("photons are emitted before the pass");
        let eye = Eye { scene, settings: &self.settings, maps };
        let mut parts = Parts::default();
        let raw = eye.look(ray, numbers, &mut parts);
        let shown = parts.0.iter().chain(self.settings.shows_raw.then_some(&raw));
        for (layer, light) in layers.chunks_exact_mut(3).zip(shown) {
            light.write_to_slice(layer);
        }
        parts.0.iter().sum()
    }
}

/// The second pass.
struct Eye<'s> {
    scene: &'s Scene,
    settings: &'s Settings,
    maps: &'s Maps,
}

/// A direction to gather from.
struct Draw {
    sample: Sample,
    /// What the density of the direction is, whichever way it was drawn.
    density: PerSolidAngle,
}

impl Eye<'_> {
    /// Follows a camera's ray and adds what it shows; returns what the global map shows of the first surface.
    fn look(&self, ray: &Ray, numbers: &mut PathNumbers, parts: &mut Parts) -> Rgb {
        let (scene, depths) = (self.scene, self.settings.depths);
        let mut raw = Rgb::ZERO;
        if depths.max == 0 {
            return raw;
        }
        let mut met = first_vertex(scene, ray, self.settings.hide_emitters);
        let mut direction = ray.direction;
        let (mut throughput, mut eta, mut state) = (Rgb::ONE, 1.0, FromEye::START);
        for depth in 1.. {
            // Lights are seen from the camera, and in mirrors and glass.
            let is_hidden = depth == 1 && self.settings.hide_emitters;
            let seen = if is_hidden { Rgb::ZERO } else { self.shining(met.as_ref(), direction) };
            let Some(vertex) = met else {
                parts.add(state.at_light(), throughput * seen);
                break;
            };
            parts.add(state.at_light(), throughput * (seen + scene.glow(&vertex)));
            if depth >= depths.max {
                break;
            }
            let junction = Junction::new(scene, vertex);
            if depth == 1 && self.settings.shows_raw {
                raw = self.estimate(&self.maps.global, &self.maps.global_lookup, &junction, |_| true);
            }
            let mut found = Parts::default();
            let further = self.part(&junction, depth, numbers, &mut found);
            for class in PathClass::ALL {
                let shown = if state == FromEye::START { class } else { PathClass::Specular };
                parts.add(shown, throughput * found.0[class as usize]);
            }

            // Go on through mirrors and glass.
            let Some(sample) = further else { break };
            throughput *= sample.weight;
            eta *= sample.eta;
            if throughput == Rgb::ZERO || !self.survives(depth, &mut throughput, eta, numbers) {
                break;
            }
            state = state.scattered(sample.lobe);
            direction = vertex.surface.shading.to_world(sample.wo);
            met = scene.intersect(&Ray::leaving(junction.p(), direction));
        }
        raw
    }

    /// The radiance of a light that a ray meets, be it the sky.
    fn shining(&self, met: Option<&Vertex>, direction: glam::DVec3) -> Rgb {
        met.map_or_else(|| self.scene.sky(direction), |vertex| self.scene.emitted(vertex))
    }

    fn survives(&self, depth: u32, throughput: &mut Rgb, eta: f64, numbers: &mut PathNumbers) -> bool {
        if depth < self.settings.depths.roulette {
            return true;
        }
        let survival = survival(*throughput, eta);
        let survives = numbers.next_1d() < survival;
        *throughput /= survival;
        survives
    }

    /// Adds the parts of the light that a vertex shows apart from single directions, and returns one of those to go on in.
    fn part(
        &self,
        junction: &Junction<'_>,
        depth: u32,
        numbers: &mut PathNumbers,
        found: &mut Parts,
    ) -> Option<Sample> {
        if !junction.bsdf.is_smooth() {
            return junction.bsdf.sample(&junction.query, numbers.next_1d(), numbers.next_2d());
        }
        let (maps, settings) = (self.maps, self.settings);
        let left = settings.depths.max.saturating_sub(depth);
        let is_short = |photon: &Photon| photon.depth() <= left;
        found.add(PathClass::Caustic, self.estimate(&maps.caustic, &maps.caustic_lookup, junction, is_short));
        let from_global =
            |class| self.estimate(&maps.global, &maps.global_lookup, junction, |p| is_short(p) && p.class() == class);
        if settings.direct == Direct::Map {
            found.add(PathClass::Direct, from_global(PathClass::Direct));
        }
        if settings.gather.is_none() {
            found.add(PathClass::Indirect, from_global(PathClass::Indirect));
        }
        self.gather(junction, depth, numbers, found)
    }

    /// Connects with a light, and sends out rays for the direct light that connections are bad at, and for indirect light.
    fn gather(
        &self,
        junction: &Junction<'_>,
        depth: u32,
        numbers: &mut PathNumbers,
        found: &mut Parts,
    ) -> Option<Sample> {
        let settings = self.settings;
        // Without gathering, rays are only there to meet lights.
        let meets_lights =
            settings.direct != Direct::Map && (settings.gather.is_some() || settings.direct == Direct::Traced);
        let rays = settings.gather.unwrap_or(u32::from(meets_lights));
        let guide = self.guide(junction);
        if settings.direct != Direct::Map {
            let shares = [1.0, if meets_lights { f64::from(rays) } else { 0.0 }];
            found.add(PathClass::Direct, self.connect(junction, guide.as_ref(), shares, numbers));
        }
        let mut further = None;
        for number in 0..rays.max(u32::from(junction.bsdf.has_delta())) {
            let Some(Draw { mut sample, density }) = draw(junction, guide.as_ref(), numbers) else { continue };
            if sample.lobe != Lobe::Smooth {
                if number == 0 {
                    further = Some(sample);
                }
                continue;
            }
            if rays == 0 {
                continue;
            }
            sample.weight /= f64::from(rays);
            let weight =
                |by_light: PerSolidAngle| power_heuristic(PerSolidAngle(f64::from(rays) * density.0), by_light);
            self.follow(junction, &sample, depth + 1, meets_lights.then_some(&weight), numbers, found);
        }
        further
    }

    fn guide(&self, junction: &Junction<'_>) -> Option<Guide> {
        if !self.settings.is_guided || self.settings.gather.is_none() || junction.bsdf.has_delta() {
            return None;
        }
        let site = Site::new(self.scene, &junction.vertex);
        Guide::new(&self.maps.global, &self.maps.global_lookup, &site, junction)
    }

    /// Next event estimation, as one of two strategies with so many samples.
    fn connect(
        &self,
        junction: &Junction<'_>,
        guide: Option<&Guide>,
        shares: [f64; 2],
        numbers: &mut PathNumbers,
    ) -> Rgb {
        let Some(connection) = junction.propose(self.scene, numbers) else { return Rgb::ZERO };
        if !self.is_seen(junction, connection.light, &connection.incident.shadow_ray) {
            return Rgb::ZERO;
        }
        let Some(density) = connection.incident.density else { return connection.scattered };
        let other = PerSolidAngle(shares[1] * density_of(junction, guide, connection.wo).0);
        connection.scattered * (power_heuristic(PerSolidAngle(shares[0] * density.0), other) / density.0)
    }

    /// Whether nothing stands between a vertex and a light, by the word of shadow photons where they are of one mind.
    fn is_seen(&self, junction: &Junction<'_>, light: usize, shadow_ray: &Ray) -> bool {
        let Some(shadow) = &self.maps.shadow else { return !self.scene.occluded(shadow_ray) };
        let shade = shadow.shade(&Site::new(self.scene, &junction.vertex), light);
        self.maps.shadow_rays.count(shade != Shade::Unknown);
        match shade {
            Shade::Lit => true,
            Shade::Dark => false,
            Shade::Unknown => !self.scene.occluded(shadow_ray),
        }
    }

    /// Follows a ray of gathering. `weight` tells the weight of lights that it meets; without, they are found otherwise.
    fn follow(
        &self,
        junction: &Junction<'_>,
        sample: &Sample,
        depth: u32,
        weight: Option<&dyn Fn(PerSolidAngle) -> f64>,
        numbers: &mut PathNumbers,
        found: &mut Parts,
    ) {
        let scene = self.scene;
        let mut direction = junction.vertex.surface.shading.to_world(sample.wo);
        let mut met = scene.intersect(&Ray::leaving(junction.p(), direction));
        if let Some(weight) = weight {
            let weight = weight(scene.light_density(junction.p(), met.as_ref()));
            found.add(PathClass::Direct, weight * sample.weight * self.shining(met.as_ref(), direction));
        }
        let (mut throughput, mut eta) = (sample.weight, 1.0);
        let mut state = FromEye::START.scattered(Lobe::Smooth);
        for depth in depth.. {
            let Some(vertex) = met else { return };
            found.add(state.at_light(), throughput * scene.glow(&vertex));
            if self.settings.gather.is_none() || depth >= self.settings.depths.max {
                return;
            }
            let next = Junction::new(scene, vertex);
            if next.bsdf.is_smooth() {
                let left = self.settings.depths.max.saturating_sub(depth);
                let light =
                    self.estimate(&self.maps.global, &self.maps.global_lookup, &next, |photon| photon.depth() <= left);
                found.add(PathClass::Indirect, throughput * light);
            }
            if !next.bsdf.has_delta() {
                return;
            }
            let drawn = next.bsdf.sample(&next.query, numbers.next_1d(), numbers.next_2d());
            let Some(sample) = drawn.filter(|sample| sample.lobe != Lobe::Smooth) else { return };
            throughput *= sample.weight;
            eta *= sample.eta;
            if throughput == Rgb::ZERO || !self.survives(depth, &mut throughput, eta, numbers) {
                return;
            }
            state = state.scattered(sample.lobe);
            direction = vertex.surface.shading.to_world(sample.wo);
            met = scene.intersect(&Ray::leaving(next.p(), direction));
        }
    }

    /// The radiance that the photons of a map around a vertex send back along the path, of those that are accepted.
    fn estimate(&self, map: &Map, lookup: &Lookup, junction: &Junction<'_>, accepts: impl Fn(&Photon) -> bool) -> Rgb {
        if map.is_empty() || !junction.bsdf.is_smooth() {
            return Rgb::ZERO;
        }
        let site = Site::new(self.scene, &junction.vertex);
        let shading = &junction.vertex.surface.shading;
        let mut radiance = Rgb::ZERO;
        map.gather(&site, lookup, |photon, density| {
            if !accepts(photon) {
                return;
            }
            let direction = photon.direction();
            let scattered = junction.bsdf.eval_cos(&junction.query, shading.to_local(direction));
            // Photons are counted per area: the true surface's cosine is in their density already.
            let cos = direction.dot(site.n);
            if cos > 0.0 {
                radiance += scattered * photon.power() * (density / cos);
            }
        });
        radiance
    }
}

/// Draws a direction from the BSDF or, every other time, from the guide.
fn draw(junction: &Junction<'_>, guide: Option<&Guide>, numbers: &mut PathNumbers) -> Option<Draw> {
    let (u1, u2) = (numbers.next_1d(), numbers.next_2d());
    let Some(guide) = guide else {
        let sample = junction.bsdf.sample(&junction.query, u1, u2)?;
        return Some(Draw { sample, density: sample.density });
    };
    let wo = if u1 < 0.5 { guide.sample(u2) } else { junction.bsdf.sample(&junction.query, 2.0 * u1 - 1.0, u2)?.wo };
    let density = density_of(junction, Some(guide), wo);
    let scattered = junction.bsdf.eval_cos(&junction.query, wo);
    if scattered == Rgb::ZERO || density.0 == 0.0 {
        return None;
    }
    let sample = Sample { wo, weight: scattered / density.0, density, lobe: Lobe::Smooth, eta: 1.0 };
    Some(Draw { sample, density })
}

/// The density with which [`draw`] draws a direction, without single ones.
fn density_of(junction: &Junction<'_>, guide: Option<&Guide>, wo: glam::DVec3) -> PerSolidAngle {
    let by_bsdf = junction.bsdf.density(&junction.query, wo);
    // Balance heuristic for one sample, Veach 1997, eq. (9.15).
    guide.map_or(by_bsdf, |guide| PerSolidAngle(0.5 * (by_bsdf.0 + guide.density(wo).0)))
}
