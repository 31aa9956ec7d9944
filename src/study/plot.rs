//! Drawings for a paper: curves over logarithmic axes, in SVG that stands alone.

mod axis;

use std::fmt::Write as _;

use axis::LogAxis;

/// One drawing.
#[derive(Clone, Debug)]
pub(super) struct Plot {
    pub(super) title: String,
    pub(super) x_title: String,
    pub(super) y_title: String,
    pub(super) curves: Vec<Curve>,
}

/// The points of a method, with what is predicted of them.
#[derive(Clone, Debug)]
pub(super) struct Curve {
    pub(super) label: String,
    /// Which colour and mark it has: that of its method in all drawings of a study.
    pub(super) style: usize,
    pub(super) dots: Vec<Dot>,
    /// A dashed line.
    pub(super) prediction: Vec<[f64; 2]>,
}

/// A point with its standard error.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dot {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) std_error: Option<f64>,
}

impl Dot {
    /// Two standard errors to both sides.
    fn band(&self) -> [f64; 2] {
        let reach = 2.0 * self.std_error.unwrap_or(0.0);
        [self.y - reach, self.y + reach]
    }

    /// Whether all that is known is that it is no more than its upper end.
    fn is_limit(&self) -> bool {
        self.band()[0] <= 0.0
    }
}

/// Colours that the colour-blind tell apart, dark ones first: Okabe and Ito 2008, "Color Universal Design".
const COLOURS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#000000", "#e69f00", "#56b4e9"];
const LEFT: f64 = 74.0;
const RIGHT: f64 = 470.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 330.0;
const HEIGHT: f64 = 384.0;
/// Where the legend begins, and how wide a letter is at most.
const LEGEND: f64 = 486.0;
const LETTER: f64 = 6.9;

impl Plot {
    /// The drawing; None if there is nothing to draw.
    pub(super) fn draw(&self) -> Option<String> {
        let dots = || self.curves.iter().flat_map(|curve| &curve.dots);
        let x = LogAxis::around(dots().map(|dot| dot.x), [LEFT, RIGHT])?;
        let measured = dots().flat_map(|dot| if dot.is_limit() { [dot.band()[1]; 2] } else { dot.band() });
        let predicted = self.curves.iter().flat_map(|curve| curve.prediction.iter().map(|at| at[1]));
        let y = LogAxis::around(measured.chain(predicted), [BOTTOM, TOP])?;
        let longest = self.curves.iter().map(|curve| curve.label.chars().count()).max().unwrap_or(0).max(10);
        let width = LEGEND + 34.0 + LETTER * longest as f64;
        let mut svg = format!(
            r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0} {HEIGHT}" width="{width:.0}" height="{HEIGHT}" role="img" font-family="Helvetica, Arial, 'DejaVu Sans', sans-serif" font-size="13" fill="#000"><title>{}</title><rect width="100%" height="100%" fill="#fff"/>"##,
            escaped(&format!("{}: {} over {}", self.title, self.y_title, self.x_title))
        );
        self.frame(&mut svg, &x, &y);
        let _ = write!(
            svg,
            r#"<clipPath id="c"><rect x="{LEFT}" y="{TOP}" width="{}" height="{}"/></clipPath>"#,
            RIGHT - LEFT,
            BOTTOM - TOP
        );
        for curve in &self.curves {
            curve.draw(&mut svg, &x, &y);
        }
        self.legend(&mut svg);
        Some(svg + "</svg>\n")
    }

    fn frame(&self, svg: &mut String, x: &LogAxis, y: &LogAxis) {
        for tick in x.ticks() {
            let at = x.place(tick.value);
            if let Some(label) = &tick.label {
                let _ = write!(
                    svg,
                    r##"<path d="M{at:.1} {TOP}V{BOTTOM}" stroke="#ddd"/><text x="{at:.1}" y="{}" text-anchor="middle">{label}</text>"##,
                    BOTTOM + 20.0
                );
            }
            let _ = write!(svg, r##"<path d="M{at:.1} {BOTTOM}v-{}" stroke="#000"/>"##, tick.length());
        }
        for tick in y.ticks() {
            let at = y.place(tick.value);
            if let Some(label) = &tick.label {
                let _ = write!(
                    svg,
                    r##"<path d="M{LEFT} {at:.1}H{RIGHT}" stroke="#ddd"/><text x="{}" y="{:.1}" text-anchor="end">{label}</text>"##,
                    LEFT - 8.0,
                    at + 4.5
                );
            }
            let _ = write!(svg, r##"<path d="M{LEFT} {at:.1}h{}" stroke="#000"/>"##, tick.length());
        }
        let middle = 0.5 * (TOP + BOTTOM);
        let _ = write!(
            svg,
            r##"<rect x="{LEFT}" y="{TOP}" width="{}" height="{}" fill="none" stroke="#000"/><text x="{}" y="{}" text-anchor="middle">{}</text><text transform="translate(18 {middle}) rotate(-90)" text-anchor="middle">{}</text><text x="{LEFT}" y="{}" font-weight="bold">{}</text>"##,
            RIGHT - LEFT,
            BOTTOM - TOP,
            0.5 * (LEFT + RIGHT),
            BOTTOM + 42.0,
            escaped(&self.x_title),
            escaped(&self.y_title),
            TOP - 12.0,
            escaped(&self.title)
        );
    }

    fn legend(&self, svg: &mut String) {
        let mut at = TOP + 10.0;
        for curve in &self.curves {
            let colour = curve.colour();
            let _ = write!(svg, r#"<path d="M{LEGEND} {at}h24" stroke="{colour}" stroke-width="1.5"/>"#);
            mark(svg, curve.style, (LEGEND + 12.0, at));
            let _ = write!(svg, r#"<text x="{}" y="{}">{}</text>"#, LEGEND + 32.0, at + 4.5, escaped(&curve.label));
            at += 20.0;
        }
        if self.curves.iter().any(|curve| !curve.prediction.is_empty()) {
            let _ = write!(
                svg,
                r##"<path d="M{LEGEND} {at}h24" stroke="#444" stroke-width="1.5" stroke-dasharray="5 3"/><text x="{}" y="{}">predicted</text>"##,
                LEGEND + 32.0,
                at + 4.5
            );
            at += 20.0;
        }
        let _ = write!(
            svg,
            r##"<rect x="{LEGEND}" y="{}" width="24" height="10" fill="#444" opacity="0.2"/><text x="{}" y="{}">±2 s.e.</text>"##,
            at - 5.0,
            LEGEND + 32.0,
            at + 4.5
        );
    }
}

impl Curve {
    fn colour(&self) -> &'static str {
        COLOURS[self.style % COLOURS.len()]
    }

    fn draw(&self, svg: &mut String, x: &LogAxis, y: &LogAxis) {
        let colour = self.colour();
        let place = |at: f64, value: f64| format!("{:.1} {:.1}", x.place(at), y.place(value));
        let known: Vec<&Dot> = self.dots.iter().filter(|dot| !dot.is_limit()).collect();
        if known.len() > 1 {
            let upper = known.iter().map(|dot| place(dot.x, dot.band()[1]));
            let lower = known.iter().rev().map(|dot| place(dot.x, dot.band()[0]));
            let around: Vec<_> = upper.chain(lower).collect();
            let _ = write!(svg, r#"<path d="M{}Z" fill="{colour}" opacity="0.2"/>"#, around.join("L"));
            let line: Vec<_> = known.iter().map(|dot| place(dot.x, dot.y)).collect();
            let _ = write!(svg, r#"<path d="M{}" fill="none" stroke="{colour}" stroke-width="1.5"/>"#, line.join("L"));
        }
        if self.prediction.len() > 1 {
            let line: Vec<_> = self.prediction.iter().map(|[at, value]| place(*at, *value)).collect();
            let _ = write!(
                svg,
                r##"<path d="M{}" fill="none" stroke="{colour}" stroke-width="1.5" stroke-dasharray="5 3" clip-path="url(#c)"/>"##,
                line.join("L")
            );
        }
        for dot in &self.dots {
            let at = x.place(dot.x);
            if dot.is_limit() {
                let top = y.place(dot.band()[1]);
                let _ = write!(
                    svg,
                    r#"<path d="M{:.1} {top:.1}h10m-5 0v16m-4 -5l4 5l4 -5" fill="none" stroke="{colour}" stroke-width="1.3"/>"#,
                    at - 5.0
                );
            } else {
                let [low, high] = dot.band().map(|end| y.place(end));
                let _ = write!(svg, r#"<path d="M{at:.1} {low:.1}V{high:.1}" stroke="{colour}"/>"#);
                mark(svg, self.style, (at, y.place(dot.y)));
            }
        }
    }
}

/// The mark of a style: each has its own, so that a print without colour is read too.
fn mark(svg: &mut String, style: usize, (x, y): (f64, f64)) {
    let colour = COLOURS[style % COLOURS.len()];
    let outline = match style % 7 {
        0 => {
            let _ = write!(svg, r#"<circle cx="{x:.1}" cy="{y:.1}" r="3.8" fill="{colour}"/>"#);
            return;
        }
        1 => "m-3.5 -3.5h7v7h-7z",
        2 => "m0 -4.6l4.4 7.6h-8.8z",
        3 => "m0 -5l4.4 5l-4.4 5l-4.4 -5z",
        4 => "m-4 -4l8 8m-8 0l8 -8",
        5 => "m0 4.6l4.4 -7.6h-8.8z",
        _ => "m-4.6 0h9.2m-4.6 -4.6v9.2",
    };
    let _ = write!(svg, r#"<path d="M{x:.1} {y:.1}{outline}" fill="{colour}" stroke="{colour}" stroke-width="1.4"/>"#);
}

/// A text as it may stand in a file of tags.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(dots: Vec<Dot>) -> Plot {
        let prediction = vec![[1.0, 1.0], [100.0, 0.1]];
        let curve = Curve { label: "a & <b>".into(), style: 1, dots, prediction };
        Plot { title: "scene".into(), x_title: "samples".into(), y_title: "RMSE".into(), curves: vec![curve] }
    }

    fn dot(x: f64, y: f64, std_error: f64) -> Dot {
        Dot { x, y, std_error: Some(std_error) }
    }

    #[test]
    fn points_stand_where_they_are() {
        let svg = plot(vec![dot(1.0, 1.0, 0.0), dot(10.0, 0.316_227_766, 0.0), dot(100.0, 0.1, 0.0)]).draw().unwrap();
        // The middle point is the middle of the axes, and lies on the line that is predicted.
        assert!(svg.contains("M272.0 182.0m-3.5"), "{svg}");
        assert!(svg.contains("a &amp; &lt;b&gt;") && svg.contains("predicted") && !svg.contains("NaN"), "{svg}");
        roxmltree::Document::parse(&svg).unwrap();
    }

    #[test]
    fn what_may_be_zero_is_drawn_as_a_limit() {
        let svg = plot(vec![dot(1.0, 1.0, 0.1), dot(10.0, -0.01, 0.02), dot(100.0, 0.01, 0.02)]).draw().unwrap();
        assert_eq!(svg.matches("v16m-4 -5").count(), 2, "{svg}");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }

    #[test]
    fn nothing_draws_nothing() {
        assert!(plot(Vec::new()).draw().is_none());
        assert!(plot(vec![dot(1.0, 1.0, 0.0)]).draw().is_some());
    }
}
