//! The p-values of the tiles as a histogram in SVG.

use std::fmt::Write as _;

use serde::Serialize;

use super::number;
use crate::stats::{Ks, Verdict};

/// Units of the drawing: width, height, and where the axes cross.
const SIZE: (f64, f64) = (320.0, 220.0);
const LEFT: f64 = 34.0;
const BOTTOM: f64 = 182.0;
const TOP: f64 = 12.0;
const RIGHT: f64 = 308.0;

/// A histogram with what stands beneath it.
#[derive(Debug, Serialize)]
pub(super) struct Histogram {
    svg: String,
    caption: String,
}

impl Histogram {
    /// Of the luminances of all tiles that test anything; `None` if none does.
    pub(super) fn of_tiles(verdict: &Verdict) -> Option<Self> {
        let tested = verdict.tiles.iter().flatten().filter(|tile| !tile.luminance.is_vacuous());
        let p: Vec<f64> = tested.map(|tile| tile.luminance.p).collect();
        if p.is_empty() {
            return None;
        }
        let bins = if p.len() < 200 { 10 } else { 20 };
        let mut counts = vec![0_u32; bins];
        for p in &p {
            counts[((p * bins as f64) as usize).min(bins - 1)] += 1;
        }
        let uniformity = number::probability(Ks::one_sample(&p, |p| p).p);
        let caption = format!(
            "p-values of {} tiles. If the images agree, bars scatter about the dashed line, 19 of 20 within the band. \
             Kolmogorov–Smirnov against uniform: p = {uniformity} (for the reader; not part of the verdict).",
            p.len()
        );
        Some(Self { svg: draw(&counts), caption })
    }
}

fn draw(counts: &[u32]) -> String {
    let (total, bins) = (f64::from(counts.iter().sum::<u32>()), counts.len() as f64);
    let expected = total / bins;
    // Two standard deviations of a binomial count.
    let band = 2.0 * (expected * (1.0 - 1.0 / bins)).sqrt();
    let tallest = f64::from(counts.iter().copied().max().unwrap_or(0)).max(expected + band) * 1.05;
    let x = |p: f64| LEFT + p * (RIGHT - LEFT);
    let y = |count: f64| BOTTOM - count / tallest * (BOTTOM - TOP);
    let mut svg = format!(
        r#"<svg class="histogram" viewBox="0 0 {} {}" role="img" aria-label="Histogram of p-values of tiles in {bins} bins, expecting {} in each; counts: {}">"#,
        SIZE.0,
        SIZE.1,
        number::significant(expected, 3),
        counts.iter().map(u32::to_string).collect::<Vec<_>>().join(", "),
    );
    let (high, low) = (y(expected + band), y((expected - band).max(0.0)));
    let (left, width) = (x(0.0), x(1.0) - x(0.0));
    let _ = write!(svg, r#"<rect class="band" x="{left}" y="{high:.1}" width="{width}" height="{:.1}"/>"#, low - high);
    for (i, &count) in counts.iter().enumerate() {
        let (from, top) = (x(i as f64 / bins), y(f64::from(count)));
        let (width, height) = ((x(1.0) - x(0.0)) / bins - 1.5, BOTTOM - top);
        let _ =
            write!(svg, r#"<rect class="bar" x="{from:.1}" y="{top:.1}" width="{width:.1}" height="{height:.1}"/>"#);
    }
    let at = y(expected);
    let _ = write!(
        svg,
        r#"<path class="expected" d="M{left} {at:.1}H{RIGHT}"/><path class="axis" d="M{left} {TOP}V{BOTTOM}H{RIGHT}"/>"#
    );
    for (p, label) in [(0.0, "0"), (0.5, "0.5"), (1.0, "1")] {
        let _ = write!(svg, r#"<text x="{}" y="{}" text-anchor="middle">{label}</text>"#, x(p), BOTTOM + 16.0);
    }
    let _ = write!(svg, r#"<text x="{}" y="{}" text-anchor="middle">p of a tile</text>"#, x(0.5), BOTTOM + 33.0);
    let _ = write!(
        svg,
        r#"<text x="{}" y="{:.1}" text-anchor="end">{}</text>"#,
        LEFT - 5.0,
        at + 4.0,
        number::significant(expected, 2)
    );
    svg + "</svg>"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_a_bar_a_bin_and_nothing_is_drawn_outside() {
        let svg = draw(&[3, 0, 12, 5]);
        assert_eq!(svg.matches(r#"class="bar""#).count(), 4);
        assert!(svg.contains("counts: 3, 0, 12, 5") && svg.contains("expecting 5 in each"), "{svg}");
        assert!(!svg.contains("NaN") && !svg.contains(r#"="-"#), "{svg}");
    }
}
