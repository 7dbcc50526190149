//! A drive in memory: what the sensors said, in the order of arrival, and apart from that where the vehicle really was.

use agv_core::geometry::Pose;
use agv_core::localizer::{Event, LandmarkUse, Parameters, PoseFix, PoseOutput};
use agv_core::maps::Landmark;
use agv_core::measurement::{
    EncoderFaults, EncoderSample, PoseIncrement, ReflectorObservation, Reflectors, Scan, SpeedSample, Time,
};
use agv_core::record::Output;
pub use agv_core::record::{Reference, Truth};

/// A scan that owns its ranges; the fields are those of [`Scan`].
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedScan {
    /// When the first beam was measured.
    pub start: Time,
    /// Time between neighbouring beams, s.
    pub beam_interval: f64,
    /// Direction of the first beam in S, rad.
    pub first_bearing: f64,
    /// Angle between neighbouring beams, rad.
    pub bearing_step: f64,
    /// Range of each beam, m.
    pub ranges: Vec<f32>,
    /// Strength of each return, or empty.
    pub intensities: Vec<u16>,
}

impl RecordedScan {
    /// The scan as the core takes it.
    #[must_use]
    pub fn view(&self) -> Scan<'_> {
        Scan {
            start: self.start,
            beam_interval: self.beam_interval,
            first_bearing: self.first_bearing,
            bearing_step: self.bearing_step,
            ranges: &self.ranges,
            intensities: &self.intensities,
        }
    }
}

/// An event that owns what it carries.
#[derive(Clone, Debug, PartialEq)]
pub enum RecordedEvent {
    /// Counters of a tricycle's encoders.
    Encoders(EncoderSample),
    /// What is wrong with a tricycle's encoders.
    EncoderFaults(EncoderFaults),
    /// Speed and steering angle.
    Speed(SpeedSample),
    /// Motion that the vehicle has integrated itself.
    Increment(PoseIncrement),
    /// Reflectors of one revolution.
    Reflectors(Vec<ReflectorObservation>),
    /// Ranges of one sweep.
    Scan(RecordedScan),
    /// A pose from outside.
    SetPose(PoseFix),
}

impl RecordedEvent {
    /// The event as the core takes it.
    #[must_use]
    pub fn view(&self) -> Event<'_> {
        match self {
            Self::Encoders(sample) => Event::Encoders(*sample),
            Self::EncoderFaults(faults) => Event::EncoderFaults(*faults),
            Self::Speed(sample) => Event::Speed(*sample),
            Self::Increment(increment) => Event::Increment(*increment),
            Self::Reflectors(observations) => Event::Reflectors(Reflectors { observations }),
            Self::Scan(scan) => Event::Scan(scan.view()),
            Self::SetPose(fix) => Event::SetPose(*fix),
        }
    }
}

impl RecordedEvent {
    /// Whether somebody has told where the vehicle is.
    #[must_use]
    pub fn is_told(&self) -> bool {
        matches!(self, Self::SetPose(_))
    }

    /// When it happened; for a revolution, when it began. None for a revolution without reflectors.
    #[must_use]
    pub fn time(&self) -> Option<Time> {
        match self {
            Self::Encoders(sample) => Some(sample.time),
            Self::EncoderFaults(faults) => Some(faults.time),
            Self::Speed(sample) => Some(sample.time),
            Self::Increment(increment) => Some(increment.time),
            Self::Reflectors(observations) => observations.first().map(|observation| observation.time),
            Self::Scan(scan) => Some(scan.start),
            Self::SetPose(fix) => Some(fix.time),
        }
    }
}

impl From<Event<'_>> for RecordedEvent {
    fn from(event: Event<'_>) -> Self {
        match event {
            Event::Encoders(sample) => Self::Encoders(sample),
            Event::EncoderFaults(faults) => Self::EncoderFaults(faults),
            Event::Speed(sample) => Self::Speed(sample),
            Event::Increment(increment) => Self::Increment(increment),
            Event::Reflectors(reflectors) => Self::Reflectors(reflectors.observations.to_vec()),
            Event::Scan(scan) => Self::Scan(RecordedScan {
                start: scan.start,
                beam_interval: scan.beam_interval,
                first_bearing: scan.first_bearing,
                bearing_step: scan.bearing_step,
                ranges: scan.ranges.to_vec(),
                intensities: scan.intensities.to_vec(),
            }),
            Event::SetPose(fix) => Self::SetPose(fix),
        }
    }
}

/// A drive in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// What the localiser believes of its vehicle.
    pub parameters: Parameters,
    /// The map that the localiser is given.
    pub landmarks: Vec<Landmark>,
    /// What happened, in the order of arrival.
    pub events: Vec<RecordedEvent>,
    /// Where the vehicle really was, in order of time; empty if nobody knows.
    pub truth: Vec<Truth>,
    /// Where another instrument has seen the laser, in order of time; empty if there was none.
    pub references: Vec<Reference>,
}

/// What the localiser answered to one event when it was recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedOutput {
    /// Index of the event.
    pub event: usize,
    /// The pose after the event.
    pub pose: PoseOutput,
    /// What became of the event's observations, in order of time.
    pub uses: Vec<LandmarkUse>,
}

impl RecordedOutput {
    /// The answer as a log takes it.
    #[must_use]
    pub fn view(&self) -> Output<'_> {
        Output { pose: self.pose, uses: &self.uses }
    }
}

impl Recording {
    /// The poses of R that the references state: those with a heading, in order of time.
    #[must_use]
    pub fn referenced_poses(&self) -> Vec<Truth> {
        let laser_in_reverse = self.parameters.laser.inverse();
        let poses = self.references.iter().filter_map(|reference| {
            let laser = Pose::new(reference.x, reference.y, reference.heading?);
            Some(Truth { time: reference.time, pose: laser.compose(&laser_in_reverse) })
        });
        poses.collect()
    }
}

/// The true pose at a time, at constant body velocity between its neighbours. None outside the recorded truth.
#[must_use]
pub fn truth_at(truth: &[Truth], time: Time) -> Option<Pose> {
    let after = truth.partition_point(|sample| sample.time < time);
    let next = truth.get(after)?;
    if next.time == time {
        return Some(next.pose);
    }
    let previous = truth.get(after.checked_sub(1)?)?;
    let share = time.since(previous.time) / next.time.since(previous.time);
    Some(previous.pose.compose(&previous.pose.between(&next.pose).fraction(share)))
}
