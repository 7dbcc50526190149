//! Localising by contours, in simulated surroundings whose truth is kept apart.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is how a test fails")]

use std::f64::consts::{PI, TAU};

use agv_core::contours::{
    ContourMatcher, KeptMap, KeptMapError, KeptPoint, KeyRing, Prediction, SearchWindow, Submap, SurfacePoint,
    Surroundings, TILE, Tile, refine, search,
};
use agv_core::geometry::{Pose, ScanPoint, difference};
use agv_core::measurement::{LaserId, Scan, Time};
use agv_core::sensing::PointScan;

use super::support::kept_map::kept_map;
use super::support::walls::{Noise, Walls, corridor, range, room};

/// A laser: beams, and the angle that they span, rad.
#[derive(Clone, Copy)]
struct Laser {
    beams: usize,
    span: f64,
}

const LASERS: [Laser; 3] =
    [Laser { beams: 180, span: PI }, Laser { beams: 361, span: PI }, Laser { beams: 1440, span: TAU }];

fn ranges(walls: &Walls, pose: &Pose, laser: Laser, noise: &mut Noise) -> Vec<f32> {
    let step = laser.span / laser.beams as f64;
    let bearing = |beam: usize| pose.theta - 0.5 * laser.span + step * beam as f64;
    (0..laser.beams).map(|beam| range(walls, &Pose { theta: bearing(beam), ..*pose }, noise)).collect()
}

/// How far off the matcher is behind a drive: along the last heading, across it (m), and of the heading (rad); and how often it
/// said that an axis is free.
struct Drift {
    along: f64,
    across: f64,
    heading: f64,
    free: usize,
}

fn see(matcher: &mut ContourMatcher, walls: &Walls, pose: &Pose, laser: Laser, noise: &mut Noise) {
    let ranges = ranges(walls, pose, laser, noise);
    let scan = Scan {
        laser: LaserId::FIRST,
        start: Time::default(),
        beam_interval: 0.0,
        first_bearing: -0.5 * laser.span,
        bearing_step: laser.span / laser.beams as f64,
        ranges: &ranges,
        intensities: &[],
    };
    let mut points: Box<PointScan<1440>> = Box::default();
    points.set(&scan, 0.02, 80.0);
    matcher.see(points.view());
}

/// Drives through walls. The odometry has the way 2 % too long, and turns by 0.2 deg too much for a metre.
fn drive(walls: &Walls, path: &[Pose], laser: Laser, seed: u64) -> Drift {
    let mut noise = Noise(seed);
    let mut matcher: Box<ContourMatcher> = Box::default();
    let mut found = path[0];
    let mut free = 0;
    for (number, truth) in path.iter().enumerate() {
        see(&mut matcher, walls, truth, laser, &mut noise);
        if number > 0 {
            let step = path[number - 1].between(truth);
            let way = step.position().norm();
            let odometry = Pose::new(1.02 * step.x, 1.02 * step.y, step.theta + way * 0.2_f64.to_radians());
            let aligned = matcher.align(&Prediction::by_odometry(&found, &odometry)).unwrap();
            (found, free) = (aligned.pose, free + usize::from(aligned.free_axis.is_some()));
        }
        matcher.keep(&found);
    }
    let last = path[path.len() - 1];
    let error = last.between(&found);
    Drift { along: error.x, across: error.y, heading: difference(found.theta, last.theta), free }
}

/// Straight on by 10 cm a scan.
fn straight(metres: f64) -> Vec<Pose> {
    (0..=(10.0 * metres) as usize).map(|step| Pose::new(0.1 * step as f64, 0.1, 0.02)).collect()
}

#[test]
fn a_plain_corridor_does_not_hold_the_vehicle_back() {
    for laser in LASERS {
        for seed in 1..=4 {
            let drift = drive(&corridor(None), &straight(12.0), laser, seed);
            let what = format!("{} beams, seed {seed}", laser.beams);
            // The odometry's own error is 0.24 m; its heading alone would be 2.4 deg off.
            assert!((drift.along - 0.24).abs() < 0.1, "{what}: {} m along", drift.along);
            assert!(drift.across.abs() < 0.03, "{what}: {} m across", drift.across);
            assert!(drift.heading.abs() < 0.4_f64.to_radians(), "{what}: {} deg", drift.heading.to_degrees());
            assert!(drift.free > 110, "{what}: free {} times", drift.free);
        }
    }
}

#[test]
fn niches_of_a_corridor_say_how_far_the_vehicle_has_come() {
    for laser in LASERS {
        for seed in 1..=4 {
            let drift = drive(&corridor(Some(4.0)), &straight(12.0), laser, seed);
            let what = format!("{} beams, seed {seed}", laser.beams);
            assert!(drift.along.abs() < 0.1, "{what}: {} m along, free {}", drift.along, drift.free);
            assert!(drift.across.abs() < 0.03, "{what}: {} m across", drift.across);
        }
    }
}

#[test]
fn a_room_holds_the_pose_to_millimetres() {
    for laser in LASERS {
        for seed in 1..=4 {
            let drift = drive(&room(), &straight(5.0), laser, seed);
            let what = format!("{} beams, seed {seed}", laser.beams);
            assert!(drift.along.hypot(drift.across) < 0.02, "{what}: {} m, {} m", drift.along, drift.across);
            assert!(drift.heading.abs() < 0.25_f64.to_radians(), "{what}: {} deg", drift.heading.to_degrees());
            assert_eq!(drift.free, 0, "{what}");
        }
    }
}

/// Wheels slip, or a log has a gap: the step is wrong by more than the usual search looks for.
#[test]
fn a_step_of_the_wheels_beyond_the_usual_search_is_found() {
    for laser in LASERS {
        for (seed, wrong) in
            [(1, Pose::new(1.3, 0.2, 0.1)), (2, Pose::new(-1.0, 0.9, -0.4)), (3, Pose::new(0.3, 0.0, 0.75))]
        {
            let mut noise = Noise(seed);
            let mut matcher: Box<ContourMatcher> = Box::default();
            for pose in straight(2.0) {
                see(&mut matcher, &room(), &pose, laser, &mut noise);
                matcher.keep(&pose);
            }
            let truth = Pose::new(2.2, 0.15, 0.1);
            see(&mut matcher, &room(), &truth, laser, &mut noise);
            let step = straight(2.0)[20].between(&truth.compose(&wrong));
            let found = matcher.align(&Prediction::by_odometry(&straight(2.0)[20], &step)).unwrap();
            let error = truth.between(&found.pose);
            let what = format!("{} beams, {wrong:?}: {error:?}, share {}", laser.beams, found.share);
            assert!(error.position().norm() < 0.05 && error.theta.abs() < 0.02, "{what}");
        }
    }
}

/// A wall fits anywhere along itself, but for noise: how far from the prediction the search goes is told by the window.
#[test]
fn along_a_wall_a_search_stays_as_near_to_the_prediction_as_its_window_asks() {
    let map = kept_map(&corridor(None), &Pose::default());
    let mean_shift = |distance: f32| {
        let window = SearchWindow { shifts: 2, shift: 3, turns: 0, turn: 0.0, distance };
        let shifts = (1..=20_u64).map(|seed| {
            let (mut matcher, mut submap) = (Box::<ContourMatcher>::default(), Box::<Submap<4096>>::default());
            let pose = Pose::new(0.37 * seed as f64, 0.2, 0.1);
            see(&mut matcher, &corridor(None), &pose, LASERS[2], &mut Noise(seed));
            map.load(Tile::place_of(pose.x, pose.y).unwrap(), 4096, &mut submap);
            let inside = submap.origin().between(&pose);
            let found = search(matcher.points(), submap.grid(), &inside, &window);
            (found.pose.x - inside.x).abs()
        });
        shifts.sum::<f64>() / 20.0
    };
    let (near, far) = (mean_shift(1.0), mean_shift(10.0));
    assert!(near < 0.2 && far > 1.5 * near, "{near} m, {far} m");
}

#[test]
fn a_turn_widens_what_is_searched_and_nonsense_does_not() {
    let window = |step: Pose| Prediction::by_odometry(&Pose::default(), &step).window();
    let usual = window(Pose::new(0.1, 0.0, 0.0));
    assert!(window(Pose::new(0.0, 0.0, 1.5)).turns > usual.turns, "a turn on the spot is wrong by a share of it");
    assert_eq!(window(Pose::new(0.0, 0.0, 1.5)).shifts, usual.shifts);
    assert!(window(Pose::new(4.0, 0.0, 0.0)).shifts > usual.shifts);
    assert_eq!(window(Pose { x: f64::NAN, y: 0.0, theta: f64::NAN }), usual);
}

#[test]
fn kept_points_are_true_to_a_millimetre_and_half_a_degree() {
    let mut noise = Noise(5);
    for _ in 0..1000 {
        let position = ScanPoint::new(4.0 * noise.uniform() as f32, 4.0 * noise.uniform() as f32);
        let angle = TAU * noise.uniform();
        let normal = ScanPoint::new(angle.cos() as f32, angle.sin() as f32);
        let kept = KeptPoint::of(&SurfacePoint { position, normal }).unpacked();
        assert!((kept.position - position).norm() < 0.8e-3);
        let turn = f64::from(kept.normal.y).atan2(f64::from(kept.normal.x));
        assert!(difference(turn, angle).abs() < 0.5_f64.to_radians());
    }
    let corner = SurfacePoint { position: ScanPoint::new(1.0, 2.0), normal: ScanPoint::zeros() };
    assert!(KeptPoint::of(&corner).unpacked().is_corner());
}

#[test]
fn a_kept_map_gives_what_is_around_and_refuses_what_is_not_in_order() {
    let point = KeptPoint::of(&SurfacePoint { position: ScanPoint::new(1.0, 3.0), normal: ScanPoint::new(0.0, 1.0) });
    let bytes = |tiles: &[Tile]| {
        let tile_bytes = tiles.iter().flat_map(Tile::bytes);
        KeptMap::header(tiles.len() as u32)
            .into_iter()
            .chain(tile_bytes)
            .chain([point; 3].iter().flat_map(KeptPoint::bytes))
            .collect::<Vec<u8>>()
    };
    let error = |bytes: &[u8]| KeptMap::read(bytes).unwrap_err();
    let tile = |row, column, end| Tile { place: (row, column), end };
    let tiles = [tile(-2, 5, 1), tile(0, 0, 2), tile(0, 7, 3)];
    assert_eq!(error(&bytes(&[tiles[1], tiles[0], tiles[2]])), KeptMapError::Order);
    assert_eq!(error(&bytes(&[tile(0, 0, 1), tile(0, 0, 3)])), KeptMapError::Order);
    for ends in [[0, 2], [1, 4], [3, 2], [0, u32::MAX]] {
        assert_eq!(error(&bytes(&[tile(0, 0, ends[0]), tile(0, 1, ends[1])])), KeptMapError::Points, "{ends:?}");
    }
    let bytes = bytes(&tiles);
    for length in 0..bytes.len() {
        let wanted =
            if length < 8 + 24 || (length - 32) % 5 != 0 { KeptMapError::Format } else { KeptMapError::Points };
        assert_eq!(error(&bytes[..length]), wanted, "{length} bytes");
    }
    assert_eq!(error(&[&[0], &bytes[1..]].concat()), KeptMapError::Format);
    assert_eq!(error(&[&bytes[..4], &[0xFF; 4], &bytes[8..]].concat()), KeptMapError::Format);

    // Two of a tile, of which the first is further along.
    let far = KeptPoint::of(&SurfacePoint { position: ScanPoint::new(2.0, 0.0), normal: ScanPoint::zeros() });
    let two = |points: [&KeptPoint; 2]| {
        let tile_bytes = tile(0, 0, 2).bytes();
        [&KeptMap::header(1)[..], &tile_bytes, &points[0].bytes(), &points[1].bytes()].concat()
    };
    assert_eq!(error(&two([&far, &point])), KeptMapError::Order);
    assert!(KeptMap::read(&two([&point, &far])).is_ok() && KeptMap::read(&two([&point, &point])).is_ok());

    let map = KeptMap::read(&bytes).unwrap();
    assert_eq!((map.len(), KeptMap::EMPTY.len(), KeptMap::read(&KeptMap::header(0)).unwrap().len()), (3, 0, 0));
    let places: Vec<_> = map.surfaces().map(|(corner, surface)| corner + surface.position.cast::<f64>()).collect();
    for (place, known) in places.iter().zip([[21.0, -5.0], [1.0, 3.0], [29.0, 3.0]]) {
        assert!((place.x - known[0]).hypot(place.y - known[1]) < 1e-3, "{place:?}");
    }
    let mut surroundings: Box<Surroundings> = Box::default();
    let none = KeyRing::<1, 1>::new();
    // The three points are at (1, 3), (29, 3) and (21, -5).
    assert_eq!(surroundings.around(&map, &none, &Pose::new(2.0, 2.0, 0.3)).len(), 1);
    assert_eq!(surroundings.around(&map, &none, &Pose::new(25.0, 2.0, 0.3)).len(), 2);
    let around = surroundings.around(&map, &none, &Pose::new(14.0, 2.0, 0.3));
    assert_eq!(around.len(), 3);
    let at = |x: f64, y: f64| {
        let position = ScanPoint::new((x - around.origin().x) as f32, (y - around.origin().y) as f32);
        let sought = SurfacePoint { position, normal: ScanPoint::new(0.0, 1.0) };
        around.nearest(&sought, 0.01).is_some_and(|found| (found.position - position).norm() < 2e-3)
    };
    assert!(at(1.0, 3.0) && at(29.0, 3.0) && at(21.0, -5.0) && !at(21.0, -4.9));
    assert_eq!(surroundings.around(&map, &none, &Pose::new(1e9, f64::NAN, 0.3)).len(), 3, "nowhere is no other place");
    assert!((TILE - 4.0).abs() < 1e-12);
}

/// The front of a cupboard on a wall has moved. The walls are seen to a centimetre, so what is off by more says little.
#[test]
fn what_was_moved_by_less_than_a_decimetre_takes_the_pose_along_by_millimetres() {
    let truth = Pose::new(4.0, 1.0, 0.3);
    let furnished = |by: f64| -> Walls {
        let top = -1.5 + by;
        [room(), vec![[1.0, -3.0, 1.0, top], [1.0, top, 3.5, top], [3.5, top, 3.5, -3.0]]].concat()
    };
    for by in [0.06, 0.08, 0.1] {
        for seed in 1..=8 {
            let (mut matcher, mut noise) = (ContourMatcher::default(), Noise(seed));
            see(&mut matcher, &furnished(0.0), &truth, LASERS[2], &mut noise);
            assert!(matcher.keep(&truth));
            see(&mut matcher, &furnished(by), &truth, LASERS[2], &mut noise);
            let found = matcher.align(&Prediction::by_odometry(&truth, &Pose::default())).unwrap().pose;
            let error = truth.between(&found);
            assert!(error.position().norm() < 0.0038, "moved by {by}, seed {seed}: {error:?}");
        }
    }
}

/// The two walls of a corridor stand farther apart than in the map. The points of the near one lie denser; it counts no more than the other.
#[test]
fn points_count_by_the_length_of_contour() {
    let wall = |y: f32, spacing: f32, length: f32| {
        let count = (length / spacing).round() as usize;
        let place = move |index: usize| ScanPoint::new((index as f32 + 0.5) * spacing - 0.5 * length, y);
        let normal = ScanPoint::new(0.0, -y.signum());
        (0..count).map(move |index| SurfacePoint { position: place(index), normal })
    };
    let mut submap = Box::<Submap<4096>>::default();
    submap.begin(&Pose::default());
    for point in wall(1.0, 0.05, 8.0).chain(wall(-1.0, 0.05, 8.0)) {
        submap.add_point(&point);
    }
    for (spacing, most) in [(0.05, 0.0005), (0.15, 0.0005), (0.1, 0.0005)] {
        let points: Vec<_> = wall(1.01, 0.05, 6.0).chain(wall(-1.01, spacing, 6.0)).collect();
        let found = refine(&points, &submap, &Pose::new(0.0, 0.003, 0.0)).unwrap();
        assert!(found.pose.y.abs() < most, "{spacing}: {:?}", found.pose);
        // Whatever they stand for, the information is that of so many points.
        let expected = points.len() as f64 / (0.03 * 0.03);
        assert!(found.information.m22 > 0.3 * expected && found.information.m22 <= expected, "{spacing}: {found:?}");
    }
}
