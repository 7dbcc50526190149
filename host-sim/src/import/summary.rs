//! How an import ends: what a drive holds, what was left out of its input, and what is doubtful in both.

use agv_core::measurement::Time;
use serde::Serialize;

use crate::account::{Account, LeftOut};
use crate::drive::way_steps;
use crate::recording::{RecordedEvent, Recording};

/// A sensor that is silent for longer is a warning, s.
pub const LONGEST_GAP: f64 = 1.0;

/// A drive made of an input of others, and what became of that.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The drive.
    pub recording: Recording,
    /// What was left out, assumed and doubted on the way to it.
    pub account: Account,
}

/// What an import found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ImportSummary {
    /// Samples of encoders or speeds, and increments.
    pub odometry: usize,
    /// Scans.
    pub scans: usize,
    /// Revolutions with reflectors that the sensor has found.
    pub reflectors: usize,
    /// Samples of a gyro.
    pub gyro: usize,
    /// Poses that somebody told.
    pub told_poses: usize,
    /// Landmarks of the map.
    pub landmarks: usize,
    /// True poses.
    pub truth: usize,
    /// Poses of another instrument.
    pub references: usize,
    /// From the first event to the last, s.
    pub span_s: f64,
    /// Length of the way by the odometry, m.
    pub distance_m: f64,
    /// What should have been used and was not.
    pub left_out: Vec<LeftOut>,
    /// What was in the input and nobody asked for.
    pub beside: Vec<LeftOut>,
    /// What was assumed.
    pub notes: Vec<String>,
    /// What is probably wrong.
    pub warnings: Vec<String>,
}

impl ImportSummary {
    /// Looks at a drive and at the account of its input.
    #[must_use]
    pub fn of(recording: &Recording, account: &Account) -> Self {
        let count = |is: fn(&RecordedEvent) -> bool| recording.events.iter().filter(|event| is(event)).count();
        let times = recording.events.iter().filter_map(RecordedEvent::time);
        let (first, last) = (times.clone().min(), times.max());
        let mut warnings = doubts(recording);
        warnings.extend(account.warnings());
        Self {
            odometry: count(RecordedEvent::is_odometry),
            scans: count(|event| matches!(event, RecordedEvent::Scan(_))),
            reflectors: count(|event| matches!(event, RecordedEvent::Reflectors(_))),
            gyro: count(|event| matches!(event, RecordedEvent::Gyro(_))),
            told_poses: count(RecordedEvent::is_told),
            landmarks: recording.landmarks.len(),
            truth: recording.truth.len(),
            references: recording.references.len(),
            span_s: first.zip(last).map_or(0.0, |(first, last)| last.since(first)),
            distance_m: way_steps(recording).sum(),
            left_out: account.left_out().to_vec(),
            beside: account.beside().to_vec(),
            notes: account.notes().to_vec(),
            warnings,
        }
    }

    /// The rows of a table, without notes and warnings.
    #[must_use]
    pub fn rows(&self) -> Vec<[String; 2]> {
        let counted = [
            ("odometry samples", self.odometry),
            ("scans", self.scans),
            ("reflector sets", self.reflectors),
            ("gyro samples", self.gyro),
            ("told poses", self.told_poses),
            ("landmarks", self.landmarks),
            ("true poses", self.truth),
            ("reference poses", self.references),
        ];
        let mut rows: Vec<[String; 2]> = counted.map(|(name, count)| [name.to_owned(), count.to_string()]).to_vec();
        rows.push(["span".to_owned(), format!("{:.2} s", self.span_s)]);
        rows.push(["distance".to_owned(), format!("{:.2} m", self.distance_m)]);
        rows.extend(self.left_out.iter().map(|one| ["left out".to_owned(), one.to_string()]));
        rows.extend(self.beside.iter().map(|one| ["set aside".to_owned(), one.to_string()]));
        rows
    }
}

/// A kind of sensor, and whether an event is its.
type Sensor = (&'static str, fn(&RecordedEvent) -> bool);

const SENSORS: [Sensor; 4] = [
    ("the odometry", RecordedEvent::is_odometry),
    ("the laser's scans", |event| matches!(event, RecordedEvent::Scan(_))),
    ("the laser's reflectors", |event| matches!(event, RecordedEvent::Reflectors(_))),
    ("the gyro", |event| matches!(event, RecordedEvent::Gyro(_))),
];

/// Gaps, times that run backward, and sensors that were never heard at one time.
fn doubts(recording: &Recording) -> Vec<String> {
    let mut doubts = Vec::new();
    let mut spans: Vec<(&str, Time, Time)> = Vec::new();
    for (name, is_its) in SENSORS {
        let times: Vec<Time> =
            recording.events.iter().filter(|event| is_its(event)).filter_map(RecordedEvent::time).collect();
        let Some((first, last)) = times.iter().min().zip(times.iter().max()) else { continue };
        spans.push((name, *first, *last));
        let backward = times.windows(2).filter(|pair| pair[1] < pair[0]).count();
        if backward > 0 {
            doubts.push(format!("the times of {name} run backward {backward} times"));
        }
        let gaps = || times.windows(2).map(|pair| (pair[1].since(pair[0]), pair[0])).filter(|gap| gap.0 > LONGEST_GAP);
        if let Some((longest, at)) = gaps().max_by(|a, b| a.0.total_cmp(&b.0)) {
            let seconds = at.since(*first);
            let number = gaps().count();
            doubts.push(format!(
                "{name} has {number} gaps over {LONGEST_GAP} s, the longest of {longest:.2} s, {seconds:.2} s behind its beginning"
            ));
        }
    }
    for (index, (name, first, last)) in spans.iter().enumerate() {
        for (other, from, to) in spans.iter().skip(index + 1) {
            if last < from || to < first {
                let apart = if last < from { from.since(*last) } else { first.since(*to) };
                doubts.push(format!(
                    "the times of {name} and {other} do not overlap: they are {apart:.2} s apart, as of two clocks"
                ));
            }
        }
    }
    doubts
}
