//! The simulated encoders of several wheels: held against the truth by the rolling of each wheel alone, and whole drives of the localiser
//! with them.

use agv_core::geometry::{Pose, difference};
use agv_core::measurement::WheelSample;
use agv_core::odometry::{Vehicle, WheelBased, WheelVehicle};
use agv_core::state::Mode;
use agv_host_sim::recording::{RecordedEvent, Recording, truth_at};
use agv_host_sim::replay::replay;
use agv_host_sim::simulate::block_storage::{BlockStoragePath, ReflectorPlacement};
use agv_host_sim::simulate::scenario::{MotionReport, OdometryOptions, Scenario};
use agv_host_sim::simulate::simulate;

const KINDS: [MotionReport; 3] = [MotionReport::Differential, MotionReport::BiSteerable, MotionReport::Omnidirectional];

fn wheel_samples(recording: &Recording) -> Vec<WheelSample> {
    let of = |event: &RecordedEvent| match event {
        RecordedEvent::Wheels(sample) => Some(*sample),
        _ => None,
    };
    recording.events.iter().filter_map(of).collect()
}

fn vehicle(recording: &Recording) -> WheelVehicle {
    let Vehicle::Wheels(vehicle) = recording.parameters.vehicle else { panic!("no vehicle of several wheels") };
    vehicle
}

#[test]
fn each_wheel_rolls_as_its_contact_moves() {
    for reports in KINDS {
        let mut scenario = Scenario::block_storage(BlockStoragePath::P2, 4);
        scenario.laser.scans = false;
        scenario.odometry = OdometryOptions::perfect();
        scenario.vehicle.reports = reports;
        scenario.vehicle.truth.drive_scale_error = 0.0;
        scenario.vehicle.truth.wheel_difference = 0.0;
        scenario.vehicle.truth.steering_offset_error_deg = 0.0;
        scenario.vehicle.believed.drive_scale = 1e-6;
        scenario.vehicle.believed.drive_counter = 1 << 30;
        let recording = simulate(&scenario).unwrap().recording;
        let (samples, wheels) = (wheel_samples(&recording), vehicle(&recording).wheels().as_ref().to_vec());
        let mut compared = 0;
        for pair in samples.windows(2) {
            let poses = [pair[0].time, pair[1].time].map(|time| truth_at(&recording.truth, time).unwrap());
            for (number, wheel) in wheels.iter().enumerate() {
                // Where the contact goes in W, and in which direction the wheel stands in the middle.
                let place = Pose::new(wheel.x, wheel.y, 0.0);
                let [from, to] = poses.map(|pose| pose.compose(&place).position());
                let turned = difference(poses[1].theta, poses[0].theta);
                let steering = wheel.steering.map_or(0.0, |encoder| {
                    let at = |sample: &WheelSample| {
                        encoder.scale * encoder.range.signed(sample.wheels[number].steering) as f64
                    };
                    0.5 * (at(&pair[0]) + at(&pair[1]))
                });
                let direction = poses[0].theta + 0.5 * turned + wheel.heading + steering;
                let rolled = (to - from).x * direction.cos() + (to - from).y * direction.sin();
                let encoder = wheel.turn.unwrap();
                let ticks = encoder.range.step(pair[0].wheels[number].count, pair[1].wheels[number].count);
                let told = wheel.radius * encoder.scale * ticks as f64;
                assert!((told - rolled).abs() < 2e-5, "{reports:?}, wheel {number}: {told} {rolled}");
                compared += 1;
            }
        }
        assert!(compared > 1000, "{reports:?}: {compared}");
    }
}

#[test]
fn the_localiser_drives_each_kind_with_and_without_a_gyro() {
    for reports in KINDS {
        for has_gyro in [false, true] {
            let placement = ReflectorPlacement::AisleAndLaneEnd;
            let mut scenario = Scenario::block_storage_with_reflectors(BlockStoragePath::P2, placement, 21);
            scenario.laser.scans = false;
            scenario.vehicle.reports = reports;
            scenario.gyro.fitted = has_gyro;
            let recording = simulate(&scenario).unwrap().recording;
            let answers = replay(&recording, |_| ()).unwrap();
            let start = recording.truth.first().unwrap().time;
            let (mut worst, mut compared) = ((0.0_f64, 0.0_f64), 0);
            for output in answers.poses.iter().filter(|output| output.time.since(start) > 2.0) {
                let Some(truth) = truth_at(&recording.truth, output.time) else { continue };
                let position = (output.pose.position() - truth.position()).norm();
                let heading = difference(output.pose.theta, truth.theta).abs();
                worst = (worst.0.max(position), worst.1.max(heading));
                compared += 1;
                assert!(!matches!(output.mode, Mode::Lost | Mode::WithoutOdometry), "{reports:?}: {output:?}");
                assert!(
                    position <= output.level.position && heading <= output.level.heading,
                    "{reports:?}: {output:?}"
                );
            }
            println!(
                "{reports:?}, gyro {has_gyro}: {compared} poses, {:.4} m, {:.3} deg",
                worst.0,
                worst.1.to_degrees()
            );
            assert!(compared > 1000 && worst.0 < 0.06 && worst.1 < 0.015, "{reports:?} {worst:?}");
        }
    }
}
