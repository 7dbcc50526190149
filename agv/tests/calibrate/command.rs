//! `agv calibrate` as people run it.

use agv_host_sim::calibrate::vehicle_file::VehicleFile;
use agv_settings::Settings;
use agv_settings::leaf::{Leaf, Value};

use crate::support::{Files, agv, refusal, text};

#[test]
fn a_planned_drive_is_simulated_calibrated_and_applied() {
    let files = Files::new();
    let (scenario, log, vehicle) = (files.path("plan.toml"), files.path("drive.agvlog"), files.path("vehicle.toml"));
    let plan = agv(&["calibrate", "plan", "--area", "12x10", "--time", "300", "--scenario", &scenario, "--json"]);
    assert!(plan.status.success(), "{}", text(&plan.stderr));
    let plan: serde_json::Value = serde_json::from_slice(&plan.stdout).unwrap();
    assert!(plan["duration_s"].as_f64().unwrap() <= 300.0);
    assert!(agv(&["simulate", &scenario, "--output", &log, "--seed", "4"]).status.success());
    let report = files.path("report");
    let found = agv(&["calibrate", &log, "--side", "front", "--apply", &vehicle, "--report", &report, "--json"]);
    assert!(found.status.success(), "{}", text(&found.stderr));
    let found: serde_json::Value = serde_json::from_slice(&found.stdout).unwrap();
    // The scenario's vehicle: an offset of 0.5 deg with random sign, a laser that is 10 mm further ahead than believed.
    let offset = found["parameters"]["steer_offset_forward_rad"].as_f64().unwrap().to_degrees();
    assert!((offset.abs() - 0.5).abs() < 0.03, "{offset}");
    let x = found["parameters"]["laser_x_m"].as_f64().unwrap();
    assert!((x - 0.91).abs() < 1e-3, "{x}");
    assert_eq!(found["std"]["wheelbase_m"], serde_json::Value::Null);
    let std = found["std"]["laser_x_m"].as_f64().unwrap();
    let expected = plan["expected_std"]["laser_x_m"].as_f64().unwrap();
    assert!((0.3..3.0).contains(&(std / expected)), "{std} and {expected}");
    let page = std::fs::read_to_string(std::path::Path::new(&report).join("index.html")).unwrap();
    assert!(page.matches("<svg").count() >= 3);
    // Dead reckoning is better with what was found.
    let error = |arguments: &[&str]| {
        let output = agv(&[&["replay", &log, "--landmarks", "none", "--json"], arguments].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        let summary: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        summary["accuracy"]["heading_deg"]["median"].as_f64().unwrap()
    };
    let (before, after) = (error(&[]), error(&["--vehicle", &vehicle]));
    assert!(after < 0.5 * before, "{before} deg before and {after} deg after");
}

#[test]
fn vehicle_files_come_back_as_they_were_written() {
    let files = Files::new();
    let path = files.path("vehicle.toml");
    let file = VehicleFile { wheelbase_m: Some(1.5), laser_x_m: Some(-0.125), ..VehicleFile::default() };
    file.write(path.as_ref()).unwrap();
    assert_eq!(VehicleFile::read(path.as_ref()).unwrap(), file);
}

#[test]
fn settings_of_the_firmware_take_a_vehicle_file() {
    let vehicle = super::truth::vehicle();
    let file = VehicleFile::of(&vehicle.tricycle, &vehicle.laser);
    let mut parameters = vehicle.believed();
    let mut settings = Settings::of(parameters);
    for (name, value) in file.settings() {
        Leaf::named(name).unwrap().set(&mut settings, Value::Number(value)).unwrap();
    }
    // What replay makes of the file is what the firmware starts with.
    assert!(file.apply(&mut parameters));
    assert_eq!(settings.parameters.vehicle, parameters.vehicle);
    assert_eq!(*settings.parameters.lasers.first(), *parameters.lasers.first());
    assert_eq!(file.settings().count(), 8);
}

#[test]
fn bad_input_is_refused_in_one_line() {
    let files = Files::new();
    let log = files.path("straight.agvlog");
    let scenario =
        files.write("straight.toml", b"seed = 1\n[world]\nkind = \"block_storage\"\nreflectors = \"aisle\"\n");
    assert!(agv(&["simulate", &scenario, "--output", &log]).status.success());
    let complaint = refusal(&["calibrate", &log]);
    assert!(complaint.contains("straight.agvlog") && complaint.contains("steering angle"), "{complaint}");
    assert!(refusal(&["calibrate", &files.path("missing.agvlog")]).contains("no such file"));
    assert!(refusal(&["calibrate", "plan", "--area", "3x3"]).contains("larger"));
    for (text, part) in [
        ("wheel_base = 1.5\n", "wheel_base"),
        ("laser_x_m = 0.1\nwheelbase_m = -1.5\n", ":2: wheelbase_m must be from 0.05 to 50, and is -1.5"),
        ("laser_x_m = nan\n", "laser_x_m"),
    ] {
        let vehicle = files.write("vehicle.toml", text.as_bytes());
        let complaint = refusal(&["replay", &log, "--vehicle", &vehicle]);
        assert!(complaint.contains(part), "{complaint}");
    }
}
