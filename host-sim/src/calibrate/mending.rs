//! The log of a vehicle whose mistakes are mended in what is believed of it.

use agv_core::geometry::wrap;
use agv_core::odometry::Vehicle;

use super::causes::{Cause, Explanation};
use super::log_input::LogInput;

/// The same log with what is believed of the vehicle as an explanation says: signs of the counters, offsets of the steering, the
/// wheelbase and the laser. None if the log is not of a tricycle, if nothing is wrong, or if no parameter mends it.
#[must_use]
pub fn mended(input: &LogInput, explanation: &Explanation) -> Option<LogInput> {
    let mut right = input.clone();
    let Vehicle::Tricycle(tricycle) = &mut right.parameters.vehicle else { return None };
    if !explanation.is_mendable() {
        return None;
    }
    let laser = right.parameters.lasers.first_mut();
    for cause in &explanation.causes {
        match *cause {
            Cause::DriveReversed => tricycle.drive_scale = -tricycle.drive_scale,
            Cause::SteeringReversed => tricycle.steering_scale = -tricycle.steering_scale,
            Cause::SteeringOffset(offset) => {
                tricycle.steering_offset_forward = wrap(tricycle.steering_offset_forward + offset);
                tricycle.steering_offset_backward = wrap(tricycle.steering_offset_backward + offset);
            }
            Cause::Wheelbase(length) => tricycle.wheelbase = length,
            Cause::LaserHeading(turn) => laser.theta = wrap(laser.theta + turn),
            Cause::LaserPlace(ahead, left) => {
                laser.x += ahead;
                laser.y += left;
            }
            Cause::EncodersSwapped | Cause::FewReflectors(_) => {}
        }
    }
    Some(right)
}
