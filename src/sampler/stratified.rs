use glam::DVec2;

use super::{Address, Common, PathSampler, SAMPLE_COUNT, SEED, SampleStream, SamplerModel};
use crate::{
    math::rng::{Stream, hash, permute},
    scene_file::{Category, Described, Params, Plugin, SceneError, manual},
};

/// One jittered sample in each stratum, with as many strata as samples and a random order for every pixel and
/// dimension. In two dimensions the strata are the cells of the smallest near-square grid with at least as many cells
/// as samples. The number of samples is not rounded up to a square, unlike in Mitsuba.
#[derive(Clone, Debug)]
pub struct Stratified {
    pub(super) common: Common,
}

impl Described for Stratified {
    const PLUGIN: Plugin = Plugin {
        category: Category::Sampler,
        manual: manual!("stratified.rs": "Stratified"),
        name: "stratified",
        summary: "Stratified sampling: one jittered sample in each stratum.",
        params: &[SAMPLE_COUNT, SEED],
        examples: &[r#"<sampler type="stratified"><integer name="sample_count" value="16"/></sampler>"#],
        evidence: &["sampler/variance", "sampler/dimensions", "reference/aov-still-life"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self { common: Common::read(params)? })
    }
}

impl SamplerModel for Stratified {
    fn sample_count(&self) -> u32 {
        self.common.sample_count
    }

    fn seed(&self) -> u64 {
        self.common.seed
    }

    fn path_sampler(&self, address: &Address) -> PathSampler {
        let columns = f64::from(address.samples).sqrt().ceil() as u32;
        PathSampler::Stratified(Strata {
            jitter: Stream::at(&address.of_sample()),
            order: hash(&address.of_pixel()),
            sample: address.sample,
            samples: address.samples,
            columns,
            rows: address.samples.div_ceil(columns),
            dimension: 0,
        })
    }
}

/// The random numbers of one path.
#[derive(Clone, Debug)]
pub struct Strata {
    jitter: Stream,
    order: u64,
    sample: u32,
    samples: u32,
    columns: u32,
    rows: u32,
    dimension: u64,
}

impl Strata {
    /// The stratum of this sample in the next dimension, out of `strata`.
    fn stratum(&mut self, strata: u32) -> u32 {
        self.dimension += 1;
        permute(self.sample, strata, hash(&[self.order, self.dimension]) as u32)
    }
}

impl SampleStream for Strata {
    fn next_1d(&mut self) -> f64 {
        let stratum = self.stratum(self.samples);
        below_one((f64::from(stratum) + self.jitter.next_1d()) / f64::from(self.samples))
    }

    fn next_2d(&mut self) -> DVec2 {
        let stratum = self.stratum(self.columns * self.rows);
        let cell = DVec2::new(f64::from(stratum % self.columns), f64::from(stratum / self.columns));
        let p = (cell + self.jitter.next_2d()) / DVec2::new(f64::from(self.columns), f64::from(self.rows));
        DVec2::new(below_one(p.x), below_one(p.y))
    }
}

/// Rounding in the last stratum may give 1.
fn below_one(x: f64) -> f64 {
    x.min(1.0_f64.next_down())
}
