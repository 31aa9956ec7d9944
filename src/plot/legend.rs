//! The legend: symbols with labels, in rows below the axes.

use std::fmt::Write as _;

use super::{
    axis::Axis,
    layer::{Errors, Layer, Shape, Style, limit},
    text::{self, LINE, escaped},
};

/// The width of a symbol.
const SYMBOL: f64 = 24.0;
/// The distance between a symbol and its label.
const GAP: f64 = 7.0;
/// The distance between two entries.
const BETWEEN: f64 = 14.0;

/// A symbol with its label.
struct Entry {
    style: Style,
    symbol: Symbol,
    label: String,
}

enum Symbol {
    Mark { joined: bool },
    Line { is_dashed: bool },
    Swatch(&'static str),
    ErrorBar,
    Limit,
}

impl Symbol {
    fn of(shape: &Shape) -> Self {
        match shape {
            Shape::Points { joined, .. } => Self::Mark { joined: *joined },
            Shape::Line { is_dashed, .. } => Self::Line { is_dashed: *is_dashed },
            Shape::Bars { .. } => Self::Swatch("bar"),
            Shape::Band(_) => Self::Swatch("band"),
            Shape::HorizontalLine(_) | Shape::VerticalLine(_) => Self::Line { is_dashed: true },
        }
    }

    /// Draws the symbol to the right of a point.
    fn draw(&self, svg: &mut String, style: Style, [x, y]: [f64; 2]) {
        let middle = x + 0.5 * SYMBOL;
        let mut path = |class: &str, outline: &str| {
            let _ = write!(svg, r#"<path class="{class}" d="{outline}"/>"#);
        };
        let line = format!("M{x:.1} {y:.1}h{SYMBOL}");
        match self {
            Self::Mark { joined } => {
                if *joined {
                    path("line", &line);
                }
                style.mark(svg, [middle, y], 1.0);
            }
            Self::Line { is_dashed } => path(if *is_dashed { "line dashed" } else { "line" }, &line),
            Self::Swatch(class) => path(class, &format!("M{x:.1} {:.1}h{SYMBOL}v10h-{SYMBOL}z", y - 5.0)),
            Self::ErrorBar => path("error", &format!("M{middle:.1} {:.1}v12", y - 6.0)),
            Self::Limit => limit(svg, [middle, y - 6.0]),
        }
    }
}

/// The entries of layers, and entries that explain their errors on the y axis.
fn entries(y: &Axis, layers: &[Layer]) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    for layer in layers.iter().filter(|layer| !layer.label.is_empty()) {
        match entries.iter_mut().find(|entry| entry.label == layer.label) {
            // Layers of several colours share an entry without a colour.
            Some(entry) if entry.style != layer.style => entry.style = Style::Plain,
            Some(_) => {}
            None => {
                entries.push(Entry {
                    style: layer.style,
                    symbol: Symbol::of(&layer.shape),
                    label: layer.label.clone(),
                });
            }
        }
    }
    // Entries without a colour apply to all layers.
    entries.sort_by_key(|entry| entry.style == Style::Plain);
    let shows = |what: fn(Errors) -> bool| layers.iter().any(|layer| what(layer.shape.errors(y)));
    if shows(|errors| errors.bars) {
        let symbol = if shows(|errors| errors.band) { Symbol::Swatch("band") } else { Symbol::ErrorBar };
        entries.push(Entry { style: Style::Plain, symbol, label: "± 2 standard errors".into() });
    }
    if shows(|errors| errors.limits) {
        let label = "upper end; the value may be 0".into();
        entries.push(Entry { style: Style::Plain, symbol: Symbol::Limit, label });
    }
    entries
}

/// The position and size of the legend.
pub(super) struct Column {
    pub(super) left: f64,
    pub(super) right: f64,
    pub(super) top: f64,
}

/// Draws the legend of layers into a column, and returns its height.
pub(super) fn draw(svg: &mut String, axis: &Axis, layers: &[Layer], column: &Column) -> f64 {
    let Column { left, right, top } = *column;
    let (mut x, mut y) = (left, top);
    // The height of the row so far.
    let mut row = 0.0_f64;
    for entry in &entries(axis, layers) {
        let lines = text::wrapped(&entry.label, right - left - SYMBOL - GAP);
        let words = lines.iter().map(|line| text::width(line)).fold(0.0, f64::max);
        if x > left && x + SYMBOL + GAP + words > right {
            (x, y, row) = (left, y + row, 0.0);
        }
        let _ = write!(svg, r#"<g class="{}">"#, entry.style.class());
        entry.symbol.draw(svg, entry.style, [x, y + 0.5 * LINE]);
        svg.push_str("</g>");
        for (i, line) in lines.iter().enumerate() {
            let baseline = y + LINE * i as f64 + 0.5 * LINE + 4.5;
            let _ = write!(svg, r#"<text x="{:.1}" y="{baseline:.1}">{}</text>"#, x + SYMBOL + GAP, escaped(line));
        }
        x += SYMBOL + GAP + words + BETWEEN;
        row = row.max(LINE * lines.len() as f64);
    }
    y + row - top
}

#[cfg(test)]
mod tests {
    use super::{super::layer::Point, *};

    fn layer(label: &str, series: usize, shape: Shape) -> Layer {
        Layer { label: label.into(), style: Style::Series(series), shape }
    }

    fn line() -> Shape {
        Shape::Line { points: vec![[1.0, 1.0], [2.0, 2.0]], is_dashed: true }
    }

    fn height(svg: &mut String, layers: &[Layer]) -> f64 {
        draw(svg, &Axis::log("y"), layers, &Column { left: 8.0, right: 352.0, top: 100.0 })
    }

    #[test]
    fn layers_of_a_label_share_an_entry_without_colour() {
        let layers = [layer("a", 0, line()), layer("predicted", 0, line()), layer("predicted", 1, line())];
        let found: Vec<_> =
            entries(&Axis::log("y"), &layers).into_iter().map(|entry| (entry.label, entry.style)).collect();
        assert_eq!(found, [("a".into(), Style::Series(0)), ("predicted".into(), Style::Plain)]);
    }

    #[test]
    fn errors_and_limits_are_explained_where_there_are_any() {
        let labels = |y: f64, std_error| {
            let points = vec![Point { x: 1.0, y, std_error }];
            let layers = [layer("", 0, Shape::Points { points, joined: false })];
            entries(&Axis::log("y"), &layers).into_iter().map(|entry| entry.label).collect::<Vec<_>>()
        };
        assert!(labels(1.0, None).is_empty());
        assert_eq!(labels(1.0, Some(0.1)), ["± 2 standard errors"]);
        assert_eq!(labels(1.0, Some(0.6)), ["upper end; the value may be 0"]);
    }

    #[test]
    fn rows_wrap_within_the_column() {
        let long = "a method whose name is longer than one row of the legend can be";
        let layers: Vec<Layer> = (0..4).map(|i| layer(&format!("{i} {long}"), i, line())).collect();
        let mut svg = String::new();
        assert_eq!(height(&mut svg, &layers), 4.0 * 2.0 * LINE);
        assert_eq!(svg.matches("<text").count(), 8);
        let short = [layer("a", 0, line()), layer("b", 1, line())];
        assert_eq!(height(&mut String::new(), &short), LINE);
    }
}
