//! Integrals, roots and interpolation of functions of one variable.

use std::f64::consts::PI;

/// The estimated relative error at which integration stops. The estimate is far too large for smooth functions.
const ACCURACY: f64 = 1e-10;

/// The number of pieces at which integration stops, whatever the error.
const MAX_PIECES: usize = 400;

/// The integral of a function over `[a, b]`, to a relative error of at most 1e-10. The ends are not evaluated.
///
/// The piece with the largest error is halved until the sum of the errors is small.
/// Piessens et al. 1983, *QUADPACK*, the routine QAG with the pair of 7 and 15 points.
#[must_use]
pub fn integral(f: impl Fn(f64) -> f64, [a, b]: [f64; 2]) -> f64 {
    let mut pieces = vec![Piece::new(&f, [a, b])];
    while pieces.len() < MAX_PIECES {
        let error: f64 = pieces.iter().map(|piece| piece.error).sum();
        let size: f64 = pieces.iter().map(|piece| piece.value.abs()).sum();
        if error <= ACCURACY * size {
            break;
        }
        let worst = (0..pieces.len())
            .max_by(|&i, &j| pieces[i].error.total_cmp(&pieces[j].error))
            .expect("there is a piece to begin with");
        let [a, b] = pieces.swap_remove(worst).ends;
        let middle = 0.5 * (a + b);
        pieces.extend([[a, middle], [middle, b]].map(|ends| Piece::new(&f, ends)));
    }
    pieces.iter().map(|piece| piece.value).sum()
}

struct Piece {
    ends: [f64; 2],
    value: f64,
    error: f64,
}

impl Piece {
    fn new(f: &impl Fn(f64) -> f64, ends: [f64; 2]) -> Self {
        let [a, b] = ends;
        let (centre, half) = (0.5 * (a + b), 0.5 * (b - a));
        let [mut kronrod, mut gauss] = [0.0; 2];
        for (i, [x, weight]) in KRONROD.into_iter().enumerate() {
            let sum = if x == 0.0 { f(centre) } else { f(centre - half * x) + f(centre + half * x) };
            kronrod += weight * sum;
            // Every other point belongs to Gauss's rule.
            if i % 2 == 1 {
                gauss += GAUSS[i / 2] * sum;
            }
        }
        Self { ends, value: half * kronrod, error: (half * (kronrod - gauss)).abs() }
    }
}

/// Points on [0, 1] and weights of Kronrod's rule of 15 points on [-1, 1].
const KRONROD: [[f64; 2]; 8] = [
    [0.991_455_371_120_812_6, 0.022_935_322_010_529_225],
    [0.949_107_912_342_758_5, 0.063_092_092_629_978_55],
    [0.864_864_423_359_769_1, 0.104_790_010_322_250_18],
    [0.741_531_185_599_394_4, 0.140_653_259_715_525_92],
    [0.586_087_235_467_691_1, 0.169_004_726_639_267_9],
    [0.405_845_151_377_397_2, 0.190_350_578_064_785_4],
    [0.207_784_955_007_898_47, 0.204_432_940_075_298_9],
    [0.0, 0.209_482_141_084_727_82],
];

/// Weights of Gauss's rule of 7 points.
const GAUSS: [f64; 4] =
    [0.129_484_966_168_869_7, 0.279_705_391_489_276_64, 0.381_830_050_505_118_9, 0.417_959_183_673_469_4];

/// The root of a function whose sign changes once in `[a, b]`: the last `f64` on the side of `a` before the sign
/// change.
#[must_use]
pub fn bisect(f: impl Fn(f64) -> f64, [mut a, mut b]: [f64; 2]) -> f64 {
    let positive = f(a) > 0.0;
    loop {
        let middle = 0.5 * (a + b);
        if middle == a || middle == b {
            return a;
        }
        if (f(middle) > 0.0) == positive {
            a = middle;
        } else {
            b = middle;
        }
    }
}

/// The root of a monotone function in `[a, b]`, or the end with the smaller absolute value if there is no root.
#[must_use]
pub fn crossing(f: impl Fn(f64) -> f64, [a, b]: [f64; 2]) -> f64 {
    let [at_a, at_b] = [f(a), f(b)];
    match () {
        () if (at_a > 0.0) != (at_b > 0.0) => bisect(f, [a, b]),
        () if at_a.abs() < at_b.abs() => a,
        () => b,
    }
}

/// The root of a monotone function in `[a, b]`, or `None` if there is no sign change.
#[must_use]
pub fn root(f: impl Fn(f64) -> f64, [a, b]: [f64; 2]) -> Option<f64> {
    ((f(a) > 0.0) != (f(b) > 0.0)).then(|| bisect(f, [a, b]))
}

/// Interpolates `N` smooth functions by polynomials through their values at the Chebyshev points of an interval.
///
/// The error falls geometrically with the number of points. Berrut and Trefethen 2004, "Barycentric Lagrange
/// Interpolation", eq. (4.2) and (5.3).
#[derive(Clone, Debug)]
pub struct Interpolant<const N: usize> {
    ends: [f64; 2],
    /// The Chebyshev points, each with the values of the functions.
    nodes: Vec<(f64, [f64; N])>,
}

impl<const N: usize> Interpolant<N> {
    /// Evaluates the functions at `nodes` points between the ends.
    #[must_use]
    pub fn new(f: impl Fn(f64) -> [f64; N], ends: [f64; 2], nodes: u32) -> Self {
        let [a, b] = ends;
        let node = |i: u32| {
            let fraction = 0.5 - 0.5 * (PI * (f64::from(i) + 0.5) / f64::from(nodes)).cos();
            let x = a + fraction * (b - a);
            (x, f(x))
        };
        Self { ends, nodes: (0..nodes).map(node).collect() }
    }

    /// The interpolated values at a point between the ends.
    #[must_use]
    pub fn at(&self, x: f64) -> [f64; N] {
        let [a, b] = self.ends;
        let (mut sums, mut total) = ([0.0; N], 0.0);
        for (i, (node, values)) in self.nodes.iter().enumerate() {
            if x == *node {
                return *values;
            }
            let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
            let weight = sign * ((node - a) * (b - node)).sqrt() / (x - node);
            total += weight;
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
        }
        sums.map(|sum| sum / total)
    }
}

/// The number of steps at whose ends the sign of a slope is evaluated.
const SAMPLES: u32 = 400;

/// The interval `[a, b]`, cut where the slope of a function changes its sign. Two changes within a 400th of it are
/// missed.
#[must_use]
pub fn monotone(slope: impl Fn(f64) -> f64, [a, b]: [f64; 2]) -> Vec<[f64; 2]> {
    // The samples avoid the ends, where a slope may be 0 or infinite.
    let margin = 1e-6 * (b - a);
    let point = |i: u32| a + margin + (b - a - 2.0 * margin) * f64::from(i) / f64::from(SAMPLES);
    let turns = (0..SAMPLES).filter_map(|i| root(&slope, [point(i), point(i + 1)]));
    let mut ends: Vec<f64> = [a].into_iter().chain(turns).collect();
    ends.push(b);
    ends.windows(2).map(|pair| [pair[0], pair[1]]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpolants_go_through_smooth_functions() {
        let interpolant = Interpolant::new(|x| [x.exp(), 1.0 / (4.0 + x * x)], [-0.5, 2.0], 30);
        for x in [-0.5, -0.1, 0.75, 1.3, 2.0_f64] {
            let [exp, bell] = interpolant.at(x);
            assert!((exp - x.exp()).abs() < 1e-13 && (bell - 1.0 / (4.0 + x * x)).abs() < 1e-12, "{x}: {exp}, {bell}");
        }
    }

    #[test]
    fn the_rules_are_exact_for_the_polynomials_they_should_be() {
        for (rule, degree) in [("Kronrod", 22), ("Gauss", 13)] {
            for n in (0..=degree).step_by(2) {
                let piece = Piece::new(&|x: f64| x.powi(n), [-1.0, 1.0]);
                let error = (piece.value - 2.0 / f64::from(n + 1)).abs();
                let error = if rule == "Gauss" { error.max(piece.error) } else { error };
                assert!(error < 2e-16 * 4.0, "{rule}, x^{n}: {error:e}");
            }
        }
    }

    #[test]
    fn integrals_with_kinks_and_infinite_slopes() {
        let circle = integral(|x| (1.0 - x * x).sqrt(), [-1.0, 1.0]);
        assert!((circle - std::f64::consts::FRAC_PI_2).abs() < 1e-10);
        assert!((integral(|x| (x - 0.3).abs(), [0.0, 1.0]) - 0.29).abs() < 1e-10);
        assert!((integral(f64::ln, [0.0, 1.0]) + 1.0).abs() < 1e-9);
        assert!((integral(f64::exp, [1.0, 0.0]) + 1.0_f64.exp() - 1.0).abs() < 1e-13);
    }

    #[test]
    fn a_cubic_has_three_monotone_pieces_with_a_root_in_each() {
        let f = |x: f64| x * x * x - x;
        let pieces = monotone(|x| 3.0 * x * x - 1.0, [-2.0, 2.0]);
        let roots: Vec<f64> = pieces.iter().filter_map(|&piece| root(f, piece)).collect();
        assert_eq!(pieces.len(), 3);
        assert!(roots.iter().zip([-1.0, 0.0, 1.0]).all(|(found, x)| (found - x).abs() < 1e-15), "{roots:?}");
        assert_eq!([crossing(f, [1.5, 2.0]), crossing(f, [-2.0, -1.5])], [1.5, -1.5]);
    }
}
