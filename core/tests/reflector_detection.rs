//! Reflectors in scans of a world that is known.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is how a test fails")]

use std::f64::consts::{PI, TAU};

use agv_core::geometry::{Point, Pose, difference};
use agv_core::measurement::{LaserId, ReflectorObservation, Scan, Time};
use agv_core::sensing::{ReflectorDetection, detect_reflectors};
use proptest::prelude::*;

const BEAMS: usize = 1440;
const STEP: f64 = TAU / BEAMS as f64;
const REVOLUTION: f64 = 0.125;

/// A round reflector.
#[derive(Clone, Copy, Debug)]
struct Reflector {
    centre: Point,
    radius: f64,
}

/// A laser that turns while the vehicle moves.
#[derive(Clone, Copy, Debug)]
struct Sweep {
    first_bearing: f64,
    is_clockwise: bool,
    beams: usize,
    /// Displacement of S in 1 s.
    speed: Pose,
}

impl Sweep {
    fn at(&self, seconds: f64) -> Pose {
        Pose::new(self.speed.x * seconds, self.speed.y * seconds, self.speed.theta * seconds)
    }

    /// Where the reflector is in S, as range and bearing.
    fn truth(&self, reflector: &Reflector, seconds: f64) -> (f64, f64) {
        let seen = self.at(seconds).inverse_transform(&reflector.centre);
        (seen.norm(), seen.y.atan2(seen.x))
    }

    fn detect<const ROOM: usize>(&self, reflectors: &[Reflector]) -> Vec<ReflectorObservation> {
        let interval = REVOLUTION / BEAMS as f64;
        let step = if self.is_clockwise { -STEP } else { STEP };
        let (mut ranges, mut intensities) = (vec![20.0; self.beams], vec![0; self.beams]);
        for beam in 0..self.beams {
            let bearing = self.first_bearing + step * beam as f64;
            for reflector in reflectors {
                let (range, direction) = self.truth(reflector, interval * beam as f64);
                if difference(bearing, direction).abs() <= (reflector.radius / range).asin() {
                    (ranges[beam], intensities[beam]) = (range as f32, 200);
                }
            }
        }
        let scan = Scan {
            laser: LaserId::FIRST,
            start: Time::default(),
            beam_interval: interval,
            first_bearing: self.first_bearing,
            bearing_step: step,
            ranges: &ranges,
            intensities: &intensities,
        };
        let mut found = heapless::Vec::<_, ROOM>::new();
        let detection = ReflectorDetection { least_intensity: 100, ..ReflectorDetection::default() };
        detect_reflectors(&scan, &detection, &mut found);
        found.to_vec()
    }
}

fn standing(first_bearing: f64, is_clockwise: bool) -> Sweep {
    Sweep { first_bearing, is_clockwise, beams: BEAMS, speed: Pose::default() }
}

fn round(range: f64, bearing: f64, radius: f64) -> Reflector {
    Reflector { centre: Point::new(range * bearing.cos(), range * bearing.sin()), radius }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn where_a_circle_begins_does_not_matter(
        seam in -8.0..8.0_f64, begin in -PI..PI, is_clockwise: bool, range in 2.0..15.0_f64, others in 0..4_usize
    ) {
        // About ten beams wide, with the seam somewhere in or next to it.
        let own = round(range, begin + seam * STEP, 5.0 * STEP * range);
        let mut reflectors = vec![own];
        reflectors.extend((1..=others).map(|number| round(6.0, begin + number as f64, 0.1)));
        let sweep = standing(begin, is_clockwise);
        let found = sweep.detect::<16>(&reflectors);
        prop_assert_eq!(found.len(), reflectors.len());
        prop_assert!(found.windows(2).all(|pair| pair[0].time <= pair[1].time), "{:?}", found);
        for reflector in &reflectors {
            let (range, bearing) = sweep.truth(reflector, 0.0);
            let near = found.iter().filter(|one| {
                difference(f64::from(one.bearing), bearing).abs() <= 0.51 * STEP && (f64::from(one.range) - range).abs() < 1e-4
            });
            prop_assert_eq!(near.count(), 1, "{:?} {:?}", found, reflector);
        }
    }

    /// The two halves are a revolution apart.
    #[test]
    fn a_reflector_across_the_seam_is_where_it_was_at_its_time(
        seam in -3.5..3.5_f64, begin in -PI..PI, is_clockwise: bool, range in 4.0..15.0_f64,
        speed in (-1.0..1.0_f64, -0.2..0.2_f64, -0.05..0.05_f64),
    ) {
        let own = round(range, begin + seam * STEP, 6.0 * STEP * range);
        let forward = Point::new(speed.0 * begin.cos(), speed.0 * begin.sin());
        let speed = Pose::new(forward.x, forward.y, speed.2);
        let sweep = Sweep { speed, ..standing(begin, is_clockwise) };
        let found = sweep.detect::<4>(&[own]);
        prop_assert_eq!(found.len(), 1);
        let (range, bearing) = sweep.truth(&own, found[0].time.seconds());
        prop_assert!((f64::from(found[0].range) - range).abs() < 0.002, "{:?} {}", found, range);
        prop_assert!(difference(f64::from(found[0].bearing), bearing).abs() < 0.6 * STEP, "{:?} {}", found, bearing);
    }
}

#[test]
fn what_is_not_one_across_the_seam_stays_two() {
    // Another range on the other side of the seam.
    let pair = [round(5.0, 3.5 * STEP, 3.2 * STEP * 5.0), round(7.0, -4.5 * STEP, 3.2 * STEP * 7.0)];
    assert_eq!(standing(0.0, false).detect::<4>(&pair).len(), 2);
    // Three beams without a return between them.
    let pair = [round(5.0, 5.0 * STEP, 3.2 * STEP * 5.0), round(5.0, -5.0 * STEP, 3.2 * STEP * 5.0)];
    assert_eq!(standing(0.0, false).detect::<4>(&pair).len(), 2);
    // No circle: the ends of the sweep are apart.
    let sweep = Sweep { beams: BEAMS - 4, ..standing(0.0, false) };
    let pair = [round(5.0, 2.0 * STEP, 2.2 * STEP * 5.0), round(5.0, -7.0 * STEP, 2.2 * STEP * 5.0)];
    assert_eq!(sweep.detect::<4>(&pair).len(), 2);
}

#[test]
fn a_shining_strip_across_the_seam_is_no_reflector() {
    // Each side is narrow enough, the whole is not.
    let strip = round(10.0, 0.0, 0.7);
    assert!(standing(0.0, false).detect::<4>(&[strip]).is_empty());
    assert!(standing(1.0, false).detect::<4>(&[strip]).is_empty());
}

#[test]
fn where_there_is_no_room_for_all_the_one_across_the_seam_is_still_one() {
    let reflectors: Vec<Reflector> = (0..6).map(|number| round(6.0, f64::from(number), 0.1)).collect();
    let found = standing(0.0, false).detect::<4>(&reflectors);
    assert_eq!(found.len(), 4);
    let across = found.iter().filter(|one| difference(f64::from(one.bearing), 0.0).abs() < 0.51 * STEP);
    assert_eq!(across.count(), 1);
}
