//! Numbers as text, with significant digits and powers of ten.

use crate::plot::power_of_ten;

/// A narrow no-break space.
const THIN: char = '\u{202f}';

/// A number to `digits` significant digits, without trailing zeros. Numbers below 0.001 and from a million up have a
/// power of ten.
pub(crate) fn significant(x: f64, digits: usize) -> String {
    if !x.is_finite() || x == 0.0 {
        return special(x);
    }
    let scientific = format!("{x:.*e}", digits.saturating_sub(1));
    let (mantissa, exponent) = scientific.split_once('e').expect("Rust writes an exponent");
    let exponent: i32 = exponent.parse().expect("Rust writes a number");
    if (-3..6).contains(&exponent) {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        return trimmed(&format!("{x:.decimals$}"));
    }
    let power = power_of_ten(exponent);
    match trimmed(mantissa).as_str() {
        "1" => power,
        "−1" => format!("−{power}"),
        mantissa => format!("{mantissa}{THIN}×{THIN}{power}"),
    }
}

/// A number with one digit more than the bound on its error, so that a violation of the bound is visible.
pub(super) fn to_bound(x: f64, bound: f64) -> String {
    let plain = x == 0.0 || (1e-3..1e6).contains(&x.abs());
    if !plain || !x.is_finite() {
        return significant(x, 4);
    }
    let decimals = if bound > 0.0 { (1.0 - bound.log10().floor()).clamp(2.0, 12.0) } else { 12.0 };
    trimmed(&format!("{x:.*}", decimals as usize))
}

/// A probability, to three digits.
pub(crate) fn probability(p: f64) -> String {
    significant(p, 3)
}

/// A ratio in per cent, to three digits.
pub(super) fn percent(x: f64) -> String {
    format!("{}{THIN}%", significant(100.0 * x, 3))
}

/// A ratio in per cent, to three digits, with its sign.
pub(super) fn signed_percent(x: f64) -> String {
    let sign = if x > 0.0 { "+" } else { "" };
    format!("{sign}{}", percent(x))
}

/// A duration in seconds, or from 120 s in minutes and seconds.
pub(crate) fn duration(seconds: f64) -> String {
    if seconds < 120.0 {
        return format!("{}{THIN}s", significant(seconds, 2));
    }
    format!("{:.0}{THIN}min {:.0}{THIN}s", (seconds / 60.0).floor(), (seconds % 60.0).floor())
}

fn special(x: f64) -> String {
    match x {
        0.0 => "0".into(),
        f64::INFINITY => "∞".into(),
        f64::NEG_INFINITY => "−∞".into(),
        _ => "not a number".into(),
    }
}

/// Removes trailing zeros, and replaces a hyphen by a minus sign.
fn trimmed(text: &str) -> String {
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text };
    match text {
        "-0" => "0".into(),
        _ => text.replace('-', "−"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_significant_digits() {
        let cases = [
            (0.040_000_000_000_001, 3, "0.04"),
            (0.000_999_9, 2, "0.001"),
            (1234.5, 3, "1234"),
            (-0.25, 3, "−0.25"),
            (1e-8, 2, "10⁻⁸"),
            (1.763e-4, 2, "1.8\u{202f}×\u{202f}10⁻⁴"),
            (-3e12, 2, "−3\u{202f}×\u{202f}10¹²"),
            (0.0, 3, "0"),
            (f64::NAN, 3, "not a number"),
            (f64::NEG_INFINITY, 3, "−∞"),
        ];
        for (x, digits, text) in cases {
            assert_eq!(significant(x, digits), text);
        }
    }

    #[test]
    fn a_violated_bound_is_visible() {
        assert_eq!((to_bound(0.877_217, 1e-3), to_bound(0.876, 1e-3)), ("0.8772".into(), "0.876".into()));
        assert_eq!(to_bound(0.050_239_911_3, 1e-8), "0.050239911");
        assert_eq!((to_bound(1.0, 0.0), to_bound(-1e-14, 1e-9).as_str()), ("1".into(), "−10⁻¹⁴"));
        assert_eq!(to_bound(f64::INFINITY, 1.0), "∞");
    }

    #[test]
    fn ratios_and_durations() {
        assert_eq!((percent(0.005), signed_percent(0.001_234)), ("0.5\u{202f}%".into(), "+0.123\u{202f}%".into()));
        assert_eq!((signed_percent(-0.5), signed_percent(0.0)), ("−50\u{202f}%".into(), "0\u{202f}%".into()));
        assert_eq!((duration(1.26), duration(754.9)), ("1.3\u{202f}s".into(), "12\u{202f}min 34\u{202f}s".into()));
    }
}
