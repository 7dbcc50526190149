//! How often each landmark has corrected the pose.

use std::collections::BTreeMap;

use agv_core::localizer::{LandmarkSource, LandmarkUse};
use agv_core::maps::{LandmarkKind, Verdict};
use agv_core::measurement::Time;
use serde::Serialize;

/// A landmark that was found while driving.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FoundLandmark {
    /// Its name.
    pub id: u16,
    /// Where it was seen last, m.
    pub position: [f64; 2],
    /// How often it has corrected the pose.
    pub hits: usize,
}

/// When each landmark has corrected the pose, in order of time.
#[derive(Clone, Debug, Default)]
pub(super) struct Hits {
    reflectors: BTreeMap<u16, Vec<Time>>,
    features: BTreeMap<u16, Vec<Time>>,
    found: BTreeMap<u16, Vec<(Time, [f64; 2])>>,
    /// Whether a feature among the landmarks has corrected the pose.
    pub(super) is_by_features: bool,
}

impl Hits {
    pub(super) fn take(&mut self, time: Time, one: &LandmarkUse) {
        self.is_by_features |= one.verdict == Verdict::Accepted && one.kind != LandmarkKind::Reflector;
        match one.landmark.filter(|_| one.verdict == Verdict::Accepted) {
            Some((LandmarkSource::Fixed, id)) if one.kind == LandmarkKind::Reflector => {
                self.reflectors.entry(id).or_default().push(time);
            }
            Some((LandmarkSource::Fixed, id)) => self.features.entry(id).or_default().push(time),
            Some((LandmarkSource::Dynamic, id)) => self.found.entry(id).or_default().push((time, one.located)),
            None => {}
        }
    }

    /// How often a landmark of the map has corrected the pose up to that time.
    pub(super) fn of(&self, kind: LandmarkKind, id: u16, until: Time) -> usize {
        let map = if kind == LandmarkKind::Reflector { &self.reflectors } else { &self.features };
        map.get(&id).map_or(0, |times| times.partition_point(|time| *time <= until))
    }

    /// Landmarks that have been found up to that time.
    pub(super) fn found(&self, until: Time) -> Vec<FoundLandmark> {
        let look = |(id, seen): (&u16, &Vec<(Time, [f64; 2])>)| {
            let hits = seen.partition_point(|(time, _)| *time <= until);
            let (_, position) = seen.get(hits.checked_sub(1)?)?;
            Some(FoundLandmark { id: *id, position: *position, hits })
        };
        self.found.iter().filter_map(look).collect()
    }
}
