//! A place that was found is told once enough has been seen that fits it, and nothing that contradicts it.
#![allow(clippy::indexing_slicing, reason = "a panic is how a test fails")]

use std::f64::consts::{PI, TAU};

use agv_core::geometry::{Point, Pose, difference};
use agv_core::localizer::{EFFORT_A_REVOLUTION, Event, Mode, PoseFix, StartSearch};
use agv_core::maps::{FixedMap, Landmark};
use agv_core::measurement::{LaserId, PoseIncrement, ReflectorObservation, Reflectors, Scan, Time};
use agv_core::state::Relocalization;

use super::support::stage::{LASER, parameters, reflectors};

const BEAMS: usize = 720;

/// A vehicle that is switched on with this map.
struct Start {
    map: Box<FixedMap<64>>,
    search: Box<StartSearch>,
    pose: Pose,
    time: f64,
}

impl Start {
    fn new(landmarks: &[Landmark]) -> Self {
        let mut map = Box::new(FixedMap::new());
        assert_eq!(map.extend(landmarks), Ok(()));
        let search = Box::new(StartSearch::new(&parameters(), true));
        let mut start = Self { map, search, pose: Pose::new(-3.0, 0.5, 0.2), time: 5.0 };
        start.drive(0.0, 1);
        start
    }

    fn tell(&mut self, event: &Event) {
        self.search.handle(event, Mode::NotLocalised, self.map.view());
    }

    fn moved(&mut self, displacement: Pose) {
        self.time += 0.02;
        self.tell(&Event::Increment(PoseIncrement { time: Time::from_seconds(self.time), displacement }));
    }

    /// So many samples of the odometry on a straight.
    fn drive(&mut self, speed: f64, samples: usize) {
        for _ in 0..samples {
            let displacement = Pose::new(0.02 * speed, 0.0, 0.0);
            self.pose = self.pose.compose(&displacement);
            self.moved(displacement);
        }
    }

    /// Turns on the spot.
    fn turn(&mut self, angle: f64) {
        for _ in 0..100 {
            let displacement = Pose::new(0.0, 0.0, 0.01 * angle);
            self.pose = self.pose.compose(&displacement);
            self.moved(displacement);
        }
    }

    fn sensor(&self) -> Pose {
        self.pose.compose(&LASER)
    }

    /// Sees things at these places.
    fn see(&mut self, places: &[Point]) {
        let sensor = self.sensor();
        let time = Time::from_seconds(self.time);
        let observations: Vec<_> = places
            .iter()
            .map(|place| {
                let seen = sensor.inverse_transform(place);
                ReflectorObservation { time, range: seen.norm() as f32, bearing: seen.y.atan2(seen.x) as f32 }
            })
            .collect();
        self.tell(&Event::Reflectors(Reflectors::of_first(&observations)));
    }

    /// A scan of a wide place in which these things stand, 0.1 m wide.
    fn scan(&mut self, things: &[Point]) {
        let sensor = self.sensor();
        self.scan_of(1.0, -PI, |bearing| {
            let hits = things
                .iter()
                .map(|thing| sensor.inverse_transform(thing))
                .filter(|thing| difference(thing.y.atan2(thing.x), bearing).abs() < 0.05 / thing.norm());
            hits.map(|thing| thing.norm()).fold(30.0, f64::min)
        });
    }

    /// A scan from a bearing on with that range at each, counter-clockwise (1) or clockwise (-1).
    fn scan_of(&mut self, sense: f64, first: f64, range: impl Fn(f64) -> f64) {
        let bearing = |beam: usize| first + sense * beam as f64 * TAU / BEAMS as f64;
        let ranges: Vec<f32> = (0..BEAMS).map(|beam| range(bearing(beam)) as f32).collect();
        self.tell(&Event::Scan(Scan {
            laser: LaserId::FIRST,
            start: Time::from_seconds(self.time),
            beam_interval: 0.0,
            first_bearing: first,
            bearing_step: sense * TAU / BEAMS as f64,
            ranges: &ranges,
            intensities: &[],
        }));
    }

    fn search(&mut self) -> Option<PoseFix> {
        (0..=EFFORT_A_REVOLUTION)
            .map_while(|_| {
                let (goes_on, fix) = self.search.advance(self.map.view(), None);
                (goes_on || fix.is_some()).then_some(fix)
            })
            .find_map(|fix| fix)
    }

    /// The number of the revolution that tells the pose, of so many in which these places are seen.
    fn told_after(&mut self, places: &[Point], revolutions: usize) -> Option<usize> {
        (1..=revolutions).find(|_| {
            self.drive(0.0, 6);
            self.see(places);
            self.search().is_some_and(|fix| {
                let off = self.pose.between(&fix.pose);
                assert!(off.x.hypot(off.y) < 0.01 && off.theta.abs() < 0.002, "{fix:?} {:?}", self.pose);
                true
            })
        })
    }
}

fn places(which: impl IntoIterator<Item = usize>) -> Vec<Point> {
    let all = reflectors();
    which.into_iter().map(|index| all[index].position()).collect()
}

#[test]
fn five_reflectors_are_believed_after_eight_revolutions() {
    let mut start = Start::new(&reflectors());
    assert_eq!(start.told_after(&places([0, 2, 4, 7, 9]), 20), Some(8));
}

/// What is seen is forgotten once the vehicle has driven ten metres since, and not all of it at once.
#[test]
fn what_did_not_fit_a_few_metres_ago_counts_wherever_the_vehicle_was_switched_on() {
    let elsewhere = [Point::new(-2.5, 3.0), Point::new(-1.0, -3.5), Point::new(1.5, 3.2), Point::new(2.0, -3.0)];
    for (before, after, is_told) in [(400, 150, false), (375, 150, false), (0, 150, false), (0, 550, true)] {
        let mut start = Start::new(&reflectors());
        start.pose = Pose::new(-12.0, 0.5, 0.0);
        // At a metre a second: ten metres are fifty times ten samples.
        start.drive(1.0, before);
        for _ in 0..4 {
            start.drive(1.0, 6);
            start.see(&elsewhere);
            let _ = start.search();
        }
        start.drive(1.0, after);
        assert_eq!(start.told_after(&places([0, 2, 4, 7, 9]), 12).is_some(), is_told, "{before}, {after}");
    }
}

#[test]
fn four_reflectors_are_believed_once_they_were_seen_from_two_metres_further_on() {
    let four = places([0, 2, 5, 7]);
    for (speed, is_told) in [(0.9, false), (1.1, true), (-1.1, true)] {
        let mut start = Start::new(&reflectors());
        assert_eq!(start.told_after(&four, 30), None);
        assert_eq!(start.search.state(), Relocalization::Searching);
        start.drive(speed, 94);
        assert_eq!(start.told_after(&four, 1).is_some(), is_told, "{speed}");
    }
}

#[test]
fn a_vehicle_that_is_carried_meanwhile_is_looked_for_anew() {
    let mut start = Start::new(&reflectors());
    let all = places(0..12);
    assert_eq!(start.told_after(&all, 6), None);
    start.pose = Pose::new(2.0, -1.0, 2.0);
    // What was seen before contradicts what is seen now.
    assert_eq!(start.told_after(&all, 7), None);
}

/// Carried aside without a turn, or turned on the spot, as a lift or a turntable does: too much is seen that does not fit, or enough anew.
#[test]
fn a_vehicle_that_is_only_moved_or_only_turned_meanwhile_is_looked_for_anew() {
    for carried in [Pose::new(1.0, 0.4, 0.0), Pose::new(0.0, 0.0, 0.3)] {
        let mut start = Start::new(&reflectors());
        let all = places(0..12);
        assert_eq!(start.told_after(&all, 6), None);
        start.pose = start.pose.compose(&carried);
        assert_eq!(start.told_after(&all, 7), None, "{carried:?}");
    }
}

/// Far reflectors may be too weak to be seen.
#[test]
fn a_reflector_further_off_than_fifteen_metres_is_not_missing() {
    for (x, is_told) in [(-14.0, false), (-21.0, true)] {
        let far = Landmark::reflector(90, Point::new(x, 0.7), 0.002);
        let landmarks: Vec<Landmark> = reflectors().into_iter().chain([far]).collect();
        let all = places(0..12);
        let mut start = Start::new(&landmarks);
        let told = (0..20).find(|_| {
            let told = start.told_after(&all, 1);
            start.scan(&[]);
            told.is_some()
        });
        assert_eq!(told.is_some(), is_told, "{x}");
    }
}

/// Strangers may stand around; but where half of the reflectors was moved alike, most of what is seen fits a wrong place.
#[test]
fn for_each_reflector_that_the_map_does_not_have_four_more_must_fit() {
    let strangers = [Point::new(1.0, 3.0), Point::new(-4.0, -2.0), Point::new(5.5, 2.2)];
    let cases = [
        (9, 1, true, Relocalization::Searching),
        (8, 1, false, Relocalization::Searching),
        (12, 2, false, Relocalization::Searching),
        (12, 3, false, Relocalization::Searching),
        (6, 3, false, Relocalization::Unknown),
    ];
    for (known, count, is_told, state) in cases {
        let mut start = Start::new(&reflectors());
        let seen: Vec<Point> = places(0..known).into_iter().chain(strangers[..count].iter().copied()).collect();
        assert_eq!(start.told_after(&seen, 20).is_some(), is_told, "{known}, {count}");
        assert_eq!(start.search.state(), state, "{known}, {count}");
    }
}

/// Two looks from places two metres apart are enough only if the map explains all that is seen.
#[test]
fn four_reflectors_and_a_stranger_are_not_believed_from_two_metres_further_on() {
    let seen: Vec<Point> = places([0, 2, 5, 7]).into_iter().chain([Point::new(1.0, 3.0)]).collect();
    let mut start = Start::new(&reflectors());
    assert_eq!(start.told_after(&seen, 30), None);
    start.drive(1.1, 94);
    assert_eq!(start.told_after(&seen, 10), None);
}

/// What stands where the map has a reflector that is not seen, and how much the vehicle is turned: the seam of a scan is anywhere.
#[test]
fn a_reflector_through_whose_place_the_laser_sees_is_missing() {
    let all = places(0..12);
    let seen: Vec<Point> = all[1..].to_vec();
    let cases = [("nothing", false), ("a dirty reflector", true), ("a pallet before it", true)];
    let turns = (0..16).map(|turn| f64::from(turn) * TAU / 16.0);
    for ((what, is_told), turn) in turns.flat_map(|turn| cases.map(|case| (case, turn))) {
        let mut start = Start::new(&reflectors());
        start.turn(turn);
        let mut things = seen.clone();
        match what {
            "a dirty reflector" => things.push(all[0]),
            "a pallet before it" => {
                let sensor = start.sensor().position();
                things.push(sensor + (all[0] - sensor) * 0.5);
            }
            _ => {}
        }
        let told = (0..20).find(|_| {
            let told = start.told_after(&seen, 1);
            start.scan(&things);
            told.is_some()
        });
        assert_eq!(told, is_told.then_some(7), "{what}, turned by {turn}");
        if !is_told {
            assert_eq!(start.search.state(), Relocalization::Unknown);
        }
    }
}

#[test]
fn a_reflector_that_is_seen_now_and_then_is_not_missing() {
    let all = places(0..12);
    let mut start = Start::new(&reflectors());
    let told = (0..20).find(|revolution| {
        let told = start.told_after(&all[usize::from(*revolution != 2)..], 1);
        // The beams pass beside the thin post.
        start.scan(&[]);
        told.is_some()
    });
    assert_eq!(told, Some(7));
}

/// Whether all but the first reflector, which is behind the beams of a scan with that range at each bearing from it (rad) and its own
/// range, are believed. The scan begins at the bearing `first` from it, and goes round in that sense.
fn is_told_beside((sense, first): (f64, f64), range: impl Fn(f64, f64) -> f64) -> bool {
    let all = places(0..12);
    let mut start = Start::new(&reflectors());
    let missing = start.sensor().inverse_transform(&all[0]);
    let (own, towards) = (missing.norm(), missing.y.atan2(missing.x));
    let told = (0..20).find(|_| {
        let told = start.told_after(&all[1..], 1);
        start.scan_of(sense, towards + first, |bearing| range(difference(bearing, towards), own));
        told.is_some()
    });
    assert!(told.is_none_or(|told| told == 7), "{told:?}");
    told.is_some()
}

/// Beams within 0.2 m of the place, and as much as the laser turns in half a revolution, 0.02 rad, must all have passed.
#[test]
fn a_place_is_seen_through_if_all_beams_beside_it_pass() {
    const STEP: f64 = TAU / BEAMS as f64;
    let reach = |own: f64| 0.2 / own + 0.02;
    // The scan begins far from the place, and within reach on either side of it.
    for scan in [-2.5, -0.03, 0.02, 1.1].into_iter().flat_map(|first| [(1.0, first), (-1.0, first)]) {
        for side in [1.0, -1.0] {
            let post = |middle: f64| {
                move |off: f64, own: f64| {
                    let is_post = (off - side * (reach(own) + middle * STEP)).abs() < 0.5 * STEP;
                    if is_post { 0.5 * own } else { 30.0 }
                }
            };
            assert!(is_told_beside(scan, post(-1.0)), "a post within reach, {scan:?}, {side}");
            assert!(!is_told_beside(scan, post(3.0)), "a post beside it, {scan:?}, {side}");
        }
        assert!(is_told_beside(scan, |_, own| own + 0.45), "a wall close behind it, {scan:?}");
        assert!(!is_told_beside(scan, |_, own| own + 0.55), "a wall farther behind it, {scan:?}");
    }
}

/// Looks that are no longer believed are forgotten with what they saw through.
#[test]
fn what_was_seen_through_from_a_wrong_place_is_forgotten() {
    let all = places(0..12);
    let mut start = Start::new(&reflectors());
    // The beams go through the first place until somebody stands where it was.
    for _ in 0..5 {
        assert_eq!(start.told_after(&all[1..], 1), None);
        start.scan(&all[1..]);
    }
    start.tell(&Event::SetPose(PoseFix {
        time: Time::from_seconds(start.time),
        pose: Pose::default(),
        position_deviation: 1.0,
        heading_deviation: 1.0,
    }));
    let told = (0..20).find(|_| {
        let told = start.told_after(&all[1..], 1);
        start.scan(&all);
        told.is_some()
    });
    assert!(told.is_some());
}

/// What was seen is carried for ten metres, and not further.
#[test]
fn what_was_seen_ten_metres_ago_counts_and_what_is_further_off_does_not() {
    for (samples, told) in [(160, Some(2)), (161, None)] {
        let mut start = Start::new(&reflectors());
        let all = places(0..12);
        assert_eq!(start.told_after(&all, 6), None);
        // A sixteenth of a metre a sample, so that the sum is exact.
        start.drive(3.125, samples);
        assert_eq!(start.told_after(&all, 2), told, "{samples} samples");
    }
}
