use glam::DVec2;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::Crop;
use crate::{
    memory::{NoMemory, try_filled},
    stats::ExactMoments,
};

/// A named group of channels.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LayerSpec {
    /// The name before the dot; the beauty has none.
    pub name: String,
    /// The names after the dot.
    pub channels: Vec<String>,
    /// Where its values come from.
    pub source: LayerSource,
}

/// Where a layer's values come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum LayerSource {
    /// The mean of what the integrator writes for each sample.
    Sampled,
    /// How many samples a pixel has.
    Count,
    /// The mean of the squares of the beauty.
    SecondMoment,
}

impl LayerSpec {
    /// The image itself.
    #[must_use]
    pub fn beauty() -> Self {
        Self { name: String::new(), channels: ["R", "G", "B"].map(String::from).into(), source: LayerSource::Sampled }
    }

    /// A layer of colours that the integrator writes.
    #[must_use]
    pub fn sampled(name: &str) -> Self {
        Self { name: name.to_owned(), ..Self::beauty() }
    }

    fn channel_name(&self, channel: &str) -> String {
        if self.name.is_empty() { channel.to_owned() } else { format!("{}.{channel}", self.name) }
    }
}

/// The gathered samples of some pixels, exact sums whose order does not matter.
#[derive(Clone, Debug)]
pub struct Pixels {
    width: u32,
    /// By pixel, row by row, and in each by channel.
    pub(super) moments: Vec<ExactMoments>,
    pub(super) stride: usize,
}

impl Pixels {
    /// Pixels without samples, with so many sampled channels.
    #[must_use]
    pub fn new(width: u32, height: u32, channels: usize) -> Self {
        let moments = vec![ExactMoments::default(); width as usize * height as usize * channels];
        Self { width, moments, stride: channels }
    }

    /// The same where memory may be short.
    fn try_new(width: u32, height: u32, channels: usize) -> Result<Self, NoMemory> {
        let count = (width as usize).saturating_mul(height as usize).saturating_mul(channels);
        Ok(Self { width, moments: try_filled(ExactMoments::default(), count)?, stride: channels })
    }

    /// Adds one sample to a pixel: a value for each channel.
    pub fn push(&mut self, x: u32, y: u32, sample: &[f64]) {
        let start = self.start(x, y);
        for (moments, value) in self.moments[start..start + self.stride].iter_mut().zip(sample) {
            moments.push(*value);
        }
    }

    fn start(&self, x: u32, y: u32) -> usize {
        (y as usize * self.width as usize + x as usize) * self.stride
    }

    fn height(&self) -> u32 {
        (self.moments.len() / self.stride / self.width as usize) as u32
    }
}

/// An image while it is gathered.
#[derive(Clone, Debug)]
pub struct Film {
    /// Which part of the whole film it is.
    pub crop: Crop,
    /// The whole film's size.
    pub size: DVec2,
    /// The layers, the beauty first.
    pub layers: Vec<LayerSpec>,
    pub(super) pixels: Pixels,
    /// Whether the scatter of its samples tells the variance of the beauty.
    pub(super) has_variance: bool,
    /// What light paths left on the beauty, by pixel; empty if there are none.
    pub(super) splats: Vec<[ExactMoments; 3]>,
}

impl Film {
    /// A film without samples.
    #[must_use]
    pub fn new(crop: Crop, size: DVec2, layers: Vec<LayerSpec>) -> Self {
        let pixels = Pixels::new(crop.width, crop.height, sampled_channels(&layers));
        Self { crop, size, layers, pixels, has_variance: true, splats: Vec::new() }
    }

    /// The same where memory may be short.
    ///
    /// # Errors
    /// If there is no room for its sums.
    pub fn try_new(crop: Crop, size: DVec2, layers: Vec<LayerSpec>) -> Result<Self, NoMemory> {
        let pixels = Pixels::try_new(crop.width, crop.height, sampled_channels(&layers))?;
        Ok(Self { crop, size, layers, pixels, has_variance: true, splats: Vec::new() })
    }

    /// The same film, whose samples are not independent: its image has no variances.
    #[must_use]
    pub fn without_variance(self) -> Self {
        Self { has_variance: false, ..self }
    }

    /// How many values a sample has.
    #[must_use]
    pub fn stride(&self) -> usize {
        self.pixels.stride
    }

    /// Adds a block of pixels whose upper left one is at `(x, y)`.
    pub fn add(&mut self, x: u32, y: u32, block: &Pixels) {
        for row in 0..block.height() {
            let (from, to) = (block.start(0, row), self.pixels.start(x, y + row));
            let length = block.width as usize * block.stride;
            let targets = &mut self.pixels.moments[to..to + length];
            for (target, source) in targets.iter_mut().zip(&block.moments[from..from + length]) {
                target.merge(source);
            }
        }
    }

    /// Adds what light paths left on the beauty, whose mean goes on top of that of the samples.
    pub fn add_splats(&mut self, splats: &[[ExactMoments; 3]]) {
        if self.splats.is_empty() {
            self.splats = vec![Default::default(); splats.len()];
        }
        for (target, source) in self.splats.iter_mut().flatten().zip(splats.iter().flatten()) {
            target.merge(source);
        }
    }

    /// The means of all pixels of the beauty, row by row.
    #[must_use]
    pub fn means(&self) -> Vec<[f64; 3]> {
        let [r, g, b] = [0, 1, 2].map(|channel| self.beauty(channel, Estimate::mean));
        r.into_iter().zip(g).zip(b).map(|((r, g), b)| [r, g, b]).collect()
    }

    /// The estimated relative error of the beauty: the root of the mean variance of all pixels' means, over all channels,
    /// divided by the mean of the image; infinite where that cannot be told. Samples are taken to be independent, so that
    /// it is too large where a sampler spreads them evenly.
    #[must_use]
    pub fn relative_error(&self) -> f64 {
        /// So many pixels are summed by one thread; their sums are added in order.
        const TOGETHER: usize = 4096;
        let stride = self.pixels.stride;
        let pixel = |number: usize, samples: &[ExactMoments]| {
            let estimate = |channel: usize| {
                let paths = self.splats.get(number).map(|splats| splats[channel]);
                Estimate { samples: samples[channel], paths }
            };
            let estimates = [0, 1, 2].map(estimate);
            DVec2::new(
                estimates.iter().map(Estimate::variance_of_mean).sum(),
                estimates.iter().map(Estimate::mean).sum(),
            )
        };
        let chunks = self.pixels.moments.par_chunks(TOGETHER * stride).enumerate();
        let sums: Vec<DVec2> = chunks
            .map(|(i, chunk)| {
                let pixels = chunk.chunks_exact(stride).enumerate();
                pixels.map(|(k, samples)| pixel(i * TOGETHER + k, samples)).sum()
            })
            .collect();
        let values = 3.0 * (self.pixels.moments.len() / stride) as f64;
        let means = sums.into_iter().sum::<DVec2>() / values;
        let error = means.x.sqrt() / means.y.abs();
        if error.is_nan() { f64::INFINITY } else { error }
    }

    /// Something about a channel of the beauty, by pixel.
    fn beauty<T>(&self, channel: usize, value: impl Fn(&Estimate) -> T) -> Vec<T> {
        let samples = self.pixels.moments.iter().skip(channel).step_by(self.pixels.stride);
        let estimate = |(pixel, samples): (usize, &ExactMoments)| {
            let paths = self.splats.get(pixel).map(|splats| splats[channel]);
            value(&Estimate { samples: *samples, paths })
        };
        samples.enumerate().map(estimate).collect()
    }

    /// The image: the mean of every layer, and the variance of the mean of the beauty if it is known.
    #[must_use]
    pub fn image(&self) -> Image {
        let mut image = Image { crop: self.crop, size: self.size, channels: Vec::new(), attributes: Vec::new() };
        let mut first = 0;
        for layer in &self.layers {
            for (i, channel) in layer.channels.iter().enumerate() {
                let plane = match layer.source {
                    LayerSource::Sampled if first == 0 => self.beauty(i, |e| e.mean() as f32),
                    LayerSource::Sampled => self.plane(first + i, |m| m.mean().unwrap_or(0.0)),
                    LayerSource::Count => self.plane(0, |m| m.n() as f64),
                    LayerSource::SecondMoment => self.beauty(i, |e| e.second_moment() as f32),
                };
                image.channels.push((layer.channel_name(channel), plane));
            }
            if layer.source == LayerSource::Sampled {
                first += layer.channels.len();
            }
        }
        let variances: &[&str] = if self.has_variance { &VARIANCE } else { &[] };
        for (i, channel) in variances.iter().enumerate() {
            let plane = self.beauty(i, |e| e.variance_of_mean() as f32);
            image.channels.push(((*channel).to_owned(), plane));
        }
        image
    }

    fn plane(&self, channel: usize, value: impl Fn(&ExactMoments) -> f64) -> Vec<f32> {
        self.pixels.moments.iter().skip(channel).step_by(self.pixels.stride).map(|m| value(m) as f32).collect()
    }
}

/// A pixel's value: the mean of its own samples and, on top of it, that of light paths, which are independent of them.
struct Estimate {
    samples: ExactMoments,
    paths: Option<ExactMoments>,
}

impl Estimate {
    fn mean(&self) -> f64 {
        let mean = |moments: &ExactMoments| moments.mean().unwrap_or(0.0);
        mean(&self.samples) + self.paths.as_ref().map_or(0.0, mean)
    }

    fn variance_of_mean(&self) -> f64 {
        let variance = |moments: &ExactMoments| moments.variance_of_mean().unwrap_or(f64::INFINITY);
        variance(&self.samples) + self.paths.as_ref().map_or(0.0, variance)
    }

    /// The mean of the squares; of light paths, as if as many as there are samples of a pixel were one sample.
    fn second_moment(&self) -> f64 {
        let (n, mean) = (self.samples.n() as f64, self.mean());
        let of_samples = self.samples.variance().unwrap_or(0.0) * (n - 1.0) / n;
        let of_paths = self.paths.as_ref().and_then(ExactMoments::variance_of_mean).unwrap_or(0.0) * n;
        mean * mean + of_samples + of_paths
    }
}

fn sampled_channels(layers: &[LayerSpec]) -> usize {
    layers.iter().filter(|layer| layer.source == LayerSource::Sampled).map(|layer| layer.channels.len()).sum()
}

/// The channels that hold the variance of the mean of the beauty, of independent samples.
pub const VARIANCE: [&str; 3] = ["variance.R", "variance.G", "variance.B"];

/// A finished image: named planes of equal size, row by row from the top left.
#[derive(Clone, Debug)]
pub struct Image {
    /// Which part of the whole film it is.
    pub crop: Crop,
    /// The whole film's size.
    pub size: DVec2,
    /// Names and values, R, G and B first.
    pub channels: Vec<(String, Vec<f32>)>,
    /// What its header says about it: names and texts.
    pub attributes: Vec<(String, String)>,
}

impl Image {
    /// A text of its header.
    #[must_use]
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(known, _)| known == name).map(|(_, text)| text.as_str())
    }

    /// A channel by its name.
    #[must_use]
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels.iter().find(|(known, _)| known == name).map(|(_, values)| values.as_slice())
    }

    /// Three channels together, if all are there.
    #[must_use]
    pub fn rgb(&self, names: [&str; 3]) -> Option<Vec<[f32; 3]>> {
        let [r, g, b] = names.map(|name| self.channel(name));
        let (r, g, b) = (r?, g?, b?);
        Some(r.iter().zip(g).zip(b).map(|((&r, &g), &b)| [r, g, b]).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rng::Stream;
    use crate::stats::Moments;

    /// What pixel and channel show: something else each, the first pixel nothing.
    fn truth(pixel: u32, channel: usize) -> f64 {
        f64::from(pixel) * (0.3 + channel as f64)
    }

    /// Exponentially distributed samples, and as many that light paths leave.
    fn film(seed: u64, samples: u64, has_splats: bool) -> Film {
        let crop = Crop { x: 0, y: 0, width: 5, height: 1 };
        let layers = vec![LayerSpec::beauty(), LayerSpec::sampled("other")];
        let mut film = Film::new(crop, DVec2::new(5.0, 1.0), layers);
        let mut stream = Stream::at(&[seed]);
        let mut value = |pixel, channel| truth(pixel, channel) * -(1.0 - stream.next_1d()).ln();
        let mut splats = [[ExactMoments::default(); 3]; 5];
        for pixel in 0..5 {
            let mut block = Pixels::new(1, 1, 6);
            for _ in 0..samples {
                block.push(0, 0, &[0, 1, 2, 3, 4, 5].map(|channel| value(pixel, channel)));
                let of_pixel = splats[pixel as usize].iter_mut().enumerate();
                of_pixel.for_each(|(channel, moments)| moments.push(value(pixel, channel)));
            }
            film.add(pixel, 0, &block);
        }
        if has_splats {
            film.add_splats(&splats);
        }
        film
    }

    #[test]
    fn the_relative_error_is_that_of_many_images() {
        for has_splats in [false, true] {
            let share = if has_splats { 2.0 } else { 1.0 };
            let values = || (0..5).flat_map(|pixel| (0..3).map(move |channel| (pixel, channel)));
            let mean = values().map(|(pixel, channel)| share * truth(pixel, channel)).sum::<f64>() / 15.0;
            let (mut squares, mut told) = (Moments::default(), Moments::default());
            for seed in 0..2000 {
                let film = film(seed, 20, has_splats);
                let means = film.means();
                let error = |(pixel, channel)| means[pixel as usize][channel] - share * truth(pixel, channel);
                squares.push(values().map(error).map(|error| error * error).sum::<f64>() / 15.0 / (mean * mean));
                told.push(film.relative_error().powi(2));
            }
            let error = (told.mean - squares.mean).abs();
            let both = told.std_error().unwrap_or(0.0).hypot(squares.std_error().unwrap_or(0.0));
            // The mean of the image, by which each is divided, scatters too: its variance is some 1.5 % of its square.
            assert!(error < 4.0 * both + 0.05 * squares.mean, "{} instead of {}", told.mean, squares.mean);
            assert!(both < 0.03 * squares.mean, "the test could see nothing");
        }
    }

    #[test]
    fn the_relative_error_is_infinite_where_nothing_is_known() {
        for samples in [0, 1] {
            assert_eq!(film(1, samples, false).relative_error(), f64::INFINITY);
        }
        let crop = Crop { x: 0, y: 0, width: 1, height: 1 };
        let mut black = Film::new(crop, DVec2::ONE, vec![LayerSpec::beauty()]);
        let mut block = Pixels::new(1, 1, 3);
        (0..9).for_each(|_| block.push(0, 0, &[0.0; 3]));
        black.add(0, 0, &block);
        assert_eq!(black.relative_error(), f64::INFINITY);
    }
}
