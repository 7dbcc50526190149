//! Signatures and their distances: closed forms, and what must not change them.

use std::f32::consts::TAU;

use agv_lidar3d::cloud::Cloud;
use agv_lidar3d::place::{
    BINS, Enriched, Facing, Histogram, KeySignatures, Limits, Neighbours, Orientation, chi_square, fitted_surfaces,
    from_key_scans, loop_closure, normalised_chi_square, normalised_sorensen, relative_turn, sorensen, vertical_parts,
};
use proptest::prelude::*;

const RINGS: usize = 32;
const COLUMNS: usize = 360;
const HEIGHT: f32 = 1.7;

/// Level ground and a rectangle of walls round the sensor, at these distances ahead, left, behind and right, m.
fn yard([ahead, left, behind, right]: [f32; 4]) -> Vec<Option<[f32; 3]>> {
    let at = |ring: usize, column: usize| {
        let (sin_up, cos_up) = (5.0 - 1.2 * ring as f32).to_radians().sin_cos();
        let (sin, cos) = (-(column as f32) * TAU / COLUMNS as f32).sin_cos();
        let to = |distance: f32, rate: f32| if rate > 1e-6 { distance / rate } else { f32::MAX };
        let walls = [to(ahead, cos), to(left, sin), to(behind, -cos), to(right, -sin)];
        let to_wall = walls.into_iter().fold(f32::MAX, f32::min) / cos_up;
        let range = to_wall.min(to(HEIGHT, -sin_up));
        Some([range * cos_up * cos, range * cos_up * sin, range * sin_up])
    };
    (0..RINGS).flat_map(|ring| (0..COLUMNS).map(move |column| at(ring, column))).collect()
}

/// The sensor turned to the left by so many columns: what it sees moves to the right.
fn turned(points: &[Option<[f32; 3]>], columns: usize) -> Vec<Option<[f32; 3]>> {
    let (sin, cos) = (-(columns as f32) * TAU / COLUMNS as f32).sin_cos();
    let turn = |[x, y, z]: [f32; 3]| [x * cos - y * sin, x * sin + y * cos, z];
    let mut turned: Vec<_> = points.iter().map(|point| point.map(turn)).collect();
    for ring in turned.as_chunks_mut::<COLUMNS>().0 {
        ring.rotate_right(columns);
    }
    turned
}

fn histogram(points: &[Option<[f32; 3]>]) -> Histogram {
    Histogram::new(&Cloud::new(points, RINGS).unwrap(), &Neighbours::default())
}

fn enriched(points: &[Option<[f32; 3]>]) -> Enriched {
    Enriched::new(&Cloud::new(points, RINGS).unwrap(), &histogram(points), HEIGHT)
}

fn orientation(points: &[Option<[f32; 3]>]) -> Orientation {
    Orientation::of_heights(&Cloud::new(points, RINGS).unwrap(), -1.2, 1.0, 50.0)
}

fn walls() -> impl Strategy<Value = [f32; 4]> {
    [4.0_f32..25.0, 4.0_f32..25.0, 4.0_f32..25.0, 4.0_f32..25.0]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn a_turn_of_the_sensor_changes_no_signature(walls in walls(), columns in 0..COLUMNS) {
        let points = yard(walls);
        let other = turned(&points, columns);
        // Points at the edge of a bin may fall into its neighbour.
        prop_assert!(sorensen(&histogram(&points), &histogram(&other)) < 0.01);
        // By whole sectors of six columns, nothing changes but the rounding.
        let whole = turned(&points, columns / 6 * 6);
        let apart = enriched(&points).distance(&enriched(&whole));
        prop_assert!(apart < 0.12, "{}", apart);
    }

    #[test]
    fn the_turn_itself_is_found(walls in walls(), columns in 0..COLUMNS) {
        // A rectangle looks the same after half a turn unless its sides differ.
        prop_assume!((walls[0] - walls[2]).abs() > 3.0 && (walls[1] - walls[3]).abs() > 3.0);
        let points = yard(walls);
        let found = orientation(&points).turn(&orientation(&turned(&points, columns)));
        let off = (found - columns as f32 * TAU / 360.0 + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
        prop_assert!(off.abs() < 1.5_f32.to_radians(), "{}", off.to_degrees());
    }

    #[test]
    fn walls_tell_the_turn_from_another_stand_too(
        walls in walls(), columns in 0..COLUMNS, ahead in -1.5_f32..1.5, left in -1.5_f32..1.5,
    ) {
        prop_assume!((walls[0] - walls[2]).abs() > 6.0 && (walls[1] - walls[3]).abs() > 6.0);
        let moved = [walls[0] - ahead, walls[1] - left, walls[2] + ahead, walls[3] + left];
        let (there, back) = (yard(walls), turned(&yard(moved), columns));
        let facing = |points: &[Option<[f32; 3]>]| {
            Facing::new(&Cloud::new(points, RINGS).unwrap(), &Neighbours::default())
        };
        let found = relative_turn((&orientation(&there), &facing(&there)), (&orientation(&back), &facing(&back)));
        let off = (found - columns as f32 * TAU / 360.0 + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
        prop_assert!(off.abs() < 1.5_f32.to_radians(), "{}", off.to_degrees());
        prop_assert!(facing(&there).distance(&facing(&there)) < 1e-4);
    }

    #[test]
    fn distances_are_distances(
        counts in prop::collection::vec(0_u32..5000, BINS),
        others in prop::collection::vec(0_u32..5000, BINS),
        scale in 2_u32..9,
    ) {
        let of = |counts: &[u32]| Histogram(std::array::from_fn(|bin| f64::from(counts[bin])));
        let (a, b) = (of(&counts), of(&others));
        let (p, q) = (a.normalised(), b.normalised());
        for (there, back, same) in [
            (chi_square(&a, &b), chi_square(&b, &a), chi_square(&a, &a)),
            (sorensen(&a, &b), sorensen(&b, &a), sorensen(&a, &a)),
            (normalised_chi_square(&p, &q), normalised_chi_square(&q, &p), normalised_chi_square(&p, &p)),
            (normalised_sorensen(&p, &q), normalised_sorensen(&q, &p), normalised_sorensen(&p, &p)),
        ] {
            prop_assert!(there >= 0.0 && (there - back).abs() <= 1e-12 * there && same == 0.0);
        }
        prop_assert!(sorensen(&a, &b) <= 1.0 && normalised_chi_square(&p, &q) <= 2.0 + 1e-12);
        // The normalised forms do not depend on the number of points.
        let many = Histogram(a.0.map(|count| count * f64::from(scale))).normalised();
        prop_assert!(normalised_chi_square(&p, &many) < 1e-24 && normalised_sorensen(&p, &many) < 1e-12);
    }
}

#[test]
fn planes_through_neighbours_are_the_ground_and_the_walls() {
    let points = yard([12.0, 9.0, 15.0, 6.0]);
    let (mut planes, mut level, mut upright) = (0, 0, 0);
    fitted_surfaces(&Cloud::new(&points, RINGS).unwrap(), &Neighbours::default(), |point, normal| {
        let dot: f32 = point.iter().zip(normal).map(|(a, b)| a * b).sum();
        let length: f32 = normal.iter().map(|value| value * value).sum();
        assert!(dot <= 0.0 && (length - 1.0).abs() < 1e-4, "{point:?} {normal:?}");
        planes += 1;
        level += usize::from(normal[2] > 0.9999 && point[2] < -0.99 * HEIGHT);
        // The walls stand along the axes.
        upright += usize::from(normal[0].abs().max(normal[1].abs()) > 0.9999 && normal[2].abs() < 0.01);
    });
    assert!(planes > 3000 && level > 1000 && upright > 1000, "{planes} {level} {upright}");
    // Only at the edges between them neighbours belong to two.
    assert!(10 * (level + upright) > 8 * planes, "{planes} {level} {upright}");
}

#[test]
fn distances_have_the_values_of_their_formulas() {
    let with = |values: &[(usize, f64)]| {
        let mut histogram = Histogram([0.0; BINS]);
        for (bin, value) in values {
            histogram.0[*bin] = *value;
        }
        histogram
    };
    let (a, b) = (with(&[(0, 3.0), (50, 10.0)]), with(&[(0, 1.0), (100, 4.0)]));
    // M 5.1: 4/5 + 100/11 + 16/5.
    assert!((chi_square(&a, &b) - (4.0 / 5.0 + 100.0 / 11.0 + 16.0 / 5.0)).abs() < 1e-12);
    // M 5.2: (2 + 10 + 4) / 18.
    assert!((sorensen(&a, &b) - 16.0 / 18.0).abs() < 1e-12);
    let (p, q) = (a.normalised(), b.normalised());
    let (first, second): (f64, f64) = (3.0 / 13.0, 1.0 / 5.0);
    let expected = (first - second).powi(2) / (first + second) + 10.0 / 13.0 + 4.0 / 5.0;
    assert!((normalised_chi_square(&p, &q) - expected).abs() < 1e-12);
    assert!((normalised_sorensen(&p, &q) - 0.5 * (first - second + 10.0 / 13.0 + 0.8)).abs() < 1e-12);
    let empty = with(&[]);
    assert_eq!((sorensen(&empty, &empty), empty.normalised()), (0.0, empty));
}

#[test]
fn ground_is_upright_and_walls_are_level() {
    let points = yard([8.0; 4]);
    let cloud = Cloud::new(&points, RINGS).unwrap();
    let mut parts = Vec::new();
    vertical_parts(&cloud, &Neighbours::default(), |part| parts.push(part));
    let of = |low: f32, high: f32| parts.iter().filter(|part| (low..=high).contains(&part.abs())).count();
    let (walls, ground) = (of(0.0, 0.05), of(0.99, 1.0));
    assert!(walls > 500 && ground > 500, "{walls} {ground}");
    // Only where they meet there is something between, and at corners nothing.
    assert!(walls + ground > parts.len() * 3 / 4, "{walls} + {ground} of {}", parts.len());
    // All on the ground point to the same side.
    assert!(
        parts
            .iter()
            .filter(|part| part.abs() > 0.99)
            .all(|part| part.signum() == parts.iter().copied().find(|p| p.abs() > 0.99).unwrap().signum())
    );
}

#[test]
fn a_scan_of_nothing_has_signatures_too() {
    let points = vec![None; RINGS * COLUMNS];
    assert_eq!(histogram(&points).0, [0.0; BINS]);
    assert_eq!(enriched(&points).distance(&enriched(&points)), 0.0);
    assert!(orientation(&points).turn(&orientation(&points)).is_finite());
    assert!(Cloud::new(&points[1..], RINGS).is_none());
}

#[test]
fn a_return_to_an_old_place_is_a_loop_closure_and_a_recent_place_is_none() {
    let scans: Vec<Histogram> =
        (0..20).map(|number| histogram(&yard([5.0 + number as f32, 6.0, 8.0, 7.0 + 0.5 * number as f32]))).collect();
    let limits = Limits { chi_square: 5.0, sorensen: 0.005, recent: 15 };
    assert_eq!(loop_closure(&scans[3], &scans, &limits), Some(3));
    assert_eq!(loop_closure(&scans[10], &scans, &limits), None);
    assert_eq!(loop_closure(&scans[3], &scans[..15], &limits), None);
}

#[test]
fn key_signatures_are_chosen_by_what_the_first_scans_teach() {
    let at = |place: f32| histogram(&yard([8.0 + place, 6.0, 30.0 - place, 7.0]));
    let mut keys = KeySignatures::default();
    // At walking pace, and then a leap.
    let slow: Vec<bool> = (0..21).map(|number| keys.is_key(&at(0.05 * number as f32))).collect();
    assert!(slow[0] && slow[1..20].iter().all(|is_key| !is_key));
    assert!(keys.threshold().is_some());
    assert!(keys.is_key(&at(9.0)));
    assert!(!keys.is_key(&at(9.0)));
    let mut fixed = KeySignatures::with_threshold(380.0);
    assert!((fixed.threshold().unwrap() - 380.0).abs() < 1e-9);
    assert!(fixed.is_key(&at(0.0)) && !fixed.is_key(&at(0.0)));
}

#[test]
fn the_threshold_is_below_the_least_distance_of_different_places() {
    let positions = [[0.0, 0.0], [10.0, 0.0], [40.0, 0.0], [80.0, 0.0]];
    let distance = |one: usize, other: usize| (one + other) as f64;
    // Pairs more than 30 m apart: 2-0, 3-0, 3-1, 3-2; the least sum is 2. The pair 2-1 is just 30 m apart.
    assert_eq!(from_key_scans(&positions, 30.0, distance), Some(1.6));
    assert_eq!(from_key_scans(&positions[..2], 30.0, distance), None);
}
