//! A plot as an element of a page, or as a separate file.

use super::{
    axis::Axis,
    layer::Layer,
    sheet::{Sheet, WIDTH},
    text,
};

/// The style sheet of the plots of a page.
pub(crate) const STYLE: &str = include_str!("plot.css");

/// A plot: layers over two axes, the first layer at the back.
#[derive(Clone, Debug)]
pub(crate) struct Plot {
    pub(crate) title: String,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    pub(crate) layers: Vec<Layer>,
}

impl Plot {
    /// The plot as an SVG element of a page. None if there is nothing to draw.
    pub(crate) fn inline(&self) -> Option<String> {
        let sheet = Sheet::new(&self.title, [&self.x, &self.y], &self.layers)?;
        Some(format!(
            r#"<svg class="chart" viewBox="0 0 {} {}" role="img" aria-label="{}">{}</svg>"#,
            WIDTH,
            sheet.height,
            text::escaped(&self.description()),
            sheet.content
        ))
    }

    /// The plot as a separate SVG file. None if there is nothing to draw.
    pub(crate) fn file(&self) -> Option<String> {
        /// The magnification of a file. A plot in a page has the width of its column instead.
        const MAGNIFICATION: f64 = 1.5;
        /// The margin between the sheet and the edge of the paper.
        const EDGE: f64 = 10.0;
        let sheet = Sheet::new(&self.title, [&self.x, &self.y], &self.layers)?;
        let (width, height) = (WIDTH + 2.0 * EDGE, sheet.height + 2.0 * EDGE);
        Some(format!(
            r#"<svg xmlns="http://www.w3.org/2000/svg" class="chart alone" viewBox="-{EDGE} -{EDGE} {width} {height}" width="{}" height="{}" role="img"><title>{}</title><style>{STYLE}</style><rect class="paper" x="-{EDGE}" y="-{EDGE}" width="{width}" height="{height}"/>{}</svg>
"#,
            MAGNIFICATION * width,
            MAGNIFICATION * height,
            text::escaped(&self.description()),
            sheet.content
        ))
    }

    /// A text alternative of the plot, in one sentence.
    fn description(&self) -> String {
        let mut labels: Vec<&str> = Vec::new();
        for layer in &self.layers {
            if !layer.label.is_empty() && !labels.contains(&layer.label.as_str()) {
                labels.push(&layer.label);
            }
        }
        format!("{}: {} over {}; {}", self.title, self.y.title, self.x.title, labels.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::layer::{COLOURS, Point, Shape, Style},
        *,
    };

    fn plot(layers: Vec<Layer>) -> Plot {
        Plot { title: "scene".into(), x: Axis::log("samples"), y: Axis::log("RMSE"), layers }
    }

    fn points(points: &[[f64; 3]]) -> Layer {
        let points = points.iter().map(|&[x, y, error]| Point { x, y, std_error: Some(error) }).collect();
        Layer { label: "a & <b>".into(), style: Style::Series(1), shape: Shape::Points { points, joined: true } }
    }

    fn line(points: &[[f64; 2]]) -> Layer {
        let shape = Shape::Line { points: points.to_vec(), is_dashed: true };
        Layer { label: "predicted".into(), style: Style::Series(1), shape }
    }

    /// Draws a plot. Asserts that the SVG is well-formed and that all its numbers are finite.
    fn drawn(plot: &Plot) -> String {
        let file = plot.file().unwrap();
        roxmltree::Document::parse(&file).unwrap();
        let svg = plot.inline().unwrap();
        roxmltree::Document::parse(&svg).unwrap();
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        svg
    }

    #[test]
    fn points_and_their_prediction_have_equal_positions() {
        let ends = [[1.0, 1.0], [100.0, 0.1]];
        let svg =
            drawn(&plot(vec![points(&[[1.0, 1.0, 0.0], [10.0, 0.1_f64.sqrt(), 0.0], [100.0, 0.1, 0.0]]), line(&ends)]));
        let positions = |class: &str| {
            let from = svg.find(&format!(r#"class="{class}" d="M"#)).unwrap();
            let path = svg[from..].split('"').nth(3).unwrap().trim_start_matches('M');
            path.split('L').map(|at| at.split(' ').map(|x| x.parse().unwrap()).collect()).collect::<Vec<Vec<f64>>>()
        };
        let (measured, predicted) = (positions("line"), positions("line dashed"));
        assert_eq!((measured.len(), predicted.len()), (3, 2));
        assert_eq!((&measured[0], &measured[2]), (&predicted[0], &predicted[1]));
        for coordinate in 0..2 {
            let middle = 0.5 * (measured[0][coordinate] + measured[2][coordinate]);
            assert!((measured[1][coordinate] - middle).abs() < 0.11, "{measured:?}");
        }
    }

    #[test]
    fn texts_are_escaped() {
        let mut plot = plot(vec![points(&[[1.0, 1.0, 0.1]])]);
        for text in [&mut plot.title, &mut plot.x.title, &mut plot.y.title] {
            *text = r#"</text><script>"&'"#.into();
        }
        let svg = drawn(&plot);
        assert!(svg.contains("a &amp; &lt;b&gt;") && !svg.contains("<script>"), "{svg}");
    }

    #[test]
    fn points_that_may_be_zero_are_limits() {
        let svg =
            drawn(&plot(vec![points(&[[1.0, 1.0, 0.1], [10.0, -0.01, 0.02], [100.0, 0.01, 0.02], [5.0, 0.0, 0.0]])]));
        assert_eq!(svg.matches(r#"class="limit""#).count(), 3 + 1, "three points and the legend: {svg}");
        assert!(svg.contains("may be 0"), "{svg}");
    }

    #[test]
    fn empty_plots_are_none() {
        let nan = f64::NAN;
        for layers in [vec![], vec![points(&[])], vec![points(&[[nan, 1.0, 0.1], [1.0, nan, 0.1], [0.0, 1.0, 0.1]])]] {
            assert!(plot(layers.clone()).inline().is_none() && plot(layers).file().is_none());
        }
        drawn(&plot(vec![points(&[[1.0, 1.0, 0.0]])]));
    }

    #[test]
    fn values_that_are_not_finite_are_left_out() {
        let (nan, inf) = (f64::NAN, f64::INFINITY);
        let dots = points(&[
            [1.0, 1.0, 0.1],
            [2.0, nan, 0.1],
            [inf, 1.0, 0.1],
            [3.0, inf, 0.1],
            [4.0, 0.5, inf],
            [5.0, 0.4, nan],
        ]);
        let svg = drawn(&plot(vec![dots, line(&[[1.0, 1.0], [2.0, nan], [3.0, 0.5], [4.0, 0.4], [5.0, -inf]])]));
        assert_eq!(svg.matches(r#"class="dot""#).count(), 3 + 1, "three points and the legend: {svg}");
        assert_eq!(svg.matches(r#"class="line dashed""#).count(), 1 + 1, "the line breaks: {svg}");
    }

    #[test]
    fn bars_begin_at_zero() {
        let shape = Shape::Bars { ends: [0.0, 1.0], heights: vec![3.0, 0.0, f64::NAN, 6.0] };
        let bars = Layer { label: String::new(), style: Style::Series(0), shape };
        let level = Layer { label: "expected".into(), style: Style::Plain, shape: Shape::HorizontalLine(3.0) };
        let band = Layer { label: "band".into(), style: Style::Plain, shape: Shape::Band([1.0, 5.0]) };
        let (x, y) = (Axis::linear("p", [0.0, 1.0]), Axis::linear("tiles", [0.0, 6.0]));
        let svg = drawn(&Plot { title: String::new(), x, y, layers: vec![band, bars, level] });
        let heights: Vec<f64> = svg
            .match_indices(r#"class="bar""#)
            .map(|(at, _)| svg[at..].split("height=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap())
            .collect();
        assert_eq!(heights.len(), 3);
        assert!(heights[1] == 0.0 && (heights[2] - 2.0 * heights[0]).abs() < 0.11, "{heights:?}");
    }

    #[test]
    fn colours_stand_out_from_light_and_from_dark_paper() {
        let luminance = |hex: &str| {
            let channel = |at: usize| f64::from(u8::from_str_radix(&hex[at..at + 2], 16).unwrap()) / 255.0;
            let linear = |x: f64| if x <= 0.040_45 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) };
            0.2126 * linear(channel(1)) + 0.7152 * linear(channel(3)) + 0.0722 * linear(channel(5))
        };
        let (light, dark) = STYLE.split_once("@media").unwrap();
        for (sheet, paper) in [(light, "#fdfdfb"), (dark, "#16181b")] {
            for series in 0..COLOURS {
                let rule = format!(".chart .s{series} {{ color: ");
                let at = sheet.find(&rule).unwrap_or_else(|| panic!("{rule}")) + rule.len();
                let [a, b] = [luminance(&sheet[at..at + 7]), luminance(paper)];
                // WCAG 2.2, 1.4.11: graphics have a contrast of 3.
                assert!((a.max(b) + 0.05) / (a.min(b) + 0.05) > 3.0, "{}", &sheet[at..at + 7]);
            }
        }
    }
}
