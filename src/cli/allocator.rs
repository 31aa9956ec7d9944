//! Ends the program when memory runs out, with one line and the exit code of bad input.
//!
//! The library allocates its largest piece, the film, in a way that returns an error. Any other allocation, in this
//! program or in a crate that it uses, cannot report a failure; the standard library would abort. Its hook for this
//! case is not stable, so this module wraps the system's allocator. Each method passes its arguments on unchanged and
//! only checks the result.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    io::{self, Write as _},
};

use etendue::memory;
use signal_hook::low_level;

use super::BAD_INPUT;

/// The system's allocator, but a failed allocation ends the program.
pub(crate) struct OrExit;

impl OrExit {
    fn checked(memory: *mut u8, bytes: usize) -> *mut u8 {
        if memory.is_null() && !memory::is_trying() {
            let megabytes = bytes.div_ceil(1_000_000);
            // Nothing here allocates: standard error is unbuffered, and numbers are formatted without a buffer.
            let _ = writeln!(
                io::stderr(),
                "out of memory: {megabytes} MB more are not available; a smaller film or fewer photons need less"
            );
            // Exits at once, because exit handlers may allocate.
            low_level::exit(BAD_INPUT.into());
        }
        memory
    }
}

// SAFETY: every method forwards to the system allocator, with the same arguments and the same result.
#[expect(unsafe_code, reason = "the trait of allocators is unsafe")]
unsafe impl GlobalAlloc for OrExit {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's guarantees are the ones that the system's allocator requires.
        Self::checked(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        Self::checked(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as above.
        Self::checked(unsafe { System.realloc(memory, layout, size) }, size)
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(memory, layout) }
    }
}
