//! Renders a scene with an integrator to a film, tile by tile on all threads. The bits do not depend on the number of
//! threads.

pub mod checkpoint;
pub mod drive;
pub mod reach;

use std::{ops::Range, time::Duration};

use rayon::prelude::*;

use crate::{
    film::{Film, Frame, LayerSpec, Pixels, Splats, splats},
    integrator::{
        CameraRay, Estimator, Integrator, IntegratorModel as _, IntegratorState, Iteration, IterationPlan, Notes,
        Overrides, SampleOutput,
    },
    math::Rgb,
    photon::radius::PassCounts,
    sampler::{Address, SampleStream as _, SamplerModel as _},
    scene::Scene,
    scene_file::{Document, SceneError},
    sensor::SensorModel as _,
};

/// A scene with the integrator that renders it. An image is a function of the two and of a [`Replicate`], to the last
/// bit, on any number of threads: it uses the threads of the current rayon pool.
#[derive(Debug)]
pub struct Renderer {
    /// The scene.
    pub scene: Scene,
    /// The integrator.
    pub integrator: Integrator,
    /// The time after which a render ends, if the scene sets one.
    pub timeout: Option<Duration>,
}

/// The address of one estimate of the whole image, and its number of samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Replicate {
    /// The user's seed.
    pub seed: u64,
    /// The number of the estimate: replicates of one seed with different numbers are independent of each other.
    pub number: u64,
    /// The number of samples of each pixel; for `sppm`, the number of passes.
    pub samples: u32,
}

/// The edge of a tile in pixels: small enough that the threads finish together.
const TILE: u32 = 8;
/// The number of splats that a thread collects before it adds them to the film that all threads share.
const SPLATS_AT_ONCE: usize = 4096;

impl Renderer {
    /// Builds the scene and the integrator of a document.
    ///
    /// # Errors
    /// All faults of the scene and of the integrator: unknown plugins and parameters, wrong types and ranges, files
    /// that cannot be read. Also if the integrator cannot render the scene.
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
            let what = format!("the integrator \"{}\" cannot render this scene: {why}", integrator.plugin().name);
            SceneError::at(&document.object(document.root).place, what)
        })?;
        let timeout = Integrator::timeout(document, overrides)?;
        Ok(Self { scene, integrator, timeout })
    }

    /// Warnings for the user, such as triangles that were left out, or a scene without light; one line each.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = self.scene.warnings().to_vec();
        if !self.scene.emits_light() && self.integrator.needs_light() {
            let what =
                if self.scene.has_emitters() { "the scene's lights have no power" } else { "the scene has no light" };
            warnings.push(format!("{what}: the image will be black"));
        }
        // Light paths start at emitters only, and self-emission is not one.
        if self.scene.has_self_emission() && (self.integrator.traces_light() || !self.integrator.has_variance()) {
            let what =
                "surfaces with self-emission (the bsdf normals, ambient of phong) are visible, but emit no photons";
            warnings.push(format!("{what}: some of their light is missing"));
        }
        if self.integrator.traces_light() && !self.scene.has_smooth() {
            let what = "every surface is specular, so that no light path can be connected to the sensor";
            warnings.push(format!("{what}: only directly visible emitters appear"));
        }
        warnings
    }

    /// The number of samples of each pixel that the scene sets.
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

    /// Begins a replicate.
    #[must_use]
    pub fn begin(&self, replicate: Replicate) -> Rendering<'_> {
        self.resume(replicate, 0, self.film(), IntegratorState::Empty)
    }

    /// Continues a replicate with the sample `next`, from what the samples before left: the film, and
    /// [`Rendering::state`]. Shards of a replicate begin at any sample, with an empty film.
    #[must_use]
    pub fn resume(&self, replicate: Replicate, next: u32, film: Film, state: IntegratorState) -> Rendering<'_> {
        let mut rendering = Rendering { renderer: self, replicate, next, film, state, estimator: None };
        if !self.integrator.iterations().is_per_sample() {
            rendering.begin_iteration(0);
        }
        rendering
    }

    /// Renders one replicate. `progress` receives the numbers of samples that have been added, from any thread.
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

/// A replicate while it is rendered. Its samples are a function of the scene, the integrator, the replicate and the
/// state, whenever it is stopped, stored and resumed.
#[derive(Debug)]
pub struct Rendering<'r> {
    renderer: &'r Renderer,
    replicate: Replicate,
    /// The number of the next sample of each pixel.
    next: u32,
    film: Film,
    /// What the next iteration depends on.
    state: IntegratorState,
    /// The estimator of the current iteration; None before the first.
    estimator: Option<Box<dyn Estimator + 'r>>,
}

impl Rendering<'_> {
    /// Statistics of the current iteration.
    #[must_use]
    pub fn notes(&self) -> Notes {
        self.estimator.as_ref().map(|estimator| estimator.notes()).unwrap_or_default()
    }

    /// The film so far.
    #[must_use]
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// The film at the end.
    #[must_use]
    pub fn into_film(self) -> Film {
        self.film
    }

    /// The number of the next sample of each pixel.
    #[must_use]
    pub fn next(&self) -> u32 {
        self.next
    }

    /// The state that later samples depend on, besides the replicate.
    #[must_use]
    pub fn state(&self) -> &IntegratorState {
        &self.state
    }

    /// Continues with a later or earlier sample. The iterations of the integrator must be independent.
    ///
    /// # Panics
    /// If the iterations depend on each other.
    pub fn go_to(&mut self, sample: u32) {
        let is_chained = self.renderer.integrator.iterations() == IterationPlan::Chained;
        assert!(sample == self.next || !is_chained, "sample {sample} follows from those after {}", self.next);
        self.next = sample;
    }

    /// Renders more samples of each pixel, but none beyond the replicate. `progress` receives the numbers of samples
    /// that have been added, from any thread.
    pub fn advance(&mut self, samples: u32, progress: &(dyn Fn(u64) + Sync)) {
        let end = self.replicate.samples.min(self.next.saturating_add(samples));
        if !self.renderer.integrator.iterations().is_per_sample() {
            self.add_samples(self.next..end, progress);
            return;
        }
        while self.next < end {
            self.begin_iteration(self.next);
            self.add_samples(self.next..self.next + 1, progress);
        }
    }

    /// Begins the iteration of a sample: photon mappers emit their photons.
    fn begin_iteration(&mut self, sample: u32) {
        let Renderer { scene, integrator, .. } = self.renderer;
        let iteration = Iteration { seed: self.replicate.seed, replicate: self.replicate.number, sample };
        self.estimator = Some(integrator.begin(scene, &iteration, &self.state));
    }

    fn add_samples(&mut self, samples: Range<u32>, progress: &(dyn Fn(u64) + Sync)) {
        let crop = self.film.crop;
        let tiles: Vec<(u32, u32)> = (0..crop.height.div_ceil(TILE))
            .flat_map(|y| (0..crop.width.div_ceil(TILE)).map(move |x| (x * TILE, y * TILE)))
            .collect();
        let splats = self.renderer.integrator.traces_light().then(|| Splats::new(crop.width, crop.height));
        let is_chained = self.renderer.integrator.iterations() == IterationPlan::Chained;
        let pixels = if is_chained { crop.width as usize * crop.height as usize } else { 0 };
        let mut found = vec![PassCounts::default(); pixels];
        // One strip of tiles at a time bounds the memory of finished tiles.
        for strip in tiles.chunks(4096) {
            let finished: Vec<_> = strip
                .par_iter()
                .map(|&(x, y)| {
                    let (width, height) = (TILE.min(crop.width - x), TILE.min(crop.height - y));
                    let tile = self.tile((x, y), (width, height), &samples, splats.as_ref());
                    progress(u64::from(width * height) * samples.len() as u64);
                    tile
                })
                .collect();
            for (&(x, y), tile) in strip.iter().zip(&finished) {
                self.film.add(x, y, &tile.pixels);
                for &((x, y), photons) in &tile.photons {
                    found[y as usize * crop.width as usize + x as usize] = photons;
                }
            }
        }
        if let Some(splats) = splats {
            let paths = u64::from(crop.width) * u64::from(crop.height) * samples.len() as u64;
            self.film.add_splats(&splats.finish(paths));
        }
        if let Some(estimator) = &self.estimator {
            self.state = estimator.next_state(&found);
        }
        self.next = samples.end;
    }

    fn tile(&self, corner: (u32, u32), size: (u32, u32), samples: &Range<u32>, splats: Option<&Splats>) -> Tile {
        let stride = self.film.stride();
        let is_chained = self.renderer.integrator.iterations() == IterationPlan::Chained;
        let mut tile = Tile { pixels: Pixels::new(size.0, size.1, stride), photons: Vec::new() };
        let mut values = vec![0.0; stride];
        let mut path = splats::Path::default();
        let mut left = Vec::new();
        for (x, y) in (0..size.1).flat_map(|y| (0..size.0).map(move |x| (x, y))) {
            let pixel = (corner.0 + x, corner.1 + y);
            for sample in samples.clone() {
                let (_, photons) = self.one_sample(pixel, sample, &mut values, &mut path);
                tile.pixels.push(x, y, &values);
                if is_chained {
                    tile.photons.push((pixel, photons));
                }
                path.drain_into(&mut left);
                if let Some(splats) = splats
                    && left.len() >= SPLATS_AT_ONCE
                {
                    splats.add(&mut left);
                }
            }
        }
        if let Some(splats) = splats {
            splats.add(&mut left);
        }
        tile
    }

    /// Takes one sample of one pixel, in the iteration that it belongs to. `values` has one element for each sampled
    /// channel. The splats of the light path are added to `path`.
    ///
    /// # Panics
    /// As [`Renderer::render`] does.
    pub fn sample(&mut self, pixel: (u32, u32), sample: u32, values: &mut [f64], path: &mut splats::Path) -> Rgb {
        match self.renderer.integrator.iterations() {
            IterationPlan::Independent | IterationPlan::PerReplicate => {}
            IterationPlan::PerSample => self.begin_iteration(sample),
            IterationPlan::Chained => {
                self.advance(sample.saturating_sub(self.next), &|_| {});
                self.begin_iteration(sample);
            }
        }
        self.one_sample(pixel, sample, values, path).0
    }

    /// Writes the values of a sample, and returns the photons that it found.
    #[inline]
    fn one_sample(
        &self,
        (x, y): (u32, u32),
        sample: u32,
        values: &mut [f64],
        path: &mut splats::Path,
    ) -> (Rgb, PassCounts) {
        let (sensor, replicate) = (&self.renderer.scene.sensor, self.replicate);
        let estimator = self.estimator.as_ref().expect("an iteration has begun");
        let crop = sensor.film.rendered();
        // Pixels are numbered on the whole film, so that a crop shows the same samples.
        let pixel = u64::from(crop.y + y) * sensor.film.size().x as u64 + u64::from(crop.x + x);
        let address =
            Address { seed: replicate.seed, replicate: replicate.number, pixel, sample, samples: replicate.samples };

        // The camera's ray.
        let mut sampler = sensor.sampler.path_sampler(&address);
        let position = sensor.film.sample(x, y, sampler.next_2d());
        let ray = sensor.camera.ray(position, sampler.next_2d());
        let camera_ray = CameraRay { ray, pixel: y as usize * crop.width as usize + x as usize };

        // The camera path.
        values.fill(0.0);
        let (beauty, layers) = values.split_at_mut(3);
        let mut output = SampleOutput::new(layers);
        let radiance = estimator.radiance(&camera_ray, &mut sampler, &mut output);
        assert!(radiance.is_finite(), "the radiance is {radiance} at {address:?}");
        radiance.write_to_slice(beauty);

        // The light path.
        let photons = output.photons;
        estimator.light_path(&mut sampler, path);
        assert!(path.is_finite(), "a path from a light is not finite at {address:?}");
        (radiance, photons)
    }
}

/// The samples of the pixels of a tile.
struct Tile {
    pixels: Pixels,
    /// The photons that the sample of each pixel found, if the next iteration depends on them.
    photons: Vec<((u32, u32), PassCounts)>,
}
