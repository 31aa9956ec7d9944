//! A logarithmic axis.

/// Powers of ten along a line of the drawing.
#[derive(Clone, Copy, Debug)]
pub(super) struct LogAxis {
    /// The decimal logarithms of its ends.
    ends: [f64; 2],
    /// Where they are in the drawing.
    places: [f64; 2],
}

/// A mark of an axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tick {
    pub(super) value: f64,
    /// Of minor ticks, none.
    pub(super) label: Option<String>,
    is_decade: bool,
}

impl Tick {
    pub(super) fn length(&self) -> f64 {
        if self.is_decade { 7.0 } else { 4.0 }
    }
}

impl LogAxis {
    /// An axis that holds all values above 0, with some room about them; None if there are none.
    pub(super) fn around(values: impl Iterator<Item = f64>, places: [f64; 2]) -> Option<Self> {
        let logs = values.filter(|x| *x > 0.0 && x.is_finite()).map(f64::log10);
        let (low, high) = logs.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        if low > high {
            return None;
        }
        // Never less than a third of a decade: noise should not fill a drawing.
        let room = (0.05 * (high - low)).max(0.5 * (0.35 - (high - low)));
        Some(Self { ends: [low - room, high + room], places })
    }

    /// Where a value above 0 is; what lies beyond the axis is at its end.
    pub(super) fn place(&self, value: f64) -> f64 {
        let [low, high] = self.ends;
        let part = ((value.max(f64::MIN_POSITIVE).log10() - low) / (high - low)).clamp(0.0, 1.0);
        self.places[0] + part * (self.places[1] - self.places[0])
    }

    /// Its marks, in rising order: decades, and 2 to 9 times them; none of these where there are many decades. Labels are at
    /// some five decades, or at 1, 2 and 5 if there are fewer than two; at all if that is little.
    pub(super) fn ticks(&self) -> Vec<Tick> {
        let [low, high] = self.ends;
        let (first, last) = (low.floor() as i32, high.ceil() as i32);
        let decades = (high.floor() - low.ceil()) as i32 + 1;
        let step = ((decades + 6) / 7).max(1);
        let labelled = |digit: i32, decade: i32| match decades {
            2.. => digit == 1 && decade.rem_euclid(step) == 0,
            1 => matches!(digit, 1 | 2 | 5),
            _ => high - low < 0.5 || matches!(digit, 1 | 2 | 5),
        };
        // All labels of an axis in the same way.
        let is_plain = low >= -3.0 && high <= 4.0;
        let tick = |digit: i32, decade: i32| Tick {
            value: f64::from(digit) * 10_f64.powi(decade),
            label: labelled(digit, decade).then(|| label(digit, decade, is_plain)),
            is_decade: digit == 1,
        };
        let inside = |tick: &Tick| (low..=high).contains(&tick.value.log10());
        let minor = if decades > 9 { 2 } else { 10 };
        (first..=last)
            .flat_map(|decade| (1..minor).map(move |digit| (digit, decade)))
            .map(|(d, e)| tick(d, e))
            .filter(inside)
            .collect()
    }
}

/// A digit times a power of ten.
fn label(digit: i32, decade: i32, is_plain: bool) -> String {
    if is_plain || decade == 0 {
        let decimals = usize::try_from(-decade).unwrap_or(0);
        return format!("{:.decimals$}", f64::from(digit) * 10_f64.powi(decade));
    }
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let raised = |c: char| c.to_digit(10).map_or('⁻', |digit| DIGITS[digit as usize]);
    let power: String = decade.to_string().chars().map(raised).collect();
    if digit == 1 { format!("10{power}") } else { format!("{digit}·10{power}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(low: f64, high: f64) -> Vec<String> {
        let axis = LogAxis { ends: [low.log10(), high.log10()], places: [0.0, 1.0] };
        axis.ticks().into_iter().filter_map(|tick| tick.label).collect()
    }

    #[test]
    fn labels_are_few_and_never_none() {
        assert_eq!(labels(0.5, 2000.0), ["1", "10", "100", "1000"]);
        assert_eq!(labels(3e-7, 2e-4), ["10⁻⁶", "10⁻⁵", "10⁻⁴"]);
        assert_eq!(labels(0.015, 0.16), ["0.02", "0.05", "0.1"]);
        assert_eq!(labels(2.1e-5, 4.9e-5), ["3·10⁻⁵", "4·10⁻⁵"]);
        assert_eq!(labels(0.5, 2e5), ["1", "10¹", "10²", "10³", "10⁴", "10⁵"]);
        let many = labels(1e-12, 1e6);
        assert!((4..8).contains(&many.len()), "{many:?}");
    }

    #[test]
    fn values_have_places() {
        let axis = LogAxis::around([1.0, 100.0, 0.0, -3.0, f64::NAN].into_iter(), [0.0, 1.0]).unwrap();
        assert!((axis.place(10.0) - 0.5).abs() < 1e-12);
        assert!((axis.place(1.0) - 0.1 / 2.2).abs() < 1e-12 && axis.place(-1.0) == 0.0 && axis.place(1e9) == 1.0);
        assert!(LogAxis::around([0.0].into_iter(), [0.0, 1.0]).is_none());
    }
}
