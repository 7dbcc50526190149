//! All tests of this crate from outside, in one program: it is linked once.

mod alert_limits;
mod calibration;
mod contour_source;
mod contour_start;
mod contours;
mod contours_behind;
mod counters;
mod covariance_repair;
mod event;
mod examples;
mod falko;
mod filter;
mod geometry;
mod given_pose;
mod gyro;
mod innovation_monitor;
mod integrity;
mod jump_check;
mod key_scans;
mod landmark_observation;
mod landmark_use;
mod landmarks;
mod laser_odometry;
mod localizer;
mod mapping;
mod misuse;
mod modes;
mod motion;
mod mounting_check;
mod moving_laser;
mod odometry;
mod order;
mod output_predictor;
mod overflow;
mod parameters;
mod pose_output;
mod prediction;
mod public_items;
mod record;
mod redundancy_check;
mod reflector_detection;
mod reflector_search;
mod second_laser;
mod separation;
mod slam;
mod slip_check;
mod slot_life;
mod sources;
mod start_confirmation;
mod start_finder;
mod start_search;
mod start_watch;
mod state_slots;
mod support;
mod surface_check;
mod surroundings;
mod timeline;
mod traction_check;
mod tricycle_speed;
mod turn_check;
mod uncertain_motion;
mod wheel_vehicle;
mod wheels;
mod whole_drives;

/// A file that is no module of this program would be no test, and nobody would notice.
#[test]
fn every_file_beside_this_one_is_a_module_of_it() {
    let entries = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/tests")).expect("this folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let sources = paths.filter(|path| path.is_dir() || path.extension().is_some_and(|extension| extension == "rs"));
    let names = sources.filter_map(|path| Some(path.file_stem()?.to_str()?.to_owned()));
    let mut files: Vec<_> = names.filter(|name| name != "all").collect();
    files.sort_unstable();
    let declarations = include_str!("all.rs").lines().filter_map(|line| line.strip_prefix("mod ")?.strip_suffix(';'));
    assert_eq!(files, declarations.collect::<Vec<_>>());
}
