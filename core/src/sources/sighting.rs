//! What is seen in one event, as the filter takes it.

use heapless::Vec;

use crate::filter::{Cartesian, Observation};
use crate::geometry::Pose;
use crate::maps::{LandmarkKind, Verdict};
use crate::measurement::{LaserId, ReflectorObservation, Time};
use crate::sensing::SensorPath;

/// Observations of one event at the most.
pub const OBSERVATIONS: usize = 128;

/// Memory that is used within one event only.
#[derive(Clone, Debug, Default)]
pub struct Workspace {
    pub path: SensorPath,
    pub reflectors: Vec<ReflectorObservation, OBSERVATIONS>,
    pub sightings: Vec<Sighting, OBSERVATIONS>,
}

/// One observation of one event.
#[derive(Clone, Copy, Debug)]
pub struct Sighting {
    pub time: Time,
    pub laser: LaserId,
    /// Where that laser is mounted in R.
    pub mount: Pose,
    pub kind: LandmarkKind,
    pub observation: Observation,
    /// Direction of a feature in S, rad.
    pub orientation: f32,
    /// What is left to do for the dynamic map: the landmark that it belongs to, or none if it is new.
    pub matched: Option<u16>,
    pub verdict: Verdict,
}

impl Sighting {
    /// The same as it would be seen at `time`, by a path that begins at `start`.
    pub fn moved(&self, path: &SensorPath, start: Time, time: Time) -> Self {
        let seen = self.observation.cartesian();
        let at_start = path.to_start(self.time.since(start), &seen.position);
        let position = path.from_start(time.since(start), &at_start);
        Self { observation: Observation::Cartesian(Cartesian { position, ..seen }), ..*self }
    }
}
