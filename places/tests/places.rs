//! Signatures, association and alignment on point sets whose truth is known.
#![allow(clippy::expect_used, clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is how a test fails")]

use std::f64::consts::PI;

use agv_core::geometry::fit_rigid;
use agv_core::geometry::{Point, Pose, ScanPoint, difference};
use agv_core::measurement::{LaserId, Scan, Time};
use agv_core::sensing::{Keypoint, KeypointKind, PointScan};
use agv_places::{
    AffineHough, Candidate, Compatibility, Correspondence, CorrespondenceGraph, Glare, GlareParameters, GlareTables,
    HoughParameters, OverlapParameters, PlaceIndex, RandomSample, RandomSampleParameters, ScanAlignmentParameters,
    align_scans, common_points, overlap, surface_normal,
};
use nalgebra::Vector3;
use proptest::prelude::*;

fn tables() -> GlareTables {
    GlareTables::new(&GlareParameters::default())
}

fn points() -> impl Strategy<Value = Vec<ScanPoint>> {
    prop::collection::vec((-6.0_f32..6.0, -6.0_f32..6.0).prop_map(|(x, y)| ScanPoint::new(x, y)), 3..24)
}

fn turned(points: &[ScanPoint], angle: f32) -> Vec<ScanPoint> {
    let (sine, cosine) = angle.sin_cos();
    points.iter().map(|p| ScanPoint::new(cosine * p.x - sine * p.y, sine * p.x + cosine * p.y)).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn signature_does_not_depend_on_the_order_of_points(points in points(), rotation in 0_usize..24) {
        let mut other = points.clone();
        other.reverse();
        other.rotate_left(rotation % points.len());
        let (first, second) = (Glare::of(&points, &tables()), Glare::of(&other, &tables()));
        // Sums in another order may round to the next byte.
        prop_assert!(first.unshifted_distance(&second) <= 4, "{}", first.unshifted_distance(&second));
    }

    #[test]
    fn distance_does_not_change_when_points_are_turned_by_whole_cells(points in points(), steps in 1_u8..16) {
        let other = turned(&points, f32::from(steps) * Glare::DIRECTION_STEP);
        let (first, second) = (Glare::of(&points, &tables()), Glare::of(&other, &tables()));
        let (distance, shift) = first.distance(&second);
        // A pair on the boundary of a tabulated phase may fall to either side.
        prop_assert!(distance <= 60, "{distance}");
        let (back, back_shift) = second.distance(&first);
        prop_assert_eq!(distance, back);
        prop_assert_eq!((shift + back_shift) % 8, 0);
        // The unshifted signature does depend on the turn.
        if steps % 8 == 4 && first.unshifted_distance(&first) == 0 {
            prop_assert!(distance <= first.unshifted_distance(&second));
        }
    }

    #[test]
    fn signature_does_not_change_when_points_are_moved(points in points(), x in -9_f32..9.0, y in -9_f32..9.0) {
        let moved: Vec<_> = points.iter().map(|p| p + ScanPoint::new(x, y)).collect();
        prop_assert!(Glare::of(&points, &tables()).distance(&Glare::of(&moved, &tables())).0 <= 60);
    }

    #[test]
    fn other_points_have_another_signature(points in points(), other in points()) {
        let (first, second) = (Glare::of(&points, &tables()), Glare::of(&other, &tables()));
        prop_assert_eq!(first.distance(&first), (0, 0));
        if points.len() > 5 && other.len() > 5 {
            prop_assert!(first.distance(&second).0 > 200);
        }
    }

    #[test]
    fn signature_of_normals_does_not_change_by_any_turn(points in points(), angle in -3.0_f32..3.0) {
        let normals: Vec<f32> = (0..points.len()).map(|i| (i as f32 * 0.37) % 6.0 - 3.0).collect();
        let other: Vec<f32> = normals.iter().map(|n| difference(f64::from(n + angle), 0.0) as f32).collect();
        let (first, second) = (Glare::of_normals(&points, &normals, &tables()), Glare::of_normals(&turned(&points, angle), &other, &tables()));
        prop_assert!(first.unshifted_distance(&second) <= 120, "{}", first.unshifted_distance(&second));
    }

    #[test]
    fn exact_pairs_are_aligned_exactly(points in points(), x in -9_f64..9.0, y in -9_f64..9.0, theta in -3.1_f64..3.1) {
        let pose = Pose::new(x, y, theta);
        let pairs = points.iter().map(|p| (p.cast(), pose.transform(&p.cast()), 1.0));
        let found = fit_rigid(pairs).unwrap();
        prop_assert!(found.residual < 1e-6);
        prop_assert!((found.pose.position() - pose.position()).norm() < 1e-6);
        prop_assert!(difference(found.pose.theta, theta).abs() < 1e-7);
    }

    #[test]
    fn candidates_are_the_nearest(sets in prop::collection::vec(points(), 8..20)) {
        let mut index = PlaceIndex::<32>::new();
        for set in &sets {
            index.push(Glare::of(set, &tables())).unwrap();
        }
        let query = index.signatures()[0];
        let mut found = heapless::Vec::<Candidate, 5>::new();
        index.search(&query, |place| place != 0, &mut found);
        let mut all: Vec<_> = (1..sets.len()).map(|place| (query.distance(&index.signatures()[place]).0, place as u32)).collect();
        all.sort_unstable();
        let expected: Vec<_> = all.iter().take(5).copied().collect();
        prop_assert_eq!(found.iter().map(|c| (c.distance, c.place)).collect::<Vec<_>>(), expected);
    }
}

/// Repeatable numbers in [0, 1).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / (1_u64 << 31) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }
}

#[test]
fn covariance_of_an_alignment_is_what_noise_makes() {
    const DEVIATION: f64 = 0.01;
    let mut random = Random(7);
    let points: Vec<_> = (0..9).map(|_| Point::new(3.0 + 4.0 * random.unit(), 6.0 * random.unit())).collect();
    let pose = Pose::new(1.0, -2.0, 0.7);
    let (mut sum, mut predicted) = (nalgebra::Matrix3::zeros(), nalgebra::Matrix3::zeros());
    let runs = 4000;
    for _ in 0..runs {
        let noisy: Vec<_> = points
            .iter()
            .map(|p| (*p, pose.transform(p) + DEVIATION * Point::new(random.normal(), random.normal()), 1.0))
            .collect();
        let found = fit_rigid(noisy.iter().copied()).unwrap();
        let error =
            Vector3::new(found.pose.x - pose.x, found.pose.y - pose.y, difference(found.pose.theta, pose.theta));
        sum += error * error.transpose() / f64::from(runs);
        predicted = found.unit_covariance * DEVIATION * DEVIATION;
    }
    for (measured, predicted) in sum.iter().zip(&predicted) {
        assert!((measured - predicted).abs() < 0.08 * predicted.abs() + 1e-6, "{sum} {predicted}");
    }
}

fn keypoint(position: Point, orientation: f64) -> Keypoint {
    Keypoint {
        kind: KeypointKind::Corner,
        beam: 0,
        position: position.cast(),
        covariance: [1e-4, 0.0, 1e-4],
        orientation: orientation as f32,
        radius: 0.3,
        score: 0.0,
    }
}

/// Two views of the same corners: those of the first at `pose` in the frame of the second, with noise, and some that only
/// one of them sees.
fn two_views(seed: u64, pose: &Pose, common: usize, others: usize) -> (Vec<Keypoint>, Vec<Keypoint>) {
    let mut random = Random(seed);
    let place = |random: &mut Random| {
        (Point::new(10.0 * random.unit() - 5.0, 10.0 * random.unit() - 5.0), 2.0 * PI * random.unit() - PI)
    };
    let (mut first, mut second) = (Vec::new(), Vec::new());
    for _ in 0..common {
        let (point, orientation) = place(&mut random);
        let noise = 0.01 * Point::new(random.normal(), random.normal());
        first.push(keypoint(pose.inverse_transform(&point) + noise, orientation - pose.theta));
        second.push(keypoint(point, orientation));
    }
    for _ in 0..others {
        let ((a, turn_a), (b, turn_b)) = (place(&mut random), place(&mut random));
        first.insert(0, keypoint(a, turn_a));
        second.push(keypoint(b, turn_b));
    }
    (first, second)
}

fn is_near(found: &Pose, truth: &Pose) -> bool {
    let error = truth.between(found);
    error.position().norm() < 0.08 && error.theta.abs() < 0.02
}

#[test]
fn associations_find_the_pose_among_points_that_only_one_scan_has() {
    let mut graph = Box::new(CorrespondenceGraph::<512, 16>::new());
    let mut hough = Box::<AffineHough>::default();
    let mut voted = 0;
    for seed in 0..40 {
        let mut random = Random(seed);
        let pose = Pose::new(3.0 * random.unit(), -2.0 * random.unit(), 2.4 * random.unit() - 1.2);
        let (source, target) = two_views(seed, &pose, 8, 5);
        for compatibility in [Compatibility::default(), Compatibility::thesis()] {
            let (found, clique) = graph.associate(&source, &target, &compatibility).unwrap();
            assert!(is_near(&found.pose, &pose), "{found:?} {pose:?}");
            assert!(clique.is_maximum && clique.vertices.len() >= 8);
        }
        let found = hough.associate(&source, &target, &HoughParameters::default()).unwrap();
        voted += usize::from(common_points(&source, &target, &found.pose, 0.1) >= 6);
        let mut sample = RandomSample::new(seed);
        for number in 0..8 {
            // The common ones stand behind five others in the source.
            sample.offer(Correspondence { source: number + 5, target: number });
            sample.offer(Correspondence { source: number, target: number });
        }
        let trials = RandomSampleParameters { inlier_probability: 0.4, ..RandomSampleParameters::default() };
        let found = sample.associate(&source, &target, &trials).unwrap();
        assert!(is_near(&found.pose, &pose));
    }
    // Votes that fall on both sides of a cell's boundary are lost to it.
    assert!(voted >= 30, "{voted}");
}

#[test]
fn votes_find_the_pose_however_many_keypoints_there_are() {
    let mut hough = Box::<AffineHough>::default();
    let pose = Pose::new(0.75, -0.55, 0.2);
    let wide = HoughParameters { cell: 0.3, ..HoughParameters::default() };
    for common in [254, 255, 256, 257, 300] {
        let mut random = Random(common as u64);
        let mut place = || Point::new(30.0 * random.unit() - 15.0, 30.0 * random.unit() - 15.0);
        let target: Vec<_> = (0..common).map(|_| keypoint(place(), 0.0)).collect();
        let source: Vec<_> =
            target.iter().map(|one| keypoint(pose.inverse_transform(&one.position.cast()), -pose.theta)).collect();
        let found = hough.associate(&source, &target, &wide).unwrap();
        assert!(is_near(&found.pose, &pose), "{common}: {found:?} {pose:?}");
    }
}

#[test]
fn mirror_images_are_refused() {
    let mut graph = Box::new(CorrespondenceGraph::<512, 16>::new());
    for seed in 0..40 {
        let (source, target) = two_views(seed, &Pose::new(0.0, 0.0, 0.0), 8, 0);
        let mirrored: Vec<_> = source
            .iter()
            .map(|own| {
                let position = Point::new(f64::from(-own.position.x), f64::from(own.position.y));
                keypoint(position, PI - f64::from(own.orientation))
            })
            .collect();
        for compatibility in [Compatibility::default(), Compatibility::thesis()] {
            if let Some((found, _)) = graph.associate(&mirrored, &target, &compatibility) {
                assert!(common_points(&mirrored, &target, &found.pose, 0.1) < 5, "{found:?}");
            }
        }
    }
}

/// A room whose walls are lines, seen from inside.
fn room(pose: &Pose, beams: usize) -> Box<PointScan<720>> {
    room_swept(pose, -PI, 2.0 * PI / beams as f64, beams)
}

/// The same room as a sweep from `first_bearing` in steps of `bearing_step`, rad, sees it.
fn room_swept(pose: &Pose, first_bearing: f64, bearing_step: f64, beams: usize) -> Box<PointScan<720>> {
    let corners = [(-4.0, -3.0), (5.0, -3.0), (5.0, 1.0), (3.0, 1.0), (3.0, 4.0), (-4.0, 4.0)];
    let ranges: Vec<f32> = (0..beams)
        .map(|beam| {
            let angle = pose.theta + first_bearing + bearing_step * beam as f64;
            let (sine, cosine) = angle.sin_cos();
            let mut nearest = f64::INFINITY;
            for (index, (ax, ay)) in corners.iter().enumerate() {
                let (bx, by) = corners[(index + 1) % corners.len()];
                let (ex, ey) = (bx - ax, by - ay);
                let determinant = cosine * -ey + ex * sine;
                if determinant.abs() < 1e-12 {
                    continue;
                }
                let (dx, dy) = (ax - pose.x, ay - pose.y);
                let way = (dx * -ey + ex * dy) / determinant;
                let share = (cosine * dy - sine * dx) / determinant;
                if way > 0.0 && (0.0..=1.0).contains(&share) {
                    nearest = nearest.min(way);
                }
            }
            nearest as f32
        })
        .collect();
    let scan = Scan {
        laser: LaserId::FIRST,
        start: Time::default(),
        beam_interval: 0.0,
        first_bearing,
        bearing_step,
        ranges: &ranges,
        intensities: &[],
    };
    let mut points = Box::new(PointScan::new());
    points.set(&scan, 0.05, 30.0);
    points
}

#[test]
fn scans_of_a_room_are_aligned_and_agree_only_where_they_were_taken() {
    let (first, second) = (Pose::new(0.0, 0.0, 0.3), Pose::new(0.4, -0.3, 0.1));
    let (source, target) = (room(&first, 360), room(&second, 360));
    let truth = second.between(&first);
    let start = truth.compose(&Pose::new(0.15, -0.1, 0.04));
    let found = align_scans(&source, &target, &start, &ScanAlignmentParameters::default()).unwrap();
    let error = truth.between(&found.pose);
    assert!(error.position().norm() < 5e-3 && error.theta.abs() < 1e-3, "{error:?}");

    let parameters = OverlapParameters::default();
    let right = overlap(&source, &target, &truth, &parameters);
    let wrong = overlap(&source, &target, &truth.compose(&Pose::new(1.5, 0.5, 1.0)), &parameters);
    assert!(right.agreement() > 0.97 && right.contradicting == 0, "{right:?}");
    assert!(wrong.agreement() < 0.5 && wrong.contradicting > 100, "{wrong:?}");
}

#[test]
fn the_sense_in_which_a_laser_turns_and_where_it_begins_do_not_matter() {
    let (first, second) = (Pose::new(0.0, 0.0, 0.3), Pose::new(0.4, -0.3, 0.1));
    let truth = second.between(&first);
    let start = truth.compose(&Pose::new(0.15, -0.1, 0.04));
    let step = PI / 180.0;
    // A circle, and three quarters of one that are about the front.
    for (beams, begins) in [(360, [-PI, 0.0, 2.0, 4.0]), (270, [-2.35, -2.4, -2.3, -2.35 - 2.0 * PI])] {
        let sweep = |pose, begin: f64, is_clockwise| {
            let sign = if is_clockwise { -1.0 } else { 1.0 };
            room_swept(pose, sign * begin, sign * step, beams)
        };
        for (begin, senses) in begins.iter().flat_map(|begin| (0..4).map(|senses| (*begin, senses))) {
            let (source, target) = (sweep(&first, begin, senses & 1 != 0), sweep(&second, begin, senses & 2 != 0));
            let found = align_scans(&source, &target, &start, &ScanAlignmentParameters::default()).unwrap();
            let error = truth.between(&found.pose);
            assert!(error.position().norm() < 5e-3 && error.theta.abs() < 1e-3, "{beams} {begin} {senses}: {error:?}");
            let right = overlap(&source, &target, &truth, &OverlapParameters::default());
            assert!(right.agreement() > 0.97 && right.contradicting == 0, "{beams} {begin} {senses}: {right:?}");
            // Beams that look where the other sensor's do not.
            assert!(right.outside <= if beams == 360 { 0 } else { 20 }, "{beams} {begin} {senses}: {right:?}");
        }
    }
}

#[test]
fn normals_face_the_sensor_across_the_surface() {
    let scan = room(&Pose::new(0.0, 0.0, 0.0), 720);
    let wall = surface_normal(&scan, ScanPoint::new(0.0, -3.0), 0.4).unwrap();
    assert!((f64::from(wall) - PI / 2.0).abs() < 0.02, "{wall}");
    let wall = surface_normal(&scan, ScanPoint::new(-4.0, 0.0), 0.4).unwrap();
    assert!(wall.abs() < 0.02, "{wall}");
}
