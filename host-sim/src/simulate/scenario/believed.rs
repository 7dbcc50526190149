//! What the localiser believes of the vehicle of a scenario.

use agv_core::localizer::Parameters;
use agv_core::odometry::{
    Ackermann, AckermannWheels, AngleEncoder, BiSteerable, CounterRange, Differential, DrivenWheel, GyroParameters,
    Mecanum, Omnidirectional, SteeredWheel, Tricycle, TricycleSpeed, Vehicle, WheelVehicle,
};

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
        MotionReport::TricycleSpeed => Vehicle::TricycleSpeed(TricycleSpeed {
            wheelbase: believed.wheelbase,
            steering_offset: believed.steering_offset_forward_deg.to_radians(),
        }),
        MotionReport::Increments => Vehicle::Increments,
        _ => believed_wheels(scenario).map_or(Vehicle::Increments, Vehicle::Wheels),
    };
    let gyro = &scenario.gyro;
    let mut parameters = Parameters::new(vehicle, scenario.laser.mounting.pose());
    if gyro.fitted {
        parameters.gyro = GyroParameters {
            is_fitted: true,
            latency: gyro.middle_latency(),
            range: gyro.range_deg.to_radians(),
            ..GyroParameters::default()
        };
    }
    parameters
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

/// Radius of the wheels of a vehicle with several, m.
const RADIUS: f64 = 0.1;

/// The vehicle of several wheels that the localiser believes in; none if it is another one.
#[must_use]
pub fn believed_wheels(scenario: &Scenario) -> Option<WheelVehicle> {
    let believed = &scenario.vehicle.believed;
    let range = |values: u64| CounterRange::new(values).unwrap_or(CounterRange::BITS_32);
    let turn = AngleEncoder { scale: believed.drive_scale / RADIUS, range: range(believed.drive_counter) };
    let driven = DrivenWheel { radius: RADIUS, turn };
    let scale = std::f64::consts::TAU / believed.steering_counter as f64;
    let steering = AngleEncoder { scale, range: range(believed.steering_counter) };
    let steered = |x: f64| SteeredWheel { x, y: 0.0, drive: driven, steering, steering_offset: 0.0 };
    let axle = Differential { track: believed.track, left: driven, right: driven };
    match scenario.vehicle.reports {
        MotionReport::Encoders | MotionReport::Speed | MotionReport::TricycleSpeed | MotionReport::Increments => None,
        MotionReport::Differential => Some(WheelVehicle::Differential(axle)),
        MotionReport::Ackermann => Some(WheelVehicle::Ackermann(AckermannWheels {
            rear: axle,
            wheelbase: believed.wheelbase,
            steering,
            steering_offset: believed.steering_offset_forward_deg.to_radians(),
        })),
        MotionReport::BiSteerable => {
            let half = 0.5 * believed.wheelbase;
            Some(WheelVehicle::BiSteerable(BiSteerable { front: steered(half), rear: steered(-half) }))
        }
        MotionReport::ThreeOmnidirectional => Some(WheelVehicle::ThreeOmnidirectional(Omnidirectional {
            arm: 0.5 * believed.track,
            first: std::f64::consts::FRAC_PI_3,
            driven: [driven; 3],
        })),
        MotionReport::Omnidirectional => Some(WheelVehicle::FourOmnidirectional(Omnidirectional {
            arm: 0.5 * believed.track,
            first: std::f64::consts::FRAC_PI_4,
            driven: [driven; 4],
        })),
        MotionReport::Mecanum => Some(WheelVehicle::Mecanum(Mecanum {
            wheelbase: believed.wheelbase,
            track: believed.track,
            driven: [driven; 4],
        })),
    }
}
