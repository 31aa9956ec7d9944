/// Parses a whole number such as `250000`, `2.5e5` or `25e4`; None if the text is not a whole number, such as `1e-1`.
#[must_use]
pub fn whole_number(text: &str) -> Option<i128> {
    if let Ok(number) = text.parse() {
        return Some(number);
    }
    let (mantissa, exponent) = text.split_once(['e', 'E'])?;
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let digits: i128 = format!("{whole}{fraction}").parse().ok()?;
    let shift = exponent.parse::<i32>().ok()?.checked_sub(i32::try_from(fraction.len()).ok()?)?;
    let power = 10_i128.checked_pow(shift.unsigned_abs())?;
    if shift >= 0 { digits.checked_mul(power) } else { (digits % power == 0).then(|| digits / power) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_are_read_as_people_write_them() {
        let cases = [
            ("0", 0),
            ("-12", -12),
            ("1e5", 100_000),
            ("2.5e3", 2500),
            ("-3E2", -300),
            ("1.50e1", 15),
            ("120e-1", 12),
            ("18446744073709551615", u64::MAX.into()),
            ("1e19", 10_000_000_000_000_000_000),
        ];
        for (text, number) in cases {
            assert_eq!(whole_number(text), Some(number), "{text}");
        }
        for text in ["", "1.0", "1e-1", "2.55e1", "e5", "1e", "1e5.0", "1.-2e3", "1e99", "1e999999999999", "nan", "0x3"]
        {
            assert_eq!(whole_number(text), None, "{text}");
        }
    }
}
