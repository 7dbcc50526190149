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

/// Most single weak or missing beams that lie next to each other in a reflector, and one.
const LONGEST_STEP: usize = 2;

/// Beams that belong to one reflector.
#[derive(Clone, Copy)]
struct Group {
    first: usize,
    last: usize,
    beams: f64,
    index_sum: f64,
    range_sum: f64,
    first_range: f32,
    last_range: f32,
}

impl Group {
    fn new(index: usize, range: f32) -> Self {
        Self {
            first: index,
            last: index,
            beams: 1.0,
            index_sum: index as f64,
            range_sum: f64::from(range),
            first_range: range,
            last_range: range,
        }
    }

    /// Whether a strong return `steps` beams after the last one is of the same reflector.
    fn goes_on(&self, steps: usize, range: f32, parameters: &ReflectorDetection) -> bool {
        steps <= LONGEST_STEP && libm::fabsf(range - self.last_range) <= parameters.largest_step
    }

    fn add(&mut self, index: usize, range: f32) {
        self.last = index;
        self.last_range = range;
        self.beams += 1.0;
        self.index_sum += index as f64;
        self.range_sum += f64::from(range);
    }

    fn index(&self) -> f64 {
        self.index_sum / self.beams
    }

    fn range(&self) -> f64 {
        self.range_sum / self.beams
    }

    fn observation(&self, scan: &Scan, parameters: &ReflectorDetection) -> Option<ReflectorObservation> {
        let mean = Mean { time: self.index(), direction: self.index(), range: self.range() };
        mean.observation(self.last - self.first, scan, parameters)
    }

    /// Whether the group that ends a full circle and `head`, which begins it, are of the same reflector.
    fn meets(&self, head: &Self, scan: &Scan, parameters: &ReflectorDetection) -> bool {
        self.goes_on(scan.ranges.len() - self.last + head.first, head.first_range, parameters)
    }

    /// This group and `head`, beyond the seam, as one. The two were seen a revolution apart: their ends lie about the
    /// direction, and their ranges about the range, that the reflector had in the middle of that time.
    fn observation_with(
        &self,
        head: &Self,
        scan: &Scan,
        parameters: &ReflectorDetection,
    ) -> Option<ReflectorObservation> {
        let circle = scan.ranges.len();
        let direction = (self.index_sum + head.index_sum + head.beams * circle as f64) / (self.beams + head.beams);
        let mean = Mean {
            time: 0.5 * (self.index() + head.index()),
            direction: if direction < circle as f64 { direction } else { direction - circle as f64 },
            range: 0.5 * (self.range() + head.range()),
        };
        mean.observation(head.last + circle - self.first, scan, parameters)
    }
}

/// What the beams of a reflector say together; time and direction in beams.
struct Mean {
    time: f64,
    direction: f64,
    range: f64,
}

impl Mean {
    /// The reflector, if it is no wider than one can be.
    fn observation(&self, steps: usize, scan: &Scan, parameters: &ReflectorDetection) -> Option<ReflectorObservation> {
        let width = self.range * libm::fabs(scan.bearing_step) * steps as f64;
        (width <= f64::from(parameters.largest_width)).then(|| ReflectorObservation {
            time: scan.start.offset(self.time * scan.beam_interval),
            range: self.range as f32 + parameters.centre_offset,
            bearing: (scan.first_bearing + self.direction * scan.bearing_step) as f32,
        })
    }
}

/// Finds groups of strong returns and gives the mean direction and range of each, in order of time. A group may have
/// single weak or missing beams inside, and goes on across the seam of a full circle. Of more than there is room for in
/// `found` as many are kept, from all around. Returns how many are left out.
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
    let mut keep = |observation: Option<ReflectorObservation>| {
        let Some(observation) = observation else { return };
        count += 1;
        if choice.takes() {
            let _ = found.push(observation);
        }
    };
    let mut group: Option<Group> = None;
    // The group that begins the scan is told last, as the one that ends it may be of the same reflector.
    let mut head: Option<Group> = None;
    for (index, (&range, &intensity)) in scan.ranges.iter().zip(scan.intensities).enumerate() {
        let is_strong = intensity >= parameters.least_intensity && range > 0.0 && range <= parameters.farthest;
        if !is_strong {
            continue;
        }
        match &mut group {
            Some(open) if open.goes_on(index - open.last, range, parameters) => open.add(index, range),
            _ => {
                let closed = group.replace(Group::new(index, range));
                if head.is_none() {
                    head = closed;
                } else if let Some(closed) = closed {
                    keep(closed.observation(scan, parameters));
                }
            }
        }
    }
    if let Some(tail) = group {
        match head {
            Some(head) if scan.is_full_circle() && tail.meets(&head, scan, parameters) => {
                keep(tail.observation_with(&head, scan, parameters));
            }
            _ => {
                keep(tail.observation(scan, parameters));
                keep(head.and_then(|head| head.observation(scan, parameters)));
            }
        }
        sort_last(found);
    }
    count
}

/// Moves the last observation to its place among the others, which are in order of time.
fn sort_last(found: &mut [ReflectorObservation]) {
    let mut rest = found;
    while let Some((last, others)) = rest.split_last_mut() {
        match others.last_mut() {
            Some(before) if before.time > last.time => core::mem::swap(before, last),
            _ => return,
        }
        rest = others;
    }
}
