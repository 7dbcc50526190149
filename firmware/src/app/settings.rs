//! What the firmware is told about its vehicle.

use agv_core::geometry::Pose;
use agv_core::landmarks::Landmark;
use agv_core::localizer::Parameters;
use agv_core::odometry::{CounterRange, Tricycle, Vehicle};
use agv_core::wire::can::canopen::NodeId;
use agv_core::wire::can::encoder::{EncoderSettings, Reporting};
use agv_core::wire::can::encoder_pair::ChannelSettings;
use agv_core::wire::can::supervision::SupervisionLimits;

/// Everything that is set on commissioning.
pub struct Settings {
    /// What the localiser believes of its vehicle and its sensors.
    pub parameters: Parameters,
    /// The map.
    pub landmarks: &'static [Landmark],
    /// Node of the controller.
    pub controller: NodeId,
    /// The driving wheel's encoder.
    pub drive: ChannelSettings,
    /// The steering's encoder.
    pub steering: ChannelSettings,
    /// Address of the NAV350, and its port.
    pub laser: ([u8; 4], u16),
    /// Port of the log stream.
    pub log_port: u16,
}

/// The node with that number.
const fn node(number: u8) -> NodeId {
    match NodeId::new(number) {
        Some(node) => node,
        None => panic!("no such node"),
    }
}

/// Time between positions of the encoders, s.
pub const SYNC_PERIOD: f64 = 0.010;

impl Settings {
    /// The vehicle of the standard simulated world: safe values for a vehicle that is not set up are no map, so it never
    /// claims to know where it is.
    #[must_use]
    pub fn standard(landmarks: &'static [Landmark]) -> Self {
        let vehicle = Tricycle {
            wheelbase: 1.5,
            drive_scale: 1e-4,
            drive_range: CounterRange::BITS_32,
            steering_scale: core::f64::consts::TAU / 65_536.0,
            steering_range: CounterRange::BITS_16,
            steering_offset_forward: 0.0,
            steering_offset_backward: 0.0,
        };
        let parameters = Parameters::new(Vehicle::Tricycle(vehicle), Pose::new(0.9, 0.0, 0.0));
        Self::of(parameters, landmarks)
    }

    /// The settings of a vehicle with these parameters.
    #[must_use]
    pub fn of(parameters: Parameters, landmarks: &'static [Landmark]) -> Self {
        let (drive_limits, steering_limits) = match parameters.vehicle {
            Vehicle::Tricycle(vehicle) => (
                (parameters.limits.fastest / vehicle.drive_scale.abs(), 2.5 / vehicle.drive_scale.abs()),
                (3.0 / vehicle.steering_scale.abs(), 100.0 / vehicle.steering_scale.abs()),
            ),
            _ => ((1e6, 1e6), (1e6, 1e6)),
        };
        let channel = |number, (fastest, braking)| ChannelSettings {
            encoder: EncoderSettings {
                reporting: Reporting::Timer { period: 10 },
                ..EncoderSettings::new(node(number))
            },
            limits: SupervisionLimits::every_10_ms(fastest, braking),
        };
        Self {
            parameters,
            landmarks,
            controller: node(16),
            drive: channel(1, drive_limits),
            steering: channel(2, steering_limits),
            laser: ([10, 0, 2, 2], 2112),
            log_port: 5350,
        }
    }
}
