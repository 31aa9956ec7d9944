//! From a scene and an integrator to a film: tiles on all threads, with the same bits however many there are.

pub mod checkpoint;
pub mod drive;
pub mod laws;
pub mod reach;

use std::{borrow::Cow, ops::Range};

use rayon::prelude::*;

use crate::{
    film::{Film, Frame, LayerSpec, Pixels, Splats, splats},
    integrator::{EyeRay, Integrator, IntegratorModel as _, Iteration, Notes, Overrides, Preprocess},
    math::Rgb,
    sampler::{Address, SampleStream as _, SamplerModel as _},
    scene::Scene,
    scene_file::{Document, SceneError},
    sensor::SensorModel as _,
};

/// A scene with the integrator that renders it.
#[derive(Debug)]
pub struct Renderer {
    /// What is rendered.
    pub scene: Scene,
    /// How it is rendered.
    pub integrator: Integrator,
}

/// One estimate of the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Replicate {
    /// The user's seed.
    pub seed: u64,
    /// Which estimate: passes of one seed are independent of one another.
    pub number: u64,
    /// Samples per pixel.
    pub samples: u32,
}

/// The edge of a tile in pixels: small enough that the threads finish together.
const TILE: u32 = 8;
/// So many splats are gathered before they go to the film that all threads share.
const SPLATS_AT_ONCE: usize = 4096;

impl Renderer {
    /// Builds what a document describes.
    ///
    /// # Errors
    /// All that is wrong with the scene or its integrator, or that the one cannot treat the other.
    pub fn new(document: &Document, overrides: &Overrides) -> Result<Self, SceneError> {
        let (scene, integrator) = match (Scene::build(document), Integrator::of_scene(document, overrides)) {
            (Ok(scene), Ok(integrator)) => (scene, integrator),
            (Err(scene), Err(integrator)) => {
                let all = SceneError(scene.0.into_iter().chain(integrator.0).collect());
                return Err(all.in_order(&document.files));
            }
            (Err(error), _) | (_, Err(error)) => return Err(error),
        };
        integrator.check(&scene).map_err(|why| {
            let what = format!("the integrator \"{}\" cannot treat this scene: {why}", integrator.plugin().name);
            SceneError::at(&document.object(document.root).place, what)
        })?;
        Ok(Self { scene, integrator })
    }

    /// What a careful user would want to know: dropped triangles, a scene without light.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = self.scene.warnings().to_vec();
        if !self.scene.shines() && self.integrator.needs_light() {
            let what =
                if self.scene.has_lights() { "the scene's lights have no power" } else { "the scene has no light" };
            warnings.push(format!("{what}: the image will be black"));
        }
        // Both follow light from emitters, of which surfaces that glow are none.
        if self.scene.has_self_emission() && (self.integrator.traces_light() || !self.integrator.has_variance()) {
            let what =
                "surfaces that self_emission (the bsdf normals, ambient of phong) are seen, but send out no photons";
            warnings.push(format!("{what}: not all that they light is shown"));
        }
        if self.integrator.traces_light() && !self.scene.has_smooth() {
            let what = "every surface scatters into single directions, in which no light can be traced to the sensor";
            warnings.push(format!("{what}: only lights themselves are seen"));
        }
        warnings
    }

    /// Samples of each pixel that the scene asks for.
    #[must_use]
    pub fn samples(&self) -> u32 {
        self.integrator.samples().unwrap_or(self.scene.sensor.sampler.sample_count())
    }

    /// A film without samples, with the layers of this integrator.
    #[must_use]
    pub fn film(&self) -> Film {
        let format = &self.scene.sensor.film;
        let layers = [LayerSpec::beauty()].into_iter().chain(self.integrator.layers()).collect();
        let film = Film::new(format.rendered(), format.size(), layers);
        if self.integrator.has_variance() { film } else { film.without_variance() }
    }

    /// The film without its sums.
    #[must_use]
    pub fn frame(&self) -> Frame {
        let format = &self.scene.sensor.film;
        let layers = [LayerSpec::beauty()].into_iter().chain(self.integrator.layers()).collect();
        let (crop, size) = (format.rendered(), format.size().to_array());
        Frame { crop, size, layers, has_variance: self.integrator.has_variance() }
    }

    /// Begins a pass.
    #[must_use]
    pub fn begin(&self, replicate: Replicate) -> Rendering<'_> {
        self.resume(replicate, 0, self.film(), Vec::new())
    }

    /// Goes on with a pass after so many samples, from what they left: the film, and what [`Rendering::state`] gave. Shards
    /// of a pass begin at any sample, with an empty film.
    #[must_use]
    pub fn resume(&self, replicate: Replicate, next: u32, film: Film, state: Vec<f64>) -> Rendering<'_> {
        let mut integrator = Cow::Borrowed(&self.integrator);
        if !state.is_empty() {
            integrator.to_mut().restore_state(state);
        }
        let mut rendering = Rendering { renderer: self, integrator, replicate, next, film };
        if self.integrator.preprocess() == Preprocess::Replicate {
            rendering.prepare(0);
        }
        rendering
    }

    /// Renders one pass. `progress` is told how many samples have been added, from any thread.
    ///
    /// # Panics
    /// If a sample is infinite or not a number, which is a bug; the message is its address.
    #[must_use]
    pub fn render(&self, replicate: Replicate, progress: &(dyn Fn(u64) + Sync)) -> Film {
        let mut rendering = self.begin(replicate);
        rendering.advance(replicate.samples, progress);
        rendering.film
    }
}

/// A pass while it is rendered. All that it will be is a function of the pass and of what stands here, whenever it is
/// stopped, kept and resumed.
#[derive(Debug)]
pub struct Rendering<'r> {
    renderer: &'r Renderer,
    /// As it was prepared last.
    integrator: Cow<'r, Integrator>,
    replicate: Replicate,
    /// Which sample of each pixel comes next.
    next: u32,
    film: Film,
}

impl Rendering<'_> {
    /// What happened so far, for whoever watches.
    #[must_use]
    pub fn notes(&self) -> Notes {
        self.integrator.notes()
    }

    /// What has been gathered.
    #[must_use]
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// What has been gathered, at the end.
    #[must_use]
    pub fn into_film(self) -> Film {
        self.film
    }

    /// Which sample of each pixel comes next.
    #[must_use]
    pub fn next(&self) -> u32 {
        self.next
    }

    /// What samples still to come depend on besides the pass; empty if on nothing.
    #[must_use]
    pub fn state(&self) -> Vec<f64> {
        self.integrator.state()
    }

    /// Goes on with a later sample, or an earlier one, of an integrator whose samples do not follow from one another.
    ///
    /// # Panics
    /// If they do.
    pub fn go_to(&mut self, sample: u32) {
        let is_chained = self.integrator.preprocess() == Preprocess::Chain;
        assert!(sample == self.next || !is_chained, "sample {sample} follows from those after {}", self.next);
        self.next = sample;
    }

    /// Renders so many more samples of each pixel, but none beyond the pass. `progress` is told how many samples have been
    /// added, from any thread.
    pub fn advance(&mut self, samples: u32, progress: &(dyn Fn(u64) + Sync)) {
        let end = self.replicate.samples.min(self.next.saturating_add(samples));
        if !self.integrator.preprocess().is_for_each_sample() {
            self.add_samples(self.next..end, progress);
            return;
        }
        while self.next < end {
            self.prepare(self.next);
            self.add_samples(self.next..self.next + 1, progress);
        }
    }

    /// Makes everything ready for a sample of all pixels: photon mappers send out photons.
    fn prepare(&mut self, sample: u32) {
        let iteration = Iteration { seed: self.replicate.seed, replicate: self.replicate.number, sample };
        if let Some(integrator) = self.integrator.prepared(&self.renderer.scene, &iteration) {
            self.integrator = Cow::Owned(integrator);
        }
    }

    fn add_samples(&mut self, samples: Range<u32>, progress: &(dyn Fn(u64) + Sync)) {
        let (crop, stride) = (self.film.crop, self.film.stride());
        let tiles: Vec<(u32, u32)> = (0..crop.height.div_ceil(TILE))
            .flat_map(|y| (0..crop.width.div_ceil(TILE)).map(move |x| (x * TILE, y * TILE)))
            .collect();
        let splats = self.integrator.traces_light().then(|| Splats::new(crop.width, crop.height));
        // A strip of tiles at a time, so that finished tiles do not pile up beside the film.
        for strip in tiles.chunks(4096) {
            let finished: Vec<_> = strip
                .par_iter()
                .map(|&(x, y)| {
                    let (width, height) = (TILE.min(crop.width - x), TILE.min(crop.height - y));
                    let block = self.tile((x, y), (width, height), &samples, stride, splats.as_ref());
                    progress(u64::from(width * height) * samples.len() as u64);
                    block
                })
                .collect();
            for (&(x, y), block) in strip.iter().zip(&finished) {
                self.film.add(x, y, block);
            }
        }
        if let Some(splats) = splats {
            let paths = u64::from(crop.width) * u64::from(crop.height) * samples.len() as u64;
            self.film.add_splats(&splats.finish(paths));
        }
        self.next = samples.end;
    }

    fn tile(
        &self,
        corner: (u32, u32),
        size: (u32, u32),
        samples: &Range<u32>,
        stride: usize,
        splats: Option<&Splats>,
    ) -> Pixels {
        let mut block = Pixels::new(size.0, size.1, stride);
        let mut values = vec![0.0; stride];
        let mut path = splats::Path::default();
        let mut left = Vec::new();
        for y in 0..size.1 {
            for x in 0..size.0 {
                for sample in samples.clone() {
                    self.one_sample((corner.0 + x, corner.1 + y), sample, &mut values, &mut path);
                    block.push(x, y, &values);
                    path.drain_into(&mut left);
                    if let Some(splats) = splats
                        && left.len() >= SPLATS_AT_ONCE
                    {
                        splats.add(&mut left);
                    }
                }
            }
        }
        if let Some(splats) = splats {
            splats.add(&mut left);
        }
        block
    }

    /// One sample of one pixel, for which everything is made ready. `values` has one element for each sampled channel. What
    /// a path from a light leaves on all the film goes into `path`.
    ///
    /// # Panics
    /// As [`Renderer::render`] does.
    pub fn sample(&mut self, pixel: (u32, u32), sample: u32, values: &mut [f64], path: &mut splats::Path) -> Rgb {
        match self.integrator.preprocess() {
            Preprocess::None | Preprocess::Replicate => {}
            Preprocess::Sample => self.prepare(sample),
            Preprocess::Chain => {
                self.advance(sample.saturating_sub(self.next), &|_| {});
                self.prepare(sample);
            }
        }
        self.one_sample(pixel, sample, values, path)
    }

    #[inline]
    fn one_sample(&self, (x, y): (u32, u32), sample: u32, values: &mut [f64], path: &mut splats::Path) -> Rgb {
        let (scene, replicate) = (&self.renderer.scene, self.replicate);
        let sensor = &scene.sensor;
        let crop = sensor.film.rendered();
        // Pixels are numbered on the whole film, so that a crop shows the same samples.
        let pixel = u64::from(crop.y + y) * sensor.film.size().x as u64 + u64::from(crop.x + x);
        let address =
            Address { seed: replicate.seed, replicate: replicate.number, pixel, sample, samples: replicate.samples };
        let mut sampler = sensor.sampler.path_sampler(&address);
        let position = sensor.film.sample(x, y, sampler.next_2d());
        let ray = sensor.camera.ray(position, sampler.next_2d());
        values.fill(0.0);
        let (beauty, layers) = values.split_at_mut(3);
        let eye = EyeRay { ray, pixel: y as usize * crop.width as usize + x as usize };
        let radiance = self.integrator.radiance(scene, &eye, &mut sampler, layers);
        assert!(radiance.is_finite(), "the radiance is {radiance} at {address:?}");
        radiance.write_to_slice(beauty);
        self.integrator.light_path(scene, &mut sampler, path);
        assert!(path.is_finite(), "a path from a light is not finite at {address:?}");
        radiance
    }
}
