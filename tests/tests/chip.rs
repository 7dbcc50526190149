//! The images that are flashed, each in its emulated chip: `tests/chip` judges, this asks it.

use std::path::Path;
use std::process::{Command, Output};

use agv_host_sim::contour_map::ContourMap;
use agv_host_sim::emulate::vehicle::{InChip, InChipOptions, drive_in_chip, errors};
use agv_host_sim::mapping::contour_mapper::{CELL, map_contours_at};
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;
use agv_host_sim::{log, replay};
use agv_tests::{image, python, repository, skip};
use serde_json::Value;

/// Fewer checks than this were not all.
const LEAST: usize = 20;

/// What is asked of the smaller board in the short form: what its single bank of flash, its clocks and its memory change.
const OF_ONE_BANK: [&str; 4] =
    ["boots", "has_the_clocks_of_the_manual", "says_before_it_stands_still", "writes_after_an_error"];

fn chip(arguments: &[&str]) -> Command {
    let mut chip = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    chip.args(["xtask", "chip"]).args(arguments).current_dir(repository(""));
    chip
}

/// Whether there are the image and what emulates its chip. A word about what is missing.
fn is_there(test: &str, board: &str) -> bool {
    if image(test, board, "vehicle").is_none() || python(test, "unicorn, elftools").is_none() {
        return false;
    }
    let has_compiler = Command::new("cc").arg("--version").output().is_ok_and(|run| run.status.success());
    if !has_compiler {
        skip(test, "there is no compiler for C (Debian package gcc)");
    }
    has_compiler
}

/// Asks for checks of a board, all if none is named, and fails if one has failed or fewer have answered.
fn check(test: &str, board: &str, checks: &[&str]) {
    if !is_there(test, board) {
        return;
    }
    let is_long = std::env::var_os("AGV_LONG").is_some();
    let mut arguments = vec!["--board", board];
    arguments.extend(if is_long { &["--long"][..] } else { checks });
    let output: Output = chip(&arguments).output().unwrap();
    let printed = String::from_utf8(output.stdout).unwrap();
    let answers: Vec<Value> = printed.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let least = if is_long || checks.is_empty() { LEAST } else { checks.len() };
    assert!(answers.len() >= least, "{} checks:\n{}", answers.len(), String::from_utf8_lossy(&output.stderr));
    let failed: Vec<&Value> = answers.iter().filter(|answer| answer["passed"] != true).collect();
    assert!(failed.is_empty(), "{failed:#?}");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn the_flashed_image_lives_in_the_emulated_chip() {
    check("the_flashed_image_lives_in_the_emulated_chip", "h743", &[]);
}

#[test]
fn the_image_of_the_smaller_board_lives_in_its_chip() {
    check("the_image_of_the_smaller_board_lives_in_its_chip", "h723", &OF_ONE_BANK);
}

/// The hall in virtual time, in maps of reflectors or of contours, with so many frames of other nodes a second: poses as on the emulated
/// board, no fault of an encoder, a log that replays to the same bits.
fn drives_through_the_hall(test: &str, board: &str, seconds: f64, by_contours: bool, foreign_rate: f64) {
    if !is_there(test, board) {
        return;
    }
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host-sim/scenarios/warehouse_hall.toml");
    let mut recording = simulate(&Scenario::read(&scenario).unwrap()).unwrap().recording;
    let map = by_contours.then(|| map_contours_at(&recording, &recording.truth, CELL));
    if by_contours {
        recording.landmarks.clear();
    }
    // Among contours it finds out where it is.
    let options = InChipOptions { contours: map.as_ref(), is_not_told: by_contours, foreign_rate };
    let folder = tempfile::tempdir().unwrap();
    let InChip { driven, stack } =
        drive_in_chip(&recording, chip(&["--board", board, "--serve"]), folder.path(), seconds, options).unwrap();
    let errors = errors(&driven, &recording).unwrap();
    println!("{errors:?}, {stack} bytes of stack");
    assert!(errors.poses as f64 >= 99.0 * seconds && errors.localised_share > 0.99, "{errors:?}");
    assert!(errors.position_max_m < 0.02 && errors.heading_max_deg < 0.1, "{errors:?}");
    assert!(errors.longest_gap_s < 0.015, "{errors:?}");
    let healths = driven.poses.iter().filter(|heard| heard.heard > driven.begin).map(|heard| heard.pose.health);
    let faults: Vec<_> = healths.flat_map(|health| [health.drive, health.steering]).flatten().collect();
    assert!(faults.is_empty(), "{faults:?}");
    let contents = log::read_contents(&driven.log, |_| ()).unwrap();
    // Poses are published before anybody listens to the log.
    assert!(driven.stream.damages <= 1, "{:?}", driven.stream);
    let again = replay::replay_in(&contents.recording, map.as_ref().map(ContourMap::view), |_| ()).unwrap();
    let outputs = replay::compare(&contents.outputs, &again);
    assert_eq!(outputs.first_difference, None);
    assert!(outputs.compared as f64 > 100.0 * seconds, "{}", outputs.compared);
    let published = replay::compare_published(&contents.recording, &contents.publishing, &again);
    assert_eq!(published.first_difference, None);
    assert!(published.compared as f64 >= 99.0 * seconds, "{} poses were published", published.compared);
}

/// Among frames of other nodes, three times as many a second as the emulated line of the AN500 is given.
#[test]
fn the_flashed_image_drives_through_the_hall() {
    drives_through_the_hall("the_flashed_image_drives_through_the_hall", "h743", 10.0, false, 1500.0);
}

#[test]
fn the_flashed_image_drives_through_the_hall_by_contours() {
    drives_through_the_hall("the_flashed_image_drives_through_the_hall_by_contours", "h743", 5.0, true, 0.0);
}

#[test]
fn the_image_of_the_smaller_board_drives_through_the_hall() {
    drives_through_the_hall("the_image_of_the_smaller_board_drives_through_the_hall", "h723", 3.0, false, 0.0);
}
