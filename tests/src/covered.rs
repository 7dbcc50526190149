//! A drive on which an incident comes, and the logs that are kept of it.

use std::path::{Path, PathBuf};
use std::time::Duration;

use agv_host_sim::recording::{RecordedEvent, Recording};
use agv_host_sim::run::RingOptions;

/// The drive, whose reflectors are covered from that time of it on, s: as soon as nothing is seen, its level is too large for travelling.
#[must_use]
pub fn covered(mut recording: Recording, seconds: f64) -> Recording {
    recording.parameters.alert_limits.travel.position = 0.1;
    let first = recording.events.iter().filter_map(RecordedEvent::time).min().unwrap_or_default();
    for event in &mut recording.events {
        let is_covered = event.time().is_some_and(|time| time.since(first) > seconds);
        if let RecordedEvent::Reflectors(seen) = event
            && is_covered
        {
            seen.observations.clear();
        }
    }
    recording
}

/// A ring of four seconds in parts of one, and incidents with two seconds before them and one behind.
#[must_use]
pub fn short_ring(folder: PathBuf) -> RingOptions {
    RingOptions {
        span: Duration::from_secs(4),
        part: Duration::from_secs(1),
        around: [Duration::from_secs(2), Duration::from_secs(1)],
        ring_bytes: 8 << 20,
        incident_bytes: 8 << 20,
        ..RingOptions::usual(folder)
    }
}

/// The logs in a folder, in order of their names.
///
/// # Panics
/// If there is no such folder.
#[must_use]
pub fn logs(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut logs: Vec<_> = entries.filter(|path| path.extension().is_some_and(|ending| ending == "agvlog")).collect();
    logs.sort();
    logs
}
