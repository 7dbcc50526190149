//! The experiments, held to what they must show.

use std::path::PathBuf;

use agv_core::geometry::{Point, Pose};
use agv_host_sim::data;
use agv_host_sim::evaluate::carpark::{self, Noise};
use agv_host_sim::evaluate::warehouse::{Map, Method, PATHS, experiment};
use agv_host_sim::evaluate::warehouse_disturbance::Disturbance;

fn carpark_folder(test: &str) -> Option<PathBuf> {
    let folder = data::folder();
    if folder.is_none() {
        eprintln!("{test}: skipped, no folder of recordings (AGV_DATA)");
    }
    folder.map(|folder| folder.join("carpark"))
}

#[test]
fn the_car_park_is_localised_to_seven_centimetres() {
    let Some(folder) = carpark_folder("the_car_park_is_localised_to_seven_centimetres") else { return };
    let (outcome, recording, replay) = carpark::run(&folder, Noise::Nominal).unwrap();
    println!("{outcome:?}");
    assert!(outcome.rmse_m <= 0.070, "{} m", outcome.rmse_m);
    assert!(outcome.max_m < 0.4 && outcome.heading_rmse_deg < 0.5);
    assert_eq!((outcome.lost_at_s, outcome.wrong_at_s), (None, None));
    // A second account of the error, from poses and receiver alone: at each reference the pose nearest in time, which at
    // 40 samples a second and 2 m/s is up to 3 cm old.
    let laser = recording.parameters.laser;
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
    let Some(folder) = carpark_folder("a_localiser_too_sure_of_itself_says_that_it_is_lost") else { return };
    let (outcome, _, _) = carpark::run(&folder, Noise::Tight).unwrap();
    println!("{outcome:?}");
    if let Some(wrong) = outcome.wrong_at_s {
        let lost = outcome.lost_at_s.expect("it was wrong and did not say so");
        assert!(lost <= wrong + 2.0, "wrong at {wrong} s, said so at {lost} s");
    }
}

/// Worst of four paths at the 95 % mark: mm and degrees.
fn worst(name: &str, runs: u64) -> (f64, f64, f64) {
    let method = Method::ALL.iter().find(|method| method.name == name).unwrap();
    let mut worst = (0.0_f64, 0.0_f64, 1.0_f64);
    for path in PATHS {
        let outcome = experiment(path, method, Disturbance::None, 1..1 + runs, || ()).unwrap();
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
fn features_found_on_the_way_bring_the_vehicle_twelve_metres_within_the_requirement() {
    let (position, heading, ok) = worst("slam", 6);
    assert!(position <= 20.0 && heading <= 0.1 && ok >= 0.8, "{position} mm, {heading} deg, {ok}");
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
