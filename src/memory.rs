//! Memory that may not be there.

use std::cell::Cell;

use thiserror::Error;

thread_local! {
    static IS_TRYING: Cell<bool> = const { Cell::new(false) };
}

/// Memory that was asked for and is not there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("{:.1} GB of memory are not available", *bytes as f64 * 1e-9)]
pub struct NoMemory {
    /// How much was asked for.
    pub bytes: usize,
}

/// A vector of `count` copies of a value.
///
/// # Errors
/// If there is no memory for them.
pub fn try_filled<T: Clone>(value: T, count: usize) -> Result<Vec<T>, NoMemory> {
    let mut filled = Vec::new();
    IS_TRYING.set(true);
    let reserved = filled.try_reserve_exact(count);
    IS_TRYING.set(false);
    reserved.map_err(|_| NoMemory { bytes: count.saturating_mul(size_of::<T>()) })?;
    filled.resize(count, value);
    Ok(filled)
}

/// Whether this thread asks for memory that it can do without. An allocator that ends the program where memory is short
/// has to return null instead.
#[must_use]
pub fn is_trying() -> bool {
    IS_TRYING.get()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_that_is_not_there_is_an_error() {
        assert_eq!(try_filled(7_u8, 3), Ok(vec![7; 3]));
        let error = try_filled(0_u64, 1 << 59).expect_err("no machine has as much");
        assert_eq!(error.to_string(), "4611686018.4 GB of memory are not available");
        assert!(!is_trying());
    }
}
