//! What calibration takes from a log.

use std::path::Path;

use agv_core::geometry::Pose;
use agv_core::localizer::{Event, Parameters};
use agv_core::maps::{Landmark, LandmarkKind};
use agv_core::measurement::{EncoderSample, ReflectorObservation, WheelSample};
use agv_core::record::{Damage, Item, Record};

use super::windows::LaserPose;
use crate::log::{LogError, Reader};
use crate::recording::{RecordedEvent, Recording};

/// Encoders and whatever says how the laser has moved; scans are not kept.
#[derive(Clone, Debug, PartialEq)]
pub struct LogInput {
    /// What the localiser believed of its vehicle.
    pub parameters: Parameters,
    /// Samples of the encoders, in the order of arrival.
    pub encoders: Vec<EncoderSample>,
    /// Samples of several wheels, in the order of arrival.
    pub wheels: Vec<WheelSample>,
    /// Reflectors revolution by revolution, without those that are not finite.
    pub revolutions: Vec<Vec<ReflectorObservation>>,
    /// Observations of reflectors that were no numbers.
    pub bad_observations: usize,
    /// Poses of the laser that another instrument has measured.
    pub laser_poses: Vec<LaserPose>,
    /// Poses that were given from outside, as poses of the laser where the parameters say that it is.
    pub given_poses: Vec<LaserPose>,
    /// Reflectors of the log's own map.
    pub reflectors: Vec<Landmark>,
}

impl LogInput {
    /// A log without any record but its header.
    #[must_use]
    pub fn new(parameters: Parameters) -> Self {
        Self {
            parameters,
            encoders: Vec::new(),
            wheels: Vec::new(),
            revolutions: Vec::new(),
            bad_observations: 0,
            laser_poses: Vec::new(),
            given_poses: Vec::new(),
            reflectors: Vec::new(),
        }
    }

    /// Reads a log, record by record.
    ///
    /// # Errors
    /// If it cannot be read or has no header.
    pub fn read(path: &Path, mut progress: impl FnMut(u64)) -> Result<(Self, Vec<Damage>), LogError> {
        let mut reader = Reader::open(path)?;
        let mut damages = Vec::new();
        let mut input: Option<Self> = None;
        let mut records = 0_u64;
        while let Some(item) = reader.next()? {
            let (offset, record) = match item {
                Item::Damage(damage) => {
                    damages.push(damage);
                    continue;
                }
                Item::Record { offset, record, .. } => (offset, record),
            };
            records += 1;
            if records.is_multiple_of(1024) {
                progress(offset);
            }
            match (&mut input, record) {
                (None, Record::Header(header)) => input = Some(Self::new(*header.parameters)),
                (Some(known), Record::Header(header)) if known.parameters != *header.parameters => {
                    return Err(LogError::SecondDrive { path: path.to_owned(), offset });
                }
                (Some(input), Record::Event(event)) => input.add(&event),
                (Some(input), Record::Landmarks(landmarks)) => input.add_landmarks(landmarks),
                (Some(input), Record::Reference(reference)) => {
                    let heading = reference.heading.unwrap_or(f64::NAN);
                    input.add_laser_pose(reference.time, Pose { x: reference.x, y: reference.y, theta: heading });
                }
                _ => {}
            }
        }
        let header = LogError::Header { path: path.to_owned(), damage: damages.first().copied() };
        input.map(|input| (input, damages)).ok_or(header)
    }

    /// Takes what a recording in memory says, except for the truth.
    #[must_use]
    pub fn of(recording: &Recording) -> Self {
        let mut input = Self::new(recording.parameters);
        recording.events.iter().map(RecordedEvent::view).for_each(|event| input.add(&event));
        input.add_landmarks(&recording.landmarks);
        for reference in &recording.references {
            let heading = reference.heading.unwrap_or(f64::NAN);
            input.add_laser_pose(reference.time, Pose { x: reference.x, y: reference.y, theta: heading });
        }
        input
    }

    /// Takes an event.
    pub fn add(&mut self, event: &Event) {
        match event {
            Event::Encoders(sample) => self.encoders.push(*sample),
            Event::Wheels(sample) => self.wheels.push(*sample),
            Event::Reflectors(reflectors) => {
                let is_good = |seen: &&ReflectorObservation| {
                    seen.range.is_finite() && seen.bearing.is_finite() && (0.0..1e4).contains(&seen.range)
                };
                let good: Vec<_> = reflectors.observations.iter().filter(is_good).copied().collect();
                self.bad_observations += reflectors.observations.len() - good.len();
                if !good.is_empty() {
                    self.revolutions.push(good);
                }
            }
            Event::SetPose(fix) if fix.is_sound() => {
                let pose = fix.pose.compose(self.parameters.lasers.first());
                self.given_poses.push(LaserPose { time: fix.time, pose });
            }
            _ => {}
        }
    }

    /// Poses of the laser: those that another instrument has measured; if there are none, those that were given from outside.
    #[must_use]
    pub fn poses(&self) -> &[LaserPose] {
        if self.laser_poses.is_empty() { &self.given_poses } else { &self.laser_poses }
    }

    fn add_laser_pose(&mut self, time: agv_core::measurement::Time, pose: Pose) {
        if pose.is_finite() {
            self.laser_poses.push(LaserPose { time, pose });
        }
    }

    fn add_landmarks(&mut self, landmarks: &[Landmark]) {
        let is_reflector = |landmark: &&Landmark| landmark.kind == LandmarkKind::Reflector;
        self.reflectors.extend(landmarks.iter().filter(is_reflector));
    }
}
