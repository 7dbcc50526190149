//! Tables of wheels as drives.

use std::path::Path;

use agv_core::geometry::{Pose, wrap};
use agv_core::localizer::Parameters;
use agv_core::measurement::{EncoderSample, MOST_WHEELS, SpeedSample, Time, WheelReading, WheelSample};
use agv_core::odometry::{Tricycle, Vehicle, WheelBased, WheelMotion};
use serde::Deserialize;
use thiserror::Error;

use super::Imported;
use super::wheel_table::{self, TableColumns};
use crate::calibrate::wheeled::drive::WheelDrive;
use crate::recording::{RecordedEvent, Recording, Reference};
use crate::text_file::{self, TextFileError};

/// Why the wheels of a table are not those of a vehicle.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum WheelRecordingError {
    /// The vehicle reports no wheels.
    #[error("such a vehicle reports no wheels")]
    NoWheels,
    /// There are more or fewer wheels than the vehicle has.
    #[error("the vehicle has {has} wheels, and {told} are described")]
    Count {
        /// Of the vehicle.
        has: usize,
        /// In the table.
        told: usize,
    },
    /// The wheel's radius is needed.
    #[error("the radius of the first wheel is needed")]
    NoRadius,
}

/// What a file says of a table.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Description {
    /// The vehicle as logs have it; counters are written in its ticks.
    vehicle: Vehicle,
    /// Where that is whose poses the reference tells, in R.
    #[serde(default)]
    sensor: Pose,
    /// The columns.
    table: TableColumns,
}

/// Reads a table with the file that says what its columns are.
///
/// # Errors
/// If one of them is missing or bad, or they do not fit each other.
pub fn read(table: &Path, columns: &Path) -> Result<Imported, TextFileError> {
    let text = text_file::read(columns, "a description of columns")?;
    let description: Description = toml::from_str(&text).map_err(|error| {
        let line = error.span().map_or(1, |span| 1 + text[..span.start].matches('\n').count());
        TextFileError::of_line(columns, line, error.message().lines().collect::<Vec<_>>().join(" "))
    })?;
    let radius = description.table.wheel.first().and_then(|wheel| wheel.radius);
    let (drive, account) = wheel_table::read_all(table, &description.table)?;
    let recording = of(&drive, description.vehicle, radius, description.sensor)
        .map_err(|error| TextFileError::of_line(columns, 1, error.to_string()))?;
    Ok(Imported { recording, account })
}

/// The drive of that vehicle. `radius` is that of the first wheel, m, for vehicles that count a way.
///
/// # Errors
/// [`WheelRecordingError`].
pub fn of(
    drive: &WheelDrive,
    vehicle: Vehicle,
    radius: Option<f64>,
    sensor: Pose,
) -> Result<Recording, WheelRecordingError> {
    let first = drive.poses.first().map_or(0.0, |pose| pose.time.min(0.0));
    let time = |seconds: f64| Time::from_micros((1e6 * (seconds - first)).round() as u64);
    let told = drive.steps.first().map_or(0, |step| step.motions.len());
    let mut turns = vec![0.0; told];
    let still = drive.steps.first().map_or_else(Vec::new, |step| {
        let before = |motion: &WheelMotion| WheelMotion { turn: 0.0, steering_end: motion.steering_start, ..*motion };
        step.motions.iter().map(before).collect()
    });
    let rows = std::iter::once((0.0, &still)).chain(drive.steps.iter().map(|step| (step.end, &step.motions)));
    let (mut events, mut last) = (Vec::new(), 0.0);
    for (end, motions) in rows {
        turns.iter_mut().zip(motions).for_each(|(turn, motion)| *turn += motion.turn);
        let step = Row { time: time(end), duration: end - last, turns: &turns, motions };
        events.push(step.event(&vehicle, radius)?);
        last = end;
    }
    let references = drive.poses.iter().map(|pose| Reference {
        time: time(pose.time),
        x: pose.x,
        y: pose.y,
        heading: Some(wrap(pose.heading)),
    });
    let references = references.collect();
    let parameters = Parameters::new(vehicle, sensor);
    Ok(Recording { parameters, landmarks: Vec::new(), events, truth: Vec::new(), references, state: None })
}

struct Row<'a> {
    time: Time,
    duration: f64,
    /// Since the first row, rad.
    turns: &'a [f64],
    motions: &'a [WheelMotion],
}

impl Row<'_> {
    fn event(&self, vehicle: &Vehicle, radius: Option<f64>) -> Result<RecordedEvent, WheelRecordingError> {
        let none = WheelRecordingError::Count { has: 1, told: 0 };
        let (turn, motion) = self.turns.first().zip(self.motions.first()).ok_or(none)?;
        let radius = || radius.ok_or(WheelRecordingError::NoRadius);
        let ticks = |value: f64, scale: f64| (value / scale).round() as i64;
        Ok(match vehicle {
            Vehicle::Tricycle(Tricycle { drive_scale, drive_range, steering_scale, steering_range, .. }) => {
                let drive = drive_range.wrap(ticks(turn * radius()?, *drive_scale));
                let steering = steering_range.wrap(ticks(motion.steering_end, *steering_scale));
                RecordedEvent::Encoders(EncoderSample { time: self.time, drive, steering })
            }
            Vehicle::Ackermann(_) | Vehicle::TricycleSpeed(_) => {
                let way = motion.turn * radius()?;
                let speed = if self.duration > 0.0 { way / self.duration } else { 0.0 };
                RecordedEvent::Speed(SpeedSample { time: self.time, speed, steering: motion.steering_end })
            }
            Vehicle::Wheels(vehicle) => {
                let wheels = vehicle.wheels();
                let (has, told) = (wheels.as_ref().len(), self.turns.len());
                if has != told {
                    return Err(WheelRecordingError::Count { has, told });
                }
                let mut readings = [WheelReading::default(); MOST_WHEELS];
                let said = wheels.as_ref().iter().zip(self.turns).zip(self.motions);
                for (reading, ((wheel, turn), motion)) in readings.iter_mut().zip(said) {
                    if let Some(encoder) = wheel.turn {
                        reading.count = encoder.range.wrap(ticks(*turn, encoder.scale));
                    }
                    if let Some(encoder) = wheel.steering {
                        reading.steering = encoder.range.wrap(ticks(motion.steering_end, encoder.scale));
                    }
                }
                RecordedEvent::Wheels(WheelSample { time: self.time, wheels: readings })
            }
            Vehicle::Increments => return Err(WheelRecordingError::NoWheels),
        })
    }
}
