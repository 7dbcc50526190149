//! How much of the CAN bus the controller and its encoders take.

use agv_wire::can::bus_load::{Cycle, load};

use crate::Settings;

/// Time between heartbeats, s: those of the controller and of both encoders.
const HEARTBEAT: f64 = 0.1;
/// Time between the reports of standstill that the controller of the vehicle may send, s: half of what they hold for.
const REPORT: f64 = 0.1;

/// The share of the bit rate that the poses, both encoders, heartbeats and reports of standstill take at worst. What others
/// say, and services, are not in it.
#[must_use]
pub fn bus_load(settings: &Settings) -> f64 {
    let pose = 1e-3 * f64::from(settings.publishing_period);
    let encoders = 1e-3 * f64::from(settings.encoder_period);
    let cycles = [
        Cycle { frames: 5, bytes: 8, period: pose },
        Cycle { frames: 2, bytes: 4, period: encoders },
        Cycle { frames: 3, bytes: 1, period: HEARTBEAT },
        Cycle { frames: 1, bytes: 8, period: REPORT },
    ];
    load(&cycles, settings.bit_rate)
}
