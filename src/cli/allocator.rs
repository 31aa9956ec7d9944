//! Memory that runs out ends the program as other faults do: with one line and the exit code of bad input.
//!
//! The library asks for its largest pieces, the film, in a way that gives an error. Whatever else asks, in this program
//! or in a crate that it uses, has no way to go on; the standard library would abort. Its hook for this is not stable,
//! so the system's allocator is wrapped. Each method passes its arguments on as they are and only looks at the answer.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    io::{self, Write as _},
};

use etendue::memory;
use signal_hook::low_level;

use super::BAD_INPUT;

/// The system's allocator, which ends the program where memory is short.
pub(crate) struct OrExit;

impl OrExit {
    fn checked(memory: *mut u8, bytes: usize) -> *mut u8 {
        if memory.is_null() && !memory::is_trying() {
            let megabytes = bytes.div_ceil(1_000_000);
            // Nothing here allocates: standard error has no buffer, and numbers are written without one.
            let _ = writeln!(
                io::stderr(),
                "out of memory: {megabytes} MB more are not available; a smaller film or fewer photons need less"
            );
            // At once, for whatever runs at an exit may allocate.
            low_level::exit(BAD_INPUT.into());
        }
        memory
    }
}

// SAFETY: every method is the system allocator's, with the same arguments and the same result.
#[expect(unsafe_code, reason = "the trait of allocators is unsafe")]
unsafe impl GlobalAlloc for OrExit {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's promises are those that the system's allocator asks for.
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
