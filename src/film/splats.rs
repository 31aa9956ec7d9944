//! Light that paths leave on pixels all over the film.

use std::sync::{Mutex, MutexGuard, PoisonError};

use glam::DVec2;

use super::HdrFilm;
use crate::{math::Rgb, stats::ExactMoments};

/// What light paths leave on a film, gathered by all threads at once. Sums are exact, so that it does not matter in which
/// order they come.
#[derive(Debug)]
pub struct Splats {
    width: u32,
    /// Rows of pixels that are locked together, three channels each.
    bands: Vec<Mutex<Vec<[ExactMoments; 3]>>>,
}

/// Rows of a band.
const ROWS: u32 = 8;

impl Splats {
    /// Nothing yet.
    #[must_use]
    pub fn new(width: u32, height: u32) -> Self {
        let band = |first: u32| {
            let rows = ROWS.min(height - first);
            Mutex::new(vec![<[ExactMoments; 3]>::default(); (width * rows) as usize])
        };
        Self { width, bands: (0..height).step_by(ROWS as usize).map(band).collect() }
    }

    /// Adds what some paths left, each entry being all that one path left on one pixel, and forgets the entries.
    pub fn add(&self, splats: &mut Vec<((u32, u32), Rgb)>) {
        splats.sort_unstable_by_key(|((x, y), _)| (y / ROWS, *y, *x));
        for chunk in splats.chunk_by(|((_, one), _), ((_, other), _)| one / ROWS == other / ROWS) {
            let row = chunk[0].0.1;
            let mut band = lock(&self.bands[(row / ROWS) as usize]);
            for ((x, y), value) in chunk {
                let pixel = &mut band[((y % ROWS) * self.width + x) as usize];
                pixel.iter_mut().zip(value.to_array()).for_each(|(moments, value)| moments.push(value));
            }
        }
        splats.clear();
    }

    /// All pixels, row by row, after so many paths.
    #[must_use]
    pub fn finish(self, paths: u64) -> Vec<[ExactMoments; 3]> {
        let bands = self.bands.into_iter().map(|band| band.into_inner().unwrap_or_else(PoisonError::into_inner));
        let mut pixels: Vec<_> = bands.flatten().collect();
        for moments in pixels.iter_mut().flatten() {
            moments.push_zeros(paths - moments.n());
        }
        pixels
    }
}

/// A thread that panicked leaves no entry half-written.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What one path leaves on the pixels of a film.
#[derive(Debug, Default)]
pub struct Path {
    pixels: Vec<((u32, u32), Rgb)>,
}

impl Path {
    /// Adds light at a position on the film, in pixels; several times at one pixel is once with the sum.
    #[inline]
    pub fn splat(&mut self, film: &HdrFilm, position: DVec2, value: Rgb) {
        for (pixel, density) in film.seen_by(position) {
            let value = density * value;
            match self.pixels.iter_mut().find(|(known, _)| *known == pixel) {
                Some((_, sum)) => *sum += value,
                None => self.pixels.push((pixel, value)),
            }
        }
    }

    /// The pixels with their sums.
    #[must_use]
    pub fn pixels(&self) -> &[((u32, u32), Rgb)] {
        &self.pixels
    }

    /// Whether all of it is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.pixels.iter().all(|(_, value)| value.is_finite())
    }

    /// Moves all to the end of a list.
    pub fn drain_into(&mut self, list: &mut Vec<((u32, u32), Rgb)>) {
        list.append(&mut self.pixels);
    }
}
