//! What an emulated sensor will see: the drive, turn by turn.

use std::f64::consts::TAU;

use agv_core::geometry::Pose;
use agv_core::localizer::Event;
use agv_core::measurement::{ReflectorObservation, Time};
use agv_wire::nav350::{Distance, IdentifiedLandmark, Milliangle, SensorFrame};

use crate::layout_file;
use crate::recording::{RecordedEvent, RecordedReflectors, RecordedScan, Recording};

/// What the sensor measured in one turn.
#[derive(Clone, Debug, PartialEq)]
pub struct Turn {
    /// When its first beam was measured, in the time of the drive.
    pub start: Time,
    /// Range of each beam, mm.
    pub ranges: Vec<u32>,
    /// Strength of each echo, or empty.
    pub remission: Vec<u16>,
    /// Direction of the first beam.
    pub first: Milliangle,
    /// Angle between beams, thousandths of a degree.
    pub resolution: u16,
    /// Reflectors.
    pub reflectors: Vec<ReflectorObservation>,
    /// True pose of S at the end.
    pub pose: Option<Pose>,
}

/// What the sensor will see.
#[derive(Clone, Debug)]
pub struct Drive {
    pub(super) turns: Vec<Turn>,
    /// Number of the first of them; of a drive that goes on, older ones are forgotten.
    pub(super) first: usize,
    /// Whether turns come while the sensor is asked.
    pub(super) is_live: bool,
    /// When the drive begins, in the time of the recording: the first sample of the encoders, if there are any.
    pub(super) begin: Time,
    layout: Vec<IdentifiedLandmark>,
    pub(super) frame: SensorFrame,
}

/// Why a recording cannot be served.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DriveError {
    /// It has no scans and no reflectors.
    #[error("the drive has neither scans nor reflectors")]
    Empty,
}

/// Turns of a drive that goes on which can still be asked for.
const KEPT: usize = 4;

impl Turn {
    /// A scan, without reflectors and pose.
    #[must_use]
    pub fn of(scan: &RecordedScan, frame: &SensorFrame) -> Self {
        Self {
            start: scan.start,
            ranges: scan.ranges.iter().copied().map(millimetres).collect(),
            remission: scan.intensities.clone(),
            first: Milliangle::from_radians(agv_core::geometry::wrap(frame.angle(scan.first_bearing))),
            resolution: Milliangle::from_radians(scan.bearing_step.abs()).0.try_into().unwrap_or(u16::MAX),
            reflectors: Vec::new(),
            pose: None,
        }
    }
}

fn millimetres(range: f32) -> u32 {
    Distance::from_metres(f64::from(range)).0
}

impl Drive {
    /// The scans and reflectors of a recording, turn by turn.
    ///
    /// # Errors
    /// If it has neither.
    pub fn new(recording: &Recording, frame: SensorFrame) -> Result<Self, DriveError> {
        let mut turns: Vec<Turn> = Vec::new();
        let empty = |start| Turn {
            start,
            ranges: Vec::new(),
            remission: Vec::new(),
            first: Milliangle(0),
            resolution: 250,
            reflectors: Vec::new(),
            pose: None,
        };
        for event in &recording.events {
            let RecordedEvent::Scan(scan) = event else { continue };
            turns.push(Turn::of(scan, &frame));
        }
        let has_scans = !turns.is_empty();
        turns.sort_by_key(|turn| turn.start);
        for event in &recording.events {
            let RecordedEvent::Reflectors(RecordedReflectors { observations, .. }) = event else { continue };
            let Some(first) = observations.first() else { continue };
            if has_scans {
                let index = turns.partition_point(|turn| turn.start <= first.time).saturating_sub(1);
                turns[index].reflectors.extend(observations);
            } else {
                let earliest = turns.last().map(|turn| turn.start.offset(0.5 * frame.period));
                let start = turn_start(first, &frame, earliest);
                turns.push(Turn { reflectors: observations.clone(), ..empty(start) });
            }
        }
        let begin = begin(recording).or(turns.first().map(|turn| turn.start)).ok_or(DriveError::Empty)?;
        if !has_scans {
            turns = without_gaps(turns, begin, &frame, empty);
        }
        for turn in &mut turns {
            let end = turn.start.offset(frame.period);
            let index = recording.truth.partition_point(|truth| truth.time <= end);
            let truth = recording.truth.get(index.saturating_sub(1));
            turn.pose = truth.map(|truth| truth.pose.compose(recording.parameters.lasers.first()));
        }
        let layout = layout_file::layout(&recording.landmarks);
        if turns.is_empty() {
            Err(DriveError::Empty)
        } else {
            Ok(Self { turns, first: 0, is_live: false, begin, layout, frame })
        }
    }

    /// A drive that goes on: nothing is seen yet, and the times of what will be are those since the start of the sensor.
    #[must_use]
    pub fn live(frame: SensorFrame) -> Self {
        Self { turns: Vec::new(), first: 0, is_live: true, begin: Time::default(), layout: Vec::new(), frame }
    }

    /// Adds a turn that has ended; those that nobody asks for any more are forgotten.
    pub(super) fn push(&mut self, turn: Turn) {
        self.turns.push(turn);
        let old = self.turns.len().saturating_sub(KEPT);
        self.turns.drain(..old);
        self.first += old;
    }

    /// Place among the turns of the turn of that number, or of the oldest that is known.
    pub(super) fn place(&self, number: usize) -> usize {
        number.saturating_sub(self.first)
    }

    /// What the sensor will see, turn by turn.
    #[must_use]
    pub fn turns(&self) -> &[Turn] {
        &self.turns
    }

    /// What the sensor was taught.
    #[must_use]
    pub fn layout(&self) -> &[IdentifiedLandmark] {
        &self.layout
    }
}

/// When the encoders began to report.
fn begin(recording: &Recording) -> Option<Time> {
    recording.events.iter().find_map(|event| match event.view() {
        Event::Encoders(sample) => Some(sample.time),
        _ => None,
    })
}

/// When the head began the turn in which it saw a reflector: the reflector's direction says how far it had turned. Not
/// before `earliest`, as the noise of a direction may carry it across the seam between two turns.
fn turn_start(seen: &ReflectorObservation, frame: &SensorFrame, earliest: Option<Time>) -> Time {
    let turned = frame.angle(f64::from(seen.bearing)).rem_euclid(TAU);
    let start = seen.time.offset(-frame.interval(turned));
    match earliest {
        Some(earliest) if start < earliest => start.offset(frame.period),
        _ => start,
    }
}

/// The head turns when there is nothing to see, too: from `begin` on there is a turn in every period.
fn without_gaps(turns: Vec<Turn>, begin: Time, frame: &SensorFrame, empty: impl Fn(Time) -> Turn) -> Vec<Turn> {
    let mut filled: Vec<Turn> = Vec::new();
    for turn in turns {
        let next = filled.last().map_or(begin, |last| last.start.offset(frame.period));
        let missing = (turn.start.since(next) / frame.period).round().max(0.0) as u32;
        filled.extend((1..=missing).rev().map(|back| empty(turn.start.offset(-f64::from(back) * frame.period))));
        filled.push(turn);
    }
    filled
}
