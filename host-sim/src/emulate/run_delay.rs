//! How long the machine lets a program wait for a core.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How often it is looked at.
const INTERVAL: Duration = Duration::from_millis(20);

/// Ticks in which times of `/proc/stat` are counted, s (`USER_HZ`, proc(5)).
const TICK: f64 = 0.01;

/// The run delay of a program's threads, as the scheduler of Linux counts it (`/proc/PID/task/*/schedstat`, second number, ns), and what a
/// hypervisor takes of the cores (`/proc/stat`, steal), which no scheduler sees. Elsewhere it is not known, and 0.
#[derive(Debug)]
pub struct RunDelay {
    tasks: PathBuf,
    statistics: Option<PathBuf>,
    /// What each thread has waited until the last look, ns.
    waited: HashMap<String, u64>,
    /// What was taken of all cores until the last look, ticks.
    stolen: Option<u64>,
    due: Option<Instant>,
    longest: Duration,
}

impl RunDelay {
    /// Of the program with this number.
    #[must_use]
    pub fn of(process: u32) -> Self {
        Self::of_tasks(format!("/proc/{process}/task")).with_statistics("/proc/stat")
    }

    /// Of the program whose threads have their folders in this one.
    #[must_use]
    pub fn of_tasks(folder: impl Into<PathBuf>) -> Self {
        Self {
            tasks: folder.into(),
            statistics: None,
            waited: HashMap::new(),
            stolen: None,
            due: None,
            longest: Duration::ZERO,
        }
    }

    /// With what is taken of the cores, by the file of that name.
    #[must_use]
    pub fn with_statistics(self, file: impl Into<PathBuf>) -> Self {
        Self { statistics: Some(file.into()), ..self }
    }

    /// Looks, if the last look was long enough ago, and gives the longest wait of a thread from one look to the next so far.
    pub fn look(&mut self, now: Instant) -> Duration {
        if self.due.is_some_and(|due| now < due) {
            return self.longest;
        }
        self.due = Some(now + INTERVAL);
        let statistics = self.statistics.as_ref().and_then(|file| std::fs::read_to_string(file).ok());
        let stolen = statistics.as_deref().and_then(stolen);
        let before = std::mem::replace(&mut self.stolen, stolen);
        let taken = TICK * stolen.zip(before).map_or(0, |(now, before)| now.saturating_sub(before)) as f64;
        let taken = Duration::from_secs_f64(taken);
        self.longest = self.longest.max(taken);
        for task in std::fs::read_dir(&self.tasks).into_iter().flatten().flatten() {
            let Some(waited) = waited(&task.path()) else { continue };
            let before = self.waited.insert(task.file_name().to_string_lossy().into_owned(), waited);
            if let Some(before) = before {
                self.longest = self.longest.max(taken + Duration::from_nanos(waited.saturating_sub(before)));
            }
        }
        self.longest
    }
}

/// What was taken of all cores since the machine began, ticks: the eighth number of the first line.
fn stolen(statistics: &str) -> Option<u64> {
    statistics.lines().next()?.strip_prefix("cpu ")?.split_whitespace().nth(7)?.parse().ok()
}

fn waited(task: &Path) -> Option<u64> {
    std::fs::read_to_string(task.join("schedstat")).ok()?.split_whitespace().nth(1)?.parse().ok()
}
