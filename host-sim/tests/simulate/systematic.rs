//! Errors of a laser that are the same in each revolution, and data that are older than they state.

use agv_core::geometry::{Point, Pose, difference};
use agv_host_sim::recording::{RecordedEvent, truth_at};
use agv_host_sim::simulate::scenario::{DataAge, Scenario, SystematicErrors};
use agv_host_sim::simulate::{START, simulate};

/// A room with a round reflector and a flat one that is seen aslant; nothing is random.
const ROOM: &str = r#"
seed = 1
[world]
kind = "shapes"
walls = [[-10, -10, 10, -10], [10, -10, 10, 10], [10, 10, -10, 10], [-10, 10, -10, -10]]
reflectors = [
  { x = 5.0, y = 4.0, radius = 0.04, farthest = 30.0 },
  { x = -6.0, y = 3.0, radius = 0.04, farthest = 30.0, facing_deg = 0.0, half_width_deg = 60.0 },
]
[path]
kind = "legs"
legs = [{ direction = "forward", segments = [{ length = 0.5, curvature = 0 }] }]
[drive]
start_standstill = 3.0
[laser]
range_noise = 0.0
bearing_noise_deg = 0.0
[reflectors]
range_noise = 0.0
bearing_noise_deg = 0.0
false_share = 0.0
survey_deviation = 0.0
"#;

fn seen(scenario: &Scenario) -> (Vec<(f64, f64)>, Vec<f32>) {
    let recording = simulate(scenario).unwrap().recording;
    let mut events = recording.events.iter();
    let reflectors = events.find_map(|event| match event {
        RecordedEvent::Reflectors(seen) => {
            Some(seen.observations.iter().map(|one| (f64::from(one.range), f64::from(one.bearing))).collect())
        }
        _ => None,
    });
    let scan = recording.events.iter().find_map(|event| match event {
        RecordedEvent::Scan(scan) => Some(scan.ranges.clone()),
        _ => None,
    });
    (reflectors.unwrap(), scan.unwrap())
}

#[test]
fn what_is_told_is_wrong_by_what_is_stated() {
    let plain = Scenario::parse(ROOM).unwrap();
    let (right, walls) = seen(&plain);
    assert_eq!(right.len(), 2);
    let mut wrong = plain.clone();
    let errors = SystematicErrors {
        range_bias: 0.02,
        range_scale: 0.001,
        incidence: 0.1,
        first_harmonic_deg: 0.3,
        first_phase_deg: 40.0,
        second_harmonic_deg: 0.1,
        second_phase_deg: -20.0,
    };
    wrong.laser.systematic = errors;
    let (told, told_walls) = seen(&wrong);
    let laser = Pose::new(0.9, 0.0, 0.0);
    for place in [Point::new(5.0, 4.0), Point::new(-6.0, 3.0)] {
        let offset = place - laser.position();
        let (range, bearing) = (offset.norm(), offset.y.atan2(offset.x));
        let near = |told: &[(f64, f64)]| *told.iter().find(|one| difference(one.1, bearing).abs() < 0.1).unwrap();
        assert!((near(&right).0 - range).abs() < 1e-5 && difference(near(&right).1, bearing).abs() < 1e-5);
        // The flat one faces along x: the cosine is that of the direction from it to the laser.
        let cosine = if place.x < 0.0 { -offset.x / range } else { 1.0 };
        let expected_range = range * 1.001 + 0.02 + 0.1 * (1.0 - cosine);
        let angle = |degrees: f64| bearing - degrees.to_radians();
        let expected_bearing =
            bearing + 0.3_f64.to_radians() * angle(40.0).sin() + 0.1_f64.to_radians() * (2.0 * angle(-20.0)).sin();
        let (told_range, told_bearing) = near(&told);
        assert!((told_range - expected_range).abs() < 1e-5, "{told_range} {expected_range}");
        assert!(difference(told_bearing, expected_bearing).abs() < 1e-5, "{told_bearing} {expected_bearing}");
    }
    // A beam that is told at 0 deg, straight ahead at a wall 9.1 m away.
    let ahead = walls.len() / 2;
    let true_bearing = -errors.bearing(0.0);
    let expected = 9.1 / true_bearing.cos() * 1.001 + 0.02;
    assert!((f64::from(walls[ahead]) - 9.1).abs() < 1e-5);
    assert!((f64::from(told_walls[ahead]) - expected).abs() < 1e-5, "{} {expected}", told_walls[ahead]);
}

/// Errors of the survey that near reflectors share: two of them side by side differ by less than two far apart, over many seeds.
#[test]
fn near_reflectors_share_errors_of_the_survey() {
    let mut scenario = Scenario::parse(ROOM).unwrap();
    scenario.laser.scans = false;
    scenario.reflectors.correlated_survey = 0.01;
    scenario.reflectors.survey_length = 5.0;
    let near = ROOM.replace("x = -6.0, y = 3.0", "x = 5.5, y = 4.0");
    assert_ne!(near, ROOM);
    let difference_of = |text: &str| {
        let mut sum = 0.0;
        for seed in 1..=200 {
            let mut one = Scenario::parse(text).unwrap();
            (one.seed, one.laser.scans) = (seed, false);
            one.reflectors.clone_from(&scenario.reflectors);
            let simulated = simulate(&one).unwrap();
            let error = |index: usize| {
                let (landmark, body) = (&simulated.recording.landmarks[index], &simulated.world.reflectors[index].body);
                Point::new(landmark.x, landmark.y) - body.centre
            };
            sum += (error(0) - error(1)).norm_squared() / 200.0;
        }
        sum
    };
    // Twice the variance less the covariance, along two axes; a quarter is 3.5 deviations of a mean of so many.
    for (text, distance) in [(ROOM, 11.045_f64), (&near, 0.5)] {
        let expected = 4.0 * 1e-4 * (1.0 - (-0.5 * (distance / 5.0).powi(2)).exp());
        let found = difference_of(text);
        assert!((found / expected - 1.0).abs() < 0.25, "{found} {expected}");
    }
}

/// What is told for a time was seen from where the laser was so much before.
#[test]
fn data_that_are_older_show_where_the_laser_was() {
    let mut scenario = Scenario::parse(&ROOM.replace("length = 0.5", "length = 6.0")).unwrap();
    scenario.laser.scans = false;
    let place = Point::new(5.0, 4.0);
    for (lasts, from) in [(0.0, 0.0), (4.0, 5.0)] {
        scenario.laser.ages = vec![DataAge { from, lasts, seconds: 0.08 }];
        let recording = simulate(&scenario).unwrap().recording;
        let mut most_moved = 0.0_f64;
        for event in &recording.events {
            let RecordedEvent::Reflectors(seen) = event else { continue };
            for one in &seen.observations {
                let stated = one.time.since(START);
                let age = 0.08 * ((stated - from) / f64::max(lasts, 1e-12)).clamp(0.0, 1.0);
                let [then, now] = [age, 0.0].map(|age| truth_at(&recording.truth, one.time.offset(-age)));
                let (Some(then), Some(now)) = (then, now) else { continue };
                let seen_from = |vehicle: &Pose| vehicle.compose(&Pose::new(0.9, 0.0, 0.0)).inverse().transform(&place);
                let (expected, without) = (seen_from(&then), seen_from(&now));
                let found = Point::new(one.bearing.cos().into(), one.bearing.sin().into()) * f64::from(one.range);
                if (found - expected).norm() > 0.5 {
                    // The other reflector.
                    continue;
                }
                assert!((found - expected).norm() < 1e-3, "{stated} s: {found} {expected}");
                most_moved = most_moved.max((expected - without).norm());
            }
        }
        assert!((most_moved - 0.08 * 0.8).abs() < 3e-3, "{most_moved}");
    }
}
