use std::path::Path;

use super::check_pairs;

/// The largest spectrum file in bytes.
const MAX_BYTES: u64 = 16 << 20;

/// Reads a spectrum: a wavelength in nm and a value on each line. Lines that begin with `#` are comments.
///
/// # Errors
/// If the file cannot be read, or a line is not a pair of finite numbers, or the wavelengths do not rise.
pub fn read_spd(path: &Path) -> Result<Vec<(f64, f64)>, String> {
    let fault = |what: &dyn std::fmt::Display| format!("{}: {what}", path.display());
    let size = std::fs::metadata(path).map_err(|e| fault(&e))?.len();
    if size > MAX_BYTES {
        return Err(fault(&format_args!("has {size} bytes; at most {MAX_BYTES} are read")));
    }
    let text = std::fs::read_to_string(path).map_err(|e| fault(&e))?;
    let lines = text.lines().enumerate().filter(|(_, line)| !matches!(line.trim().bytes().next(), None | Some(b'#')));
    let pairs = lines.map(|(index, line)| {
        let what = || fault(&format_args!("line {}: is not a wavelength and a value", index + 1));
        pair(line).ok_or_else(what)
    });
    let pairs = pairs.collect::<Result<Vec<_>, _>>()?;
    check_pairs(&pairs).map_err(|what| fault(&what))?;
    Ok(pairs)
}

fn pair(line: &str) -> Option<(f64, f64)> {
    let numbers: Option<Vec<f64>> = line.split_whitespace().map(|word| word.parse().ok()).collect();
    match numbers?[..] {
        [wavelength, value] if wavelength.is_finite() && value.is_finite() => Some((wavelength, value)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_pairs_of_numbers() {
        assert_eq!(pair("  400\t0.5 "), Some((400.0, 0.5)));
        for line in ["400", "400 1 2", "400 x", "400 nan", "inf 1"] {
            assert_eq!(pair(line), None, "{line}");
        }
    }
}
