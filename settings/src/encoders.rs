//! What is expected of the encoders, from the settings.

use agv_core::odometry::{Tricycle, Vehicle};
use agv_core::wire::can::canopen::NodeId;
use agv_core::wire::can::encoder::{EncoderSettings, Reporting};
use agv_core::wire::can::encoder_pair::ChannelSettings;
use agv_core::wire::can::supervision::SupervisionLimits;

use crate::Settings;

/// Time between SYNC messages if encoders want them, s.
pub const SYNC_PERIOD: f64 = 0.010;

/// Hardest braking of a sound vehicle, m/s^2.
const BRAKING: f64 = 2.5;
/// Fastest turn of the steering, rad/s, and its hardest braking, rad/s^2.
const STEERING: (f64, f64) = (3.0, 100.0);

/// The node with that number; the settings have no other numbers than those of nodes.
#[must_use]
pub fn node(number: u8) -> NodeId {
    NodeId::new(number).unwrap_or(FIRST)
}

const FIRST: NodeId = match NodeId::new(1) {
    Some(node) => node,
    None => panic!("1 is a node"),
};

/// The driving wheel's encoder, and the steering's.
#[must_use]
pub fn channels(settings: &Settings) -> [ChannelSettings; 2] {
    let (drive_scale, steering_scale, drive_range, steering_range) = match settings.parameters.vehicle {
        Vehicle::Tricycle(Tricycle { drive_scale, steering_scale, drive_range, steering_range, .. }) => {
            (drive_scale.abs(), steering_scale.abs(), Some(drive_range), Some(steering_range))
        }
        _ => (1.0, 1.0, None, None),
    };
    let channel = |number, range, fastest, braking| ChannelSettings {
        encoder: EncoderSettings {
            reporting: Reporting::Timer { period: settings.encoder_period },
            range,
            ..EncoderSettings::new(node(number))
        },
        limits: SupervisionLimits::every(1e-3 * f64::from(settings.encoder_period), fastest, braking),
    };
    [
        channel(
            settings.nodes.drive,
            drive_range,
            settings.parameters.limits.fastest / drive_scale,
            BRAKING / drive_scale,
        ),
        channel(settings.nodes.steering, steering_range, STEERING.0 / steering_scale, STEERING.1 / steering_scale),
    ]
}
