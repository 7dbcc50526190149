//! How long the machine lets a program wait for a core.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How often it is looked at.
const INTERVAL: Duration = Duration::from_millis(20);

/// The run delay of a program's threads, as the scheduler of Linux counts it (`/proc/PID/task/*/schedstat`, second number, ns).
/// Elsewhere it is not known, and 0.
#[derive(Debug)]
pub struct RunDelay {
    tasks: PathBuf,
    /// What each thread has waited until the last look, ns.
    waited: HashMap<String, u64>,
    due: Option<Instant>,
    longest: Duration,
}

impl RunDelay {
    /// Of the program with this number.
    #[must_use]
    pub fn of(process: u32) -> Self {
        Self::of_tasks(format!("/proc/{process}/task"))
    }

    /// Of the program whose threads have their folders in this one.
    #[must_use]
    pub fn of_tasks(folder: impl Into<PathBuf>) -> Self {
        Self { tasks: folder.into(), waited: HashMap::new(), due: None, longest: Duration::ZERO }
    }

    /// Looks, if the last look was long enough ago, and gives the longest wait of a thread from one look to the next so far.
    pub fn look(&mut self, now: Instant) -> Duration {
        if self.due.is_some_and(|due| now < due) {
            return self.longest;
        }
        self.due = Some(now + INTERVAL);
        for task in std::fs::read_dir(&self.tasks).into_iter().flatten().flatten() {
            let Some(waited) = waited(&task.path()) else { continue };
            let before = self.waited.insert(task.file_name().to_string_lossy().into_owned(), waited);
            if let Some(before) = before {
                self.longest = self.longest.max(Duration::from_nanos(waited.saturating_sub(before)));
            }
        }
        self.longest
    }
}

fn waited(task: &Path) -> Option<u64> {
    std::fs::read_to_string(task.join("schedstat")).ok()?.split_whitespace().nth(1)?.parse().ok()
}
