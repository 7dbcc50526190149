//! Code of others that reads files of others: what it did not expect ends the reading, and not the program.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};

thread_local! {
    static IS_AT_WORK: Cell<bool> = const { Cell::new(false) };
}

/// Whether such code is at work in this thread: its panics are told as what is wrong with the file, and nowhere else.
#[must_use]
pub fn is_at_work() -> bool {
    IS_AT_WORK.get()
}

/// Has such code read something, of which nothing is used again if it panics.
///
/// # Errors
/// What it says if it panics.
pub fn read<T>(read: impl FnOnce() -> T) -> Result<T, String> {
    IS_AT_WORK.set(true);
    let outcome = catch_unwind(AssertUnwindSafe(read));
    IS_AT_WORK.set(false);
    outcome.map_err(|panic| {
        let text = panic.downcast_ref::<&str>().map(ToString::to_string);
        text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no reason is given".to_owned())
    })
}
