//! Whether surfaces stay where they are, held against a room whose walls are known.

use std::f64::consts::{PI, TAU};

use agv_core::geometry::{Point, Pose};
use agv_core::integrity::SurfaceCheck;
use agv_core::measurement::{LaserId, Scan, Time};

const BEAMS: usize = 720;
const REVOLUTION: f64 = 0.125;

/// A room from `low` to `high`, m, and round columns in it: position and radius, m.
struct Room {
    low: Point,
    high: Point,
    columns: Vec<(Point, f64)>,
}

impl Room {
    /// 12 m by 9 m with four columns.
    fn hall() -> Self {
        let columns = [(3.0, 2.0), (8.0, 2.5), (4.0, 7.0), (9.5, 6.0)];
        let columns = columns.map(|(x, y)| (Point::new(x, y), 0.2)).to_vec();
        Self { low: Point::new(0.0, 0.0), high: Point::new(12.0, 9.0), columns }
    }

    /// How far a beam goes from a place in a direction, rad.
    fn range(&self, from: &Pose, bearing: f64) -> f64 {
        let (sin, cos) = (from.theta + bearing).sin_cos();
        let wall = |at: f64, step: f64, low: f64, high: f64| {
            if step > 0.0 {
                (high - at) / step
            } else if step < 0.0 {
                (low - at) / step
            } else {
                f64::INFINITY
            }
        };
        let walls = wall(from.x, cos, self.low.x, self.high.x).min(wall(from.y, sin, self.low.y, self.high.y));
        let column = |(place, radius): &(Point, f64)| {
            let (x, y) = (place.x - from.x, place.y - from.y);
            let (along, across) = (x * cos + y * sin, x * sin - y * cos);
            let half = radius * radius - across * across;
            if along > 0.0 && half > 0.0 { along - half.sqrt() } else { f64::INFINITY }
        };
        self.columns.iter().map(column).fold(walls, f64::min)
    }

    /// The ranges of a revolution during which the laser moves from one pose on by `motion`.
    fn scan(&self, from: &Pose, motion: &Pose) -> Vec<f32> {
        let beam = |index: usize| {
            let sensor = from.compose(&part(motion, index as f64 / BEAMS as f64));
            self.range(&sensor, -PI + TAU * index as f64 / BEAMS as f64) as f32
        };
        (0..BEAMS).map(beam).collect()
    }
}

fn part(motion: &Pose, share: f64) -> Pose {
    Pose::new(share * motion.x, share * motion.y, share * motion.theta)
}

fn scan(revolution: usize, ranges: &[f32]) -> Scan<'_> {
    Scan {
        laser: LaserId::FIRST,
        start: Time::from_seconds(1.0 + REVOLUTION * revolution as f64),
        beam_interval: REVOLUTION / BEAMS as f64,
        first_bearing: -PI,
        bearing_step: TAU / BEAMS as f64,
        ranges,
        intensities: &[],
    }
}

/// Drives on by `motion` each revolution from a start, is carried by `carried` after revolution 4, in R; what the check says of each of the
/// revolutions, if scans are `spoilt` before it hears them.
fn verdicts(room: &Room, start: &Pose, motion: &Pose, carried: &Pose, spoil: impl Fn(usize, &mut [f32])) -> Vec<bool> {
    let mut check = SurfaceCheck::new();
    let (mut truth, mut believed) = (*start, Pose::default());
    let verdict = |revolution: usize| {
        if revolution == 5 {
            truth = truth.compose(carried);
        }
        let mut ranges = room.scan(&truth, motion);
        spoil(revolution, &mut ranges);
        let first = believed;
        truth = truth.compose(motion);
        believed = believed.compose(motion);
        check.disagrees(&scan(revolution, &ranges), |after| first.compose(&part(motion, after / REVOLUTION)))
    };
    (0..10).map(verdict).collect()
}

const STILL: Pose = Pose { x: 0.0, y: 0.0, theta: 0.0 };

#[test]
fn a_vehicle_that_moves_as_it_says_is_believed() {
    for motion in [STILL, Pose::new(0.2, 0.0, 0.0), Pose::new(0.1, 0.0, 0.12), Pose::new(-0.1, 0.0, 0.0)] {
        let verdicts = verdicts(&Room::hall(), &Pose::new(5.0, 4.5, 0.3), &motion, &STILL, |_, _| {});
        assert_eq!(verdicts, [false; 10], "{motion:?}");
    }
}

#[test]
fn one_that_is_carried_is_told_by_the_first_or_second_scan_after_it() {
    for carried in [Pose::new(3.0, 1.0, 0.0), Pose::new(-2.0, -2.0, 0.5), Pose::new(0.0, 0.0, 0.8)] {
        for motion in [STILL, Pose::new(0.15, 0.0, 0.0)] {
            let verdicts = verdicts(&Room::hall(), &Pose::new(5.0, 4.5, 0.3), &motion, &carried, |_, _| {});
            assert_eq!(
                verdicts.iter().position(|told| *told).map(|told| (5..=6).contains(&told)),
                Some(true),
                "{carried:?}"
            );
        }
    }
}

/// Along itself a corridor looks the same wherever the vehicle is.
#[test]
fn one_that_is_carried_along_a_corridor_is_not_told() {
    let corridor = Room { low: Point::new(-1e3, 0.0), high: Point::new(1e3, 2.5), columns: Vec::new() };
    let start = Pose::new(0.0, 1.2, 0.0);
    assert_eq!(verdicts(&corridor, &start, &STILL, &Pose::new(5.0, 0.0, 0.0), |_, _| {}), [false; 10]);
}

/// People hide up to a third of what was seen, and uncover it again; they do not move the vehicle.
#[test]
fn what_stands_before_a_third_of_the_view_is_no_motion() {
    let spoil = |revolution: usize, ranges: &mut [f32]| {
        if revolution % 3 == 1 {
            ranges[100..100 + BEAMS / 3].fill(1.0);
        }
    };
    let start = Pose::new(5.0, 4.5, 0.3);
    assert_eq!(verdicts(&Room::hall(), &start, &Pose::new(0.1, 0.0, 0.0), &STILL, spoil), [false; 10]);
}

#[test]
fn beams_without_a_return_and_scans_after_a_pause_tell_nothing() {
    let carried = Pose::new(3.0, 1.0, 0.0);
    let start = Pose::new(5.0, 4.5, 0.3);
    let dark = |revolution: usize, ranges: &mut [f32]| {
        if revolution >= 5 {
            ranges.iter_mut().enumerate().filter(|(index, _)| index % 8 != 0).for_each(|(_, range)| *range = 0.0);
        }
    };
    assert_eq!(verdicts(&Room::hall(), &start, &STILL, &carried, dark), [false; 10]);
    for (pause, expected) in [(0.29, true), (0.31, false)] {
        let mut check = SurfaceCheck::new();
        let (near, far) = (vec![3.0; BEAMS], vec![6.0; BEAMS]);
        assert!(!check.disagrees(&scan(0, &near), |_| STILL));
        let later = Scan { start: Time::from_seconds(1.0 + pause), ..scan(0, &far) };
        assert_eq!(check.disagrees(&later, |_| STILL), expected, "{pause}");
    }
}

#[test]
fn what_is_cleared_contradicts_nothing() {
    let mut check = SurfaceCheck::default();
    let (near, far) = (vec![3.0; BEAMS], vec![6.0; BEAMS]);
    assert!(!check.disagrees(&scan(0, &near), |_| STILL));
    check.clear();
    assert!(!check.disagrees(&scan(1, &far), |_| STILL));
    assert!(check.disagrees(&scan(2, &near), |_| STILL));
}

/// Half of the view moves otherwise: that counts once the second scan says so, too.
#[test]
fn half_of_the_view_must_disagree_twice() {
    let view = |near: usize| {
        let mut ranges = vec![6.0; BEAMS];
        ranges[..near].fill(3.0);
        ranges
    };
    let mut check = SurfaceCheck::new();
    let told = [view(BEAMS), view(BEAMS / 2), view(BEAMS), view(BEAMS / 2), view(BEAMS / 2), view(BEAMS / 2)];
    let told: Vec<bool> =
        (0..).zip(&told).map(|(revolution, ranges)| check.disagrees(&scan(revolution, ranges), |_| STILL)).collect();
    assert_eq!(told, [false, false, false, false, true, false]);
}
