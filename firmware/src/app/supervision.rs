//! Whether every task still runs: the watchdog is fed only then.

use portable_atomic::{AtomicU32, Ordering};

/// What must run. Each is a bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Task {
    /// The bus: encoders, prediction, pose.
    Bus = 1,
    /// The network: whatever listens or speaks there shares its executor.
    Network = 2,
    /// The localiser.
    Localizer = 4,
}

const ALL: u32 = Task::Bus as u32 | Task::Network as u32 | Task::Localizer as u32;

static SEEN: AtomicU32 = AtomicU32::new(0);

/// A task has run.
pub fn check_in(task: Task) {
    SEEN.fetch_or(task as u32, Ordering::Relaxed);
}

/// Whether all tasks have run since this was last true.
#[must_use]
pub fn have_all_run() -> bool {
    SEEN.compare_exchange(ALL, 0, Ordering::Relaxed, Ordering::Relaxed).is_ok()
}
