//! The firmware's images in emulation: the same bits as here, at a cost that is counted.
//!
//! The images are those of `cargo xtask firmware build`, which `cargo xtask test` runs first.

#[path = "../../core/tests/support/reference_drive.rs"]
mod reference_drive;

use std::path::{Path, PathBuf};
use std::process::Command;

use agv_host_sim::mapping::contour_mapper::{CELL, map_contours_at};
use agv_host_sim::{log, replay};
use agv_lab::evaluate::demonstration;
use agv_settings::VehicleKind;
use agv_tests::{emulator, image};

/// The folder of the images of the emulated board. None, and a word about it, if one is missing or there is no emulator.
fn images(test: &str) -> Option<PathBuf> {
    if !emulator(test) {
        return None;
    }
    let names = ["calibrate", "replay", "measure", "latency", "restart"];
    let images: Option<Vec<PathBuf>> = names.into_iter().map(|name| image(test, "an500", name)).collect();
    Some(images?.first()?.parent()?.to_owned())
}

/// Runs an image in `folder`, with the files there.
fn run(image: &Path, folder: &Path, options: &[&str]) {
    let output = Command::new("qemu-system-arm")
        .args(["-M", "mps2-an500", "-nographic", "-monitor", "none", "-serial", "none"])
        .args(["-semihosting-config", "enable=on,target=native"])
        .args(options)
        .arg("-kernel")
        .arg(image)
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
}

#[test]
fn the_emulated_controller_says_the_same_bits() {
    let Some(images) = images("the_emulated_controller_says_the_same_bits") else { return };
    for drive in demonstration::run(|_| ()).unwrap() {
        let folder = tempfile::tempdir().unwrap();
        log::write(&folder.path().join("drive.agvlog"), &drive.recording).unwrap();
        run(&images.join("replay"), folder.path(), &[]);
        let contents = log::read_contents(&folder.path().join("replayed.agvlog"), |_| ()).unwrap();
        assert!(contents.damages.is_empty(), "{:?}", contents.damages);
        assert_eq!(contents.outputs.len(), drive.recording.events.len());
        let comparison = replay::compare(&contents.outputs, &drive.replay);
        assert_eq!(comparison.first_difference, None, "{}", drive.name);
        assert!(comparison.compared > 1000);
    }
}

/// Most instructions that a piece of work may take: with 480 MHz, the scan cycle ends in about 10 ms.
const BUDGETS: [(&str, u64); 15] = [
    ("prediction", 4_000),
    ("one reflector update", 25_000),
    ("solutions of a revolution of 6 reflectors", 200_000),
    ("solutions of a revolution of 20 reflectors", 1_500_000),
    ("monitor of a revolution of 6 reflectors", 200_000),
    ("monitor of a revolution of 20 reflectors and its scan", 1_500_000),
    ("falko on 1440 beams", 3_000_000),
    ("scan cycle", 5_000_000),
    ("scan cycle with landmarks and key scans in the state", 12_000_000),
    ("scan cycle with contours of the way behind", 12_000_000),
    ("scan cycle by laser odometry with all solutions", 12_000_000),
    ("a revolution's search among 60 reflectors", 1_000_000),
    ("a revolution's search among 1000 reflectors", 50_000_000),
    ("scan cycle in a kept map of contours", 12_000_000),
    ("a search among contours", 40_000_000),
];

#[test]
fn work_costs_the_instructions_that_it_did() {
    let Some(images) = images("work_costs_the_instructions_that_it_did") else { return };
    let drives = demonstration::run(|_| ()).unwrap();
    let drive = drives.iter().find(|drive| drive.name == "mixed").unwrap();
    let folder = tempfile::tempdir().unwrap();
    log::write(&folder.path().join("drive.agvlog"), &drive.recording).unwrap();
    let contours = map_contours_at(&drive.recording, &drive.recording.truth, CELL);
    std::fs::write(folder.path().join("contours.map"), contours.bytes()).unwrap();
    let measure = || {
        run(&images.join("measure"), folder.path(), &["-icount", "shift=6,sleep=off"]);
        std::fs::read_to_string(folder.path().join("instructions.csv")).unwrap()
    };
    let found = measure();
    assert_eq!(found, measure(), "the count is not repeatable");
    let rows: Vec<Vec<&str>> = found.lines().skip(1).map(|line| line.split(',').collect()).collect();
    for (work, budget) in BUDGETS {
        let row = rows.iter().find(|row| row[0] == work).unwrap();
        let most: u64 = row[3].parse().unwrap();
        assert!(row[1].parse::<u64>().unwrap() >= 10, "{row:?}");
        assert!(most <= budget, "{work} takes {most} instructions, {budget} are allowed");
    }
    let mean_of = |row: &Vec<&str>| row[2].parse::<u64>().unwrap();
    let predictions: Vec<_> = rows.iter().filter(|row| row[0].starts_with("prediction of ")).collect();
    let tricycle = predictions.iter().find(|row| row[0] == "prediction of tricycle").unwrap();
    assert_eq!(predictions.len(), VehicleKind::ALL.len());
    for row in &predictions {
        assert!(mean_of(row) <= 2 * mean_of(tricycle), "{row:?} is dearer than two of {tricycle:?}");
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden/instructions.csv");
    if std::env::var_os("AGV_ACCEPT").is_some() {
        std::fs::write(&path, &found).unwrap();
        return;
    }
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    for (kept, found) in kept.lines().skip(1).zip(found.lines().skip(1)) {
        // Another compiler counts a little differently; what changes more is to be looked at.
        let number = |line: &str| line.rsplit(',').next().and_then(|word| word.parse::<f64>().ok()).unwrap();
        let ratio = number(found) / number(kept);
        assert!((0.9..=1.1).contains(&ratio), "kept {kept}, found {found}");
    }
    assert_eq!(kept.lines().count(), found.lines().count());
}

/// What 200 us are at 480 MHz, with an instruction in each cycle.
const LATEST_PREDICTION: u64 = 96_000;

#[test]
fn no_prediction_waits_for_a_scan() {
    let Some(images) = images("no_prediction_waits_for_a_scan") else { return };
    let drives = demonstration::run(|_| ()).unwrap();
    let drive = drives.iter().find(|drive| drive.name == "mixed").unwrap();
    let folder = tempfile::tempdir().unwrap();
    log::write(&folder.path().join("drive.agvlog"), &drive.recording).unwrap();
    run(&images.join("latency"), folder.path(), &["-icount", "shift=6,sleep=off"]);
    let found = std::fs::read_to_string(folder.path().join("latency.csv")).unwrap();
    let row: Vec<u64> = found.lines().nth(1).unwrap().split(',').map(|word| word.parse().unwrap()).collect();
    let [scans, samples, during_scans, latest, lost] = row[..] else { panic!("{found}") };
    println!("{found}");
    assert!(scans >= 50 && during_scans >= 300 && samples >= during_scans, "{found}");
    let instructions = latest * 1000 / 64;
    assert!(instructions <= LATEST_PREDICTION, "{instructions} instructions");
    assert_eq!(lost, 0);
}

#[test]
fn the_emulated_controller_calibrates_to_the_same_bits() {
    let Some(images) = images("the_emulated_controller_calibrates_to_the_same_bits") else { return };
    let folder = tempfile::tempdir().unwrap();
    run(&images.join("calibrate"), folder.path(), &["-icount", "shift=6,sleep=off"]);
    let found = std::fs::read_to_string(folder.path().join("calibration.txt")).unwrap();
    println!("{found}");
    let (cost, bits) = found.split_once('\n').unwrap();
    let numbers: Vec<usize> = cost.split(' ').filter_map(|word| word.parse().ok()).collect();
    // The sums of a whole drive; and all that this drive took, its own sums included, as they are on the stack.
    let [sums, stack, _] = numbers[..] else { panic!("{cost}") };
    assert!(sums <= 2048 && stack <= 2048, "{cost}");
    let expected = reference_drive::reference_drive_bits().unwrap();
    let expected: Vec<String> = expected.iter().map(|number| format!("{number:016x}")).collect();
    assert_eq!(bits.lines().collect::<Vec<_>>(), expected);
}

#[test]
fn a_panic_is_told_after_the_restart_and_the_watchdog_bites() {
    let Some(images) = images("a_panic_is_told_after_the_restart_and_the_watchdog_bites") else { return };
    let folder = tempfile::tempdir().unwrap();
    // Virtual time goes as fast as it can: the watchdog's patience costs little of ours.
    run(&images.join("restart"), folder.path(), &["-icount", "shift=10,sleep=off"]);
    let said = std::fs::read_to_string(folder.path().join("panic.txt")).unwrap();
    assert!(said.contains("restart.rs") && said.contains("nothing was said before 42"), "{said}");
    assert_eq!(std::fs::read_to_string(folder.path().join("watchdog.txt")).unwrap(), "bitten");
}
