//! What is told of each observation, worked out by hand from the pose before it and its covariance.

use agv_core::geometry::{Point, Pose};
use agv_core::localizer::LandmarkSource;
use agv_core::maps::{Landmark, LandmarkKind, Verdict};
use agv_core::measurement::ReflectorObservation;
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2};

use super::support::stage::{LASER, Stage, features, parameters, reflectors};

const POSITION: f64 = 0.01;
const HEADING: f64 = 0.002;

/// Distance and direction of a landmark from the laser.
fn expected(pose: &Pose, landmark: &Landmark) -> Vector2<f64> {
    let seen = pose.compose(&LASER).inverse_transform(&landmark.position());
    Vector2::new(seen.norm(), seen.y.atan2(seen.x))
}

fn told() -> Stage {
    let mut stage = Stage::new(parameters());
    stage.tell(stage.truth, POSITION, HEADING);
    stage
}

#[test]
fn the_residual_and_what_it_is_held_against_are_said() {
    for landmark in reflectors() {
        let mut stage = told();
        let pose = stage.truth;
        let there = expected(&pose, &landmark);
        let seen = ReflectorObservation {
            time: stage.time(),
            range: (there.x + 0.013) as f32,
            bearing: (there.y - 0.0008) as f32,
        };
        let outputs = stage.see(&[seen]).clone();
        assert_eq!(outputs.uses.len(), 1);
        let used = outputs.uses[0];
        assert_eq!((used.kind, used.verdict, used.time), (LandmarkKind::Reflector, Verdict::Accepted, seen.time));
        assert_eq!(used.landmark, Some((LandmarkSource::Fixed, landmark.id)));
        let (range, bearing) = (f64::from(seen.range), f64::from(seen.bearing));
        let residual = Vector2::new(range - there.x, bearing - there.y);
        assert!((Vector2::from(used.residual) - residual).norm() < 1e-9);
        let position = Point::new(range * bearing.cos(), range * bearing.sin());
        assert!((Point::new(used.position[0].into(), used.position[1].into()) - position).norm() < 1e-6);
        let located = pose.compose(&LASER).transform(&position);
        assert!((Point::from(used.located) - located).norm() < 1e-9);
        // H by finite differences; the map's own error counts twenty times, as many observations share it.
        let step = 1e-6;
        let moved = |x, y, theta| expected(&Pose::new(pose.x + x, pose.y + y, pose.theta + theta), &landmark);
        let slope = |x: f64, y: f64, theta: f64| (moved(x, y, theta) - moved(-x, -y, -theta)) / (2.0 * step);
        let jacobian = Matrix2x3::from_columns(&[slope(step, 0.0, 0.0), slope(0.0, step, 0.0), slope(0.0, 0.0, step)]);
        let prior = Matrix3::from_diagonal(&[POSITION.powi(2), POSITION.powi(2), HEADING.powi(2)].into());
        let map = 20.0 * f64::from(landmark.deviation).powi(2);
        let noise = Matrix2::from_diagonal(&[0.01_f64.powi(2) + map, 1e-6 + map / there.x.powi(2)].into());
        let covariance = jacobian * prior * jacobian.transpose() + noise;
        let deviation = Vector2::new(covariance.m11.sqrt(), covariance.m22.sqrt());
        assert!((Vector2::from(used.residual_deviation) - deviation).norm() < 1e-6 * deviation.norm());
        let square = covariance.try_inverse().map_or(f64::NAN, |inverse| (residual.transpose() * inverse * residual).x);
        assert!((used.test_ratio - square / 11.83).abs() < 1e-6, "{} {square}", used.test_ratio);
        assert!((outputs.pose.normalised_square - square).abs() < 1e-6);
        assert_eq!(outputs.pose.acceptance, 1.0);
    }
}

#[test]
fn what_fits_no_landmark_is_told_as_such() {
    let mut stage = told();
    let reflectors = reflectors();
    let view = |stage: &Stage, place: Point| stage.observe(&place);
    // Inside the radius and outside the gate; outside the radius; between two.
    let near = view(&stage, reflectors[6].position() + Point::new(-1.0, 0.3));
    let far = view(&stage, Point::new(0.0, 0.5));
    let used = stage.see(&[near, far]).clone();
    assert_eq!(used.uses[0].verdict, Verdict::Gated);
    assert_eq!(used.uses[0].landmark, Some((LandmarkSource::Fixed, 6)));
    assert!(used.uses[0].test_ratio > 1.0);
    assert_eq!((used.uses[1].verdict, used.uses[1].landmark), (Verdict::Unknown, None));
    assert_eq!(
        (used.uses[1].residual, used.uses[1].residual_deviation, used.uses[1].test_ratio),
        ([0.0; 2], [0.0; 2], 0.0)
    );
    assert_eq!(used.pose.acceptance, 0.0);
    // What is too old or too far ahead is told, and says nothing of the pose.
    let mut stage = told();
    let seen = stage.observe(&reflectors[3].position());
    for seconds in [-0.5, 0.5] {
        let outputs = stage.see(&[ReflectorObservation { time: seen.time.offset(seconds), ..seen }]).clone();
        assert_eq!(outputs.uses[0].verdict, Verdict::OutOfTime);
        assert_eq!(outputs.pose.acceptance, 1.0);
    }
    // Nor does one that is no number.
    for (range, bearing) in [(f32::NAN, 0.0), (1.0, f32::INFINITY)] {
        assert!(stage.see(&[ReflectorObservation { range, bearing, ..seen }]).uses.is_empty());
    }
}

#[test]
fn two_landmarks_that_fit_alike_decide_nothing() {
    let mut stage = told();
    let twin = Landmark::reflector(40, reflectors()[4].position() + Point::new(0.005, 0.0), 0.002);
    assert_eq!(stage.localizer.add_landmarks(&[twin]), Ok(()));
    let seen = stage.observe(&twin.position());
    let before = stage.said();
    let outputs = stage.see(&[seen]).clone();
    assert_eq!(outputs.uses[0].verdict, Verdict::Ambiguous);
    assert_eq!((outputs.pose.acceptance, outputs.pose.pose), (1.0, before.pose), "that is no evidence");
}

#[test]
fn maps_that_are_not_wanted_are_not_used() {
    let verdicts = |change: fn(&mut agv_core::localizer::MapUse)| {
        let mut parameters = parameters();
        change(&mut parameters.maps);
        let mut stage = Stage::new(parameters);
        stage.tell(stage.truth, POSITION, HEADING);
        stage.look();
        let reflectors = stage.localizer.outputs().uses.iter().filter(|used| used.verdict == Verdict::Accepted).count();
        stage.scan();
        let uses = &stage.localizer.outputs().uses;
        let of = |source| {
            let is_from = |used: &&agv_core::localizer::LandmarkUse| used.landmark.is_some_and(|(of, _)| of == source);
            uses.iter().filter(|used| used.verdict == Verdict::Accepted).filter(is_from).count()
        };
        let (fixed, seen) = (of(LandmarkSource::Fixed), uses.len());
        stage.scan();
        let uses = &stage.localizer.outputs().uses;
        let dynamic = uses.iter().filter(|used| matches!(used.landmark, Some((LandmarkSource::Dynamic, _)))).count();
        (reflectors > 9, fixed > 4, seen > 4, dynamic > 4)
    };
    assert_eq!(verdicts(|_| {}), (true, true, true, false));
    assert_eq!(verdicts(|maps| maps.reflectors = false), (false, true, true, false));
    assert_eq!(verdicts(|maps| maps.features = false), (true, false, false, false));
    assert_eq!(verdicts(|maps| (maps.features, maps.dynamic) = (false, true)), (true, false, true, true));
    // What is in the map is not found anew.
    assert_eq!(verdicts(|maps| maps.dynamic = true), (true, true, true, false));
    assert_eq!(verdicts(|maps| maps.slam = true), (true, true, true, false));
    assert_eq!(verdicts(|maps| (maps.features, maps.slam) = (false, true)), (true, false, true, true));
    assert_eq!(verdicts(|maps| (maps.reflectors, maps.slam) = (false, true)), (false, true, true, false));
}

#[test]
fn a_doubt_of_features_is_added_to_what_the_detector_states() {
    let variances = |added| {
        let mut parameters = parameters();
        parameters.features.added_deviation = added;
        let mut stage = Stage::new(parameters);
        stage.tell(stage.truth, POSITION, HEADING);
        stage.scan();
        let used = stage.localizer.outputs().uses.iter().find(|used| used.landmark.is_some());
        used.map_or([f64::NAN; 2], |used| used.residual_deviation.map(|deviation| deviation * deviation))
    };
    let without = variances(0.0);
    for added in [0.01, 0.1] {
        for (with, without) in variances(added).into_iter().zip(without) {
            assert!((with - without - added * added).abs() < 1e-9, "{with} {without}");
        }
    }
}

#[test]
fn features_found_while_driving_are_where_they_are_seen() {
    let mut parameters = parameters();
    (parameters.maps.features, parameters.maps.dynamic) = (false, true);
    let mut stage = Stage::told(parameters);
    stage.look();
    for _ in 0..6 {
        stage.drive(0.5, 0.0);
        stage.scan();
    }
    let found = stage.localizer.dynamic_landmarks();
    let corners = features();
    let is_near = |place: &Point| corners.iter().any(|corner| (corner.position() - place).norm() < 0.05);
    let right = found.iter().filter(|landmark| is_near(&landmark.position)).count();
    assert!(right >= 8 && 10 * right >= 9 * found.len(), "{right} of {}", found.len());
    assert!(found.iter().filter(|landmark| landmark.hits >= 3).count() >= 8);
    let (position, heading) = stage.error();
    assert!(position < 0.01 && heading < 0.002, "{position} {heading}");
    stage.tell(stage.truth, 0.01, 0.01);
    assert!(stage.localizer.dynamic_landmarks().is_empty(), "a new pose needs new landmarks");
}

/// A map that is surveyed while the vehicle drives replaces what the vehicle has found itself: the surveyed places are surer.
#[test]
fn a_feature_that_was_given_is_used_where_one_was_found_on_the_way() {
    let mut parameters = parameters();
    parameters.maps.dynamic = true;
    let mut stage = Stage::new(parameters);
    assert_eq!(stage.localizer.replace_landmarks(&reflectors()), Ok(()));
    stage.tell(stage.truth, POSITION, HEADING);
    stage.look();
    let sources = |stage: &mut Stage| {
        stage.scan();
        let uses = stage.localizer.outputs().uses.iter().filter(|used| used.verdict == Verdict::Accepted);
        let is_at_corner = |used: &&agv_core::localizer::LandmarkUse| {
            features().iter().any(|corner| (corner.position() - Point::from(used.located)).norm() < 0.1)
        };
        uses.filter(is_at_corner).filter_map(|used| Some(used.landmark?.0)).collect::<Vec<_>>()
    };
    for _ in 0..3 {
        sources(&mut stage);
    }
    let found = sources(&mut stage);
    assert!(found.len() > 4 && found.iter().all(|source| *source == LandmarkSource::Dynamic), "{found:?}");
    assert_eq!(stage.localizer.replace_landmarks(&[reflectors(), features()].concat()), Ok(()));
    let given = sources(&mut stage);
    assert!(given.len() > 4 && given.iter().all(|source| *source == LandmarkSource::Fixed), "{given:?}");
}
