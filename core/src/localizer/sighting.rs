//! What is seen in one event, as the filter takes it.

use heapless::Vec;
use nalgebra::Matrix2;

use super::Parameters;
use super::output::OBSERVATIONS;
use crate::filter::{Cartesian, Observation, RangeBearing};
use crate::geometry::{Point, Pose, difference};
use crate::maps::{LandmarkKind, Verdict};
use crate::measurement::{LaserId, ReflectorObservation, Reflectors, Scan, Time};
use crate::order::{Evenly, insertion_sort_by};
use crate::sensing::{Keypoint, KeypointKind, PointScan, SensorPath, falko};

/// Memory that is used within one event only.
#[derive(Clone, Debug)]
pub(super) struct Workspace<const BEAMS: usize> {
    pub points: PointScan<BEAMS>,
    pub path: SensorPath,
    pub detector: falko::Detector<BEAMS>,
    pub keypoints: Vec<Keypoint, OBSERVATIONS>,
    pub reflectors: Vec<ReflectorObservation, OBSERVATIONS>,
    pub sightings: Vec<Sighting, OBSERVATIONS>,
}

/// One observation of one event.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sighting {
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

impl<const BEAMS: usize> Workspace<BEAMS> {
    /// Finds the natural features of a scan. They are found in the scan as it would look from the first beam's place,
    /// and observed from where the sensor was at their own beam. Their covariance is not turned between the two. True if there
    /// was not room for all beams and features.
    pub fn see_features(&mut self, parameters: &Parameters, mount: &Pose, scan: &Scan) -> bool {
        let features = &parameters.features;
        self.points.set(scan, features.nearest, features.farthest);
        if features.motion_correction {
            self.path.correct(scan, &mut self.points);
        }
        let stride = PointScan::<BEAMS>::stride(scan);
        let left_out = self.detector.detect(&self.points, &mut self.keypoints);
        insertion_sort_by(&mut self.keypoints, |a, b| a.beam.cmp(&b.beam));
        self.sightings.clear();
        let added = features.added_deviation * features.added_deviation;
        for keypoint in &self.keypoints {
            let beam = usize::from(keypoint.beam) * stride;
            let position = Point::new(f64::from(keypoint.position.x), f64::from(keypoint.position.y));
            let position = if features.motion_correction {
                self.path.from_start(beam as f64 * scan.beam_interval, &position)
            } else {
                position
            };
            let [xx, xy, yy] = keypoint.covariance.map(f64::from);
            let _ = self.sightings.push(Sighting {
                time: scan.beam_time(beam),
                laser: scan.laser,
                mount: *mount,
                kind: match keypoint.kind {
                    KeypointKind::Corner => LandmarkKind::Corner,
                    KeypointKind::EndPoint => LandmarkKind::EndPoint,
                },
                observation: Observation::Cartesian(Cartesian {
                    position,
                    covariance: Matrix2::new(xx + added, xy, xy, yy + added),
                }),
                orientation: keypoint.orientation,
                matched: None,
                verdict: Verdict::Unknown,
            });
        }
        stride > 1 || left_out > 0
    }
}

/// Observations of reflectors as the filter takes them. Of more than there is room for as many are kept, from all around; true
/// if some are left out.
pub(super) fn see_reflectors(
    parameters: &Parameters,
    mount: &Pose,
    seen: &Reflectors,
    sightings: &mut Vec<Sighting, OBSERVATIONS>,
) -> bool {
    let mut choice = Evenly::new(OBSERVATIONS, seen.observations.len());
    let reflectors = &parameters.reflectors;
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
