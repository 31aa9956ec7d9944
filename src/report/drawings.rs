//! The plots of the report: measurements with theoretical curves, and histograms of p-values.

use serde::Serialize;

use super::number;
use crate::{
    law::Curve,
    plot::{Axis, Layer, Plot, Point, Shape, Style},
    stats::{Ks, Verdict},
};

/// A plot as an SVG element, and its caption.
#[derive(Debug, Serialize)]
pub(super) struct Drawing {
    svg: String,
    caption: String,
}

/// Plots the measurements of a law and the expected curve. None if there is nothing to draw.
pub(super) fn of_curve(subject: &str, curve: &Curve) -> Option<Drawing> {
    let [across, upwards] = curve.axes;
    let right = curve.expected.last()?[0];
    let points = curve.found.iter().map(|&[x, y, error]| Point { x, y, std_error: Some(error) }).collect();
    let layer = |label: &str, style, shape| Layer { label: label.into(), style, shape };
    let mark = curve.mark.map(|(at, label)| layer(label, Style::Plain, Shape::VerticalLine(at)));
    let line = Shape::Line { points: curve.expected.clone(), is_dashed: false };
    let found = layer("found", Style::Series(1), Shape::Points { points, joined: false });
    let layers = [layer("expected", Style::Series(0), line)].into_iter().chain(mark).chain([found]);
    let plot = Plot {
        title: subject.into(),
        x: Axis::linear(across, [0.0, right]),
        y: Axis::log(upwards),
        layers: layers.collect(),
    };
    let caption = format!("{} measurements and the theoretical curve.", curve.found.len());
    Some(Drawing { svg: plot.inline()?, caption })
}

/// Plots a histogram of the p-values of all tested tiles' luminances. None if no tile was tested.
pub(super) fn of_tiles(verdict: &Verdict) -> Option<Drawing> {
    let tested = verdict.tiles.iter().flatten().filter(|tile| !tile.luminance.is_vacuous());
    let p: Vec<f64> = tested.map(|tile| tile.luminance.p).collect();
    if p.is_empty() {
        return None;
    }
    let uniformity = number::probability(Ks::one_sample(&p, |p| p).p);
    let caption = format!(
        "p-values of {} tiles. If the images agree, the bars scatter about the dashed line, and about 19 of 20 end within the band. \
         Kolmogorov–Smirnov test against the uniform distribution: p = {uniformity} (not part of the verdict).",
        p.len()
    );
    Some(Drawing { svg: histogram(&p).inline()?, caption })
}

/// A histogram of p-values with equal bins, and the counts expected of a uniform distribution.
fn histogram(p: &[f64]) -> Plot {
    let bins = if p.len() < 200 { 10 } else { 20 };
    let mut counts = vec![0.0; bins];
    for p in p {
        counts[((p * bins as f64) as usize).min(bins - 1)] += 1.0;
    }
    let probability = 1.0 / bins as f64;
    let expected = p.len() as f64 * probability;
    // Two standard deviations of a binomial count.
    let reach = 2.0 * (expected * (1.0 - probability)).sqrt();
    let tallest = counts.iter().copied().fold(expected + reach, f64::max);
    let layer = |label: &str, style, shape| Layer { label: label.into(), style, shape };
    Plot {
        title: String::new(),
        x: Axis::linear("p-value of a tile", [0.0, 1.0]),
        y: Axis::linear("number of tiles", [0.0, 1.05 * tallest]),
        layers: vec![
            layer(
                "± 2 standard deviations",
                Style::Plain,
                Shape::Band([(expected - reach).max(0.0), expected + reach]),
            ),
            layer("tiles", Style::Series(0), Shape::Bars { ends: [0.0, 1.0], heights: counts }),
            layer("expected", Style::Plain, Shape::HorizontalLine(expected)),
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plots_of_laws_show_curve_points_and_mark() {
        let curve = Curve {
            axes: ["distance", "light"],
            expected: vec![[0.0, 0.1], [1.0, 10.0]],
            found: vec![[0.5, 1.0, 0.1], [1.0, 0.0, 0.0]],
            mark: Some((0.5, "edge")),
        };
        let drawing = of_curve("a case", &curve).unwrap();
        for label in ["a case", "distance", "light", "expected", "found", "edge"] {
            assert!(drawing.svg.contains(&format!(">{label}<")), "{label}: {}", drawing.svg);
        }
        assert!(of_curve("nothing", &Curve::default()).is_none());
    }

    #[test]
    fn every_p_value_is_in_a_bin() {
        let plot = histogram(&[0.0, 0.05, 0.5, 0.999, 1.0]);
        let Shape::Bars { heights, .. } = &plot.layers[1].shape else { panic!("the second layer holds the bars") };
        assert_eq!(heights, &[2.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0]);
        assert!(plot.inline().is_some());
    }
}
