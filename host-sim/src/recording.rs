//! A drive in memory: what the sensors said, in the order of arrival, and apart from that where the vehicle really was.

use agv_core::geometry::Pose;
use agv_core::localizer::{AnyEvent, AsReflectors, AsScan, Event, LandmarkUse, Parameters, PoseOutput};
use agv_core::maps::Landmark;
use agv_core::measurement::{LaserId, ReflectorObservation, Reflectors, Scan, Time};
use agv_core::record::{Output, Published, StateOwner, StatePiece};
pub use agv_core::record::{Reference, Truth};

/// A scan that owns its ranges; the fields are those of [`Scan`].
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedScan {
    /// Which laser has measured it.
    pub laser: LaserId,
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
            laser: self.laser,
            start: self.start,
            beam_interval: self.beam_interval,
            first_bearing: self.first_bearing,
            bearing_step: self.bearing_step,
            ranges: &self.ranges,
            intensities: &self.intensities,
        }
    }
}

impl AsScan for RecordedScan {
    fn as_scan(&self) -> Scan<'_> {
        self.view()
    }
}

impl From<&Scan<'_>> for RecordedScan {
    fn from(scan: &Scan) -> Self {
        Self {
            laser: scan.laser,
            start: scan.start,
            beam_interval: scan.beam_interval,
            first_bearing: scan.first_bearing,
            bearing_step: scan.bearing_step,
            ranges: scan.ranges.to_vec(),
            intensities: scan.intensities.to_vec(),
        }
    }
}

/// Reflectors of one revolution that are kept; the fields are those of [`Reflectors`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordedReflectors {
    /// Which laser has found them.
    pub laser: LaserId,
    /// Observations in order of time.
    pub observations: Vec<ReflectorObservation>,
}

impl AsReflectors for RecordedReflectors {
    fn as_reflectors(&self) -> Reflectors<'_> {
        Reflectors { laser: self.laser, observations: &self.observations }
    }
}

impl From<Vec<ReflectorObservation>> for RecordedReflectors {
    /// Those of the laser of a vehicle that has one.
    fn from(observations: Vec<ReflectorObservation>) -> Self {
        Self { laser: LaserId::FIRST, observations }
    }
}

/// An event that owns what it carries.
pub type RecordedEvent = AnyEvent<RecordedReflectors, RecordedScan>;

/// Keeps what an event carries.
#[must_use]
pub fn keep(event: &Event) -> RecordedEvent {
    event.map(
        |seen| RecordedReflectors { laser: seen.laser, observations: seen.observations.to_vec() },
        RecordedScan::from,
    )
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
    /// What was known before the first event, if the recording begins in the middle of a drive.
    pub state: Option<StoredState>,
}

/// What localiser and publisher knew before the first event of a recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StoredState {
    /// As [`agv_core::localizer::Localizer::save_state`] gives it.
    pub localizer: Vec<u8>,
    /// As [`agv_core::localizer::OutputPredictor::save_state`] gives it; empty if nobody knows.
    pub predictor: Vec<u8>,
}

impl StoredState {
    /// Adds a piece. One that does not follow is left out, and the state will be refused.
    pub(crate) fn add(&mut self, piece: &StatePiece) {
        let state = match piece.owner {
            StateOwner::Localizer => &mut self.localizer,
            StateOwner::Predictor => &mut self.predictor,
        };
        if state.len() == piece.start as usize {
            state.extend_from_slice(piece.bytes);
        }
    }

    /// Its pieces as a log takes them.
    pub(crate) fn pieces(&self) -> impl Iterator<Item = StatePiece<'_>> {
        let localizer = StatePiece::of(StateOwner::Localizer, &self.localizer);
        localizer.chain(StatePiece::of(StateOwner::Predictor, &self.predictor))
    }
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

/// What the vehicle was given when it was recorded, and what the localiser had not answered by then.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Publishing {
    /// Index of an event of the bus, and how many events before it had not been answered when the bus heard it; events before
    /// which all had been answered are left out.
    pub behind: Vec<(usize, u32)>,
    /// The poses.
    pub poses: Vec<RecordedPose>,
}

/// A pose as the vehicle was given it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordedPose {
    /// How many events stand before it in the log.
    pub events: usize,
    /// The pose, and what it rests on.
    pub published: Published,
}

impl Recording {
    /// The poses of R that the references state: those with a heading, in order of time.
    #[must_use]
    pub fn referenced_poses(&self) -> Vec<Truth> {
        let laser_in_reverse = self.parameters.lasers.first().inverse();
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

/// The true pose at a time; before the recorded truth its first pose and behind it its last, as the vehicle stands there.
/// None if there is no truth.
#[must_use]
pub fn truth_or_stand_at(truth: &[Truth], time: Time) -> Option<Pose> {
    let (first, last) = (truth.first()?, truth.last()?);
    truth_at(truth, time.clamp(first.time, last.time))
}
