//! Axes: their ranges, the positions of values, and ticks whose labels do not overlap.

use super::text;

/// The specification of an axis.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    /// The quantity and its unit.
    pub(crate) title: String,
    pub(crate) scale: Scale,
    /// The first and the last value. None: the axis spans all values, with a margin.
    pub(crate) ends: Option<[f64; 2]>,
}

/// How values map to positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scale {
    Linear,
    /// Logarithmic, base 10. Values of 0 or less have no position.
    Log,
}

impl Axis {
    /// A linear axis with given ends.
    pub(crate) fn linear(title: impl Into<String>, ends: [f64; 2]) -> Self {
        Self { title: title.into(), scale: Scale::Linear, ends: Some(ends) }
    }

    /// A logarithmic axis that spans all values.
    pub(crate) fn log(title: impl Into<String>) -> Self {
        Self { title: title.into(), scale: Scale::Log, ends: None }
    }

    /// Whether a value has a position on the axis.
    pub(super) fn has(&self, value: f64) -> bool {
        value.is_finite() && (self.scale == Scale::Linear || value > 0.0)
    }
}

/// An axis with a position in the drawing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ruler {
    scale: Scale,
    /// The values at both ends, or their decimal logarithms.
    ends: [f64; 2],
    /// The positions of both ends in the drawing.
    positions: [f64; 2],
}

/// A tick of an axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tick {
    pub(super) value: f64,
    /// The label; None at minor ticks.
    pub(super) label: Option<String>,
    /// Where two labels would overlap, the one of the lower rank is kept.
    rank: u8,
}

impl Tick {
    fn labelled(value: f64, label: String) -> Self {
        Self { value, label: Some(label), rank: 0 }
    }

    pub(super) fn length(&self) -> f64 {
        if self.rank == 0 { 6.0 } else { 3.5 }
    }
}

impl Ruler {
    /// Places an axis that must span the given values between two positions. None if the axis would have no finite
    /// range.
    pub(super) fn new(axis: &Axis, values: impl Iterator<Item = f64>, positions: [f64; 2]) -> Option<Self> {
        let scaled = |value: f64| if axis.scale == Scale::Log { value.log10() } else { value };
        let held = |[low, high]: [f64; 2], value: f64| [low.min(value), high.max(value)];
        let nothing = [f64::INFINITY, f64::NEG_INFINITY];
        let has = |value: &f64| axis.has(*value);
        if let Some(ends) = axis.ends {
            let [low, high] = ends.into_iter().filter(has).map(scaled).fold(nothing, held);
            return (low < high && (high - low).is_finite()).then_some(Self {
                scale: axis.scale,
                ends: [low, high],
                positions,
            });
        }
        let [low, high] = values.filter(has).map(scaled).fold(nothing, held);
        let span = high - low;
        if !span.is_finite() {
            return None;
        }
        // The axis spans at least 0.35 decades, or a tenth of the largest value, so that noise does not fill the plot.
        let least = match axis.scale {
            Scale::Log => 0.35,
            Scale::Linear if low == 0.0 && high == 0.0 => 1.0,
            Scale::Linear => 0.1 * low.abs().max(high.abs()),
        };
        let room = (0.05 * span).max(0.5 * (least - span));
        let ends = [low - room, high + room];
        (ends[1] - ends[0]).is_finite().then_some(Self { scale: axis.scale, ends, positions })
    }

    /// The position of a value. Values beyond an end have the position of that end.
    pub(super) fn position(&self, value: f64) -> f64 {
        let [low, high] = self.ends;
        let at = match self.scale {
            Scale::Linear => value,
            Scale::Log => value.max(f64::MIN_POSITIVE).log10(),
        };
        let part = ((at - low) / (high - low)).clamp(0.0, 1.0);
        self.positions[0] + part * (self.positions[1] - self.positions[0])
    }

    /// The positions of the low and the high end.
    pub(super) fn positions(&self) -> [f64; 2] {
        self.positions
    }

    /// Ticks in rising order, with labels that do not overlap. `extent` is the length of a label along the axis.
    pub(super) fn ticks(&self, extent: impl Fn(&str) -> f64) -> Vec<Tick> {
        if self.scale == Scale::Log {
            return self.thinned(self.log_ticks(), &extent);
        }
        let few = || self.thinned(self.linear_ticks(2), &extent);
        let is_whole = |ticks: &Vec<Tick>| ticks.iter().all(|tick| tick.label.is_some());
        (2..=6).rev().map(|steps| self.thinned(self.linear_ticks(steps), &extent)).find(is_whole).unwrap_or_else(few)
    }

    /// Removes the labels that would overlap a label of a lower rank.
    fn thinned(&self, mut ticks: Vec<Tick>, extent: &impl Fn(&str) -> f64) -> Vec<Tick> {
        let mut order: Vec<usize> = (0..ticks.len()).collect();
        order.sort_by_key(|&i| ticks[i].rank);
        let mut taken: Vec<[f64; 2]> = Vec::new();
        for i in order {
            let Some(label) = &ticks[i].label else { continue };
            let (at, half) = (self.position(ticks[i].value), 0.5 * extent(label));
            if taken.iter().any(|[from, to]| at - half < *to && *from < at + half) {
                ticks[i].label = None;
            } else {
                taken.push([at - half, at + half]);
            }
        }
        ticks
    }

    /// Ticks of a linear axis, with a step of 1, 2 or 5 times a power of ten and at most `steps` steps.
    fn linear_ticks(&self, steps: u32) -> Vec<Tick> {
        let [low, high] = self.ends;
        let rough = (high - low) / f64::from(steps);
        let mut power = rough.log10().floor() as i32;
        let factor = [1.0, 2.0, 5.0].into_iter().find(|factor| factor * 10_f64.powi(power) >= rough * (1.0 - 1e-9));
        power += i32::from(factor.is_none());
        let step = factor.unwrap_or(1.0) * 10_f64.powi(power);
        // Rounding must not lose a tick at an end. A step below the smallest number is 0 and gives no ticks.
        let (first, last) = ((low / step - 1e-6).ceil() as i64, (high / step + 1e-6).floor() as i64);
        if last.saturating_sub(first) > 20 {
            return Vec::new();
        }
        let largest = low.abs().max(high.abs()).log10().floor() as i32;
        (first..=last)
            .map(|i| i as f64 * step)
            .map(|value| Tick::labelled(value, linear_label(value, power, largest)))
            .collect()
    }

    /// Decades, and 2 to 9 times them unless there are many decades. Some five decades have labels; an axis with fewer
    /// than two decades has labels at 1, 2 and 5 times them, and a very short one at all ticks.
    fn log_ticks(&self) -> Vec<Tick> {
        let [low, high] = self.ends;
        let (first, last) = (low.floor() as i32, high.ceil() as i32);
        let decades = (high.floor() - low.ceil()) as i32 + 1;
        let step = ((decades + 6) / 7).max(1);
        let has_label = |digit: i32, decade: i32| match decades {
            2.. => digit == 1 && decade.rem_euclid(step) == 0,
            1 => matches!(digit, 1 | 2 | 5),
            _ => high - low < 0.5 || matches!(digit, 1 | 2 | 5),
        };
        // All labels of an axis have the same format.
        let is_plain = low >= -3.0 && high <= 4.0;
        let tick = |digit: i32, decade: i32| Tick {
            value: f64::from(digit) * 10_f64.powi(decade),
            label: has_label(digit, decade).then(|| log_label(digit, decade, is_plain)),
            rank: match digit {
                1 => 0,
                2 | 5 => 1,
                _ => 2,
            },
        };
        let inside = |tick: &Tick| (low..=high).contains(&tick.value.log10());
        let digits = if decades > 9 { 1..2 } else { 1..10 };
        (first..=last)
            .filter(|decade| decades <= 40 || decade.rem_euclid(step) == 0)
            .flat_map(|decade| digits.clone().map(move |digit| (digit, decade)))
            .map(|(digit, decade)| tick(digit, decade))
            .filter(inside)
            .collect()
    }
}

/// The length of a label along a horizontal axis.
pub(super) fn across(label: &str) -> f64 {
    text::width(label) + 8.0
}

/// The length of a label along a vertical axis.
pub(super) fn upright(_: &str) -> f64 {
    text::LINE
}

/// Ten to a power, with superscript digits.
pub(crate) fn power_of_ten(power: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let raised = |c: char| c.to_digit(10).map_or('⁻', |digit| DIGITS[digit as usize]);
    let power: String = power.to_string().chars().map(raised).collect();
    format!("10{power}")
}

/// A digit times a power of ten.
fn log_label(digit: i32, decade: i32, is_plain: bool) -> String {
    if is_plain || decade == 0 {
        let decimals = usize::try_from(-decade).unwrap_or(0);
        return format!("{:.decimals$}", f64::from(digit) * 10_f64.powi(decade));
    }
    if digit == 1 { power_of_ten(decade) } else { format!("{digit}·{}", power_of_ten(decade)) }
}

/// A multiple of a step of the given power of ten, on an axis whose largest value has another power.
fn linear_label(value: f64, power: i32, largest: i32) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let text = if (-4..6).contains(&largest) && power >= -5 {
        format!("{value:.*}", usize::try_from(-power).unwrap_or(0))
    } else {
        let decimals = usize::try_from(largest - power).unwrap_or(0);
        format!("{:.decimals$}·{}", value / 10_f64.powi(largest), power_of_ten(largest))
    };
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ruler(scale: Scale, ends: [f64; 2], length: f64) -> Ruler {
        let axis = Axis { title: String::new(), scale, ends: Some(ends) };
        Ruler::new(&axis, std::iter::empty(), [0.0, length]).unwrap()
    }

    fn labels(scale: Scale, ends: [f64; 2]) -> Vec<String> {
        ruler(scale, ends, 290.0).ticks(across).into_iter().filter_map(|tick| tick.label).collect()
    }

    #[test]
    fn log_axes_have_few_labels_and_at_least_one() {
        let labels = |low, high| labels(Scale::Log, [low, high]);
        assert_eq!(labels(0.5, 2000.0), ["1", "10", "100", "1000"]);
        assert_eq!(labels(3e-7, 2e-4), ["10⁻⁶", "10⁻⁵", "10⁻⁴"]);
        assert_eq!(labels(0.015, 0.16), ["0.02", "0.05", "0.1"]);
        assert_eq!(labels(2.1e-5, 4.9e-5), ["3·10⁻⁵", "4·10⁻⁵"]);
        assert_eq!(labels(0.5, 2e5), ["1", "10¹", "10²", "10³", "10⁴", "10⁵"]);
        for many in [labels(1e-12, 1e6), labels(1e-300, 1e300)] {
            assert!((4..8).contains(&many.len()), "{many:?}");
        }
    }

    #[test]
    fn linear_labels_are_round() {
        let labels = |low, high| labels(Scale::Linear, [low, high]);
        assert_eq!(labels(0.0, 1.0), ["0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(-3.0, 27.0), ["0", "5", "10", "15", "20", "25"]);
        assert_eq!(labels(-0.25, 0.3), ["−0.2", "−0.1", "0", "0.1", "0.2", "0.3"]);
        assert_eq!(labels(0.0, 3e-7), ["0", "1·10⁻⁷", "2·10⁻⁷", "3·10⁻⁷"]);
        assert_eq!(labels(0.0, 4e7).last().unwrap(), "4·10⁷");
    }

    #[test]
    fn labels_never_overlap() {
        for (scale, ends) in
            [(Scale::Log, [11_000.0, 99_000.0]), (Scale::Log, [0.0051, 0.0099]), (Scale::Linear, [99_990.0, 99_991.0])]
        {
            let ruler = ruler(scale, ends, 150.0);
            let mut last = f64::NEG_INFINITY;
            for tick in ruler.ticks(across) {
                let Some(label) = tick.label else { continue };
                let at = ruler.position(tick.value);
                assert!(at - 0.5 * text::width(&label) > last, "{ends:?}: {label}");
                last = at + 0.5 * text::width(&label);
            }
            assert!(last.is_finite(), "{ends:?} has a label");
        }
    }

    #[test]
    fn values_have_positions() {
        let axis = Axis::log("");
        let values = [1.0, 100.0, 0.0, -3.0, f64::NAN, f64::INFINITY];
        let ruler = Ruler::new(&axis, values.into_iter(), [0.0, 1.0]).unwrap();
        assert!((ruler.position(10.0) - 0.5).abs() < 1e-12);
        assert!(
            (ruler.position(1.0) - 0.1 / 2.2).abs() < 1e-12
                && ruler.position(-1.0) == 0.0
                && ruler.position(1e9) == 1.0
        );
        assert!(Ruler::new(&axis, [0.0].into_iter(), [0.0, 1.0]).is_none());
    }

    #[test]
    fn axes_without_a_range_are_none_and_equal_values_have_a_range() {
        let linear = |ends| Axis { title: String::new(), scale: Scale::Linear, ends };
        let new = |axis: Axis, values: &[f64]| Ruler::new(&axis, values.iter().copied(), [0.0, 1.0]);
        assert!(new(linear(Some([1.0, 1.0])), &[]).is_none());
        assert!(new(linear(Some([0.0, f64::NAN])), &[]).is_none());
        assert!(new(linear(None), &[f64::MIN, f64::MAX]).is_none());
        for value in [0.0, 5.0, -1e-300] {
            assert!((new(linear(None), &[value]).unwrap().position(value) - 0.5).abs() < 1e-9, "{value}");
        }
    }
}
