//! What a recording holds, in a few numbers.

use agv_host_sim::recording::{RecordedEvent, Recording};
use serde::Serialize;

use super::output;

/// What a recording holds.
#[derive(Serialize)]
pub struct Summary {
    /// Samples of encoders or speeds, and increments.
    odometry: usize,
    scans: usize,
    /// Revolutions with reflectors that the sensor has found.
    reflectors: usize,
    landmarks: usize,
    truth: usize,
    references: usize,
    /// Length of the true way, m; none if it is not known.
    way_m: Option<f64>,
}

impl Summary {
    /// Counts.
    pub fn of(recording: &Recording) -> Self {
        let count = |is: fn(&RecordedEvent) -> bool| recording.events.iter().filter(|event| is(event)).count();
        let steps = recording.truth.windows(2).map(|pair| (pair[1].pose.position() - pair[0].pose.position()).norm());
        Self {
            odometry: count(RecordedEvent::is_odometry),
            scans: count(|event| matches!(event, RecordedEvent::Scan(_))),
            reflectors: count(|event| matches!(event, RecordedEvent::Reflectors(_))),
            landmarks: recording.landmarks.len(),
            truth: recording.truth.len(),
            references: recording.references.len(),
            way_m: (!recording.truth.is_empty()).then(|| steps.sum()),
        }
    }

    /// Prints a table, or one JSON object.
    pub fn print(&self, as_json: bool) -> anyhow::Result<()> {
        if as_json {
            println!("{}", serde_json::to_string(self)?);
            return Ok(());
        }
        let row = |name: &str, value: String| [name.to_owned(), value];
        let mut rows = vec![
            row("odometry samples", self.odometry.to_string()),
            row("scans", self.scans.to_string()),
            row("reflector sets", self.reflectors.to_string()),
            row("landmarks", self.landmarks.to_string()),
            row("true poses", self.truth.to_string()),
            row("reference poses", self.references.to_string()),
        ];
        rows.extend(self.way_m.map(|way| row("way", format!("{way:.2} m"))));
        output::print_rows(&rows);
        Ok(())
    }
}
