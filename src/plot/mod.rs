//! Plots of the report and of studies, as SVG.
//!
//! A [`Plot`] is data: layers over two axes. [`Plot::inline`] draws it for a page whose style sheet contains [`STYLE`];
//! [`Plot::file`] draws the same plot as a separate file that contains the sheet. Colours are classes of that sheet,
//! each with a value for light and for dark paper. Each series also has its own mark, so that colour is never the only
//! distinction. A plot is as wide as the screen of a phone, in units of about a pixel: text is legible there, and wider
//! screens magnify it.
//!
//! | part | file |
//! |---|---|
//! | ends, positions, ticks and their labels | `axis` |
//! | layers as elements of SVG | `layer` |
//! | the frame, the texts and the layers on one sheet | `sheet` |
//! | the sheet in a page or in a file | `figure` |
//! | symbols with labels, in rows | `legend` |
//! | escaping, widths and line breaks of text | `text` |
//! | colours and strokes | `plot.css` |

mod axis;
mod figure;
mod layer;
mod legend;
mod sheet;
mod text;

pub(crate) use axis::{Axis, power_of_ten};
pub(crate) use figure::{Plot, STYLE};
pub(crate) use layer::{Layer, Point, Shape, Style};
