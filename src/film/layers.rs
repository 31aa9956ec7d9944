use glam::DVec2;

use super::Crop;
use crate::stats::ExactMoments;

/// A named group of channels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LayerSpec {
    /// The name before the dot; the beauty has none.
    pub name: String,
    /// The names after the dot.
    pub channels: &'static [&'static str],
    /// Where its values come from.
    pub source: Source,
}

/// Where a layer's values come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
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
        Self { name: String::new(), channels: &["R", "G", "B"], source: Source::Sampled }
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
    moments: Vec<ExactMoments>,
    stride: usize,
}

impl Pixels {
    /// Pixels without samples, with so many sampled channels.
    #[must_use]
    pub fn new(width: u32, height: u32, channels: usize) -> Self {
        let moments = vec![ExactMoments::default(); width as usize * height as usize * channels];
        Self { width, moments, stride: channels }
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
    pixels: Pixels,
}

impl Film {
    /// A film without samples.
    #[must_use]
    pub fn new(crop: Crop, size: DVec2, layers: Vec<LayerSpec>) -> Self {
        let pixels = Pixels::new(crop.width, crop.height, sampled_channels(&layers));
        Self { crop, size, layers, pixels }
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

    /// The means of all pixels of the beauty, row by row.
    #[must_use]
    pub fn means(&self) -> Vec<[f64; 3]> {
        let mean = |pixel: &[ExactMoments]| [0, 1, 2].map(|channel| pixel[channel].mean().unwrap_or(0.0));
        self.pixels.moments.chunks_exact(self.pixels.stride).map(mean).collect()
    }

    /// The image: the mean of every layer, and the variance of the mean of the beauty.
    #[must_use]
    pub fn image(&self) -> Image {
        let mut image = Image { crop: self.crop, size: self.size, channels: Vec::new(), attributes: Vec::new() };
        let mut first = 0;
        for layer in &self.layers {
            for (i, channel) in layer.channels.iter().enumerate() {
                let plane = match layer.source {
                    Source::Sampled => self.plane(first + i, |m| m.mean().unwrap_or(0.0)),
                    Source::Count => self.plane(0, |m| m.n() as f64),
                    Source::SecondMoment => self.plane(i, second_moment),
                };
                image.channels.push((layer.channel_name(channel), plane));
            }
            if layer.source == Source::Sampled {
                first += layer.channels.len();
            }
        }
        for (i, channel) in VARIANCE.iter().enumerate() {
            let plane = self.plane(i, |m| m.variance_of_mean().unwrap_or(f64::INFINITY));
            image.channels.push(((*channel).to_owned(), plane));
        }
        image
    }

    fn plane(&self, channel: usize, value: impl Fn(&ExactMoments) -> f64) -> Vec<f32> {
        self.pixels.moments.iter().skip(channel).step_by(self.pixels.stride).map(|m| value(m) as f32).collect()
    }
}

/// The mean of the squares.
fn second_moment(moments: &ExactMoments) -> f64 {
    let (n, mean) = (moments.n() as f64, moments.mean().unwrap_or(0.0));
    mean * mean + moments.variance().unwrap_or(0.0) * (n - 1.0) / n
}

fn sampled_channels(layers: &[LayerSpec]) -> usize {
    layers.iter().filter(|layer| layer.source == Source::Sampled).map(|layer| layer.channels.len()).sum()
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
