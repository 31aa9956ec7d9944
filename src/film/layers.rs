use glam::DVec2;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::Crop;
use crate::{
    memory::{NoMemory, try_filled},
    stats::ExactMoments,
};

/// A named group of channels of an image.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LayerSpec {
    /// The channel prefix before the dot; empty for the beauty layer.
    pub name: String,
    /// The channel names after the dot.
    pub channels: Vec<String>,
    /// The source of its values.
    pub source: LayerSource,
}

/// The source of a layer's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum LayerSource {
    /// The mean of the integrator's values for each sample.
    Sampled,
    /// The number of samples of a pixel.
    Count,
    /// The mean squared value of the beauty layer's samples.
    SecondMoment,
}

impl LayerSpec {
    /// The beauty layer: the image itself.
    #[must_use]
    pub fn beauty() -> Self {
        Self { name: String::new(), channels: ["R", "G", "B"].map(String::from).into(), source: LayerSource::Sampled }
    }

    /// An RGB layer that the integrator writes.
    #[must_use]
    pub fn sampled(name: &str) -> Self {
        Self { name: name.to_owned(), ..Self::beauty() }
    }

    fn channel_name(&self, channel: &str) -> String {
        if self.name.is_empty() { channel.to_owned() } else { format!("{}.{channel}", self.name) }
    }
}

/// The accumulated samples of some pixels, as exact sums that are independent of the order.
#[derive(Clone, Debug)]
pub struct Pixels {
    width: u32,
    /// The moments of each pixel, row by row, and in each pixel by channel.
    pub(super) moments: Vec<ExactMoments>,
    pub(super) stride: usize,
}

impl Pixels {
    /// Pixels without samples, with `channels` sampled channels.
    #[must_use]
    pub fn new(width: u32, height: u32, channels: usize) -> Self {
        let moments = vec![ExactMoments::default(); width as usize * height as usize * channels];
        Self { width, moments, stride: channels }
    }

    /// As [`Pixels::new`], but reports a lack of memory.
    fn try_new(width: u32, height: u32, channels: usize) -> Result<Self, NoMemory> {
        let count = (width as usize).saturating_mul(height as usize).saturating_mul(channels);
        Ok(Self { width, moments: try_filled(ExactMoments::default(), count)?, stride: channels })
    }

    /// Adds a sample to the pixel in column `x` and row `y` of the block: a finite value for each channel.
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

/// An image while its samples accumulate.
#[derive(Clone, Debug)]
pub struct Film {
    /// The part of the film that is rendered.
    pub crop: Crop,
    /// The size of the entire film in pixels.
    pub size: DVec2,
    /// The layers, the beauty first.
    pub layers: Vec<LayerSpec>,
    pub(super) pixels: Pixels,
    /// Whether samples are independent, so that their variance gives the variance of the beauty layer.
    pub(super) has_variance: bool,
    /// The contributions of light paths to the beauty layer, by pixel; empty if there are none.
    pub(super) splats: Vec<[ExactMoments; 3]>,
}

impl Film {
    /// A film without samples. The first of its layers is the beauty.
    #[must_use]
    pub fn new(crop: Crop, size: DVec2, layers: Vec<LayerSpec>) -> Self {
        let pixels = Pixels::new(crop.width, crop.height, sampled_channels(&layers));
        Self { crop, size, layers, pixels, has_variance: true, splats: Vec::new() }
    }

    /// As [`Film::new`], but reports a lack of memory.
    ///
    /// # Errors
    /// If there is not enough memory for the sums.
    pub fn try_new(crop: Crop, size: DVec2, layers: Vec<LayerSpec>) -> Result<Self, NoMemory> {
        let pixels = Pixels::try_new(crop.width, crop.height, sampled_channels(&layers))?;
        Ok(Self { crop, size, layers, pixels, has_variance: true, splats: Vec::new() })
    }

    /// The same film without variances, for samples that are not independent.
    #[must_use]
    pub fn without_variance(self) -> Self {
        Self { has_variance: false, ..self }
    }

    /// The number of values of a sample.
    #[must_use]
    pub fn stride(&self) -> usize {
        self.pixels.stride
    }

    /// Adds a block of pixels whose top left pixel is at `(x, y)`.
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

    /// Adds contributions of light paths to the beauty layer. Their mean adds to the mean of the samples.
    pub fn add_splats(&mut self, splats: &[[ExactMoments; 3]]) {
        if self.splats.is_empty() {
            self.splats = vec![Default::default(); splats.len()];
        }
        for (target, source) in self.splats.iter_mut().flatten().zip(splats.iter().flatten()) {
            target.merge(source);
        }
    }

    /// The means of all pixels of the beauty layer, row by row.
    #[must_use]
    pub fn means(&self) -> Vec<[f64; 3]> {
        let [r, g, b] = [0, 1, 2].map(|channel| self.beauty(channel, Estimate::mean));
        r.into_iter().zip(g).zip(b).map(|((r, g), b)| [r, g, b]).collect()
    }

    /// The estimated relative error of the beauty layer: the root of the mean variance of the pixel means over all
    /// pixels and channels, divided by the mean of the image. Infinite if it is unknown. It assumes independent
    /// samples, so it is too large for stratified samplers.
    #[must_use]
    pub fn relative_error(&self) -> f64 {
        /// The number of pixels that one thread sums; these sums are added in order.
        const CHUNK: usize = 4096;
        let stride = self.pixels.stride;
        let pixel = |index: usize, samples: &[ExactMoments]| {
            let estimate = |channel: usize| {
                let paths = self.splats.get(index).map(|splats| splats[channel]);
                Estimate { samples: samples[channel], paths }
            };
            let estimates = [0, 1, 2].map(estimate);
            DVec2::new(
                estimates.iter().map(Estimate::variance_of_mean).sum(),
                estimates.iter().map(Estimate::mean).sum(),
            )
        };
        let chunks = self.pixels.moments.par_chunks(CHUNK * stride).enumerate();
        let sums: Vec<DVec2> = chunks
            .map(|(i, chunk)| {
                let pixels = chunk.chunks_exact(stride).enumerate();
                pixels.map(|(k, samples)| pixel(i * CHUNK + k, samples)).sum()
            })
            .collect();
        let values = 3.0 * (self.pixels.moments.len() / stride) as f64;
        let means = sums.into_iter().sum::<DVec2>() / values;
        let error = means.x.sqrt() / means.y.abs();
        if error.is_nan() { f64::INFINITY } else { error }
    }

    /// Evaluates a function of a channel of the beauty layer for each pixel.
    fn beauty<T>(&self, channel: usize, value: impl Fn(&Estimate) -> T) -> Vec<T> {
        let samples = self.pixels.moments.iter().skip(channel).step_by(self.pixels.stride);
        let estimate = |(pixel, samples): (usize, &ExactMoments)| {
            let paths = self.splats.get(pixel).map(|splats| splats[channel]);
            value(&Estimate { samples: *samples, paths })
        };
        samples.enumerate().map(estimate).collect()
    }

    /// The image: the mean of every layer, and the variance of the beauty layer's mean if it is known.
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

/// The estimate of a pixel: the sum of the mean of its samples and the independent mean of the light paths.
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

    /// The mean squared value of a sample. The variance of the light paths' mean counts as if light paths were divided
    /// among the pixel's samples.
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

/// The channels of the variance of the beauty layer's mean, for independent samples.
pub const VARIANCE: [&str; 3] = ["variance.R", "variance.G", "variance.B"];

/// An image: named channels of equal size, row by row from the top left.
#[derive(Clone, Debug)]
pub struct Image {
    /// The part of the film that is rendered.
    pub crop: Crop,
    /// The size of the entire film in pixels.
    pub size: DVec2,
    /// The names and values of the channels, R, G and B first.
    pub channels: Vec<(String, Vec<f32>)>,
    /// The names and texts of the header's attributes.
    pub attributes: Vec<(String, String)>,
}

impl Image {
    /// The text of an attribute.
    #[must_use]
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(known, _)| known == name).map(|(_, text)| text.as_str())
    }

    /// The values of a channel, row by row; None if the image lacks it.
    #[must_use]
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels.iter().find(|(known, _)| known == name).map(|(_, values)| values.as_slice())
    }

    /// Three channels as pixels; None if one is missing.
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

    /// The true value of a pixel and channel: 0 in the first pixel, different elsewhere.
    fn truth(pixel: u32, channel: usize) -> f64 {
        f64::from(pixel) * (0.3 + channel as f64)
    }

    /// A film with exponentially distributed samples and equally many light paths.
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
    fn the_relative_error_matches_the_scatter_of_many_images() {
        for has_splats in [false, true] {
            let terms = if has_splats { 2.0 } else { 1.0 };
            let values = || (0..5).flat_map(|pixel| (0..3).map(move |channel| (pixel, channel)));
            let mean = values().map(|(pixel, channel)| terms * truth(pixel, channel)).sum::<f64>() / 15.0;
            let (mut squares, mut estimated) = (Moments::default(), Moments::default());
            for seed in 0..2000 {
                let film = film(seed, 20, has_splats);
                let means = film.means();
                let error = |(pixel, channel)| means[pixel as usize][channel] - terms * truth(pixel, channel);
                squares.push(values().map(error).map(|error| error * error).sum::<f64>() / 15.0 / (mean * mean));
                estimated.push(film.relative_error().powi(2));
            }
            let error = (estimated.mean - squares.mean).abs();
            let both = estimated.std_error().unwrap_or(0.0).hypot(squares.std_error().unwrap_or(0.0));
            // The mean of the image in the denominator is also random: its variance is about 1.5 % of its square.
            assert!(error < 4.0 * both + 0.05 * squares.mean, "{} instead of {}", estimated.mean, squares.mean);
            assert!(both < 0.03 * squares.mean, "the test has too little power");
        }
    }

    #[test]
    fn the_relative_error_is_infinite_if_it_is_unknown() {
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
