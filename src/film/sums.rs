//! The sums of a film: merging and serialization.

use std::io::{self, Read, Write};

use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::{Crop, Film, LayerSource, LayerSpec};
use crate::{memory::NoMemory, stats::ExactMoments};

/// The description of a film without its sums.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// The part of the film that is rendered.
    pub crop: Crop,
    /// The width and height of the entire film.
    pub size: [f64; 2],
    /// The layers, the beauty first.
    pub layers: Vec<LayerSpec>,
    /// Whether its image has variance channels.
    pub has_variance: bool,
}

impl Frame {
    /// Whether the numbers describe a film.
    #[must_use]
    pub fn is_possible(&self) -> bool {
        self.crop.width > 0 && self.crop.height > 0 && self.layers.first() == Some(&LayerSpec::beauty())
    }

    /// The film without samples.
    ///
    /// # Errors
    /// If there is no memory for it.
    pub fn film(&self) -> Result<Film, NoMemory> {
        let film = Film::try_new(self.crop, DVec2::from(self.size), self.layers.clone())?;
        Ok(if self.has_variance { film } else { film.without_variance() })
    }

    /// The size of the sums of such a film in bytes, with or without splats; None if it exceeds 64 bits.
    #[must_use]
    pub fn bytes(&self, has_splats: bool) -> Option<u64> {
        let sampled = self.layers.iter().filter(|layer| layer.source == LayerSource::Sampled);
        let channels = sampled.map(|layer| layer.channels.len() as u64).sum::<u64>() + if has_splats { 3 } else { 0 };
        let pixels = u64::from(self.crop.width).checked_mul(u64::from(self.crop.height))?;
        pixels.checked_mul(channels)?.checked_mul(ExactMoments::BYTES as u64)
    }
}

impl Film {
    /// The description of the film without its sums.
    #[must_use]
    pub fn frame(&self) -> Frame {
        let (crop, size) = (self.crop, self.size.to_array());
        Frame { crop, size, layers: self.layers.clone(), has_variance: self.has_variance }
    }

    /// Whether light paths contribute to the film.
    #[must_use]
    pub fn has_splats(&self) -> bool {
        !self.splats.is_empty()
    }

    /// Adds all samples of another film of the same frame.
    pub fn merge(&mut self, other: &Self) {
        self.add(0, 0, &other.pixels);
        if other.has_splats() {
            self.add_splats(&other.splats);
        }
    }

    /// Whether each pixel has `count` samples.
    #[must_use]
    pub fn has_samples(&self, count: u64) -> bool {
        self.pixels.moments.iter().all(|moments| moments.n() == count)
    }

    /// Writes all sums: for each pixel, row by row, the sums of its sampled channels, then the sums of splats if there
    /// are any.
    ///
    /// # Errors
    /// The errors of the writer.
    pub fn write_sums(&self, to: &mut impl Write) -> io::Result<()> {
        let sums = self.pixels.moments.iter().chain(self.splats.iter().flatten());
        sums.map(ExactMoments::to_bytes).try_for_each(|bytes| to.write_all(&bytes))
    }

    /// Reads what [`Film::write_sums`] wrote into a film without samples.
    ///
    /// # Errors
    /// The errors of the reader.
    pub fn read_sums(&mut self, from: &mut impl Read, has_splats: bool) -> io::Result<()> {
        if has_splats {
            self.splats = vec![Default::default(); self.pixels.moments.len() / self.pixels.stride];
        }
        let mut bytes = [0; ExactMoments::BYTES];
        for moments in self.pixels.moments.iter_mut().chain(self.splats.iter_mut().flatten()) {
            from.read_exact(&mut bytes)?;
            *moments = ExactMoments::from_bytes(&bytes);
        }
        Ok(())
    }
}
