//! A plot on its sheet: the texts, the frame, the layers and the legend.

use std::fmt::Write as _;

use super::{
    axis::{self, Axis, Ruler, Tick},
    layer::{Field, Layer},
    legend::{self, Column},
    text::{self, LINE, escaped},
};

/// The width of a sheet.
pub(super) const WIDTH: f64 = 360.0;
/// The margin between the drawing and the edges of the sheet.
const MARGIN: f64 = 2.0;
/// The distance between labels and their axis.
const GAP: f64 = 7.0;
/// The height of the frame.
const FRAME: f64 = 200.0;

/// A drawing without its outermost SVG element.
pub(super) struct Sheet {
    pub(super) height: f64,
    pub(super) content: String,
}

/// The edges of the frame.
struct Frame {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
}

impl Sheet {
    /// Draws layers over two axes. None if there is nothing to draw.
    pub(super) fn new(title: &str, axes: [&Axis; 2], layers: &[Layer]) -> Option<Self> {
        let [x_axis, y_axis] = axes;
        let clean = |layer: &Layer| Some(Layer { shape: layer.shape.clean(x_axis, y_axis)?, ..layer.clone() });
        let layers: Vec<Layer> = layers.iter().filter_map(clean).collect();
        if !layers.iter().any(|layer| layer.shape.is_data()) {
            return None;
        }
        let mut content = String::new();
        let top = heading(&mut content, [title, &y_axis.title]);
        let (xs, ys) =
            (layers.iter().flat_map(|layer| layer.shape.xs()), layers.iter().flat_map(|layer| layer.shape.ys(y_axis)));
        let y = Ruler::new(y_axis, ys, [top + FRAME, top])?;
        let y_ticks = y.ticks(axis::upright);
        let widest = y_ticks.iter().filter_map(|tick| tick.label.as_deref()).map(text::width).fold(0.0, f64::max);
        let frame = Frame { left: MARGIN + widest + GAP, right: WIDTH - 5.0 * MARGIN, top, bottom: top + FRAME };
        let x = Ruler::new(x_axis, xs, [frame.left, frame.right])?;
        frame.grid(&mut content, &x, &x.ticks(axis::across), &y, &y_ticks);
        let field = Field { axes, x, y };
        for layer in &layers {
            field.draw(&mut content, layer.style, &layer.shape);
        }
        let mut height = frame.footing(&mut content, &x_axis.title);
        height +=
            legend::draw(&mut content, y_axis, &layers, &Column { left: MARGIN, right: WIDTH - MARGIN, top: height });
        Some(Self { height: height + MARGIN, content })
    }
}

/// Draws the title, and the title of the vertical axis, which is horizontal for legibility. Returns the y at which the
/// frame begins.
fn heading(svg: &mut String, [title, y_title]: [&str; 2]) -> f64 {
    let mut baseline = 0.0;
    for (class, title, boldness) in [("title", title, text::BOLD), ("name", y_title, 1.0)] {
        for line in text::wrapped(title, (WIDTH - 2.0 * MARGIN) / boldness) {
            baseline += LINE;
            let _ = write!(svg, r#"<text class="{class}" x="{MARGIN}" y="{baseline:.1}">{}</text>"#, escaped(&line));
        }
    }
    baseline + text::SIZE
}

impl Frame {
    /// Draws the frame with its ticks and labels.
    fn grid(&self, svg: &mut String, x: &Ruler, x_ticks: &[Tick], y: &Ruler, y_ticks: &[Tick]) {
        let Self { left, right, top, bottom } = self;
        for tick in x_ticks {
            let at = x.position(tick.value);
            if let Some(label) = &tick.label {
                let half = 0.5 * text::width(label);
                let _ = write!(
                    svg,
                    r#"<path class="grid" d="M{at:.1} {top:.1}V{bottom:.1}"/><text x="{:.1}" y="{:.1}" text-anchor="middle">{label}</text>"#,
                    at.min(WIDTH - half),
                    bottom + LINE
                );
            }
            let _ = write!(svg, r#"<path class="tick" d="M{at:.1} {bottom:.1}v-{}"/>"#, tick.length());
        }
        for tick in y_ticks {
            let at = y.position(tick.value);
            if let Some(label) = &tick.label {
                let _ = write!(
                    svg,
                    r#"<path class="grid" d="M{left:.1} {at:.1}H{right:.1}"/><text x="{:.1}" y="{:.1}" text-anchor="end">{label}</text>"#,
                    left - GAP,
                    at + 4.5
                );
            }
            let _ = write!(svg, r#"<path class="tick" d="M{left:.1} {at:.1}h{}"/>"#, tick.length());
        }
        let _ = write!(svg, r#"<path class="frame" d="M{left:.1} {top:.1}H{right:.1}V{bottom:.1}H{left:.1}z"/>"#);
    }

    /// Draws the title of the horizontal axis. Returns the y at which the legend begins.
    fn footing(&self, svg: &mut String, title: &str) -> f64 {
        let mut baseline = self.bottom + LINE + 2.0;
        for line in text::wrapped(title, WIDTH - 2.0 * MARGIN) {
            baseline += LINE;
            // Centred on the axis, or on the sheet if the axis is too short.
            let room = 0.5 * text::width(&line) + MARGIN;
            let middle = (0.5 * (self.left + self.right)).min(WIDTH - room).max(room.min(0.5 * WIDTH));
            let _ = write!(
                svg,
                r#"<text x="{middle:.1}" y="{baseline:.1}" text-anchor="middle">{}</text>"#,
                escaped(&line)
            );
        }
        baseline + GAP
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::layer::{Point, Shape, Style},
        *,
    };

    #[test]
    fn everything_lies_on_the_sheet() {
        let points = vec![Point { x: 1e-9, y: 3e5, std_error: Some(1e4) }, Point { x: 1e7, y: 4e-5, std_error: None }];
        let shape = Shape::Points { points, joined: true };
        let layers = vec![Layer { label: "one ".repeat(30), style: Style::Series(9), shape }];
        let axes = [&Axis::log("x ".repeat(60)), &Axis::log("y")];
        let sheet = Sheet::new(&"title ".repeat(20), axes, &layers).unwrap();
        let svg = format!("<svg>{}</svg>", sheet.content);
        let document = roxmltree::Document::parse(&svg).unwrap();
        for text in document.descendants().filter(|node| node.has_tag_name("text")) {
            let number = |name| text.attribute(name).unwrap().parse::<f64>().unwrap();
            let width = text::width(text.text().unwrap());
            let left = match text.attribute("text-anchor") {
                Some("middle") => number("x") - 0.5 * width,
                Some(_) => number("x") - width,
                None => number("x"),
            };
            assert!(left >= -0.1 && left + width <= WIDTH + 0.1, "{text:?}");
            assert!(number("y") > 0.0 && number("y") < sheet.height, "{text:?}");
        }
    }
}
