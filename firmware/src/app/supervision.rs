//! Whether every task still runs: the watchdog is fed only then.
#![allow(unsafe_code, reason = "memory that outlives a restart has a section of its own")]

use embassy_time::{Duration, Instant, Ticker};
use portable_atomic::{AtomicU32, Ordering};

/// The tasks that have run since the watchdog was fed: after it has bitten, what had stood still is missing here. It is loaded and
/// stored, and changed only in a critical section: atomic operations need memory whose bus, or the processor, watches it.
#[unsafe(link_section = ".retained")]
static SEEN: AtomicU32 = AtomicU32::new(0);

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

/// Least time between two meals of the watchdog, and how often the network's executor says that it runs.
const PERIOD: Duration = Duration::from_secs(1);

/// A task has run.
pub fn check_in(task: Task) {
    critical_section::with(|_| SEEN.store(SEEN.load(Ordering::Relaxed) | task as u32, Ordering::Relaxed));
}

/// Says for ever that the executor of the network runs.
pub async fn watch_network() -> ! {
    let mut ticker = Ticker::every(PERIOD / 2);
    loop {
        check_in(Task::Network);
        ticker.next().await;
    }
}

/// When the watchdog is fed.
pub struct Supervisor {
    last_meal: Instant,
}

impl Supervisor {
    /// The watchdog was fed just now. What was seen before counts no more: [`stood_still`] comes first.
    #[must_use]
    pub fn start() -> Self {
        SEEN.store(0, Ordering::Relaxed);
        Self { last_meal: Instant::now() }
    }

    /// Whether to feed it: all tasks have run since it was fed last, which was not just now.
    #[must_use]
    pub fn is_due(&mut self) -> bool {
        let now = Instant::now();
        let is_due = now - self.last_meal >= PERIOD && have_all_run();
        if is_due {
            self.last_meal = now;
        }
        is_due
    }
}

/// Whether all tasks have run; if so, none has from now on.
fn have_all_run() -> bool {
    critical_section::with(|_| {
        let have_run = SEEN.load(Ordering::Relaxed) == ALL;
        if have_run {
            SEEN.store(0, Ordering::Relaxed);
        }
        have_run
    })
}

/// After the watchdog has bitten: what had stood still.
#[must_use]
pub fn stood_still() -> &'static str {
    match ALL & !SEEN.load(Ordering::Relaxed) {
        1 => "the watchdog: the bus stood still",
        2 => "the watchdog: the network stood still",
        4 => "the watchdog: the localiser stood still",
        7 => "the watchdog: everything stood still",
        _ => "the watchdog: more than one task stood still",
    }
}
