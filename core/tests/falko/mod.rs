//! The detector in a synthetic storage whose true corners are known, and its properties on any scan.
#![allow(clippy::expect_used, clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is how a test fails")]

pub mod scene;

use std::f64::consts::{PI, TAU};

use agv_core::geometry::ScanPoint;
use agv_core::measurement::{LaserId, Scan, Time};
use agv_core::sensing::falko::{Detector, PairSum, Parameters, Sectors};
use agv_core::sensing::{Keypoint, KeypointKind, PointScan};
use proptest::prelude::*;
use scene::{Random, Scene};

const BEAMS: usize = 1440;

fn profiles() -> [(&'static str, Parameters); 3] {
    [("thesis", Parameters::thesis()), ("reference", Parameters::reference()), ("mended", Parameters::mended())]
}

fn points(ranges: &[f32], first_bearing: f64, bearing_step: f64) -> Box<PointScan<BEAMS>> {
    let scan = Scan {
        laser: LaserId::FIRST,
        start: Time::default(),
        beam_interval: 0.0,
        first_bearing,
        bearing_step,
        ranges,
        intensities: &[],
    };
    let mut points = Box::new(PointScan::new());
    points.set(&scan, 0.05, 80.0);
    points
}

fn detect(points: &PointScan<BEAMS>, parameters: Parameters) -> Vec<Keypoint> {
    let mut detector = Detector::<BEAMS>::new(parameters);
    let mut keypoints = heapless::Vec::<Keypoint, 256>::new();
    assert_eq!(detector.detect(points, &mut keypoints), 0, "256 keypoints are room enough");
    keypoints.to_vec()
}

/// A pose in the lane: x, y, heading.
fn pose_in_lane(random: &mut Random) -> [f64; 3] {
    [random.uniform(1.0, 8.0), random.uniform(-0.15, 0.15), random.uniform(-0.1, 0.1)]
}

/// A keypoint inside the lane, and how far it is from the nearest true corner, in the frame of the sensor.
struct Seen {
    keypoint: Keypoint,
    error: [f64; 2],
}

impl Seen {
    fn distance(&self) -> f64 {
        self.error[0].hypot(self.error[1])
    }

    /// Squared Mahalanobis distance over its two degrees of freedom; 1 on average if the covariance is right.
    fn normalised(&self) -> f64 {
        let [xx, xy, yy] = self.keypoint.covariance.map(f64::from);
        let [x, y] = self.error;
        (yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy) / 2.0
    }

    /// How far an end of a face is put beyond the true end, along the face.
    fn beyond(&self) -> f64 {
        let inwards = f64::from(self.keypoint.orientation);
        -(self.error[0] * inwards.cos() + self.error[1] * inwards.sin())
    }
}

/// All keypoints of many scans in many storages, with 10 mm of noise, by a sensor that moves by `travel` (m) a scan.
fn look_around(parameters: Parameters, seeds: std::ops::Range<u64>, scans: usize, travel: f64) -> Vec<Seen> {
    let mut seen = Vec::new();
    for seed in seeds {
        let mut random = Random::new(seed);
        let scene = Scene::block_storage(&mut random);
        for _ in 0..scans {
            let pose = pose_in_lane(&mut random);
            let beams = scene.moving_scan(pose, BEAMS, travel, 0.01, &mut random);
            let ranges: Vec<f32> = beams.iter().map(|(range, _)| *range).collect();
            let mut points = points(&ranges, -PI, TAU / BEAMS as f64);
            for (point, (_, [x, y])) in points.points.iter_mut().zip(&beams) {
                *point = ScanPoint::new(*x, *y);
            }
            for keypoint in detect(&points, parameters) {
                let (sine, cosine) = pose[2].sin_cos();
                let (x, y) = (f64::from(keypoint.position.x), f64::from(keypoint.position.y));
                let world = [pose[0] + cosine * x - sine * y, pose[1] + sine * x + cosine * y];
                if world[0] > -0.3 && world[0] < 10.7 && world[1].abs() < 2.5 {
                    let offset = scene.offset_from_corner(world);
                    let error = [cosine * offset[0] + sine * offset[1], cosine * offset[1] - sine * offset[0]];
                    seen.push(Seen { keypoint, error });
                }
            }
        }
    }
    seen
}

struct Figures {
    per_scan: f64,
    within_2_cm: f64,
    over_10_cm: f64,
    /// Root mean square error an axis of those within 5 cm, m.
    deviation: f64,
    normalised: f64,
    beyond: f64,
}

fn figures(name: &str, seen: &[Seen], kind: KeypointKind, scans: usize) -> Figures {
    let chosen: Vec<_> = seen.iter().filter(|seen| seen.keypoint.kind == kind).collect();
    let count = chosen.len() as f64;
    let share = |test: &dyn Fn(&Seen) -> bool| chosen.iter().filter(|seen| test(seen)).count() as f64 / count;
    let near: Vec<_> = chosen.iter().filter(|seen| seen.distance() < 0.05).collect();
    let mean = |value: &dyn Fn(&Seen) -> f64| near.iter().map(|seen| value(seen)).sum::<f64>() / near.len() as f64;
    let figures = Figures {
        per_scan: count / scans as f64,
        within_2_cm: share(&|seen| seen.distance() < 0.02),
        over_10_cm: share(&|seen| seen.distance() > 0.10),
        deviation: (mean(&|seen| seen.distance().powi(2)) / 2.0).sqrt(),
        normalised: mean(&Seen::normalised),
        beyond: mean(&Seen::beyond),
    };
    println!(
        "{name} {kind:?}: {:.1} a scan, {:.1} % within 2 cm, {:.1} % over 10 cm, {:.1} mm an axis, normalised {:.2}, beyond {:.1} mm",
        figures.per_scan,
        100.0 * figures.within_2_cm,
        100.0 * figures.over_10_cm,
        1e3 * figures.deviation,
        figures.normalised,
        1e3 * figures.beyond,
    );
    figures
}

#[test]
fn corners_and_ends_in_a_storage_lie_where_the_pallets_do() {
    let seen = look_around(Parameters::mended(), 1000..1020, 10, 0.0);
    let corners = figures("mended", &seen, KeypointKind::Corner, 200);
    assert!(corners.per_scan > 4.5);
    assert!(corners.within_2_cm > 0.98);
    assert!(corners.over_10_cm < 0.003);
    assert!(corners.deviation < 0.0055);
    assert!(corners.normalised > 0.7 && corners.normalised < 1.4);

    let ends = figures("mended", &seen, KeypointKind::EndPoint, 200);
    assert!(ends.per_scan > 10.0);
    assert!(ends.within_2_cm > 0.89);
    assert!(ends.over_10_cm < 0.02);
    assert!(ends.normalised > 0.7 && ends.normalised < 1.5);
    assert!(ends.beyond.abs() < 0.002, "half a beam beyond the last return is the middle");
}

#[test]
fn motion_within_a_corrected_scan_does_little_harm() {
    // 1.5 m/s at 8 scans a second.
    let seen = look_around(Parameters::mended(), 2000..2020, 10, 0.19);
    let corners = figures("moving", &seen, KeypointKind::Corner, 200);
    assert!(corners.per_scan > 4.5 && corners.within_2_cm > 0.98 && corners.over_10_cm < 0.003);
    let ends = figures("moving", &seen, KeypointKind::EndPoint, 200);
    assert!(ends.per_scan > 10.0 && ends.within_2_cm > 0.89 && ends.over_10_cm < 0.02);
    assert!(ends.beyond.abs() < 0.003);
}

#[test]
fn printed_detector_slides_along_gaps() {
    let seen = look_around(Parameters::thesis(), 1000..1010, 10, 0.0);
    let corners = figures("thesis", &seen, KeypointKind::Corner, 100);
    assert!(corners.within_2_cm < 0.1, "the reason for the mended profile is gone");
}

/// Scans of a few storages, each with its ranges.
fn some_scans(count: usize) -> Vec<Vec<f32>> {
    let mut random = Random::new(7);
    let scene = Scene::block_storage(&mut random);
    (0..count).map(|_| scene.scan(pose_in_lane(&mut random), BEAMS, -PI, 0.01, &mut random)).collect()
}

#[test]
fn start_of_a_full_circle_plays_no_part() {
    for (name, parameters) in profiles().into_iter().filter(|(name, _)| *name != "reference") {
        for ranges in some_scans(10) {
            let whole = points(&ranges, -PI, TAU / BEAMS as f64);
            let mut expected = detect(&whole, parameters);
            for start in [1, 200, 719, 1001, BEAMS - 1] {
                let mut turned = whole.clone();
                turned.points.rotate_left(start);
                turned.ranges.rotate_left(start);
                let mut found = detect(&turned, parameters);
                for keypoint in &mut found {
                    keypoint.beam = ((usize::from(keypoint.beam) + start) % BEAMS) as u16;
                }
                let order = |keypoint: &Keypoint| (keypoint.kind == KeypointKind::EndPoint, keypoint.beam);
                expected.sort_by_key(order);
                found.sort_by_key(order);
                assert_eq!(found, expected, "{name}, start {start}");
            }
        }
    }
}

#[test]
fn heading_of_the_sensor_only_turns_keypoints() {
    let step = TAU / BEAMS as f64;
    for (name, parameters) in profiles() {
        let (mut total, mut lost) = (0, 0);
        for (ranges, turn) in some_scans(40).iter().zip((1..).map(|index| 0.37 * f64::from(index))) {
            let straight = detect(&points(ranges, -PI, step), parameters);
            let turned = detect(&points(ranges, -PI + turn, step), parameters);
            let (sine, cosine) = (turn.sin() as f32, turn.cos() as f32);
            total += straight.len() + turned.len();
            lost += turned.len();
            for keypoint in &straight {
                let position = keypoint.position;
                let expected =
                    ScanPoint::new(cosine * position.x - sine * position.y, sine * position.x + cosine * position.y);
                let same = turned.iter().find(|other| other.kind == keypoint.kind && other.beam == keypoint.beam);
                if same.is_some_and(|same| (same.position - expected).norm() < 1e-3) {
                    lost -= 1;
                } else {
                    lost += 1;
                }
            }
        }
        // Rounding of the points moves some of them across the boundary of a sector or of a neighbourhood.
        assert!(total > 400 && lost * 200 <= total, "{name}: {lost} of {total} keypoints depend on the heading");
    }
}

#[test]
fn seam_hides_no_corner() {
    // A square pillar ahead, seen by a full circle whose seam runs through its nearer corner.
    let ranges: Vec<f32> = (0..720)
        .map(|beam| {
            let bearing = TAU * f64::from(beam) / 720.0;
            let pillar = 2.0 / (bearing.cos() + bearing.sin().abs());
            if pillar > 0.0 && pillar < 2.6 && bearing.cos() > 0.5 { pillar as f32 } else { 6.0 }
        })
        .collect();
    for parameters in [Parameters::thesis(), Parameters::mended()] {
        let found = detect(&points(&ranges, 0.0, TAU / 720.0), parameters);
        let near = found.iter().any(|keypoint| (keypoint.position - ScanPoint::new(2.0, 0.0)).norm() < 0.005);
        assert!(near, "{found:?}");
    }
}

#[test]
fn spotless_corner_is_found_though_every_score_is_zero() {
    // Five beams, of which only the middle one has two neighbours on each side.
    let ranges: Vec<f32> = (-2..=2)
        .map(|beam| {
            let bearing = 0.03 * f64::from(beam);
            (2.0 / (bearing.cos() - bearing.sin().abs())) as f32
        })
        .collect();
    let found = detect(&points(&ranges, -0.06, 0.03), Parameters::thesis());
    let [corner] = found.as_slice() else { panic!("{found:?}") };
    assert!((corner.position - ScanPoint::new(2.0, 0.0)).norm() < 1e-3 && corner.score == 0.0, "{corner:?}");
}

#[test]
fn shadow_boundary_on_the_background_is_no_end() {
    // A wall 4 m ahead, and 2 m ahead a board from y = -0.5 to 0.5 in front of it.
    let step = PI / 720.0;
    let ranges: Vec<f32> = (0..720)
        .map(|beam| {
            let bearing = -PI / 2.0 + step * (f64::from(beam) + 0.5);
            let is_board = (2.0 * bearing.tan()).abs() <= 0.5;
            let distance = if is_board { 2.0 } else { 4.0 };
            (distance / bearing.cos()) as f32
        })
        .collect();
    let found = detect(&points(&ranges, -PI / 2.0 + 0.5 * step, step), Parameters::mended());
    let ends: Vec<_> = found.iter().filter(|keypoint| keypoint.kind == KeypointKind::EndPoint).collect();
    assert_eq!(ends.len(), 2, "{ends:?}");
    for end in ends {
        // Beams are 9 mm apart on the board.
        assert!((end.position.x - 2.0).abs() < 1e-3 && (end.position.y.abs() - 0.5).abs() < 0.005, "{end:?}");
    }
}

/// Distance of two sectors as printed (K 3.7), with the mathematical modulo.
fn sector_distance(first: usize, second: usize, sectors: usize) -> u32 {
    let (first, second, sectors) = (first as i64, second as i64, sectors as i64);
    ((first - second + sectors / 2).rem_euclid(sectors) - sectors / 2).unsigned_abs() as u32
}

fn any_range() -> impl Strategy<Value = f32> {
    prop_oneof![
        8 => 0.01_f32..20.0,
        4 => 1.0_f32..1.2,
        1 => Just(0.0),
        1 => Just(f32::NAN),
        1 => Just(f32::INFINITY),
        1 => Just(f32::NEG_INFINITY),
        1 => Just(-1.0),
        1 => Just(f32::MIN_POSITIVE),
        1 => Just(f32::MAX),
        1 => any::<f32>(),
    ]
}

#[test]
fn a_neighbourhood_that_nearly_reaches_the_sensor_is_whole() {
    // The disc about the return straight ahead is seen under asin(share) to each side. There, on the rays' nearest points
    // to its centre, lie the only neighbours.
    let step = PI / 720.0;
    for share in [0.3, 0.6, 0.79, 0.81, 0.9, 0.95, 0.99] {
        let within = (f64::asin(share) / step).floor() as usize;
        let mut ranges = vec![0.0_f32; BEAMS];
        ranges[BEAMS / 2] = 2.0;
        for beams in within - 2..=within {
            let range = 2.0 * (step * beams as f64).cos() as f32;
            (ranges[BEAMS / 2 - beams], ranges[BEAMS / 2 + beams]) = (range, range);
        }
        let parameters = Parameters {
            radius_scale: 2.0 * share as f32,
            radius_growth: 0.0,
            suppression_radius: 0.0,
            ..Parameters::thesis()
        };
        let found = detect(&points(&ranges, -PI, step), parameters);
        assert!(found.iter().any(|keypoint| usize::from(keypoint.beam) == BEAMS / 2), "{share}: {found:?}");
    }
}

proptest! {
    #[test]
    fn score_equals_the_printed_double_sum(
        half in 1_u8..=16,
        centred: bool,
        axis in -3.1_f64..3.1,
        seen in prop::collection::vec((0_usize..32, 0.1_f64..0.9), 0..80),
    ) {
        let count = 2 * usize::from(half);
        let grid = Sectors::new(2 * half, centred);
        let vector = |angle: f64| ScanPoint::new(angle.cos() as f32, angle.sin() as f32);
        let seen: Vec<_> = seen.into_iter().map(|(sector, share)| (sector % count, share)).collect();
        let mut own = PairSum::new(&grid, grid.origin(vector(axis)));
        for (sector, share) in &seen {
            let from_axis = *sector as f64 + share - if centred { 0.5 } else { 0.0 };
            own.add(vector(axis + from_axis * TAU / count as f64));
        }
        let mut sum = 0;
        for (index, (first, _)) in seen.iter().enumerate() {
            for (second, _) in seen.iter().skip(index + 1) {
                sum += sector_distance(*first, *second, count);
            }
        }
        prop_assert_eq!(own.value(), sum);
    }

    #[test]
    fn sector_is_that_of_the_angle(count in 1_u8..=16, centred: bool, axis in -3.1_f64..3.1, angle in -3.1_f64..3.1) {
        let sectors = Sectors::new(2 * count, centred);
        let width = TAU / f64::from(2 * count);
        let vector = |angle: f64, length: f64| ScanPoint::new((length * angle.cos()) as f32, (length * angle.sin()) as f32);
        let position = (angle - axis + if centred { 0.5 * width } else { 0.0 }).rem_euclid(TAU) / width;
        prop_assume!((position - position.round()).abs() > 1e-4);
        let found = sectors.index(sectors.origin(vector(axis, 3.0)), vector(angle, 0.2));
        prop_assert_eq!(found, position.floor() as usize);
    }

    #[test]
    fn any_ranges_give_finite_keypoints_at_present_returns(
        ranges in prop::collection::vec(any_range(), 0..400),
        field in 0.1_f64..TAU,
        is_full: bool,
    ) {
        let step = if is_full { TAU } else { field } / ranges.len().max(1) as f64;
        let points = points(&ranges, -1.0, step);
        for (_, parameters) in profiles() {
            for keypoint in detect(&points, parameters) {
                let range = ranges[usize::from(keypoint.beam)];
                prop_assert!(range.is_finite() && range > 0.0);
                let [xx, xy, yy] = keypoint.covariance;
                prop_assert!(keypoint.position.iter().chain(&keypoint.covariance).all(|value| value.is_finite()));
                prop_assert!(keypoint.orientation.is_finite() && keypoint.radius > 0.0);
                prop_assert!(xx > 0.0 && yy > 0.0 && f64::from(xx) * f64::from(yy) > f64::from(xy) * f64::from(xy));
            }
        }
    }

    #[test]
    fn absent_returns_change_nothing_whatever_they_are_called(
        seed in 0_u64..1000,
        holes in prop::collection::vec(0_usize..BEAMS, 0..60),
    ) {
        let mut random = Random::new(seed);
        let scene = Scene::block_storage(&mut random);
        let clean = scene.scan(pose_in_lane(&mut random), BEAMS, -PI, 0.01, &mut random);
        let names = [0.0, f32::NAN, f32::INFINITY, -3.0, 1e9];
        let with = |name: &dyn Fn(usize) -> f32| {
            let mut ranges = clean.clone();
            for hole in &holes {
                ranges[*hole] = name(*hole);
            }
            points(&ranges, -PI, TAU / BEAMS as f64)
        };
        for (_, parameters) in profiles() {
            let expected = detect(&with(&|_| 0.0), parameters);
            prop_assert_eq!(&detect(&with(&|hole| names[hole % names.len()]), parameters), &expected);
            prop_assert!(expected.iter().all(|keypoint| !holes.contains(&usize::from(keypoint.beam))));
        }
    }
}

#[test]
fn beams_that_hardly_differ_are_no_more_than_there_are() {
    let ranges: Vec<f32> = (0..200).map(|beam| 5.0 + (beam % 7) as f32 * 0.3).collect();
    for (name, parameters) in profiles() {
        for step in [1e-40, -1e-40, 7.7e-31, 1e-12] {
            let keypoints = detect(&points(&ranges, 1.0, step), parameters);
            assert!(keypoints.iter().all(|keypoint| keypoint.position.x.is_finite()), "{name}");
        }
    }
}
