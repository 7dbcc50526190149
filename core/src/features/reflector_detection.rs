//! Reflectors in a scan that reports the strength of each return.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::measurement::{ReflectorObservation, Scan};
use crate::order::Evenly;

/// What counts as a reflector.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReflectorDetection {
    /// Returns at least this strong belong to a reflector, in the device's unit.
    pub least_intensity: u16,
    /// Beams of one reflector differ in range by less than this, m.
    pub largest_step: f32,
    /// Largest width of a reflector, m.
    pub largest_width: f32,
    /// Farthest reflector, m.
    pub farthest: f32,
    /// What is added to the measured range to reach the reflector's centre, m.
    pub centre_offset: f32,
}

impl Default for ReflectorDetection {
    fn default() -> Self {
        Self { least_intensity: 1, largest_step: 0.3, largest_width: 1.0, farthest: 70.0, centre_offset: 0.0 }
    }
}

/// Beams that belong to one reflector.
struct Group {
    first: usize,
    last: usize,
    beams: f64,
    index_sum: f64,
    range_sum: f64,
    last_range: f32,
}

impl Group {
    fn observation(&self, scan: &Scan, parameters: &ReflectorDetection) -> Option<ReflectorObservation> {
        let range = self.range_sum / self.beams;
        let width = range * libm::fabs(scan.bearing_step) * (self.last - self.first) as f64;
        if width > f64::from(parameters.largest_width) {
            return None;
        }
        let index = self.index_sum / self.beams;
        Some(ReflectorObservation {
            time: scan.start.offset(index * scan.beam_interval),
            range: range as f32 + parameters.centre_offset,
            bearing: (scan.first_bearing + index * scan.bearing_step) as f32,
        })
    }
}

/// Finds groups of strong returns and gives the mean direction and range of each, in order of time. A group may have
/// single weak or missing beams inside. Of more than there is room for in `found` as many are kept, from all around. Returns
/// how many are left out.
pub fn detect_reflectors<const REFLECTORS: usize>(
    scan: &Scan,
    parameters: &ReflectorDetection,
    found: &mut Vec<ReflectorObservation, REFLECTORS>,
) -> usize {
    let count = detect(scan, parameters, Evenly::all(), found);
    if count > REFLECTORS {
        detect(scan, parameters, Evenly::new(REFLECTORS, count), found);
    }
    count.saturating_sub(REFLECTORS)
}

/// Finds all reflectors, keeps those that `choice` takes, and returns how many there are.
fn detect<const REFLECTORS: usize>(
    scan: &Scan,
    parameters: &ReflectorDetection,
    mut choice: Evenly,
    found: &mut Vec<ReflectorObservation, REFLECTORS>,
) -> usize {
    found.clear();
    let mut count = 0;
    let mut keep = |observation: ReflectorObservation| {
        count += 1;
        if choice.takes() {
            let _ = found.push(observation);
        }
    };
    let mut group: Option<Group> = None;
    for (index, (&range, &intensity)) in scan.ranges.iter().zip(scan.intensities).enumerate() {
        let is_strong = intensity >= parameters.least_intensity && range > 0.0 && range <= parameters.farthest;
        if !is_strong {
            continue;
        }
        if let Some(open) = &mut group {
            let is_same = index - open.last <= 2 && libm::fabsf(range - open.last_range) <= parameters.largest_step;
            if is_same {
                open.last = index;
                open.last_range = range;
                open.beams += 1.0;
                open.index_sum += index as f64;
                open.range_sum += f64::from(range);
                continue;
            }
            if let Some(observation) = open.observation(scan, parameters) {
                keep(observation);
            }
        }
        group = Some(Group {
            first: index,
            last: index,
            beams: 1.0,
            index_sum: index as f64,
            range_sum: f64::from(range),
            last_range: range,
        });
    }
    if let Some(observation) = group.and_then(|open| open.observation(scan, parameters)) {
        keep(observation);
    }
    count
}
