//! Layers of a plot: their data, and how they are drawn between two rulers.

use std::fmt::Write as _;

use super::axis::{Axis, Ruler, Scale};

/// A shape and its style.
#[derive(Clone, Debug)]
pub(crate) struct Layer {
    /// The label in the legend; empty if the layer has no entry. Layers with equal labels share an entry.
    pub(crate) label: String,
    pub(crate) style: Style,
    pub(crate) shape: Shape,
}

/// The colour and the mark of a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Style {
    /// The colour and mark of the n-th series, from 0.
    Series(usize),
    /// The colour of the text.
    Plain,
}

/// The shape of a layer.
#[derive(Clone, Debug)]
pub(crate) enum Shape {
    /// Measurements with error bars of two standard errors. If `joined`, a line in a band joins them.
    Points { points: Vec<Point>, joined: bool },
    /// A polyline.
    Line { points: Vec<[f64; 2]>, is_dashed: bool },
    /// Adjacent bars of equal width, from 0 to their heights.
    Bars { ends: [f64; 2], heights: Vec<f64> },
    /// A horizontal band between two values of y.
    Band([f64; 2]),
    /// A dashed horizontal line at a value of y.
    HorizontalLine(f64),
    /// A dashed vertical line at a value of x.
    VerticalLine(f64),
}

/// A measurement.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) std_error: Option<f64>,
}

/// The number of colours. More series repeat a colour with another mark. The colours are distinct for the colour-blind:
/// the first three come from Okabe and Ito 2008, "Color Universal Design"; the others also differ from them in
/// lightness.
pub(super) const COLOURS: usize = 6;

/// The outlines of marks, relative to their centre.
const MARKS: [&str; 7] = [
    "m-3.6 0a3.6 3.6 0 1 0 7.2 0a3.6 3.6 0 1 0 -7.2 0z",
    "m-3.3 -3.3h6.6v6.6h-6.6z",
    "m0 -4.4l4.2 7.3h-8.4z",
    "m0 -4.8l4.2 4.8l-4.2 4.8l-4.2 -4.8z",
    "m-3.6 -3.6l7.2 7.2m-7.2 0l7.2 -7.2",
    "m0 4.4l4.2 -7.3h-8.4z",
    "m-4.4 0h8.8m-4.4 -4.4v8.8",
];

impl Style {
    pub(super) fn class(self) -> String {
        match self {
            Self::Series(number) => format!("s{}", number % COLOURS),
            Self::Plain => "plain".into(),
        }
    }

    /// Draws the mark at a point, scaled by a factor.
    pub(super) fn mark(self, svg: &mut String, [x, y]: [f64; 2], size: f64) {
        let number = if let Self::Series(number) = self { number } else { 0 };
        let outline = MARKS[number % MARKS.len()];
        let _ =
            write!(svg, r#"<path class="dot" transform="translate({x:.1} {y:.1}) scale({size})" d="M0 0{outline}"/>"#);
    }
}

impl Point {
    /// The interval of two standard errors to either side.
    fn band(&self) -> [f64; 2] {
        let reach = 2.0 * self.std_error.filter(|error| error.is_finite()).unwrap_or(0.0);
        [self.y - reach, self.y + reach]
    }

    /// Whether a logarithmic axis can show only the upper end of its band.
    fn is_limit(&self, y: &Axis) -> bool {
        y.scale == Scale::Log && self.band()[0] <= 0.0
    }

    fn is_drawn(&self, x: &Axis, y: &Axis) -> bool {
        x.has(self.x) && self.y.is_finite() && (y.has(self.y) || self.is_limit(y))
    }
}

impl Shape {
    /// Removes data that cannot be drawn on the axes. None if no data are left.
    pub(super) fn clean(&self, x: &Axis, y: &Axis) -> Option<Self> {
        match self {
            Self::Points { points, joined } => {
                let points: Vec<Point> = points.iter().copied().filter(|point| point.is_drawn(x, y)).collect();
                (!points.is_empty()).then_some(Self::Points { points, joined: *joined })
            }
            Self::Line { points, .. } => points.iter().any(|at| x.has(at[0]) && y.has(at[1])).then(|| self.clone()),
            Self::Bars { ends, heights } => {
                let all = !heights.is_empty() && ends.iter().all(|end| x.has(*end)) && ends[0] < ends[1];
                all.then(|| self.clone())
            }
            Self::Band(ends) => ends.iter().all(|end| y.has(*end)).then(|| self.clone()),
            Self::HorizontalLine(at) => y.has(*at).then(|| self.clone()),
            Self::VerticalLine(at) => x.has(*at).then(|| self.clone()),
        }
    }

    /// Whether the shape shows data, and not only a reference level for data.
    pub(super) fn is_data(&self) -> bool {
        matches!(self, Self::Points { .. } | Self::Line { .. } | Self::Bars { .. })
    }

    /// The values that the x axis must span.
    pub(super) fn xs(&self) -> Vec<f64> {
        match self {
            Self::Points { points, .. } => points.iter().map(|point| point.x).collect(),
            Self::Line { points, .. } => points.iter().map(|at| at[0]).collect(),
            Self::Bars { ends, .. } => ends.to_vec(),
            Self::VerticalLine(at) => vec![*at],
            Self::Band(_) | Self::HorizontalLine(_) => Vec::new(),
        }
    }

    /// The values that the y axis must span.
    pub(super) fn ys(&self, y: &Axis) -> Vec<f64> {
        match self {
            Self::Points { points, .. } => {
                let ends = |point: &Point| if point.is_limit(y) { [point.band()[1]; 2] } else { point.band() };
                points.iter().flat_map(ends).collect()
            }
            Self::Line { points, .. } => points.iter().map(|at| at[1]).collect(),
            Self::Bars { heights, .. } => heights.iter().copied().chain([0.0]).collect(),
            Self::Band(ends) => ends.to_vec(),
            Self::HorizontalLine(at) => vec![*at],
            Self::VerticalLine(_) => Vec::new(),
        }
    }

    /// How the standard errors are shown on an axis.
    pub(super) fn errors(&self, y: &Axis) -> Errors {
        let Self::Points { points, joined } = self else { return Errors::default() };
        let known = points.iter().filter(|point| !point.is_limit(y));
        let has_bars = known.clone().any(|point| point.band()[0] < point.y);
        Errors {
            bars: has_bars,
            band: has_bars && *joined && known.count() > 1,
            limits: points.iter().any(|point| point.is_limit(y)),
        }
    }
}

/// How the standard errors of a layer are shown: bars, a band around its line, or arrows where only the upper end is
/// positive.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Errors {
    pub(super) bars: bool,
    pub(super) band: bool,
    pub(super) limits: bool,
}

/// The two axes of a plot, placed in a drawing.
pub(super) struct Field<'p> {
    pub(super) axes: [&'p Axis; 2],
    pub(super) x: Ruler,
    pub(super) y: Ruler,
}

impl Field<'_> {
    fn position(&self, x: f64, y: f64) -> [f64; 2] {
        [self.x.position(x), self.y.position(y)]
    }

    /// Draws a layer.
    pub(super) fn draw(&self, svg: &mut String, style: Style, shape: &Shape) {
        let _ = write!(svg, r#"<g class="{}">"#, style.class());
        let [left, right] = self.x.positions();
        let [bottom, top] = self.y.positions();
        match shape {
            Shape::Points { points, joined } => self.points(svg, style, points, *joined),
            Shape::Line { points, is_dashed } => {
                self.line(svg, points, if *is_dashed { "line dashed" } else { "line" })
            }
            Shape::Bars { ends, heights } => self.bars(svg, *ends, heights),
            Shape::Band(ends) => {
                let [low, high] = ends.map(|end| self.y.position(end));
                let _ = write!(svg, r#"<path class="band" d="M{left:.1} {low:.1}H{right:.1}V{high:.1}H{left:.1}z"/>"#);
            }
            Shape::HorizontalLine(at) => {
                let at = self.y.position(*at);
                let _ = write!(svg, r#"<path class="line dashed" d="M{left:.1} {at:.1}H{right:.1}"/>"#);
            }
            Shape::VerticalLine(at) => {
                let at = self.x.position(*at);
                let _ = write!(svg, r#"<path class="line dashed" d="M{at:.1} {bottom:.1}V{top:.1}"/>"#);
            }
        }
        svg.push_str("</g>");
    }

    fn points(&self, svg: &mut String, style: Style, points: &[Point], joined: bool) {
        let [_, y] = self.axes;
        // Many points are drawn smaller, so that the line between them stays visible.
        let size = if points.len() > 16 { 0.6 } else { 1.0 };
        let known: Vec<&Point> = points.iter().filter(|point| !point.is_limit(y)).collect();
        if joined && known.len() > 1 {
            let upper = known.iter().map(|point| self.position(point.x, point.band()[1]));
            let lower = known.iter().rev().map(|point| self.position(point.x, point.band()[0]));
            let around: Vec<_> = upper.chain(lower).map(text_of).collect();
            let _ = write!(svg, r#"<path class="band" d="M{}z"/>"#, around.join("L"));
            let line: Vec<_> = known.iter().map(|point| text_of(self.position(point.x, point.y))).collect();
            let _ = write!(svg, r#"<path class="line" d="M{}"/>"#, line.join("L"));
        }
        for point in points {
            let [low, high] = point.band();
            if point.is_limit(y) {
                limit(svg, self.position(point.x, high));
                continue;
            }
            if low < high {
                let ([x, low], [_, high]) = (self.position(point.x, low), self.position(point.x, high));
                let _ = write!(svg, r#"<path class="error" d="M{x:.1} {low:.1}V{high:.1}"/>"#);
            }
            style.mark(svg, self.position(point.x, point.y), size);
        }
    }

    /// Draws a line. It is interrupted where a point has no position.
    fn line(&self, svg: &mut String, points: &[[f64; 2]], class: &str) {
        let [x, y] = self.axes;
        for piece in points.split(|at| !(x.has(at[0]) && y.has(at[1]))).filter(|piece| piece.len() > 1) {
            let piece: Vec<_> = piece.iter().map(|at| text_of(self.position(at[0], at[1]))).collect();
            let _ = write!(svg, r#"<path class="{class}" d="M{}"/>"#, piece.join("L"));
        }
    }

    fn bars(&self, svg: &mut String, [from, to]: [f64; 2], heights: &[f64]) {
        /// The gap between two bars.
        const GAP: f64 = 1.5;
        let edge = |i: usize| self.x.position(from + (to - from) * i as f64 / heights.len() as f64);
        let ground = self.y.position(0.0);
        for (i, height) in heights.iter().enumerate().filter(|(_, height)| height.is_finite()) {
            let (left, width) = (edge(i), (edge(i + 1) - edge(i) - GAP).max(0.5));
            let top = self.y.position(*height);
            let _ = write!(
                svg,
                r#"<rect class="bar" x="{left:.1}" y="{:.1}" width="{width:.1}" height="{:.1}"/>"#,
                top.min(ground),
                (ground - top).abs()
            );
        }
    }
}

fn text_of([x, y]: [f64; 2]) -> String {
    format!("{x:.1} {y:.1}")
}

/// Draws an arrow from an upper end downwards.
pub(super) fn limit(svg: &mut String, [x, y]: [f64; 2]) {
    let _ = write!(svg, r#"<path class="limit" d="M{:.1} {y:.1}h8m-4 0v13m-3.5 -4.5l3.5 4.5l3.5 -4.5"/>"#, x - 4.0);
}
