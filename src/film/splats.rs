//! Splats: contributions of light paths to arbitrary pixels of the film.

use std::sync::{Mutex, MutexGuard, PoisonError};

use glam::DVec2;

use super::HdrFilm;
use crate::{math::Rgb, stats::ExactMoments};

/// The contributions of light paths to a film, accumulated by all threads concurrently. Sums are exact, so the result
/// does not depend on the order.
#[derive(Debug)]
pub struct Splats {
    width: u32,
    /// Bands of rows, each with its own lock, with three channels per pixel.
    bands: Vec<Mutex<Vec<[ExactMoments; 3]>>>,
}

/// The number of rows of a band.
const ROWS: u32 = 8;

impl Splats {
    /// Splats without contributions.
    #[must_use]
    pub fn new(width: u32, height: u32) -> Self {
        let band = |first: u32| {
            let rows = ROWS.min(height - first);
            Mutex::new(vec![<[ExactMoments; 3]>::default(); (width * rows) as usize])
        };
        Self { width, bands: (0..height).step_by(ROWS as usize).map(band).collect() }
    }

    /// Adds the contributions of some paths and clears the list. Each entry is the total contribution of one path to
    /// one pixel.
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

    /// The moments of all pixels, row by row, over `paths` paths.
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

/// Ignores poisoning: a panic does not leave a partially written entry.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The contributions of one path to the pixels of a film.
#[derive(Debug, Default)]
pub struct Path {
    pixels: Vec<((u32, u32), Rgb)>,
}

impl Path {
    /// Adds light at a position on the film, in pixels. Contributions to the same pixel are summed.
    #[inline]
    pub fn splat(&mut self, film: &HdrFilm, position: DVec2, value: Rgb) {
        for (pixel, density) in film.pixels_covering(position) {
            let value = density * value;
            match self.pixels.iter_mut().find(|(known, _)| *known == pixel) {
                Some((_, sum)) => *sum += value,
                None => self.pixels.push((pixel, value)),
            }
        }
    }

    /// The column and row of each reached pixel, with the sum of its contributions.
    #[must_use]
    pub fn pixels(&self) -> &[((u32, u32), Rgb)] {
        &self.pixels
    }

    /// Whether all contributions are finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.pixels.iter().all(|(_, value)| value.is_finite())
    }

    /// Moves all contributions to the end of a list.
    pub fn drain_into(&mut self, list: &mut Vec<((u32, u32), Rgb)>) {
        list.append(&mut self.pixels);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::FilmPlugin;
    use crate::math::rng::Stream;
    use crate::scene_file::xml;
    use crate::stats::Moments;

    fn film(filter: &str, more: &str) -> HdrFilm {
        let element = format!(
            r#"<film type="hdrfilm"><integer name="width" value="20"/><integer name="height" value="14"/>{filter}{more}</film>"#
        );
        let document = xml::parse_element(&element).expect("valid XML");
        FilmPlugin::read(&document, document.root).expect("a film").format().clone()
    }

    const FILTERS: [&str; 3] = [
        r#"<rfilter type="box"/>"#,
        r#"<rfilter type="gaussian"/>"#,
        r#"<rfilter type="tent"><float name="radius" value="1.7"/></rfilter>"#,
    ];

    fn total(film: &HdrFilm, position: DVec2) -> f64 {
        film.pixels_covering(position).map(|(_, density)| density).sum()
    }

    #[test]
    fn full_and_partial_bands_are_summed_exactly() {
        let splats = Splats::new(5, 19);
        splats.add(&mut vec![((4, 18), Rgb::new(1.0, 2.0, 3.0)), ((0, 0), Rgb::ONE), ((4, 18), Rgb::splat(0.5))]);
        splats.add(&mut vec![((2, 8), Rgb::ONE)]);
        let pixels = splats.finish(10);
        assert_eq!(pixels.len(), 5 * 19);
        let value = |x: usize, y: usize| pixels[y * 5 + x].map(|moments| moments.mean().unwrap() * 10.0);
        assert_eq!((value(0, 0), value(2, 8), value(1, 1)), ([1.0; 3], [1.0; 3], [0.0; 3]));
        assert_eq!(value(4, 18), [1.5, 2.5, 3.5]);
        assert!(pixels.iter().flatten().all(|moments| moments.n() == 10));
    }

    #[test]
    fn two_contributions_to_a_pixel_are_summed() {
        let film = film(FILTERS[0], "");
        let mut path = Path::default();
        path.splat(&film, DVec2::new(3.2, 4.9), Rgb::new(1.0, 2.0, 4.0));
        path.splat(&film, DVec2::new(3.9, 4.1), Rgb::new(0.5, 0.5, 0.5));
        path.splat(&film, DVec2::new(4.1, 4.1), Rgb::ONE);
        assert_eq!(path.pixels(), [((3, 4), Rgb::new(1.5, 2.5, 4.5)), ((4, 4), Rgb::ONE)]);
        let mut list = Vec::new();
        path.drain_into(&mut list);
        assert!(path.pixels().is_empty() && list.len() == 2);
    }

    #[test]
    fn light_outside_the_film_is_ignored() {
        for filter in FILTERS {
            let film =
                film(filter, r#"<integer name="crop_offset_x" value="4"/><integer name="crop_width" value="9"/>"#);
            let mut path = Path::default();
            for x in [-1e18, -3.0, 3.999, 13.001, 40.0, 1e18, f64::NAN] {
                path.splat(&film, DVec2::new(x, 5.0), Rgb::ONE);
            }
            for y in [-1e-9, -1e18, 14.001, 1e18, f64::NAN] {
                path.splat(&film, DVec2::new(6.0, y), Rgb::ONE);
            }
            assert!(path.pixels().is_empty(), "{filter}: {:?}", path.pixels());
        }
    }

    #[test]
    fn every_filter_keeps_the_total_light_inside_the_film() {
        for filter in FILTERS {
            let film = film(filter, "");
            let mut stream = Stream::at(&[80]);
            // A filter that is not a partition of unity is one on average.
            let position = || DVec2::new(6.0, 5.0) + stream.next_2d();
            let totals: Moments = std::iter::repeat_with(position).take(20_000).map(|at| total(&film, at)).collect();
            let error = (totals.mean - 1.0).abs();
            assert!(error <= 4.0 * totals.std_error().expect("many samples") + 1e-12, "{filter}: {}", totals.mean);
        }
    }

    #[test]
    fn the_density_of_each_pixel_at_a_border_integrates_to_one() {
        for filter in FILTERS {
            for more in ["", r#"<boolean name="sample_border" value="true"/>"#] {
                let film = film(filter, more);
                for (x, y) in [(0, 0), (1, 7), (19, 13), (10, 7)] {
                    let n = 600;
                    let at = |i: u32, middle: u32| {
                        f64::from(middle) + 0.5 + 3.0 * ((f64::from(i) + 0.5) / f64::from(n) * 2.0 - 1.0)
                    };
                    let density =
                        |i, j| film.pixels_covering(DVec2::new(at(i, x), at(j, y))).find(|(pixel, _)| *pixel == (x, y));
                    let sum: f64 = (0..n)
                        .flat_map(|i| (0..n).map(move |j| (i, j)))
                        .filter_map(|(i, j)| density(i, j))
                        .map(|(_, d)| d)
                        .sum();
                    let mass = sum * (6.0 / f64::from(n)).powi(2);
                    // The midpoint rule, over at most one discontinuity.
                    assert!((mass - 1.0).abs() < 0.025, "{filter}{more} {x},{y}: {mass}");
                }
            }
        }
    }
}
