//! Allocation of large arrays that reports a lack of memory.

use std::cell::Cell;

use thiserror::Error;

thread_local! {
    static IS_TRYING: Cell<bool> = const { Cell::new(false) };
}

/// The error of an allocation that failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("{:.1} GB of memory are not available", *bytes as f64 * 1e-9)]
pub struct NoMemory {
    /// The number of bytes that were requested.
    pub bytes: usize,
}

/// A vector of `count` copies of a value.
///
/// # Errors
/// If there is not enough memory.
pub fn try_filled<T: Clone>(value: T, count: usize) -> Result<Vec<T>, NoMemory> {
    let mut filled = Vec::new();
    IS_TRYING.set(true);
    let reserved = filled.try_reserve_exact(count);
    IS_TRYING.set(false);
    reserved.map_err(|_| NoMemory { bytes: count.saturating_mul(size_of::<T>()) })?;
    filled.resize(count, value);
    Ok(filled)
}

/// Whether this thread is in an allocation that may fail. An allocator that ends the program when memory runs out must
/// return null here instead.
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
