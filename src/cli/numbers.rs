//! Numbers as people write them on a command line.

use std::fmt::Display;

use etendue::scene_file::whole_number;

/// A whole number within bounds.
fn whole<T: TryFrom<i128> + PartialOrd + Display>(text: &str, least: T, most: T) -> Result<T, String> {
    let number = whole_number(text).and_then(|number| T::try_from(number).ok());
    let within = number.filter(|number| (&least..=&most).contains(&number));
    within.ok_or_else(|| format!("write a whole number from {least} to {most}, such as 1000 or 1e3"))
}

/// A number of samples, of which there is at least one.
pub(super) fn samples(text: &str) -> Result<u32, String> {
    whole(text, 1, u32::MAX)
}

/// A seed.
pub(super) fn seed(text: &str) -> Result<u64, String> {
    whole(text, 0, u64::MAX)
}

/// A number of threads or processes.
pub(super) fn count(text: &str) -> Result<u16, String> {
    whole(text, 1, u16::MAX)
}

/// The column, the row and the number of a sample.
pub(super) fn address(text: &str) -> Result<[u32; 3], String> {
    let numbers: Option<Vec<u32>> = text.split(',').map(|number| whole(number.trim(), 0, u32::MAX).ok()).collect();
    numbers.and_then(|numbers| numbers.try_into().ok()).ok_or_else(|| "write three whole numbers like 3,4,0".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_lie_within_their_bounds() {
        assert_eq!((samples("1e3"), seed("0"), count("8")), (Ok(1000), Ok(0), Ok(8)));
        assert_eq!(address("3, 4,1e2"), Ok([3, 4, 100]));
        for bad in [samples("0").err(), samples("1e10").err(), seed("-1").err(), count("65536").err()] {
            assert!(bad.is_some_and(|hint| hint.starts_with("write a whole number from ")));
        }
        assert!(address("1,2").is_err() && address("1,-2,3").is_err());
    }
}
