//! Measurements over what they should be, in SVG.

use std::fmt::Write as _;

use super::number;
use crate::law::Curve;

/// Units of the drawing: width, height, and where the axes are.
const SIZE: (f64, f64) = (480.0, 260.0);
const LEFT: f64 = 52.0;
const RIGHT: f64 = 468.0;
const TOP: f64 = 24.0;
const BOTTOM: f64 = 216.0;

/// The drawing: values upwards by their logarithms, measurements with two standard errors on either side.
pub(super) fn draw(subject: &str, curve: &Curve) -> String {
    let right = curve.expected.last().map_or(1.0, |point| point[0]);
    let x = |at: f64| LEFT + at / right * (RIGHT - LEFT);
    let [low, high] = decades(curve);
    let y = |value: f64| {
        let part = (value.max(f64::MIN_POSITIVE).log10() - low) / (high - low);
        BOTTOM - part.clamp(0.0, 1.0) * (BOTTOM - TOP)
    };
    let [across, upwards] = curve.axes;
    let mut svg = format!(
        r#"<svg class="histogram" viewBox="0 0 {} {}" role="img" aria-label="{subject}: {upwards} over {across}, {} measurements on the line that is expected">"#,
        SIZE.0,
        SIZE.1,
        curve.found.len()
    );
    if let Some(mark) = curve.mark {
        let _ = write!(svg, r#"<path class="expected" d="M{:.1} {TOP}V{BOTTOM}"/>"#, x(mark));
    }
    let line: Vec<_> = curve.expected.iter().map(|&[at, value]| format!("{:.1} {:.1}", x(at), y(value))).collect();
    let _ = write!(svg, r#"<path class="theory" d="M{}"/>"#, line.join("L"));
    for &[at, value, error] in &curve.found {
        let (at, ends) = (x(at), [value - 2.0 * error, value + 2.0 * error].map(y));
        let _ = write!(
            svg,
            r#"<path class="axis" d="M{at:.1} {:.1}V{:.1}"/><circle class="point" cx="{at:.1}" cy="{:.1}" r="2.2"/>"#,
            ends[0],
            ends[1],
            y(value)
        );
    }
    let _ = write!(svg, r#"<path class="axis" d="M{LEFT} {TOP}V{BOTTOM}H{RIGHT}"/>"#);
    for part in [0.0, 0.5, 1.0] {
        let (at, label) = (x(part * right), number::significant(part * right, 2));
        let _ = write!(svg, r#"<text x="{at}" y="{}" text-anchor="middle">{label}</text>"#, BOTTOM + 16.0);
    }
    for decade in low as i32..=high as i32 {
        let value = 10_f64.powi(decade);
        let (at, label) = (y(value) + 4.0, number::significant(value, 1));
        let _ = write!(svg, r#"<text x="{}" y="{at:.1}" text-anchor="end">{label}</text>"#, LEFT - 6.0);
    }
    let middle = 0.5 * (LEFT + RIGHT);
    let _ = write!(svg, r#"<text x="{middle}" y="{}" text-anchor="middle">{across}</text>"#, BOTTOM + 34.0);
    let _ = write!(svg, r#"<text x="{LEFT}" y="{}">{upwards}, {subject}</text>"#, TOP - 9.0);
    svg + "</svg>"
}

/// The whole powers of ten around all values.
fn decades(curve: &Curve) -> [f64; 2] {
    let values = || curve.expected.iter().map(|point| point[1].log10());
    let low = values().fold(f64::INFINITY, f64::min).floor();
    [low, values().fold(f64::NEG_INFINITY, f64::max).ceil().max(low + 1.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_lie_on_their_line() {
        let curve = Curve {
            axes: ["way", "light"],
            expected: vec![[0.0, 0.1], [1.0, 10.0]],
            found: vec![[0.5, 1.0, 0.1], [1.0, 0.0, 0.0]],
            mark: Some(0.5),
        };
        let svg = draw("a case", &curve);
        assert!(svg.contains(r#"d="M52.0 216.0L468.0 24.0""#), "{svg}");
        assert!(svg.contains(r#"cx="260.0" cy="120.0""#) && svg.contains(r#"cx="468.0" cy="216.0""#), "{svg}");
        assert!(!svg.contains("NaN") && !svg.contains(r#"="-"#), "{svg}");
    }
}
