//! Pose, calibration and landmarks in one filter, in a hall whose reflectors and corners are known to the test.

use agv_core::filter::BiasDeviations;
use agv_core::geometry::{Point, Pose};
use agv_core::localizer::{LandmarkSource, Localizer, Mode, Parameters, Reason};
use agv_core::maps::{LandmarkKind, Verdict};
use agv_core::sources::Switches;

use super::support::hall::corners;
use super::support::stage::{Small, Stage, features, parameters, reflectors};

fn mapping() -> Parameters {
    let mut parameters = parameters();
    parameters.maps.slam = true;
    parameters
}

/// One without any map.
fn without_map(parameters: Parameters) -> Stage {
    let mut stage = Stage::new(parameters);
    *stage.localizer = Small::new(parameters);
    stage.report(&Pose::default());
    stage.tell(stage.truth, 0.005, 0.001);
    stage
}

fn accepted(stage: &Stage, source: LandmarkSource) -> usize {
    let uses = stage.localizer.outputs().uses.iter();
    uses.filter(|used| used.verdict == Verdict::Accepted && used.landmark.is_some_and(|(of, _)| of == source)).count()
}

#[test]
fn given_reflectors_correct_the_pose_and_enter_the_state_once() {
    let mut stage = Stage::new(mapping());
    let told = stage.truth.compose(&Pose::new(0.03, -0.02, 0.006));
    stage.tell(told, 0.03, 0.01);
    for _ in 0..25 {
        stage.drive(0.5, 0.1);
        stage.look();
        assert!(accepted(&stage, LandmarkSource::Fixed) >= 8, "{:?}", stage.localizer.outputs().uses);
    }
    let (position, heading) = stage.error();
    assert!(position < 0.003 && heading < 0.001, "{position} {heading}");
    assert_eq!((stage.said().mode, stage.said().reason), (Mode::Reflectors, Reason::None));
    let map = reflectors();
    let known: Vec<_> = stage.localizer.state_landmarks().collect();
    assert_eq!(known.len(), map.len());
    for landmark in &map {
        let near = |(kind, place): &&(LandmarkKind, Point)| {
            *kind == LandmarkKind::Reflector && (place - landmark.position()).norm() < 0.005
        };
        assert_eq!(known.iter().filter(near).count(), 1, "{landmark:?}");
    }
    // The map states 2 mm an axis, so no pose among them can be surer than that by much.
    assert!(stage.said().covariance[0] > 1e-7, "{:?}", stage.said());
}

#[test]
fn given_features_are_known_whichever_way_the_vehicle_looks() {
    let mut stage = Stage::told(mapping());
    let mut least = usize::MAX;
    for revolution in 0..50 {
        // Once round, on a circle.
        stage.drive(0.5, 1.05);
        stage.scan();
        if revolution > 2 {
            least = least.min(accepted(&stage, LandmarkSource::Fixed));
        }
        let (position, heading) = stage.error();
        assert!(position < 0.02 && heading < 0.005, "{revolution}: {position} {heading}");
    }
    assert!(least >= 5, "{least}");
    assert_eq!((stage.said().mode, stage.said().reason), (Mode::Features, Reason::None));
}

#[test]
fn features_are_found_where_they_are_and_known_again_from_all_sides() {
    let mut parameters = mapping();
    parameters.sources.key_scans = false;
    let mut stage = without_map(parameters);
    for revolution in 0..60 {
        stage.drive(0.4, 0.9);
        stage.scan();
        let (position, heading) = stage.error();
        assert!(position < 0.04 && heading < 0.01, "{revolution}: {position} {heading}");
    }
    assert!(accepted(&stage, LandmarkSource::Dynamic) >= 5);
    let found: Vec<_> = stage.localizer.state_landmarks().collect();
    let is_near = |place: &Point| corners().any(|corner| (corner - place).norm() < 0.06);
    let right = found.iter().filter(|(_, place)| is_near(place)).count();
    assert!(right >= 8 && 10 * right >= 8 * found.len(), "{right} of {}", found.len());
    // One corner is one landmark, or two if it looks like an end from one side.
    for corner in corners() {
        let count = found.iter().filter(|(_, place)| (corner - place).norm() < 0.06).count();
        assert!(count <= 2, "{corner} {count}");
    }
}

#[test]
fn reflectors_are_found_on_the_way_if_none_are_given() {
    let mut stage = without_map(mapping());
    let acceptance = |stage: &Stage| stage.said().acceptance;
    for _ in 0..20 {
        stage.drive(0.5, 0.1);
        stage.look();
    }
    assert_eq!(accepted(&stage, LandmarkSource::Dynamic), reflectors().len());
    assert_eq!(acceptance(&stage), 1.0, "what no map has is no evidence");
    let found: Vec<_> = stage.localizer.state_landmarks().collect();
    assert_eq!(found.len(), reflectors().len());
    let (position, heading) = stage.error();
    assert!(position < 0.02 && heading < 0.004, "{position} {heading}");
    // With a map, one that is not in it is evidence against the pose and no new landmark.
    let mut stage = Stage::told(mapping());
    for _ in 0..6 {
        stage.drive(0.5, 0.1);
        let ghost = stage.observe(&Point::new(0.5, 1.0));
        let mut seen = stage.view();
        seen.push(ghost);
        stage.see(&seen);
    }
    assert!((acceptance(&stage) - 12.0 / 13.0).abs() < 1e-3, "{}", acceptance(&stage));
    assert_eq!(stage.localizer.state_landmarks().count(), reflectors().len());
}

#[test]
fn a_wrong_scale_of_the_odometry_is_learnt() {
    let mut parameters = mapping();
    parameters.slam.biases = BiasDeviations { scale: 0.03, ..BiasDeviations::default() };
    let mut stage = Stage::told(parameters);
    stage.scale = 0.97;
    for _ in 0..60 {
        stage.drive(0.5, 0.15);
        stage.look();
    }
    for _ in 0..20 {
        stage.drive(0.5, 0.15);
    }
    // 1.2 m without landmarks, of which the reported way lacks 36 mm.
    let (position, _) = stage.error();
    assert!(position < 0.009, "{position}");
}

#[test]
fn a_wrong_yaw_of_the_laser_is_learnt() {
    let mut parameters = mapping();
    parameters.slam.biases = BiasDeviations { laser_yaw: 0.01, ..BiasDeviations::default() };
    let mut stage = Stage::told(parameters);
    stage.laser.theta += 0.008;
    for _ in 0..60 {
        stage.drive(0.5, 0.15);
        stage.look();
    }
    let (position, heading) = stage.error();
    assert!(position < 0.006 && heading < 0.002, "{position} {heading}");
}

#[test]
fn a_place_is_looked_at_a_few_times_only() {
    let mut stage = Stage::told(mapping());
    let used = |stage: &mut Stage, count: usize| {
        let mut used = Vec::new();
        for _ in 0..count {
            stage.drive(0.0, 0.0);
            stage.scan();
            used.push(!stage.localizer.outputs().uses.is_empty());
        }
        used
    };
    let mut expected = vec![true; 8];
    expected.extend([false; 4]);
    assert_eq!(used(&mut stage, 12), expected);
    // A turn by a milliradian, or a way of a centimetre, makes another place.
    for (speed, turn) in [(0.0, 0.002), (0.011, 0.0), (0.0, -0.002)] {
        let mut stage = Stage::told(mapping());
        used(&mut stage, 12);
        for _ in 0..10 {
            stage.drive(speed, turn);
        }
        assert_eq!(used(&mut stage, 10), [&[true; 8][..], &[false; 2][..]].concat(), "{speed} {turn}");
    }
}

#[test]
fn evidence_against_the_pose_loses_it_while_mapping_too() {
    let mut stage = Stage::told(mapping());
    for _ in 0..10 {
        stage.drive(0.5, 0.1);
        stage.look();
    }
    // Elsewhere, and nobody has said so.
    stage.truth = Pose::new(3.0, 1.0, 2.0);
    for _ in 0..6 {
        stage.drive(0.5, 0.1);
        stage.look();
    }
    assert_eq!(stage.said().mode, Mode::Lost);
    let lost = stage.said();
    stage.look();
    assert!(stage.localizer.outputs().uses.is_empty() && stage.said().reason == lost.reason);
    stage.tell(stage.truth, 0.01, 0.002);
    assert_eq!(stage.localizer.state_landmarks().count(), 0);
    for _ in 0..6 {
        stage.drive(0.5, 0.1);
        stage.look();
    }
    assert_ne!(stage.said().mode, Mode::Lost);
    assert_eq!(accepted(&stage, LandmarkSource::Fixed), reflectors().len());
}

#[test]
fn scans_aligned_to_those_of_the_way_behind_hold_the_pose() {
    // Without features, so that the walls themselves must do it.
    let drift = |key_scans: bool| {
        let mut parameters = mapping();
        if !key_scans {
            parameters.sources.key_scans = false;
        }
        parameters.sources.corners = false;
        parameters.sources.end_points = false;
        parameters.slam.biases = BiasDeviations { scale: 0.0, steering: 0.0, laser_yaw: 0.0 };
        let mut stage = without_map(parameters);
        stage.scale = 0.95;
        for _ in 0..30 {
            stage.drive(0.8, 0.3);
            stage.scan();
        }
        stage.error()
    };
    let ((with, heading), (without, _)) = (drift(true), drift(false));
    assert!(without > 0.08, "{without}");
    assert!(with < 0.02 && heading < 0.004, "{with} {heading}");
}

#[test]
fn a_localiser_of_the_usual_size_maps_as_well() {
    let usual: Box<Localizer> = Box::new(Localizer::new(mapping()));
    assert_eq!(usual.state_landmarks().count(), 0);
}

/// Reflectors that are far enough from one another, and no features.
fn among_reflectors() -> (Stage, Vec<Point>) {
    let mut parameters = mapping();
    parameters.sources = Switches { corners: false, end_points: false, key_scans: false, ..Switches::ALL };
    let places = (0..24).map(|index| Point::new(2.2 * f64::from(index % 6) - 5.0, 2.4 * f64::from(index / 6) - 3.5));
    (without_map(parameters), places.collect())
}

fn see(stage: &mut Stage, places: &[Point]) {
    let seen: Vec<_> = places.iter().map(|place| stage.observe(place)).collect();
    stage.see(&seen);
}

/// Which of these places are in the state.
fn known(stage: &Stage, places: &[Point]) -> Vec<bool> {
    let is_known = |place: &Point| stage.localizer.state_landmarks().any(|(_, known)| (known - place).norm() < 0.05);
    places.iter().map(is_known).collect()
}

#[test]
fn a_landmark_that_is_not_confirmed_goes_after_a_while() {
    let (mut stage, places) = among_reflectors();
    for count in [3, 3, 2] {
        see(&mut stage, &places[..count]);
    }
    assert_eq!(stage.localizer.state_landmarks().count(), 3);
    // Three revolutions it may be hidden; scans tell nothing of reflectors.
    let mut hidden = 1;
    while known(&stage, &places[2..3]) == [true] {
        assert!(hidden <= 5, "it stays");
        stage.drive(0.05, 0.0);
        stage.scan();
        see(&mut stage, &places[..1]);
        hidden += 1;
    }
    assert!(hidden > 3, "it goes after {hidden} revolutions");
    for _ in 0..10 {
        stage.drive(0.05, 0.0);
        see(&mut stage, &places[..1]);
    }
    assert_eq!(known(&stage, &places[..3]), [true, true, false], "those two are confirmed");
}

#[test]
fn a_landmark_that_finds_no_room_takes_the_place_of_the_one_unseen_for_longest() {
    let (mut stage, places) = among_reflectors();
    see(&mut stage, &places);
    see(&mut stage, &places);
    see(&mut stage, &places);
    assert_eq!(known(&stage, &places), [true; 24]);
    let extra = [Point::new(7.2, 4.9), Point::new(7.2, 2.6)];
    let all: Vec<_> = places.iter().chain(&extra).copied().collect();
    see(&mut stage, &all);
    assert_eq!(known(&stage, &extra), [false, false], "all others have been seen in this revolution");
    for unseen in [5, 17] {
        stage.drive(0.1, 0.0);
        stage.scan();
        let others: Vec<_> = places.iter().enumerate().filter(|(place, _)| *place != unseen && *place != 5).collect();
        let others: Vec<_> = others.into_iter().map(|(_, place)| *place).collect();
        see(&mut stage, &others);
    }
    // Both have not been seen, the one for two scans and the other for one.
    see(&mut stage, &extra[..1]);
    let mut expected = [true; 24];
    expected[5] = false;
    assert_eq!((known(&stage, &places), known(&stage, &extra)), (expected.to_vec(), vec![true, false]));
    see(&mut stage, &extra[1..]);
    expected[17] = false;
    assert_eq!((known(&stage, &places), known(&stage, &extra)), (expected.to_vec(), vec![true, true]));
}

#[test]
fn reflectors_are_new_beyond_half_of_the_distance_at_which_they_are_compared() {
    // That is 1.5 m.
    for (distance, count) in [(0.7, 1), (0.8, 2), (1.9, 2)] {
        let (mut stage, _) = among_reflectors();
        let places = [Point::new(2.0, 1.0), Point::new(2.0, 1.0 + distance)];
        see(&mut stage, &places);
        assert_eq!(stage.localizer.state_landmarks().count(), count, "{distance}");
    }
}

#[test]
fn only_what_is_of_its_kind_and_looks_its_way_is_a_landmark() {
    // A reflector in a corner is no corner.
    let mut stage = without_map(mapping());
    stage.scan();
    let found: Vec<_> = stage.localizer.state_landmarks().collect();
    assert!(found.len() > 4 && found.iter().all(|(kind, _)| *kind != LandmarkKind::Reflector));
    see(&mut stage, &[found[0].1]);
    assert_eq!(accepted(&stage, LandmarkSource::Dynamic), 0);
    let is_reflector = |(kind, _): &(LandmarkKind, Point)| *kind == LandmarkKind::Reflector;
    assert_eq!(stage.localizer.state_landmarks().filter(is_reflector).count(), 1);
    // Where no direction is like another, features are never known again, and reflectors are.
    for (tolerance, is_known) in [(0.6, true), (-1.0, false)] {
        let mut parameters = mapping();
        parameters.slam.orientation_tolerance = tolerance;
        let mut stage = without_map(parameters);
        for _ in 0..3 {
            stage.look();
            assert_eq!(accepted(&stage, LandmarkSource::Dynamic) > 0, stage.sample > 0);
            stage.scan();
            assert_eq!(accepted(&stage, LandmarkSource::Dynamic) > 0, is_known && stage.sample > 0, "{tolerance}");
            stage.drive(0.2, 0.0);
        }
    }
}

#[test]
fn features_that_no_map_has_are_no_evidence() {
    let mut stage = without_map(mapping());
    assert_eq!(stage.localizer.add_landmarks(&features()[..6]), Ok(()));
    let mut fixed = 0;
    for _ in 0..20 {
        stage.drive(0.5, 0.3);
        stage.scan();
        fixed += accepted(&stage, LandmarkSource::Fixed);
        assert!(stage.said().acceptance > 0.95, "{}", stage.said().acceptance);
    }
    assert!(fixed > 8, "{fixed}");
}

#[test]
fn a_revolution_from_before_what_was_used_last_is_out_of_time() {
    let mut stage = Stage::told(mapping());
    let first = stage.revolve(0.5, 0.1);
    let second = stage.revolve(0.5, 0.1);
    stage.glimpse(&second);
    assert!(accepted(&stage, LandmarkSource::Fixed) >= 8, "{:?}", stage.localizer.outputs().uses);
    let before = stage.said();
    stage.glimpse(&first);
    let uses = &stage.localizer.outputs().uses;
    assert_eq!(uses.len(), reflectors().len());
    assert!(uses.iter().all(|used| used.verdict == Verdict::OutOfTime), "{uses:?}");
    assert_eq!((stage.said().pose, stage.said().covariance), (before.pose, before.covariance));
}
