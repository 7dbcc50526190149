//! How the parts of the vehicle were during a drive.

use agv_core::measurement::{EncoderFaults, Time};

use crate::recording::{RecordedEvent, Recording};

/// Time between neighbours that is longest, s.
fn longest_silence(times: impl Iterator<Item = Time>) -> Option<f64> {
    let mut times: Vec<Time> = times.collect();
    times.sort_unstable();
    times.windows(2).map(|pair| pair[1].since(pair[0])).reduce(f64::max)
}

/// What the sensors did: name and value.
#[must_use]
pub fn health_rows(recording: &Recording) -> Vec<[String; 2]> {
    let times = |wanted: fn(&RecordedEvent) -> bool| {
        recording.events.iter().filter(move |event| wanted(event)).filter_map(RecordedEvent::time)
    };
    let is_odometry = |event: &RecordedEvent| event.is_odometry();
    let silence = |longest: Option<f64>| longest.map_or("-".to_owned(), |longest| format!("{longest:.3} s"));
    let mut changes: Vec<EncoderFaults> = Vec::new();
    for event in &recording.events {
        if let RecordedEvent::EncoderFaults(faults) = event {
            let before = changes.last().copied().unwrap_or_default();
            if (before.drive, before.steering) != (faults.drive, faults.steering) {
                changes.push(*faults);
            }
        }
    }
    let row = |name: &str, value: String| [name.to_owned(), value];
    let mut rows = vec![
        row("longest silence, laser", silence(longest_silence(times(|event| matches!(event, RecordedEvent::Scan(_)))))),
        row("longest silence, odometry", silence(longest_silence(times(is_odometry)))),
        row("encoder faults", changes.iter().filter(|faults| faults.any()).count().to_string()),
    ];
    for faults in changes.iter().take(LISTED) {
        let name = |fault: Option<_>| fault.map_or("sound".to_owned(), |fault| format!("{fault:?}").to_lowercase());
        let value = format!("drive {}, steering {}", name(faults.drive), name(faults.steering));
        rows.push(row(&format!("encoders at {:.2} s", faults.time.seconds()), value));
    }
    rows
}

/// Changes that are listed at the most.
const LISTED: usize = 20;
