//! What of a log comes from one sensor: when, and in which order among the rest.

use agv_core::localizer::AnyEvent;
use agv_core::measurement::{LaserId, Time};
use agv_core::odometry::Vehicle;

use crate::recording::{RecordedEvent, Recording};

/// Who says it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Source {
    Encoders,
    Speed,
    Increments,
    Wheels,
    Gyro,
    Reflectors(LaserId),
    Scans(LaserId),
}

impl Source {
    /// The source of an event; none of what is no measurement.
    pub(super) fn of(event: &RecordedEvent) -> Option<Self> {
        match event {
            AnyEvent::Encoders(_) => Some(Self::Encoders),
            AnyEvent::Speed(_) => Some(Self::Speed),
            AnyEvent::Increment(_) => Some(Self::Increments),
            AnyEvent::Wheels(_) => Some(Self::Wheels),
            AnyEvent::Gyro(_) => Some(Self::Gyro),
            AnyEvent::Reflectors(seen) => Some(Self::Reflectors(seen.laser)),
            AnyEvent::Scan(scan) => Some(Self::Scans(scan.laser)),
            AnyEvent::EncoderFaults(_) | AnyEvent::SetPose(_) => None,
        }
    }

    /// What the odometry of a vehicle is recorded as.
    pub(super) const fn of_vehicle(vehicle: &Vehicle) -> Self {
        match vehicle {
            Vehicle::Tricycle(_) => Self::Encoders,
            Vehicle::Ackermann(_) | Vehicle::TricycleSpeed(_) => Self::Speed,
            Vehicle::Increments => Self::Increments,
            Vehicle::Wheels(_) => Self::Wheels,
        }
    }

    pub(super) const fn is_odometry(self) -> bool {
        matches!(self, Self::Encoders | Self::Speed | Self::Increments | Self::Wheels)
    }

    pub(super) const fn laser(self) -> Option<LaserId> {
        match self {
            Self::Reflectors(laser) | Self::Scans(laser) => Some(laser),
            _ => None,
        }
    }

    /// Its name, as the subject of a sentence.
    pub(super) fn name(self) -> String {
        let of = |what: &str, laser: LaserId| match laser {
            LaserId::FIRST => what.to_owned(),
            laser => format!("{what} of laser {}", laser.index() + 1),
        };
        match self {
            Self::Encoders => "the encoders".to_owned(),
            Self::Speed => "the samples of speed and steering".to_owned(),
            Self::Increments => "the increments of the odometry".to_owned(),
            Self::Wheels => "the counters of the wheels".to_owned(),
            Self::Gyro => "the readings of the gyro".to_owned(),
            Self::Reflectors(laser) => of("the revolutions with reflectors", laser),
            Self::Scans(laser) => of("the scans", laser),
        }
    }

    /// Where to look if it is not there, or comes at wrong times.
    pub(super) fn remedy(self, log: &str) -> String {
        match self {
            Self::Encoders | Self::Wheels => format!("look at the bus and its load: agv view {log}"),
            Self::Gyro => format!("look at the gyro's frame on the bus: agv view {log}"),
            Self::Speed | Self::Increments => format!("look at what sends the odometry, and when: agv view {log}"),
            Self::Reflectors(_) | Self::Scans(_) => format!("look at the laser and its cable: agv view {log}"),
        }
    }

    /// Longest time between two of them that the localiser bridges, s: for odometry and gyro a tenth of a second; a laser is taken for
    /// silent after half a second.
    const fn longest_gap(self) -> f64 {
        if self.laser().is_some() { 0.5 } else { 0.1 }
    }
}

/// Everything that one source says, in the order of arrival.
#[derive(Clone, Debug)]
pub(super) struct Stream {
    pub source: Source,
    /// When; none of a revolution without reflectors.
    pub times: Vec<Option<Time>>,
    /// The latest time of the odometry when each arrived; none before the first one.
    pub odometry: Vec<Option<Time>>,
}

impl Stream {
    /// All streams of a recording, in the order in which they begin.
    pub(super) fn all(recording: &Recording) -> Vec<Self> {
        let mut streams: Vec<Self> = Vec::new();
        let mut odometry: Option<Time> = None;
        for event in &recording.events {
            let Some(source) = Source::of(event) else { continue };
            let time = event.time();
            match streams.iter_mut().find(|stream| stream.source == source) {
                Some(stream) => {
                    stream.times.push(time);
                    stream.odometry.push(odometry);
                }
                None => streams.push(Self { source, times: vec![time], odometry: vec![odometry] }),
            }
            if source.is_odometry() {
                odometry = time;
            }
        }
        streams
    }

    /// Steps of time from one to the next, where nothing without a time lies between.
    pub(super) fn steps(&self) -> impl Iterator<Item = f64> + '_ {
        self.times.windows(2).filter_map(|pair| Some(pair[1]?.since(pair[0]?)))
    }

    /// The usual step of time, s; none of fewer than two.
    pub(super) fn interval(&self) -> Option<f64> {
        median(self.steps().filter(|step| *step > 0.0))
    }

    /// From when on a step of time is a gap, s.
    pub(super) fn gap(&self) -> f64 {
        self.source.longest_gap().max(SLOW * self.interval().unwrap_or_default())
    }

    /// First and last time.
    pub(super) fn span(&self) -> Option<(Time, Time)> {
        let times = || self.times.iter().flatten().copied();
        times().min().zip(times().max())
    }
}

/// Usual steps of time that are no gap.
const SLOW: f64 = 3.5;

/// The middle one; none of nothing.
pub(super) fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}
