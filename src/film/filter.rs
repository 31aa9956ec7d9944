//! Reconstruction filters, which are importance sampled instead of splatted: the offset of a pixel's sample is
//! distributed like the filter, and all samples have the same weight. The expected value is the filtered image, as with
//! splatting, but without the ratio bias of splatting. Pixels do not share samples, so they are independent and
//! their variances are unbiased. Ernst, Stamminger and Greiner 2006, "Filter Importance Sampling".

use enum_dispatch::enum_dispatch;

use crate::scene_file::{Category, Described, Param, ParamKind, Params, Plugin, Range, SceneError, catalogue, manual};

/// The interface of all filters: the profile along one axis, in pixels. The filter is the product of two profiles.
#[enum_dispatch]
pub trait FilterModel {
    /// The distance beyond which the profile is zero.
    fn radius(&self) -> f64;
    /// The profile at an offset, not normalised, at least 0.
    fn eval(&self, x: f64) -> f64;
}

catalogue! {
    /// A reconstruction filter.
    pub enum Filter: FilterModel in Category::Filter, {
        /// A box filter.
        Box(Box),
        /// A Gaussian filter.
        Gaussian(Gaussian),
        /// A tent filter.
       Tent(Tent),
    }
}

/// The box filter: the mean over the square of a pixel.
#[derive(Clone, Debug)]
pub struct Box;

impl Described for Box {
    const PLUGIN: Plugin = Plugin {
        category: Category::Filter,
        manual: manual!("filter.rs": "Box"),
        name: "box",
        summary: "The mean over the square of a pixel; recommended for comparisons.",
        params: &[],
        examples: &[r#"<rfilter type="box"/>"#],
        evidence: &["film/filter", "film/footprint"],
    };

    fn read(_params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self)
    }
}

impl FilterModel for Box {
    fn radius(&self) -> f64 {
        0.5
    }

    fn eval(&self, x: f64) -> f64 {
        f64::from(x.abs() <= 0.5)
    }
}

/// A Gaussian, truncated at four standard deviations and shifted down to be zero there.
#[derive(Clone, Debug)]
pub struct Gaussian {
    stddev: f64,
}

impl Described for Gaussian {
    const PLUGIN: Plugin = Plugin {
        category: Category::Filter,
        manual: manual!("filter.rs": "Gaussian"),
        name: "gaussian",
        summary: "A Gaussian that ends at four standard deviations; the default.",
        params: &[
            Param::new("stddev", ParamKind::Float, "0.5", "the standard deviation in pixels").within(Range::POSITIVE)
        ],
        examples: &[
            r#"<rfilter type="gaussian"/>"#,
            r#"<rfilter type="gaussian"><float name="stddev" value="0.8"/></rfilter>"#,
        ],
        evidence: &["film/filter", "film/footprint"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self { stddev: params.float("stddev")? })
    }
}

impl Default for Gaussian {
    fn default() -> Self {
        Self { stddev: 0.5 }
    }
}

impl FilterModel for Gaussian {
    fn radius(&self) -> f64 {
        4.0 * self.stddev
    }

    fn eval(&self, x: f64) -> f64 {
        let gaussian = |x: f64| (-0.5 * (x / self.stddev).powi(2)).exp();
        (gaussian(x) - gaussian(self.radius())).max(0.0)
    }
}

/// A tent filter.
#[derive(Clone, Debug)]
pub struct Tent {
    radius: f64,
}

impl Described for Tent {
    const PLUGIN: Plugin = Plugin {
        category: Category::Filter,
        manual: manual!("filter.rs": "Tent"),
        name: "tent",
        summary: "A tent (triangle) filter.",
        params: &[Param::new("radius", ParamKind::Float, "1", "the radius in pixels").within(Range::POSITIVE)],
        examples: &[r#"<rfilter type="tent"/>"#],
        evidence: &["film/filter", "film/footprint"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self { radius: params.float("radius")? })
    }
}

impl FilterModel for Tent {
    fn radius(&self) -> f64 {
        self.radius
    }

    fn eval(&self, x: f64) -> f64 {
        (1.0 - (x / self.radius).abs()).max(0.0)
    }
}

/// The profile of a filter as a probability density, piecewise linear between equidistant points. It is exact for box
/// and tent, and changes a pixel's value by at most a relative 1e-6 for the Gaussian.
#[derive(Clone, Debug)]
pub struct Profile {
    radius: f64,
    /// The profile at the points.
    values: Vec<f64>,
    /// The integral up to each point, the last being 1.
    cumulative: Vec<f64>,
    /// The first piece to search for each of `PIECES` equal intervals of the cumulative integral.
    guide: Vec<u16>,
    /// Whether the profile is a box.
    is_flat: bool,
}

/// The number of linear pieces. It is even, so that the centre, the corner of a tent, is a point.
const PIECES: usize = 512;

impl Profile {
    /// Tabulates a filter.
    #[must_use]
    pub fn new(filter: &impl FilterModel) -> Self {
        let radius = filter.radius();
        let step = 2.0 * radius / PIECES as f64;
        let values: Vec<f64> = (0..=PIECES).map(|i| filter.eval(-radius + step * i as f64)).collect();
        let mut cumulative = vec![0.0];
        for pair in values.windows(2) {
            let before = cumulative[cumulative.len() - 1];
            cumulative.push(before + 0.5 * (pair[0] + pair[1]));
        }
        let total = cumulative[PIECES];
        cumulative.iter_mut().for_each(|c| *c /= total);
        let begins = |interval: usize| cumulative[1..PIECES].partition_point(|&c| c <= interval as f64 / PIECES as f64);
        let guide = (0..PIECES).map(|interval| begins(interval) as u16).collect();
        let is_flat = values.iter().all(|value| *value == values[0]);
        Self { radius, values, cumulative, guide, is_flat }
    }

    /// The radius in pixels.
    #[must_use]
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Samples an offset with the profile, restricted to `[from, to]`, as its density.
    #[inline]
    #[must_use]
    pub fn sample_within(&self, u: f64, from: f64, to: f64) -> f64 {
        if self.is_flat {
            let (from, to) = (from.max(-self.radius), to.min(self.radius));
            return from + u * (to - from);
        }
        let (below, above) = (self.mass_below(from), self.mass_below(to));
        self.at_mass(below + u * (above - below)).clamp(from, to)
    }

    /// The density at an offset, per pixel, of the profile restricted to `[from, to)`.
    #[inline]
    #[must_use]
    pub fn density_within(&self, x: f64, from: f64, to: f64) -> f64 {
        let (from, to) = (from.max(-self.radius), to.min(self.radius));
        if !(from..to).contains(&x) {
            return 0.0;
        }
        if self.is_flat {
            return 1.0 / (to - from);
        }
        let (i, w) = self.locate(x);
        // The height of a linear piece over its own integral.
        let height = self.values[i] + w * (self.values[i + 1] - self.values[i]);
        let mean = (0.5 * (self.values[i] + self.values[i + 1])).max(f64::MIN_POSITIVE);
        let mass = (self.cumulative[i + 1] - self.cumulative[i]) * PIECES as f64 / (2.0 * self.radius);
        height / mean * mass / (self.mass_below(to) - self.mass_below(from))
    }

    fn mass_below(&self, x: f64) -> f64 {
        if x <= -self.radius {
            return 0.0;
        }
        if x >= self.radius {
            return 1.0;
        }
        let (i, w) = self.locate(x);
        let (left, right) = (self.values[i], self.values[i + 1]);
        let within = w * (left + 0.5 * w * (right - left)) / (0.5 * (left + right)).max(f64::MIN_POSITIVE);
        self.cumulative[i] + within * (self.cumulative[i + 1] - self.cumulative[i])
    }

    /// The piece that contains an offset, and the fraction of the piece before it.
    fn locate(&self, x: f64) -> (usize, f64) {
        let s = ((x + self.radius) / (2.0 * self.radius)).clamp(0.0, 1.0) * PIECES as f64;
        let i = (s as usize).min(PIECES - 1);
        (i, s - i as f64)
    }

    fn at_mass(&self, mass: f64) -> f64 {
        let mut i = usize::from(self.guide[((mass * PIECES as f64) as usize).min(PIECES - 1)]);
        while i < PIECES - 1 && self.cumulative[i + 1] <= mass {
            i += 1;
        }
        let fraction = (mass - self.cumulative[i]) / (self.cumulative[i + 1] - self.cumulative[i]);
        let (left, right) = (self.values[i], self.values[i + 1]);
        if left == right {
            return -self.radius + (i as f64 + fraction) * 2.0 * self.radius / PIECES as f64;
        }
        // Inverts the integral of a linear density, in a form without cancellation.
        let target = fraction * (left + right);
        let w = target / (left + (left * left + (right - left) * target).max(0.0).sqrt());
        -self.radius + (i as f64 + w) * 2.0 * self.radius / PIECES as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moments(profile: &Profile, from: f64, to: f64) -> (f64, f64) {
        let n = 20_000;
        let draws = (0..n).map(|i| profile.sample_within((i as f64 + 0.5) / n as f64, from, to));
        let (mut mean, mut square) = (0.0, 0.0);
        for x in draws {
            mean += x / n as f64;
            square += x * x / n as f64;
        }
        (mean, square)
    }

    #[test]
    fn second_moments_match_the_filters() {
        let (mean, square) = moments(&Profile::new(&Box), -9.0, 9.0);
        assert!(mean.abs() < 1e-9 && (square - 1.0 / 12.0).abs() < 1e-7);
        let (mean, square) = moments(&Profile::new(&Tent { radius: 1.0 }), -9.0, 9.0);
        assert!(mean.abs() < 1e-9 && (square - 1.0 / 6.0).abs() < 1e-6, "{square}");
        // The second moment of the shifted Gaussian, by quadrature with scipy: 0.248 570 86.
        let (mean, square) = moments(&Profile::new(&Gaussian::default()), -9.0, 9.0);
        assert!(mean.abs() < 1e-9 && (square - 0.248_570_86).abs() < 2e-5, "{square}");
    }

    #[test]
    fn densities_match_the_samples() {
        let (n, from, to) = (200_000, -0.4, 1.3);
        for profile in [Profile::new(&Box), Profile::new(&Tent { radius: 1.0 }), Profile::new(&Gaussian::default())] {
            let step = (to - from) / f64::from(n);
            let at = |i: i32| from + (f64::from(i) + 0.5) * step;
            let moment = |power: i32| {
                (0..n).map(|i| at(i).powi(power) * profile.density_within(at(i), from, to) * step).sum::<f64>()
            };
            let (mean, square) = moments(&profile, from, to);
            assert!((moment(0) - 1.0).abs() < 1e-5, "{}", moment(0));
            assert!((moment(1) - mean).abs() < 1e-4 && (moment(2) - square).abs() < 1e-4);
        }
    }

    #[test]
    fn only_the_inner_part_is_sampled_at_a_border() {
        let (mean, _) = moments(&Profile::new(&Tent { radius: 1.0 }), -0.5, 9.0);
        // Mean of a tent cut at -1/2: 1/12 of mass 7/8.
        assert!((mean - (1.0 / 12.0) / (7.0 / 8.0)).abs() < 1e-5, "{mean}");
    }
}
