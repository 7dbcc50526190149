//! Reflectors, as a laser tells them or as they are found in its scans.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::sighting::{OBSERVATIONS, Sighting};
use crate::filter::{Observation, RangeBearing};
use crate::geometry::{Pose, difference};
use crate::maps::{LandmarkKind, Verdict};
use crate::measurement::{Reflectors, Scan};
use crate::order::Evenly;
use crate::sensing::ReflectorDetection;

/// How reflectors are seen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReflectorParameters {
    /// Standard deviation of the distance, m.
    pub range_deviation: f64,
    /// Standard deviation of the direction, rad.
    pub bearing_deviation: f64,
    /// How they are found in scans that report the strength of returns; None if the sensor finds them itself.
    pub detection: Option<ReflectorDetection>,
}

impl Default for ReflectorParameters {
    fn default() -> Self {
        Self { range_deviation: 0.01, bearing_deviation: 1e-3, detection: None }
    }
}

impl ReflectorParameters {
    /// How reflectors are to be found in a scan, if they are.
    pub(crate) fn detection_in(&self, scan: &Scan) -> Option<&ReflectorDetection> {
        self.detection.as_ref().filter(|_| !scan.intensities.is_empty())
    }
}

/// Observations of reflectors as the filter takes them. Of more than there is room for as many are kept, from all around; true
/// if some are left out.
pub(crate) fn see_reflectors(
    reflectors: &ReflectorParameters,
    mount: &Pose,
    seen: &Reflectors,
    sightings: &mut Vec<Sighting, OBSERVATIONS>,
) -> bool {
    let mut choice = Evenly::new(OBSERVATIONS, seen.observations.len());
    for observation in seen.observations.iter().filter(|_| choice.takes()) {
        if !(observation.range.is_finite() && observation.bearing.is_finite()) {
            continue;
        }
        let observation_model = Observation::RangeBearing(RangeBearing {
            range: f64::from(observation.range),
            bearing: difference(f64::from(observation.bearing), 0.0),
            range_variance: reflectors.range_deviation * reflectors.range_deviation,
            bearing_variance: reflectors.bearing_deviation * reflectors.bearing_deviation,
        });
        let _ = sightings.push(Sighting {
            time: observation.time,
            laser: seen.laser,
            mount: *mount,
            kind: LandmarkKind::Reflector,
            observation: observation_model,
            orientation: 0.0,
            matched: None,
            verdict: Verdict::Unknown,
        });
    }
    choice.has_cut()
}
