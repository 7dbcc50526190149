//! How much of the CAN bus the controller and what tells it the vehicle's motion take.

use agv_wire::can::bus_load::{Cycle, load};

use crate::Settings;

/// Time between heartbeats, s: those of the controller and of the encoders.
const HEARTBEAT: f64 = 0.1;
/// Time between the reports of standstill that the controller of the vehicle may send, s: half of what they hold for.
const REPORT: f64 = 0.1;

/// The share of the bit rate that the poses, the encoders or the reports of the vehicle's own controller, heartbeats and reports of standstill take at worst. What others
/// say, and services, are not in it.
#[must_use]
pub fn bus_load(settings: &Settings) -> f64 {
    let pose = 1e-3 * f64::from(settings.publishing_period);
    let period = 1e-3 * f64::from(settings.encoder_period);
    let counters = settings.parameters.vehicle.counters().len() as u32;
    // A vehicle without counters tells its motion in at most two frames.
    let reports =
        if counters > 0 { Cycle { frames: counters, bytes: 4, period } } else { Cycle { frames: 2, bytes: 8, period } };
    let cycles = [
        Cycle { frames: 5, bytes: 8, period: pose },
        reports,
        Cycle { frames: 1 + counters, bytes: 1, period: HEARTBEAT },
        Cycle { frames: 1, bytes: 8, period: REPORT },
    ];
    load(&cycles, settings.bit_rate)
}
