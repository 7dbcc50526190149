//! What is known of a drive, in order of time; it grows while a log is read or a controller drives.

use std::path::PathBuf;

use agv_core::geometry::Pose;
use agv_core::localizer::{Event, LandmarkUse, Mode, Parameters, PoseOutput};
use agv_core::maps::{Landmark, LandmarkKind};
use agv_core::measurement::{EncoderFaults, Time};
use agv_core::odometry::Vehicle;
use agv_core::record::{Damage, DamageReason, Output, Record};
use serde::Serialize;

use super::happening::{self, Happening, HappeningKind, ModeMemory};
use super::hits::Hits;
use super::scans::Scans;
use crate::drive::{mode_name_of_drive, parameter_rows};
use crate::recording::Truth;

/// Happenings that are kept; a drive with more has another problem.
const HAPPENINGS: usize = 20_000;

/// The observations of one revolution.
#[derive(Clone, Copy, Debug)]
pub(super) struct Revolution {
    /// Time of the answer to it.
    pub(super) time: Time,
    /// End of its observations.
    pub(super) end: usize,
}

/// What is known of a drive.
#[derive(Debug)]
pub struct Timeline {
    pub(super) name: String,
    pub(super) software: String,
    pub(super) parameters: Parameters,
    pub(super) landmarks: Vec<Landmark>,
    /// The last answer of each instant since a pose was first given.
    pub(super) poses: Vec<PoseOutput>,
    /// How far landmarks moved each of these poses, m.
    pub(super) corrections: Vec<f32>,
    pub(super) revolutions: Vec<Revolution>,
    pub(super) uses: Vec<LandmarkUse>,
    pub(super) hits: Hits,
    pub(super) scans: Scans,
    pub(super) truth: Vec<Truth>,
    pub(super) faults: Vec<EncoderFaults>,
    /// Times of the odometry, one in each tenth of a second.
    pub(super) odometry: Vec<Time>,
    /// When the laser said something.
    pub(super) laser: Vec<Time>,
    pub(super) happenings: Vec<Happening>,
    span: Option<(Time, Time)>,
    mode: ModeMemory,
    asked: Asked,
    /// Share of the work that is done, 0 to 1.
    pub(super) progress: f64,
    pub(super) is_live: bool,
    pub(super) is_complete: bool,
}

/// What an answer answers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Asked {
    /// Something that may show landmarks.
    Landmarks,
    /// A pose from outside.
    Given,
    /// Anything else.
    Other,
}

impl Asked {
    pub(super) fn of(event: &Event) -> Self {
        match event {
            Event::Reflectors(_) | Event::Scan(_) => Self::Landmarks,
            Event::SetPose(_) => Self::Given,
            _ => Self::Other,
        }
    }
}

/// How far a timeline has come.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Status {
    /// First and last instant, s of the log's clock; equal if nothing has come yet.
    pub start_s: f64,
    /// See `start_s`.
    pub end_s: f64,
    /// Share of the work that is done, 0 to 1.
    pub progress: f64,
    /// Whether nothing will be added.
    pub is_complete: bool,
    /// Whether it is of a controller that drives.
    pub is_live: bool,
    /// Number of poses.
    pub poses: usize,
    /// Number of scans.
    pub scans: usize,
    /// Number of landmarks of the map.
    pub landmarks: usize,
    /// Number of happenings.
    pub happenings: usize,
}

/// What does not change while a timeline grows.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Description {
    /// Name of the log or of the controller.
    pub name: String,
    /// What wrote it.
    pub software: String,
    /// The map: kind, name, position in m.
    pub landmarks: Vec<(LandmarkKind, u16, f64, f64)>,
    /// Parameters in words.
    pub parameters: Vec<[String; 2]>,
}

impl Timeline {
    fn new(name: String, scans: Scans) -> Self {
        Self {
            name,
            software: String::new(),
            parameters: Parameters::new(Vehicle::Increments, Pose::default()),
            landmarks: Vec::new(),
            poses: Vec::new(),
            corrections: Vec::new(),
            revolutions: Vec::new(),
            uses: Vec::new(),
            hits: Hits::default(),
            scans,
            truth: Vec::new(),
            faults: Vec::new(),
            odometry: Vec::new(),
            laser: Vec::new(),
            happenings: Vec::new(),
            span: None,
            mode: ModeMemory::NEW,
            asked: Asked::Other,
            progress: 0.0,
            is_live: false,
            is_complete: false,
        }
    }

    /// An empty timeline of a log.
    #[must_use]
    pub fn of_log(path: PathBuf) -> Self {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Self::new(name, Scans::in_file(path))
    }

    /// An empty timeline of a controller that drives.
    #[must_use]
    pub fn of_controller(host: &str) -> Self {
        Self { is_live: true, ..Self::new(host.to_owned(), Scans::default()) }
    }

    /// How far it has come.
    #[must_use]
    pub fn status(&self) -> Status {
        let (start, end) = self.span.unwrap_or_default();
        Status {
            start_s: start.seconds(),
            end_s: end.seconds(),
            progress: self.progress,
            is_complete: self.is_complete,
            is_live: self.is_live,
            poses: self.poses.len(),
            scans: self.scans.count(),
            landmarks: self.landmarks.len(),
            happenings: self.happenings.len(),
        }
    }

    /// What does not change.
    #[must_use]
    pub fn description(&self) -> Description {
        let landmark = |landmark: &Landmark| (landmark.kind, landmark.id, landmark.x, landmark.y);
        Description {
            name: self.name.clone(),
            software: self.software.clone(),
            landmarks: self.landmarks.iter().map(landmark).collect(),
            parameters: parameter_rows(&self.parameters),
        }
    }

    /// Everything that happened, in order of time.
    #[must_use]
    pub fn happenings(&self) -> &[Happening] {
        &self.happenings
    }

    /// Name of a mode, by what has led so far.
    pub(super) fn mode_name(&self, mode: Mode) -> &'static str {
        mode_name_of_drive(mode, !self.hits.is_by_features)
    }

    fn now(&self) -> Time {
        self.span.map(|(_, end)| end).unwrap_or_default()
    }

    fn see(&mut self, time: Time) {
        let (start, end) = self.span.unwrap_or((time, time));
        self.span = Some((start.min(time), end.max(time)));
    }

    fn happen(&mut self, time: Time, kind: HappeningKind, text: String) {
        if self.happenings.len() < HAPPENINGS {
            let time_s = time.seconds();
            // A replay tells later what happened earlier.
            let place = self.happenings.partition_point(|known| known.time_s <= time_s);
            self.happenings.insert(place, Happening { time_s, kind, text });
        }
    }

    /// Takes a record whose frame begins at that byte of the log.
    pub fn take(&mut self, record: &Record, offset: u64) {
        match record {
            Record::Header(header) => {
                header.software.clone_into(&mut self.software);
                self.parameters = *header.parameters;
            }
            Record::Landmarks(piece) => self.landmarks.extend_from_slice(piece),
            Record::Event(event) => self.take_event(event, offset),
            Record::Output(output) => self.take_answer(output),
            Record::Truth(truth) => {
                self.see(truth.time);
                self.truth.push(*truth);
            }
            Record::Note(text) => self.happen(self.now(), HappeningKind::Note, (*text).to_owned()),
            // The page shows what the localiser says, and the pose that is published follows it.
            Record::Behind(_)
            | Record::Published(_)
            | Record::Reference(_)
            | Record::Raw(_)
            | Record::State(_)
            | Record::End => {}
        }
    }

    /// Takes what is wrong with the log.
    pub fn take_damage(&mut self, damage: &Damage) {
        // Who begins to listen late has missed what came before.
        let is_late = self.is_live && self.span.is_none() && matches!(damage.reason, DamageReason::Sequence { .. });
        if is_late {
            return;
        }
        self.happen(self.now(), HappeningKind::Damage, damage.to_string());
    }

    fn take_event(&mut self, event: &Event, offset: u64) {
        self.asked = Asked::of(event);
        match event {
            Event::Encoders(sample) => self.take_odometry(sample.time),
            Event::Speed(sample) => self.take_odometry(sample.time),
            Event::Increment(increment) => self.take_odometry(increment.time),
            Event::Wheels(sample) => self.take_odometry(sample.time),
            Event::EncoderFaults(faults) => {
                self.see(faults.time);
                let is_new =
                    |before: &EncoderFaults| (before.drive, before.steering) != (faults.drive, faults.steering);
                if self.faults.last().map_or(faults.any(), is_new) {
                    self.happen(faults.time, HappeningKind::Fault, happening::of_faults(faults));
                    self.faults.push(*faults);
                }
            }
            Event::Reflectors(reflectors) => {
                if let Some(last) = reflectors.observations.last() {
                    self.see(last.time);
                    self.laser.push(last.time);
                }
            }
            Event::Scan(scan) => {
                self.see(scan.end());
                self.laser.push(scan.end());
                self.scans.take(scan, offset);
            }
            Event::Gyro(sample) => self.see(sample.time),
            Event::SetPose(fix) => {
                self.see(fix.time);
                let Pose { x, y, theta } = fix.pose;
                let text = format!("pose given: ({x:.2}, {y:.2}) m, {:.1} deg", theta.to_degrees());
                self.happen(fix.time, HappeningKind::PoseGiven, text);
            }
        }
    }

    fn take_odometry(&mut self, time: Time) {
        self.see(time);
        if self.odometry.last().is_none_or(|last| time.since(*last) >= 0.1) {
            self.odometry.push(time);
        }
    }

    fn take_answer(&mut self, output: &Output) {
        let asked = std::mem::replace(&mut self.asked, Asked::Other);
        self.take_replayed(asked, &output.pose, output.uses);
    }

    /// Takes the answer to an event that is in the timeline already.
    pub(super) fn take_replayed(&mut self, asked: Asked, pose: &PoseOutput, uses: &[LandmarkUse]) {
        let beginning = self.span.map(|(start, _)| start).unwrap_or_default();
        let time = if pose.mode == Mode::NotLocalised { beginning } else { pose.time };
        if pose.mode != Mode::NotLocalised {
            uses.iter().for_each(|one| self.hits.take(pose.time, one));
        }
        if let Some((kind, text)) = self.mode.take(pose, self.mode_name(pose.mode)) {
            self.happen(time, kind, text);
        }
        if pose.mode == Mode::NotLocalised {
            return;
        }
        self.see(pose.time);
        let before = &self.poses[self.poses.len().saturating_sub(2)..];
        let corrected = if asked == Asked::Landmarks { happening::correction(before, pose) } else { 0.0 };
        if let Some(text) = happening::of_correction(corrected) {
            self.happen(pose.time, HappeningKind::Correction, text);
        }
        match self.poses.last_mut().filter(|last| last.time == pose.time) {
            Some(last) => {
                *last = *pose;
                if let Some(largest) = self.corrections.last_mut() {
                    *largest = largest.max(corrected as f32);
                }
            }
            None => {
                self.poses.push(*pose);
                self.corrections.push(corrected as f32);
            }
        }
        if !uses.is_empty() {
            self.uses.extend_from_slice(uses);
            self.revolutions.push(Revolution { time: pose.time, end: self.uses.len() });
        }
    }
}
