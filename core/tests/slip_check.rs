//! Whether the laser has moved as the odometry says, held against the history of each place.
#![allow(clippy::indexing_slicing, reason = "a panic is how a test fails")]

use agv_core::geometry::{Point, Pose};
use agv_core::integrity::SlipCheck;
use agv_core::measurement::{LaserId, Scan, Time};

use super::falko::scene::Random;

/// Places that are too far apart to be taken for one another.
fn place(index: usize) -> Point {
    Point::new(2.0 * (index % 6) as f64, 2.0 * (index / 6) as f64)
}

fn time(revolution: usize) -> Time {
    Time::from_micros(1_000_000 + 125_000 * revolution as u64)
}

/// In how many revolutions a place was seen so far and how long ago last; forgotten after eight that it was not seen in.
fn memory(seen: &[Vec<bool>], place: usize) -> (usize, usize) {
    let (mut times, mut age) = (0, 0);
    for revolution in seen {
        age += 1;
        if age > 8 {
            times = 0;
        }
        if revolution[place] {
            (times, age) = (times + 1, 0);
        }
    }
    // The present revolution is one later.
    if age + 1 > 8 { (0, age + 1) } else { (times, age + 1) }
}

#[test]
fn verdicts_follow_from_the_history_of_each_place() {
    const PLACES: usize = 20;
    let mut random = Random::new(7);
    let (mut wrong, mut right) = (0, 0);
    for _ in 0..400 {
        let mut check = SlipCheck::new();
        let mut history: Vec<Vec<bool>> = Vec::new();
        let mut contradictions = 0;
        let mut share = [0.0; PLACES];
        for revolution in 0..40 {
            if random.unit() < 0.15 {
                let groups = random.unit();
                let often = random.uniform(0.7, 1.0);
                share = share.map(|was| if (was < 0.5) == (random.unit() < groups) { often } else { 0.02 });
            }
            let seen = share.map(|share| random.unit() < share).to_vec();
            let (mut expected, mut again, mut new) = (0, 0, 0);
            for (index, is_seen) in seen.iter().enumerate() {
                let (times, age) = memory(&history, index);
                let is_expected = times >= 2 && age <= 2;
                expected += usize::from(is_expected);
                again += usize::from(is_expected && *is_seen);
                new += usize::from(*is_seen && times < 2);
            }
            let count = seen.iter().filter(|is_seen| **is_seen).count();
            let is_contradicted = expected >= 3 && count >= 3 && 5 * again < expected && 2 * new > count;
            contradictions = if is_contradicted { contradictions + 1 } else { 0 };
            check.begin(time(revolution));
            for (index, is_seen) in seen.iter().enumerate() {
                if *is_seen {
                    let shake = Point::new(random.uniform(-0.02, 0.02), random.uniform(-0.01, 0.01));
                    check.see(&(place(index) + shake), 0.0);
                }
            }
            assert_eq!(check.disagrees(), contradictions >= 2, "{revolution} {expected} {again} {new} {count}");
            wrong += usize::from(contradictions >= 2);
            right += usize::from(contradictions == 0 && expected >= 3);
            history.push(seen);
        }
    }
    assert!(wrong > 40 && right > 1000, "{wrong} {right}");
}

/// Three revolutions in one place and two in another that is `shift` (m) beside it, both seen from `range` (m), with `pause`
/// (s) between the two.
fn is_move_seen(count: usize, shift: f64, range: f64, pause: f64) -> bool {
    let mut check = SlipCheck::new();
    let mut now = time(0);
    let mut last = false;
    for revolution in 0..5 {
        now = now.offset(if revolution == 3 { pause } else { 0.125 });
        check.begin(now);
        for index in 0..count {
            let by = if revolution < 3 { 0.0 } else { shift };
            check.see(&(place(index) + Point::new(by, 0.0)), range);
        }
        last = check.disagrees();
    }
    last
}

#[test]
fn a_move_is_seen_if_it_is_larger_than_the_gate_for_the_distance() {
    for range in [0.0, 5.0, 30.0] {
        let gate = 0.05 + 0.006 * range;
        assert!(!is_move_seen(8, 0.99 * gate, range, 0.125), "{range}");
        assert!(is_move_seen(8, 1.01 * gate, range, 0.125), "{range}");
    }
}

#[test]
fn two_landmarks_and_a_long_pause_tell_nothing() {
    assert_eq!([2, 3, 30].map(|count| is_move_seen(count, 0.5, 5.0, 0.125)), [false, true, true]);
    assert_eq!([0.29, 0.31].map(|pause| is_move_seen(8, 0.5, 5.0, pause)), [true, false]);
}

#[test]
fn what_is_cleared_contradicts_nothing() {
    let mut check = SlipCheck::default();
    for revolution in 0..8 {
        if revolution == 5 {
            check.clear();
        }
        check.begin(time(revolution));
        for index in 0..8 {
            check.see(&(place(index) + Point::new(if revolution < 4 { 0.0 } else { 0.5 }, 0.0)), 1.0);
        }
        assert!(!check.disagrees(), "{revolution}");
    }
}

#[test]
fn more_landmarks_than_there_is_room_for_still_tell_a_move() {
    // Of 60, no more than 32 are remembered.
    assert!(is_move_seen(60, 0.5, 5.0, 0.125));
    assert!(!is_move_seen(60, 0.0, 5.0, 0.125));
}

#[test]
fn landmarks_that_are_passed_make_room_for_those_that_come() {
    let mut check = SlipCheck::new();
    for revolution in 0..8 {
        check.begin(time(revolution));
        // 32 of them, then 8 others, which then seem to jump.
        let seen = if revolution < 3 { 0..32 } else { 40..48 };
        let by = if revolution < 6 { 0.0 } else { 0.5 };
        for index in seen {
            check.see(&(place(index) + Point::new(by, 0.0)), 1.0);
        }
        assert_eq!(check.disagrees(), revolution == 4 || revolution == 7, "{revolution}");
    }
}

#[test]
fn neighbours_of_one_revolution_are_two_landmarks() {
    // One that has been seen in one revolution only need not be seen again, however many are near it.
    let mut check = SlipCheck::new();
    for revolution in 0..3 {
        check.begin(time(revolution));
        for index in 0..8 {
            for beside in [0.0, 0.03] {
                check.see(&(place(index) + Point::new(0.5 * revolution as f64 + beside, 0.0)), 1.0);
            }
        }
        assert!(!check.disagrees(), "{revolution}");
    }
}

#[test]
fn a_fifth_of_the_landmarks_is_enough() {
    for (seen, expected) in [(1, false), (0, true)] {
        let mut check = SlipCheck::new();
        for revolution in 0..5 {
            check.begin(time(revolution));
            for index in 0..10 {
                let stays = revolution < 3 || index < 2 * seen;
                check.see(&(place(index) + Point::new(if stays { 0.0 } else { 0.5 }, 0.0)), 1.0);
            }
            assert_eq!(check.disagrees(), expected && revolution == 4, "{seen} {revolution}");
        }
    }
}

/// At the end of an aisle most of what was seen goes out of sight at once. As long as half of what is seen was known at its place, the laser
/// has not moved otherwise.
#[test]
fn half_of_what_is_seen_at_its_place_is_no_move() {
    for (known, expected) in [(3, false), (2, true)] {
        let mut check = SlipCheck::new();
        for revolution in 0..7 {
            check.begin(time(revolution));
            let come = 10 + 6 * revolution..16 + 6 * revolution - known;
            let seen: Vec<usize> = match revolution {
                0..=1 => (0..16).collect(),
                // The first of them are hidden for so long that they need not be seen again.
                2..=4 => (6..16).collect(),
                5 => (0..known).chain(come).collect(),
                _ => (3..3 + known).chain(come).collect(),
            };
            seen.iter().for_each(|index| check.see(&place(*index), 1.0));
            assert_eq!(check.disagrees(), expected && revolution == 6, "{known} {revolution}");
        }
    }
}

/// Places around a laser at the origin.
fn around(index: usize, count: usize) -> Point {
    let angle = 0.4 + std::f64::consts::TAU * index as f64 / count as f64;
    Point::new(5.0 * angle.cos(), 5.0 * angle.sin())
}

/// A whole turn of a laser that stands.
fn scan_of(ranges: &[f32]) -> Scan<'_> {
    Scan {
        laser: LaserId::FIRST,
        start: time(0),
        beam_interval: 0.0,
        first_bearing: -std::f64::consts::PI,
        bearing_step: std::f64::consts::TAU / ranges.len() as f64,
        ranges,
        intensities: &[],
    }
}

/// Whether a check tells that landmarks are gone: so many were seen three times, and then none; every beam of the scans ends at `range`, m.
/// Which of the revolutions without any tells it first.
fn told_gone(count: usize, range: f32, has_scan: impl Fn(usize) -> bool) -> Option<usize> {
    let ranges = [range; 720];
    let scan = scan_of(&ranges);
    let mut check = SlipCheck::new();
    (0..7).find_map(|revolution| {
        check.begin(time(revolution));
        for index in (0..count).filter(|_| revolution < 3) {
            check.see(&around(index, count), 5.0);
        }
        assert!(!check.disagrees());
        let misses = has_scan(revolution) && check.misses(&scan, &Pose::default(), false, false);
        assert!(!(misses && revolution < 3));
        misses.then(|| revolution - 3)
    })
}

/// A vehicle that was carried to where there is no reflector sees none, although nothing hides them.
#[test]
fn landmarks_that_nothing_hides_and_that_are_all_gone_tell_a_move() {
    let always = |_: usize| true;
    for (count, told) in [(6, Some(0)), (4, Some(0)), (3, Some(1)), (2, None), (0, None)] {
        assert_eq!(told_gone(count, 8.0, always), told, "{count}");
    }
    // What ends at a post whose foil is gone has nothing before it.
    assert_eq!(told_gone(4, 4.9, always), Some(0));
    // Something stands before them, or nobody knows what does.
    assert_eq!(told_gone(6, 4.5, always), None);
    assert_eq!(told_gone(6, 0.0, always), None);
    assert_eq!(told_gone(6, f32::INFINITY, always), None);
    // Two revolutions with scans that do not follow each other are not two in a row.
    assert_eq!(told_gone(3, 8.0, |revolution| revolution != 4), None);
}

#[test]
fn one_landmark_that_is_seen_again_is_enough_against_a_move() {
    let ranges = [8.0; 720];
    let scan = scan_of(&ranges);
    let mut check = SlipCheck::new();
    for revolution in 0..8 {
        check.begin(time(revolution));
        (0..6).filter(|index| revolution < 3 || *index == 0).for_each(|index| check.see(&around(index, 6), 5.0));
        assert!(!check.misses(&scan, &Pose::default(), false, false), "{revolution}");
    }
}

/// So many were seen three times, and then others elsewhere in each revolution, but for some that stay; every beam of the scans ends at
/// `range`, m, and there are none if that is zero. Whether a move is told.
fn is_change_told(count: usize, staying: usize, range: f32) -> bool {
    let ranges = [range; 720];
    let scan = scan_of(&ranges);
    let mut check = SlipCheck::new();
    (0..5).any(|revolution| {
        check.begin(time(revolution));
        let turned = if revolution < 3 { 0.0 } else { 0.3 * (revolution as f64 - 2.0) };
        let pose = Pose::new(0.0, 0.0, turned);
        let place = |index: usize| around(index, count);
        (0..staying).for_each(|index| check.see(&place(index), 5.0));
        (staying..count).for_each(|index| check.see(&pose.transform(&place(index)), 5.0));
        let disagrees = check.disagrees();
        let confirmed = range > 0.0 && check.misses(&scan, &Pose::default(), false, false);
        disagrees || confirmed
    })
}

/// At the end of an aisle the few reflectors in sight are hidden at once, and false ones come: no move, as the scan shows.
#[test]
fn few_landmarks_that_something_hides_tell_no_move() {
    for (count, range, expected) in [
        (4, 3.0, false),
        (5, 3.0, false),
        // Nothing hides them; no scan says so; they are many.
        (4, 8.0, true),
        (4, 0.0, true),
        (6, 3.0, true),
    ] {
        assert_eq!(is_change_told(count, 0, range), expected, "{count} {range}");
    }
}

/// Passing the end of a rack hides many at once; one that is seen again says that the vehicle moves as it should.
#[test]
fn many_landmarks_that_something_hides_tell_no_move_if_one_is_seen_again() {
    for (staying, range, expected) in [(0, 3.0, true), (1, 3.0, false), (1, 8.0, true), (1, 0.0, true), (3, 8.0, false)]
    {
        assert_eq!(is_change_told(8, staying, range), expected, "{staying} {range}");
    }
}
