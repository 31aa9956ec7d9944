//! Samplers: the random numbers of a path, as a function of the address (seed, replicate, pixel, sample).
//!
//! A *replicate* is an independent estimate of the image with a given number of samples per pixel. A sampler stratifies
//! the samples within a replicate; different replicates are independent.

mod independent;
pub mod laws;
mod low_discrepancy;
mod stratified;

pub use independent::Independent;
pub use low_discrepancy::LowDiscrepancy;
pub use stratified::Stratified;

use enum_dispatch::enum_dispatch;
use glam::DVec2;

use crate::{
    math::rng::Stream,
    scene_file::{Category, Described as _, Document, ObjectId, Param, ParamKind, Property, Range, Value, catalogue},
};

/// The sample for which a stream generates random numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Address {
    /// The user's seed.
    pub seed: u64,
    /// The index of the replicate.
    pub replicate: u64,
    /// The index of the pixel on the entire film, row by row.
    pub pixel: u64,
    /// The index of the sample in this pixel and replicate.
    pub sample: u32,
    /// The number of samples per pixel in this replicate.
    pub samples: u32,
}

impl Address {
    #[inline]
    fn of_sample(&self) -> [u64; 4] {
        [self.seed, self.replicate, self.pixel, u64::from(self.sample)]
    }

    fn of_pixel(&self) -> [u64; 3] {
        [self.seed, self.replicate, self.pixel]
    }
}

/// A stream of random numbers for one path.
pub trait SampleStream {
    /// The next number in [0, 1).
    fn next_1d(&mut self) -> f64;
    /// The next point in [0, 1)².
    fn next_2d(&mut self) -> DVec2;
}

impl SampleStream for Stream {
    #[inline]
    fn next_1d(&mut self) -> f64 {
        Stream::next_1d(self)
    }

    #[inline]
    fn next_2d(&mut self) -> DVec2 {
        Stream::next_2d(self)
    }
}

catalogue! {
    /// A sampler.
    pub enum Sampler: SamplerModel in Category::Sampler, {
        /// Independent uniform numbers.
        Independent(Independent),
        /// One jittered sample in each stratum.
        Stratified(Stratified),
        /// Owen-scrambled Sobol points.
        LowDiscrepancy(LowDiscrepancy),
    }
}

/// The number of samples per pixel.
const SAMPLE_COUNT: Param = Param::new("sample_count", ParamKind::Integer, "4", "samples a pixel").within(Range {
    min: 1.0,
    max: 1e9,
    open: false,
});
/// The seed, as in Mitsuba; `--seed` overrides it.
const SEED: Param = Param::new("seed", ParamKind::Integer, "0", "the seed, unless a render is given another")
    .within(Range::NON_NEGATIVE);

/// The interface of all samplers.
#[enum_dispatch]
pub trait SamplerModel {
    /// The number of samples per pixel that the scene sets.
    fn sample_count(&self) -> u32;
    /// The seed that the scene sets.
    fn seed(&self) -> u64;
    /// The random numbers of a path.
    fn path_sampler(&self, address: &Address) -> PathSampler;
    /// Whether a sample's numbers do not depend on the number of samples, so that a render can add samples later.
    fn is_open_ended(&self) -> bool {
        false
    }
}

/// The random numbers of one path.
#[derive(Clone, Debug)]
pub enum PathSampler {
    /// The stream of [`Independent`].
    Independent(Stream),
    /// The stream of [`Stratified`].
    Stratified(stratified::Strata),
    /// The stream of [`LowDiscrepancy`].
    LowDiscrepancy(low_discrepancy::Sobol),
}

impl SampleStream for PathSampler {
    #[inline(always)]
    fn next_1d(&mut self) -> f64 {
        match self {
            Self::Independent(sampler) => sampler.next_1d(),
            Self::Stratified(sampler) => sampler.next_1d(),
            Self::LowDiscrepancy(sampler) => sampler.next_1d(),
        }
    }

    #[inline(always)]
    fn next_2d(&mut self) -> DVec2 {
        match self {
            Self::Independent(sampler) => sampler.next_2d(),
            Self::Stratified(sampler) => sampler.next_2d(),
            Self::LowDiscrepancy(sampler) => sampler.next_2d(),
        }
    }
}

impl Sampler {
    /// Replaces the sampler of all sensors in a document by the plugin `name`. It keeps the parameters that both
    /// plugins have.
    pub fn replace(document: &mut Document, name: &str) {
        for sensor in sensors(document) {
            let own = document.child(sensor, Category::Sampler);
            let id = document.add_stand_in(own, Category::Sampler, name, Self::PLUGINS);
            let place = document.object(id).place.clone();
            let properties = &mut document.objects[sensor.0].properties;
            properties.retain(|property| own.is_none_or(|own| property.value != Value::Object(own)));
            properties.push(Property { name: "sampler".to_owned(), value: Value::Object(id), place });
        }
    }

    /// The sampler of a document's sensor as text: its name and its parameters except the number of samples and the
    /// seed.
    #[must_use]
    pub fn described(document: &Document) -> String {
        let sensor = sensors(document).into_iter().next();
        let own = sensor.and_then(|sensor| document.child(sensor, Category::Sampler));
        own.map_or_else(
            || Independent::PLUGIN.name.to_owned(),
            |id| document.describe(id, &[SAMPLE_COUNT.name, SEED.name]),
        )
    }
}

/// The sensors of a document; the first is used.
fn sensors(document: &Document) -> Vec<ObjectId> {
    let is_sensor = |id: &ObjectId| document.object(*id).category == Category::Sensor;
    let objects = document.object(document.root).properties.iter().filter_map(|property| match property.value {
        Value::Object(id) => Some(id),
        _ => None,
    });
    objects.filter(is_sensor).collect()
}

/// The parameters of all samplers.
#[derive(Clone, Copy, Debug)]
pub struct Common {
    sample_count: u32,
    seed: u64,
}

impl Common {
    fn read(params: &crate::scene_file::Params<'_>) -> Result<Self, crate::scene_file::SceneError> {
        let sample_count = params.integer(SAMPLE_COUNT.name)?.unsigned_abs() as u32;
        Ok(Self { sample_count, seed: params.integer(SEED.name)?.unsigned_abs() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::Ks;

    fn samplers() -> Vec<Sampler> {
        let common = Common { sample_count: 64, seed: 0 };
        vec![Independent { common }.into(), Stratified { common }.into(), LowDiscrepancy { common }.into()]
    }

    fn draws(sampler: &Sampler, pixel: u64, samples: u32, dimension: usize) -> Vec<DVec2> {
        let path = |sample| {
            let mut sampler = sampler.path_sampler(&Address { seed: 3, replicate: 0, pixel, sample, samples });
            for _ in 0..dimension {
                sampler.next_2d();
            }
            sampler.next_2d()
        };
        (0..samples).map(path).collect()
    }

    #[test]
    fn one_sample_of_many_pixels_is_uniform_in_every_dimension() {
        for sampler in samplers() {
            for dimension in [0, 1, 7, 200] {
                let first: Vec<_> = (0..4000).map(|pixel| draws(&sampler, pixel, 1, dimension)[0]).collect();
                for coordinate in [first.iter().map(|u| u.x).collect::<Vec<_>>(), first.iter().map(|u| u.y).collect()] {
                    let p = Ks::one_sample(&coordinate, |x| x.clamp(0.0, 1.0)).p;
                    assert!(p > 1e-4, "{sampler:?}, dimension {dimension}: p = {p}");
                }
            }
        }
    }

    #[test]
    fn strata_and_nets_put_one_sample_in_each_cell() {
        for sampler in &samplers()[1..] {
            for dimension in [0, 3] {
                let mut cells = vec![0; 64];
                for u in draws(sampler, 5, 64, dimension) {
                    cells[(u.x * 8.0) as usize * 8 + (u.y * 8.0) as usize] += 1;
                }
                assert!(cells.iter().all(|&count| count == 1), "{sampler:?}: {cells:?}");
            }
        }
    }

    #[test]
    fn a_path_can_be_replayed() {
        for sampler in samplers() {
            assert_eq!(draws(&sampler, 9, 16, 2), draws(&sampler, 9, 16, 2));
            assert_ne!(draws(&sampler, 9, 16, 2), draws(&sampler, 10, 16, 2));
        }
    }
}
