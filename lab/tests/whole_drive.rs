//! Whole drives of each kind of vehicle through the whole controller: emulated encoders, gyro and laser.

use agv_core::geometry::difference;
use agv_core::state::{Mode, Reason};
use agv_host_sim::simulate::block_storage::{BlockStoragePath, ReflectorPlacement};
use agv_host_sim::simulate::scenario::{MotionReport, Scenario};
use agv_host_sim::simulate::simulate;
use agv_lab::campaign::rig::{self, RigOptions};

/// Drives a way among reflectors, and holds what is said against the truth.
fn drive(reports: MotionReport, has_gyro: bool, seed: u64) {
    let mut scenario =
        Scenario::block_storage_with_reflectors(BlockStoragePath::P2, ReflectorPlacement::AisleAndLaneEnd, seed);
    scenario.laser.scans = false;
    scenario.vehicle.reports = reports;
    scenario.gyro.fitted = has_gyro;
    let simulation = simulate(&scenario).unwrap();
    let truth = &simulation.recording.truth;
    let length = truth.last().unwrap().time.since(truth.first().unwrap().time);
    let (mut compared, mut worst, mut beyond) = (0, (0.0_f64, 0.0_f64), 0);
    let mut remarks = Vec::new();
    let options = RigOptions::told(length, seed, None);
    rig::drive(&simulation.recording, &[], &options, |heard| {
        let Some(output) = heard.output.filter(|_| heard.time > 2.0) else { return };
        let Some(truth) = (heard.truth)(output.time) else { return };
        let position = (output.pose.position() - truth.position()).norm();
        let heading = difference(output.pose.theta, truth.theta).abs();
        worst = (worst.0.max(position), worst.1.max(heading));
        beyond += usize::from(position > output.level.position || heading > output.level.heading);
        compared += 1;
        assert!(!matches!(output.mode, Mode::NotLocalised | Mode::Lost | Mode::WithoutOdometry), "{output:?}");
        if matches!(output.reason, Reason::WheelsSlip | Reason::GyroFault) {
            remarks.push((heard.time, output.reason));
        }
    })
    .unwrap();
    println!("{reports:?}, gyro {has_gyro}: {compared} poses, worst {:.4} m, {:.3} deg", worst.0, worst.1.to_degrees());
    assert!(f64::from(compared) > 80.0 * (length - 4.0), "{compared} poses in {length} s");
    assert!(worst.0 < 0.06 && worst.1 < 0.015, "{worst:?}");
    assert_eq!(beyond, 0, "poses beyond their protection level");
    let first = remarks.first().copied();
    assert_eq!(first, None, "{} remarks: nothing slips, and the gyro is sound", remarks.len());
}

/// With and without a gyro.
fn drives(reports: MotionReport, seed: u64) {
    drive(reports, false, seed);
    drive(reports, true, seed);
}

#[test]
fn a_tricycle_drives_with_and_without_a_gyro() {
    drives(MotionReport::Encoders, 11);
}

#[test]
fn a_tricycle_whose_own_controller_tells_its_speed_drives_with_and_without_a_gyro() {
    drives(MotionReport::TricycleSpeed, 17);
}

#[test]
fn a_car_whose_own_controller_tells_its_speed_drives_with_and_without_a_gyro() {
    drives(MotionReport::Speed, 18);
}

#[test]
fn a_vehicle_that_tells_increments_drives_with_and_without_a_gyro() {
    drives(MotionReport::Increments, 19);
}

#[test]
fn a_differential_vehicle_drives_with_and_without_a_gyro() {
    drives(MotionReport::Differential, 12);
}

#[test]
fn a_bi_steerable_vehicle_drives_with_and_without_a_gyro() {
    drives(MotionReport::BiSteerable, 13);
}

#[test]
fn a_car_with_counters_drives_with_and_without_a_gyro() {
    drives(MotionReport::Ackermann, 14);
}

#[test]
fn omnidirectional_vehicles_drive_with_and_without_a_gyro() {
    drives(MotionReport::ThreeOmnidirectional, 15);
    drives(MotionReport::Omnidirectional, 15);
}

#[test]
fn a_mecanum_vehicle_drives_with_and_without_a_gyro() {
    drives(MotionReport::Mecanum, 16);
}
