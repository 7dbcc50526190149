//! The experiments, held to what they must show.

use std::path::Path;

use agv_core::geometry::{Point, Pose};
use agv_core::localizer::{MapUse, Mode, PoseOutput};
use agv_host_sim::recording::truth_at;
use agv_host_sim::replay::replay;
use agv_host_sim::simulate::path::{Direction, Leg, PathSegment};
use agv_host_sim::simulate::scenario::{PathKind, PathOptions, PoseOptions, Scenario};
use agv_host_sim::simulate::simulate;
use agv_lab::equipment::Equipment;
use agv_lab::evaluate::carpark::{self, Knowledge, Noise};
use agv_lab::evaluate::slam::OfficeDrive;
use agv_lab::evaluate::warehouse::{Map, Method, PATHS, experiment};
use agv_lab::evaluate::warehouse_disturbance::Disturbance;
use agv_lab::evaluate::windows::{Candidate, Worsening, drift, vehicle_drift};
use agv_tests::recordings;

#[test]
fn the_car_park_is_localised_to_seven_centimetres() {
    let Some(folder) = recordings("the_car_park_is_localised_to_seven_centimetres", "carpark") else { return };
    let (outcome, recording, replay) = carpark::run(&folder, Noise::Nominal, Knowledge::Map).unwrap();
    println!("{outcome:?}");
    assert!(outcome.rmse_m <= 0.070, "{} m", outcome.rmse_m);
    assert!(outcome.max_m < 0.4 && outcome.heading_rmse_deg < 0.5);
    assert_eq!((outcome.lost_at_s, outcome.wrong_at_s), (None, None));
    // A second account of the error, from poses and receiver alone: at each reference the pose nearest in time, which at
    // 40 samples a second and 2 m/s is up to 3 cm old.
    let laser = *recording.parameters.lasers.first();
    let squares = recording.references.iter().skip(1).map(|reference| {
        let nearest = replay
            .poses
            .iter()
            .min_by_key(|pose| pose.time.micros().abs_diff(reference.time.micros()))
            .map_or(Pose::default(), |pose| pose.pose);
        (nearest.transform(&Point::new(laser.x, laser.y)) - reference.position()).norm_squared()
    });
    let count = recording.references.len() as f64 - 1.0;
    let rmse = (squares.sum::<f64>() / count).sqrt();
    assert!((rmse - outcome.rmse_m).abs() < 0.01, "{rmse} m and {} m", outcome.rmse_m);
}

#[test]
fn a_localiser_too_sure_of_itself_says_that_it_is_lost() {
    let Some(folder) = recordings("a_localiser_too_sure_of_itself_says_that_it_is_lost", "carpark") else { return };
    let (outcome, _, _) = carpark::run(&folder, Noise::Tight, Knowledge::Map).unwrap();
    println!("{outcome:?}");
    if let Some(wrong) = outcome.wrong_at_s {
        let lost = outcome.lost_at_s.expect("it was wrong and did not say so");
        assert!(lost <= wrong + 2.0, "wrong at {wrong} s, said so at {lost} s");
    }
}

#[test]
fn the_car_park_is_mapped_with_contours_and_without() {
    let Some(folder) = recordings("the_car_park_is_mapped_with_contours_and_without", "carpark") else { return };
    for (knowledge, most, most_elsewhere) in [(Knowledge::Slam, 0.20, 0), (Knowledge::SlamAndContours, 0.15, 0)] {
        let (outcome, _, _) = carpark::run(&folder, Noise::Nominal, knowledge).unwrap();
        println!("{knowledge:?}: {outcome:?}");
        assert!(outcome.rmse_m < most, "{knowledge:?}: {outcome:?}");
        assert_eq!(outcome.lost_at_s, None, "{knowledge:?}");
        assert!(outcome.map_error_m.is_some_and(|error| error < 0.4), "{knowledge:?}: {outcome:?}");
        assert!(outcome.landmarks_elsewhere <= most_elsewhere, "{knowledge:?}: {outcome:?}");
    }
}

/// Worst of four paths at the 95 % mark: mm and degrees.
fn worst(name: &str, runs: u64) -> (f64, f64, f64) {
    let method = Method::ALL.iter().find(|method| method.name == name).unwrap();
    let mut worst = (0.0_f64, 0.0_f64, 1.0_f64);
    for path in PATHS {
        let outcome = experiment(path, method, (Disturbance::None, Equipment::default()), 1..1 + runs, || ()).unwrap();
        println!("{outcome:?}");
        worst =
            (worst.0.max(outcome.position_mm.p95), worst.1.max(outcome.heading_deg.p95), worst.2.min(outcome.ok_share));
        let has_map = !matches!(method.map, Map::Odometry | Map::Dynamic);
        assert!(!has_map || (1.0..6.0).contains(&outcome.nees), "{}: NEES {}", outcome.name, outcome.nees);
    }
    worst
}

#[test]
fn a_static_map_holds_five_millimetres() {
    let (position, heading, ok) = worst("static", 10);
    assert!(position <= 5.0 && heading <= 0.1 && ok >= 1.0, "{position} mm, {heading} deg");
}

#[test]
fn contours_of_the_way_behind_bring_the_vehicle_twelve_metres_within_the_requirement() {
    let (position, heading, ok) = worst("slam", 6);
    assert!(position <= 20.0 && heading <= 0.1 && ok >= 0.8, "{position} mm, {heading} deg, {ok}");
}

#[test]
fn features_found_on_the_way_do_so_where_there_is_no_room_for_contours() {
    let (position, heading, ok) = worst("slam with features and key scans", 6);
    assert!(position <= 20.0 && heading <= 0.1 && ok >= 0.8, "{position} mm, {heading} deg, {ok}");
}

#[test]
fn it_goes_into_the_storage_and_out_again_without_a_jump() {
    let scenario = |name: &str| Scenario::read(Path::new(env!("CARGO_MANIFEST_DIR")).join(name).as_path()).unwrap();
    // 4 m of aisle with reflectors, 8 m of lane without any, and back.
    let mut there_and_back = scenario("../host-sim/scenarios/block_storage_p1.toml");
    let way_in = simulate(&there_and_back).unwrap().recording.truth;
    let (start, end) = (way_in[0].pose, way_in[way_in.len() - 1].pose);
    let ahead = start.between(&end).x;
    let directions = [Direction::Forward, Direction::Backward];
    let [there, back] = if ahead > 0.0 { directions } else { [directions[1], directions[0]] };
    let leg = |direction| Leg { direction, segments: vec![PathSegment::straight(ahead.abs())] };
    let start = PoseOptions { x: start.x, y: start.y, heading_deg: start.theta.to_degrees() };
    there_and_back.path = PathOptions { kind: PathKind::Legs, start, legs: vec![leg(there), leg(back)] };
    let mut recording = simulate(&there_and_back).unwrap().recording;
    recording.parameters.maps = MapUse { reflectors: true, features: false, dynamic: false, slam: true };
    let poses = replay(&recording, |_| ()).unwrap().poses;
    let settled = poses.iter().skip_while(|pose| !pose.is_good());
    let (mut modes, mut largest, mut worst) = (Vec::new(), 0.0_f64, 0.0_f64);
    for pose in settled {
        largest = largest.max(pose.correction);
        let truth = truth_at(&recording.truth, pose.time).unwrap();
        worst = worst.max((pose.pose.x - truth.x).hypot(pose.pose.y - truth.y));
        if modes.last() != Some(&pose.mode) {
            modes.push(pose.mode);
        }
    }
    println!("{modes:?}, corrected by {largest:.4} m at most, {worst:.4} m off at most");
    assert!(modes.ends_with(&[Mode::Mixed, Mode::Features, Mode::Mixed]), "{modes:?}");
    assert!(largest < PoseOutput::NOTABLE_CORRECTION && worst < 0.02, "{largest} m, {worst} m");
}

#[test]
fn moved_pallets_are_no_reason_to_be_five_centimetres_off() {
    let method = Method::ALL.iter().find(|method| method.name == "static and slam").unwrap();
    for path in PATHS {
        let outcome = experiment(path, method, (Disturbance::MovedPallets, Equipment::default()), 1..5, || ()).unwrap();
        println!("{outcome:?}");
        assert!(outcome.position_mm.max < 10.0 && outcome.heading_deg.max < 0.05, "{outcome:?}");
    }
}

#[test]
fn scans_alone_bring_robots_further_than_their_odometry_in_offices_that_were_not_tuned_on() {
    let test = "scans_alone_bring_robots_further_than_their_odometry_in_offices_that_were_not_tuned_on";
    for (log, share, by_contours) in [("aces", 0.8, 0.25), ("fhw", 0.5, 0.2)] {
        let Some(log) = recordings(test, &format!("scans2d/{log}-corrected.log.gz")) else { return };
        let drive = OfficeDrive::of_carmen(&log).unwrap();
        let drift = |name: &str| {
            let candidate = Candidate::ALL.iter().find(|candidate| candidate.name == name).unwrap();
            drift(&drive, 12.0, candidate, &Worsening::ALL[0]).unwrap()
        };
        let (odometry, slam) = (drift("odometry"), drift("slam with features and key scans"));
        let vehicle = vehicle_drift(&drive, 12.0, &Worsening::ALL[0]).unwrap();
        println!("{odometry:?}\n{slam:?}\n{vehicle:?}");
        assert!(slam.windows > 40 && slam.lost_share < 0.05);
        assert!(slam.position_m.median < share * odometry.position_m.median);
        // With contours of the way behind.
        assert!(vehicle.windows == slam.windows && vehicle.lost_share == 0.0);
        assert!(vehicle.position_m.median < by_contours * odometry.position_m.median);
    }
}

#[test]
fn reflectors_hold_five_millimetres_and_a_twentieth_of_a_degree() {
    let (position, heading, ok) = worst("reflectors", 10);
    assert!(position <= 5.0 && heading <= 0.05 && ok >= 1.0, "{position} mm, {heading} deg");
}

#[test]
fn reflectors_and_features_together_hold_it_too() {
    let (position, heading, ok) = worst("mixed", 10);
    assert!(position <= 5.0 && heading <= 0.05 && ok >= 1.0, "{position} mm, {heading} deg");
}

#[test]
fn a_dynamic_map_is_better_than_odometry_and_not_good_enough() {
    // The thesis's own open end: if this passes the requirement, the experiment has become too easy.
    let (odometry, _, _) = worst("odometry", 10);
    let (position, _, ok) = worst("dynamic", 10);
    assert!(position < 0.5 * odometry, "{position} mm and {odometry} mm");
    assert!(ok < 0.95);
}
