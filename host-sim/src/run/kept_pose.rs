//! Where the vehicle was when it knew it last. It may have been moved since: the pose is never believed by itself. It is told to the
//! localiser only where the search for a start has found that two places of the map look alike, and only if what is seen fits
//! there.

use std::path::Path;

use agv_core::geometry::{Point, Pose};
use agv_core::localizer::PoseFix;
use agv_core::maps::{Landmark, LandmarkKind};
use agv_core::measurement::ReflectorObservation;
use serde::{Deserialize, Serialize};

use crate::output_file;

/// Its file in the folder of the store.
pub const POSE: &str = "pose.json";

/// Farthest that a reflector is from its place in the map, m: a vehicle that was switched off has hardly moved, or is elsewhere.
const NEAR: f64 = 0.3;
/// Fewest reflectors that are looked at, and the share of them that must be at their places: one of five may be hidden or new.
const FEWEST: usize = 3;
const SHARE: f64 = 0.8;
/// How sure it is told to be, m and rad: what is seen then decides.
const DEVIATIONS: [f64; 2] = [0.3, 0.05];

/// A pose of R in W, m and rad, in the map of that identity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeptPose {
    /// x, m.
    pub x_m: f64,
    /// y, m.
    pub y_m: f64,
    /// Heading, rad.
    pub heading_rad: f64,
    /// The map's identity.
    pub map: u32,
}

impl KeptPose {
    /// A pose in a map.
    #[must_use]
    pub const fn new(pose: &Pose, map: u32) -> Self {
        Self { x_m: pose.x, y_m: pose.y, heading_rad: pose.theta, map }
    }

    /// The pose that is kept in a folder, if there is one of that map.
    #[must_use]
    pub fn read(folder: &Path, map: u32) -> Option<Pose> {
        let bytes = std::fs::read(folder.join(POSE)).ok()?;
        let kept: Self = serde_json::from_slice(&bytes).ok().filter(|kept: &Self| kept.map == map)?;
        let pose = Pose::new(kept.x_m, kept.y_m, kept.heading_rad);
        pose.is_finite().then_some(pose)
    }

    /// Keeps it, whole or not at all.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, folder: &Path) -> std::io::Result<()> {
        output_file::write(&folder.join(POSE), &serde_json::to_vec(self)?)
    }
}

/// What the localiser is told of a kept pose, if what a laser at `mount` has seen is what it would see there.
pub(super) fn verified(
    kept: &Pose,
    mount: &Pose,
    seen: &[ReflectorObservation],
    landmarks: &[Landmark],
) -> Option<PoseFix> {
    let laser = kept.compose(mount);
    let is_at_its_place = |observation: &&ReflectorObservation| {
        let (sine, cosine) = libm::sincos(f64::from(observation.bearing));
        let range = f64::from(observation.range);
        let place = laser.transform(&Point::new(range * cosine, range * sine));
        let reflectors = landmarks.iter().filter(|landmark| landmark.kind == LandmarkKind::Reflector);
        reflectors.into_iter().any(|landmark| libm::hypot(landmark.x - place.x, landmark.y - place.y) <= NEAR)
    };
    let fitting = seen.iter().filter(is_at_its_place).count();
    let is_there = fitting >= FEWEST && fitting as f64 >= SHARE * seen.len() as f64;
    let [position_deviation, heading_deviation] = DEVIATIONS;
    let time = seen.last()?.time;
    is_there.then_some(PoseFix { time, pose: *kept, position_deviation, heading_deviation })
}

#[cfg(test)]
mod tests {
    use agv_core::geometry::Pose;
    use agv_core::maps::{Landmark, LandmarkKind};
    use agv_core::measurement::{ReflectorObservation, Time};

    use super::{KeptPose, POSE, verified};

    fn map() -> Vec<Landmark> {
        let landmark = |(id, (x, y))| Landmark { id, kind: LandmarkKind::Reflector, x, y, deviation: 0.01 };
        (0..).zip([(5.0, 0.0), (0.0, 6.0), (-7.0, 0.0), (0.0, -8.0)]).map(landmark).collect()
    }

    fn seen_from(pose: &Pose) -> Vec<ReflectorObservation> {
        let see = |landmark: &Landmark| {
            let there = pose.between(&Pose::new(landmark.x, landmark.y, 0.0));
            let (bearing, range) = (there.y.atan2(there.x) as f32, there.x.hypot(there.y) as f32);
            ReflectorObservation { time: Time::from_seconds(3.0), range, bearing }
        };
        map().iter().map(see).collect()
    }

    #[test]
    fn it_is_told_only_where_what_is_seen_fits() {
        let (kept, mount) = (Pose::new(0.5, -0.3, 0.4), Pose::new(0.2, 0.1, 0.05));
        let seen = seen_from(&kept.compose(&mount));
        let fix = verified(&kept, &mount, &seen, &map()).unwrap();
        assert_eq!((fix.pose, fix.time), (kept, Time::from_seconds(3.0)));
        // Two are not enough, and half of them neither.
        assert_eq!(verified(&kept, &mount, &seen[..2], &map()), None);
        let wrong = seen.iter().map(|one| ReflectorObservation { range: one.range + 1.0, ..*one });
        let mixed: Vec<_> = seen[..3].iter().copied().chain(wrong.clone().take(2)).collect();
        assert_eq!(verified(&kept, &mount, &mixed, &map()), None);
        let elsewhere = seen_from(&Pose::new(2.0, -0.3, 0.4).compose(&mount));
        assert_eq!(verified(&kept, &mount, &elsewhere, &map()), None);
        assert_eq!(verified(&kept, &mount, &[], &map()), None);
    }

    #[test]
    fn one_of_another_map_or_damaged_is_none() {
        let folder = tempfile::tempdir().unwrap();
        let pose = Pose::new(1.25, -2.5, 0.125);
        assert_eq!(KeptPose::read(folder.path(), 7), None);
        KeptPose::new(&pose, 7).write(folder.path()).unwrap();
        assert_eq!(KeptPose::read(folder.path(), 7), Some(pose));
        assert_eq!(KeptPose::read(folder.path(), 8), None);
        crate::output_file::write(&folder.path().join(POSE), "{\"x_m\":1.0").unwrap();
        assert_eq!(KeptPose::read(folder.path(), 7), None);
    }
}
