//! Calibration from logs: simulated drives whose truth is known, and logs that are not good enough.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing, reason = "tests")]

use agv_core::calibration::{MountingSide, Offsets};
use agv_host_sim::calibrate::design::{Design, Order};
use agv_host_sim::calibrate::drive::{Drive, Preparation};
use agv_host_sim::calibrate::found::{Method, Question, find};
use agv_host_sim::calibrate::model::VehicleModel;
use agv_host_sim::evaluate::calibration::course::{Course, Disturbance, TrueVehicle};

const JOINT: Question = Question {
    method: Method::Joint,
    offsets: Offsets::ForEachSense,
    is_wheelbase_free: true,
    is_steering_ratio_free: false,
    side: Some(MountingSide::Front),
};

fn course(vehicle: TrueVehicle, arcs: usize, order: Order) -> Course {
    let design = Design { arcs, steering: [0.314, 0.873], turn: std::f64::consts::PI };
    Course::new(vehicle, &design.segments(vehicle.tricycle.wheelbase, order), 1.0, 1)
}

#[test]
fn only_the_resolution_of_the_encoders_is_left_without_noise() {
    let vehicle = TrueVehicle::of_the_thesis(-0.7270, -0.7747);
    let log = course(vehicle, 4, Order::ForthAndBack).log(&Disturbance::NONE, 1);
    let drive = Drive::new(&log, &Preparation::default()).unwrap();
    assert_eq!(drive.windows.len(), 16);
    let found = find(&drive, &JOINT).unwrap();
    let truth = VehicleModel::nominal(&vehicle.tricycle, &vehicle.laser);
    println!("{:?}\n{truth:?}\n{:?}", found.model, found.noise);
    for r in &found.residuals {
        println!("{:.2e} {:.2e} {:.2e} {}", r.motion.x, r.motion.y, r.motion.z, r.weight);
    }
    panic!();
}
#[test]
fn dbg() {
    let vehicle = TrueVehicle::of_the_thesis(-0.7270, -0.7747);
    let log = course(vehicle, 4, Order::ForthAndBack).log(&Disturbance::NONE, 1);
    let drive = Drive::new(&log, &Preparation::default()).unwrap();
    let truth = VehicleModel::nominal(&vehicle.tricycle, &vehicle.laser);
    for w in drive.windows.iter().take(4) {
        let (m, _) = truth.laser_motion(w);
        println!(
            "{:?} {:?} steps {} {:?}",
            m - nalgebra::Vector3::new(w.motion.x, w.motion.y, 0.0),
            w.motion,
            w.steps.len(),
            w.steps.iter().take(6).collect::<Vec<_>>()
        );
    }
    panic!();
}
