//! What the localiser believes of the vehicle of a scenario.

use agv_core::localizer::Parameters;
use agv_core::odometry::{Ackermann, CounterRange, Tricycle, Vehicle};

use super::{MotionReport, Scenario};

/// What the localiser believes of vehicle and laser.
#[must_use]
pub fn believed_parameters(scenario: &Scenario) -> Parameters {
    let believed = &scenario.vehicle.believed;
    let vehicle = match scenario.vehicle.reports {
        MotionReport::Encoders => Vehicle::Tricycle(believed_tricycle(scenario)),
        MotionReport::Speed => {
            Vehicle::Ackermann(Ackermann { wheelbase: believed.wheelbase, encoder_offset: believed.encoder_offset })
        }
        MotionReport::Increments => Vehicle::Increments,
    };
    Parameters::new(vehicle, scenario.laser.mounting.pose())
}

/// The tricycle that the localiser believes in.
#[must_use]
pub fn believed_tricycle(scenario: &Scenario) -> Tricycle {
    let believed = &scenario.vehicle.believed;
    Tricycle {
        wheelbase: believed.wheelbase,
        drive_scale: believed.drive_scale,
        drive_range: CounterRange::new(believed.drive_counter).unwrap_or(CounterRange::BITS_32),
        steering_scale: std::f64::consts::TAU / believed.steering_counter as f64,
        steering_range: CounterRange::new(believed.steering_counter).unwrap_or(CounterRange::BITS_32),
        steering_offset_forward: believed.steering_offset_forward_deg.to_radians(),
        steering_offset_backward: believed.steering_offset_backward_deg.to_radians(),
    }
}
