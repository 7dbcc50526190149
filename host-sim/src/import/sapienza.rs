//! The tricycle data of the course on probabilistic robotics of the Sapienza University of Rome: a text with a header of
//! nominal parameters and one line a sample: time, counters of steering and traction, the pose that the nominal parameters
//! give, and the pose that a tracker gives to the laser.

use std::f64::consts::TAU;
use std::path::Path;

use agv_core::geometry::Pose;
use agv_core::localizer::Parameters;
use agv_core::measurement::{EncoderSample, Time};
use agv_core::odometry::{CounterRange, Tricycle, Vehicle};

use super::table::shorten;
use crate::recording::{RecordedEvent, Recording, Reference};
use crate::text_file::{self, TextFileError};

/// What every such file begins with.
pub const SIGNATURE: &str = "#kinematic_model:";

/// The header: what is known before the first sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Header {
    /// Steering scale (a factor), way of one turn of the traction encoder (m), wheelbase (m), steering offset (rad).
    parameters: Option<[f64; 4]>,
    /// Ticks of one turn of the steering and of the traction encoder.
    ticks: Option<[f64; 2]>,
    /// Place of the laser in R, m.
    laser: Option<[f64; 3]>,
    /// Its rotation, a quaternion x, y, z, w.
    rotation: Option<[f64; 4]>,
}

/// Reads the data. Counters are kept as they are, with all faults; times count from the first sample. The nominal
/// parameters are those of the header. References are the tracker's poses of the laser, in the frame in which the tracker
/// began.
///
/// # Errors
/// If the file is missing, empty, something else, or has a bad line.
pub fn read(path: &Path) -> Result<Recording, TextFileError> {
    let expected = "a tricycle dataset of the Sapienza University";
    let text = text_file::read(path, expected)?;
    if !text.starts_with(SIGNATURE) {
        let looks_like = crate::file_kind::describe(text.as_bytes());
        return Err(TextFileError::Foreign { path: path.to_owned(), expected, looks_like });
    }
    let mut header = Header::default();
    let mut start = None;
    let (mut events, mut references) = (Vec::new(), Vec::new());
    for (line, text) in (1..).zip(text.lines()) {
        let problem = |problem: String| TextFileError::Line { path: path.to_owned(), line, problem };
        if let Some(comment) = text.strip_prefix('#') {
            header
                .take(comment)
                .ok_or_else(|| problem(format!("this header is not understood: {:?}", shorten(comment))))?;
            continue;
        }
        if text.trim().is_empty() {
            continue;
        }
        let sample = parse_sample(text).ok_or_else(|| problem("the line is no sample".to_owned()))?;
        let start = *start.get_or_insert(sample.nanoseconds);
        let since = sample.nanoseconds.checked_sub(start).ok_or_else(|| problem("time runs backward".to_owned()))?;
        let time = Time::from_micros((since + 500) / 1000);
        events.push(RecordedEvent::Encoders(EncoderSample { time, drive: sample.drive, steering: sample.steering }));
        let [x, y, heading] = sample.tracker;
        references.push(Reference { time, x, y, heading: Some(agv_core::geometry::wrap(heading)) });
    }
    if events.is_empty() {
        return Err(TextFileError::Empty { path: path.to_owned() });
    }
    let parameters = header.parameters().ok_or_else(|| TextFileError::Line {
        path: path.to_owned(),
        line: 1,
        problem: "the header does not state the vehicle's parameters".to_owned(),
    })?;
    Ok(Recording { parameters, landmarks: Vec::new(), events, truth: Vec::new(), references, state: None })
}

impl Header {
    /// Takes what a comment states; None if it states something badly. Other comments are left alone.
    fn take(&mut self, comment: &str) -> Option<()> {
        let comment = comment.trim();
        let Some((name, value)) = comment.split_once(':') else {
            return Some(());
        };
        match name {
            "parameter_values" => self.parameters = Some(numbers(value)?),
            "joints_max_enc_values" => self.ticks = Some(numbers(value)?),
            "translation" => self.laser = Some(numbers(value)?),
            "rotation" => self.rotation = Some(numbers(value)?),
            _ => {}
        }
        Some(())
    }

    fn parameters(&self) -> Option<Parameters> {
        let [steering_factor, drive_turn, wheelbase, steering_offset] = self.parameters?;
        let [steering_ticks, drive_ticks] = self.ticks?;
        let [x, y, _] = self.laser?;
        let [qx, qy, qz, qw] = self.rotation?;
        let yaw = (2.0 * (qw * qz + qx * qy)).atan2(1.0 - 2.0 * (qy * qy + qz * qz));
        let tricycle = Tricycle {
            wheelbase,
            drive_scale: drive_turn / drive_ticks,
            // The counter itself has 32 bits and does not start again after a turn.
            drive_range: CounterRange::BITS_32,
            steering_scale: steering_factor * TAU / steering_ticks,
            steering_range: CounterRange::new(steering_ticks as u64)?,
            steering_offset_forward: steering_offset,
            steering_offset_backward: steering_offset,
        };
        Some(Parameters::new(Vehicle::Tricycle(tricycle), Pose::new(x, y, yaw)))
    }
}

fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let words = text.split([' ', ',', '[', ']', '\t']).filter(|word| !word.is_empty());
    let values: Vec<f64> =
        words.map(|word| word.parse().ok().filter(|value: &f64| value.is_finite())).collect::<Option<_>>()?;
    values.try_into().ok()
}

struct Sample {
    /// Since 1970.
    nanoseconds: u64,
    steering: u32,
    drive: u32,
    tracker: [f64; 3],
}

fn parse_sample(line: &str) -> Option<Sample> {
    let rest = line.trim().strip_prefix("time:")?;
    let (time, rest) = rest.split_once("ticks:")?;
    let (ticks, rest) = rest.split_once("model_pose:")?;
    let (_, tracker) = rest.split_once("tracker_pose:")?;
    // A 64-bit float resolves a time since 1970 to a quarter of a microsecond only.
    let (seconds, fraction) = time.trim().split_once('.')?;
    if fraction.len() != 9 {
        return None;
    }
    let nanoseconds = seconds.parse::<u64>().ok()?.checked_mul(1_000_000_000)?.checked_add(fraction.parse().ok()?)?;
    let mut ticks = ticks.split_whitespace().map(|word| word.parse::<u32>().ok());
    let (steering, drive) = (ticks.next()??, ticks.next()??);
    if ticks.next().is_some() {
        return None;
    }
    Some(Sample { nanoseconds, steering, drive, tracker: numbers(tracker)? })
}
