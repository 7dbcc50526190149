//! Finding oneself among reflectors that look alike.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic is how a test fails")]

use agv_core::geometry::{Point, Pose};
use agv_core::maps::{FixedMap, Landmark};
use agv_core::relocalization::{
    ReflectorAnswer, ReflectorIndex, ReflectorNoise, ReflectorRelocalizer, ReflectorSnapshot, RelocalizationParameters,
    RelocalizationProgress,
};
use proptest::prelude::*;

const FARTHEST: f64 = 30.0;

struct Hall {
    map: FixedMap<128>,
    index: Box<ReflectorIndex>,
}

impl Hall {
    fn new(positions: &[Point]) -> Self {
        let (mut map, mut index) = (FixedMap::new(), Box::new(ReflectorIndex::new()));
        let reflectors: Vec<Landmark> =
            (0..).zip(positions).map(|(id, position)| Landmark::reflector(id, *position, 0.002)).collect();
        map.extend(&reflectors).unwrap();
        index.build(map.view());
        Self { map, index }
    }

    /// The answer to what is seen, if each call may spend so much.
    fn search(&self, seen: &[Point], effort: u32) -> ReflectorAnswer {
        let mut snapshot = ReflectorSnapshot::<64>::new();
        for position in seen {
            snapshot.see(position, position.norm(), &ReflectorNoise::default());
        }
        let reflectors = self.index.of(self.map.view());
        let mut relocalizer = ReflectorRelocalizer::<64>::new(RelocalizationParameters::default());
        relocalizer.begin(&snapshot, &reflectors);
        for _ in 0..10_000_000 {
            if let RelocalizationProgress::Done(answer) = relocalizer.advance(&reflectors, effort) {
                return answer;
            }
        }
        panic!("the search does not end")
    }
}

fn seen_from(pose: &Pose, positions: &[Point]) -> Vec<Point> {
    positions.iter().map(|position| pose.inverse_transform(position)).filter(|seen| seen.norm() < FARTHEST).collect()
}

fn positions(count: usize) -> impl Strategy<Value = Vec<Point>> {
    prop::collection::vec((0.0..60.0, 0.0..40.0).prop_map(|(x, y)| Point::new(x, y)), count)
}

fn poses() -> impl Strategy<Value = Pose> {
    (20.0..40.0, 10.0..30.0, -3.1..3.1).prop_map(|(x, y, theta)| Pose::new(x, y, theta))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn the_pose_is_found_with_reflectors_missing_and_false_ones(
        positions in positions(40),
        pose in poses(),
        missing in prop::collection::vec(any::<bool>(), 40),
        false_ones in positions(2),
    ) {
        let hall = Hall::new(&positions);
        let all = seen_from(&pose, &positions);
        // At most a third is missing.
        let mut left = all.len() / 3;
        let mut seen: Vec<Point> = all
            .iter()
            .zip(&missing)
            .filter(|(_, is_missing)| {
                let is_seen = !**is_missing || left == 0;
                left -= usize::from(!is_seen);
                is_seen
            })
            .map(|(seen, _)| *seen)
            .collect();
        prop_assume!(seen.len() >= 8);
        seen.extend(false_ones.iter().map(|position| position * 0.3));
        let answer = hall.search(&seen, u32::MAX);
        let ReflectorAnswer::Found(fix) = answer else { return Err(TestCaseError::fail(format!("{answer:?}"))) };
        let error = pose.between(&fix.pose);
        prop_assert!(error.position().norm() < 0.01 && error.theta.abs() < 0.001, "{error:?}");
    }

    #[test]
    fn a_search_in_pieces_ends_as_one_in_one_piece(positions in positions(30), pose in poses(), effort in 1_u32..5000) {
        let hall = Hall::new(&positions);
        let seen = seen_from(&pose, &positions);
        prop_assert_eq!(hall.search(&seen, effort), hall.search(&seen, u32::MAX));
    }

    #[test]
    fn a_hall_that_is_the_same_after_half_a_turn_is_ambiguous(half in positions(15), pose in poses()) {
        let turned = half.iter().map(|position| Point::new(60.0, 40.0) - position);
        let positions: Vec<Point> = half.iter().copied().chain(turned).collect();
        let seen = seen_from(&pose, &positions);
        prop_assume!(seen.len() >= 6);
        let answer = Hall::new(&positions).search(&seen, u32::MAX);
        prop_assert!(!matches!(answer, ReflectorAnswer::Found(_)), "{answer:?}");
    }

    #[test]
    fn another_hall_is_not_found(positions in positions(40), other in positions(40), pose in poses()) {
        let seen = seen_from(&pose, &other);
        let answer = Hall::new(&positions).search(&seen, u32::MAX);
        prop_assert!(!matches!(answer, ReflectorAnswer::Found(_)), "{answer:?}");
    }

    #[test]
    fn a_map_far_from_its_origin_is_as_good(positions in positions(30), pose in poses()) {
        // Coordinates of a land survey.
        let far = Point::new(3_512_345.0, 5_412_345.0);
        let moved: Vec<Point> = positions.iter().map(|position| position + far).collect();
        let seen = seen_from(&pose, &positions);
        prop_assume!(seen.len() >= 8);
        let answer = Hall::new(&moved).search(&seen, u32::MAX);
        let ReflectorAnswer::Found(fix) = answer else { return Err(TestCaseError::fail(format!("{answer:?}"))) };
        let found = fix.pose.position() - far;
        prop_assert!((found - pose.position()).norm() < 0.01, "{found:?}");
    }
}

/// What a revolution may see at most, and maps in which most pairs of it are like most pairs of the map.
#[test]
fn no_step_takes_much_more_than_its_slice() {
    const SLICE: u32 = 2_000;
    let lattice = |count: usize, columns: usize, spacing: f64| -> Vec<Point> {
        let place = |number: usize| Point::new((number % columns) as f64, (number / columns) as f64) * spacing;
        (0..count).map(place).collect()
    };
    for (columns, seen_columns, spacing) in [(40, 8, 2.5), (25, 8, 1.0), (1000, 64, 3.0)] {
        let map_positions = lattice(1000, columns, spacing);
        let seen_positions = lattice(64, seen_columns, spacing);
        let (mut map, mut index) = (Box::new(FixedMap::<1000>::new()), Box::new(ReflectorIndex::<1024>::new()));
        for (id, position) in (0..).zip(&map_positions) {
            map.extend(&[Landmark::reflector(id, *position, 0.002)]).unwrap();
        }
        index.build(map.view());
        let reflectors = index.of(map.view());
        let mut snapshot = ReflectorSnapshot::<64>::new();
        for position in &seen_positions {
            snapshot.see(position, position.norm(), &ReflectorNoise::default());
        }
        assert_eq!(snapshot.reflectors().len(), 64);
        let mut relocalizer = ReflectorRelocalizer::<64>::new(RelocalizationParameters::default());
        relocalizer.begin(&snapshot, &reflectors);
        let mut worst = 0;
        for _ in 0..3_000 {
            if let RelocalizationProgress::Done(_) = relocalizer.advance(&reflectors, SLICE) {
                break;
            }
            worst = worst.max(relocalizer.debt());
        }
        assert!(worst > 0 && worst < 2 * SLICE, "{columns} columns: {worst} beyond a slice of {SLICE}");
    }
}

#[test]
fn three_reflectors_are_too_few() {
    let positions = [Point::new(1.0, 2.0), Point::new(5.0, 1.0), Point::new(3.0, 9.0)];
    assert_eq!(Hall::new(&positions).search(&positions, u32::MAX), ReflectorAnswer::TooFew);
}

#[test]
fn an_empty_map_looks_like_nothing() {
    let seen: Vec<Point> = (1..8).map(|number| Point::new(f64::from(number), f64::from(number * number))).collect();
    assert_eq!(Hall::new(&[]).search(&seen, u32::MAX), ReflectorAnswer::Unknown);
}
