//! Whether settings go together.

use agv_core::odometry::{Counted, MOST_COUNTERS};
use agv_wire::can::bit_timing::BIT_RATES;
use agv_wire::can::bus_load::MOST_LOAD;
use agv_wire::can::motion_frames::Place;

use crate::bus_load::bus_load;
use crate::{Nodes, Settings, VehicleKind};

/// Nearer steered wheels do not tell how the vehicle turns, m.
const LEAST_APART: f64 = 0.05;
/// Largest identifier of eleven bits.
const LAST_STANDARD: u32 = 0x7FF;

/// Why a setting does not go with the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// The value is not possible, or not beside the others.
    Bounds,
    /// The CAN bus would be loaded by more than 60 % of its bit rate.
    BusLoad,
}

/// A setting that does not go with the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Contradiction {
    /// Its name.
    pub leaf: &'static str,
    /// Why.
    pub cause: Cause,
}

impl Settings {
    /// Whether the settings go together.
    ///
    /// # Errors
    /// The first setting that does not, and why.
    pub fn check(&self) -> Result<(), Contradiction> {
        let bounds = |leaf| Contradiction { leaf, cause: Cause::Bounds };
        self.check_believed().map_err(bounds)?;
        if !BIT_RATES.contains(&self.bit_rate) {
            return Err(bounds("can.bit_rate"));
        }
        self.check_nodes().map_err(bounds)?;
        self.check_frames().map_err(bounds)?;
        if bus_load(self) > MOST_LOAD {
            return Err(Contradiction { leaf: "can.publishing_period", cause: Cause::BusLoad });
        }
        Ok(())
    }

    /// Whether the localiser can compute with what it believes. The name of the leaf that hinders it.
    pub(crate) fn check_believed(&self) -> Result<(), &'static str> {
        self.check_vehicle()?;
        self.parameters.check().map_err(|error| error.leaf)
    }

    /// Whether the wheels of a vehicle with several tell how it moves. The name of the leaf that hinders it.
    fn check_vehicle(&self) -> Result<(), &'static str> {
        const SCALES: [&str; 4] =
            ["vehicle.wheel_1_scale", "vehicle.wheel_2_scale", "vehicle.wheel_3_scale", "vehicle.wheel_4_scale"];
        const STEERING_SCALES: [&str; 2] = ["vehicle.wheel_1_steering_scale", "vehicle.wheel_2_steering_scale"];
        let counters = self.parameters.vehicle.counters();
        for counter in &counters {
            let of_wheel = |names: &[&'static str]| names.get(counter.wheel).copied();
            let name = match (self.vehicle.kind, counter.counted) {
                (VehicleKind::Tricycle, _) => None,
                (VehicleKind::BiSteerable, Counted::Steering) => of_wheel(&STEERING_SCALES),
                (_, Counted::Steering) => Some("vehicle.steering_scale"),
                (_, Counted::Turn) => of_wheel(&SCALES),
            };
            if let Some(name) = name.filter(|_| counter.scale == 0.0) {
                return Err(name);
            }
        }
        let [front, rear, ..] = &self.vehicle.wheels;
        let [x, y] = [front.x - rear.x, front.y - rear.y];
        if self.vehicle.kind == VehicleKind::BiSteerable && x * x + y * y < LEAST_APART * LEAST_APART {
            return Err("vehicle.wheel_2_x");
        }
        Ok(())
    }

    /// Whether no two that are heard have the same node.
    fn check_nodes(&self) -> Result<(), &'static str> {
        const NODES: [&str; MOST_COUNTERS] =
            ["can.drive_node", "can.steering_node", "can.third_node", "can.fourth_node"];
        const PROFILES: [&str; MOST_COUNTERS] =
            ["can.drive_profile", "can.steering_profile", "can.third_profile", "can.fourth_profile"];
        let Nodes { controller, encoders, .. } = &self.nodes;
        let count = self.parameters.vehicle.counters().len();
        for (number, encoder) in encoders.iter().enumerate().take(count) {
            let is_taken = encoders.iter().take(number).any(|other| other.node == encoder.node);
            if is_taken || encoder.node == *controller {
                return Err(NODES.get(number).copied().unwrap_or_default());
            }
            if !matches!(encoder.profile, 402 | 406) {
                return Err(PROFILES.get(number).copied().unwrap_or_default());
            }
        }
        Ok(())
    }

    /// Whether the numbers of the vehicle's own controller have a place in their frames.
    fn check_frames(&self) -> Result<(), &'static str> {
        let frames = &self.motion_frames;
        let check = |place: &Place, numbers: u8, [identifier, first_byte, unit]: [&'static str; 3]| {
            if !frames.are_extended && place.identifier > LAST_STANDARD {
                return Err(identifier);
            }
            if place.first_byte.saturating_add(place.length.saturating_mul(numbers)) > 8 {
                return Err(first_byte);
            }
            if place.unit == 0.0 { Err(unit) } else { Ok(()) }
        };
        match self.vehicle.kind {
            VehicleKind::TricycleSpeed | VehicleKind::CarSpeed => {
                let speed = ["can.speed_identifier", "can.speed_first_byte", "can.speed_unit"];
                check(&frames.speed, 1, speed)?;
                check(&frames.angle, 1, ["can.angle_identifier", "can.angle_first_byte", "can.angle_unit"])
            }
            VehicleKind::Increments => {
                if frames.increment_turn == 0.0 {
                    return Err("can.increment_turn_unit");
                }
                let names = ["can.increment_identifier", "can.increment_first_byte", "can.increment_unit"];
                check(&frames.increment, 3, names)
            }
            _ => Ok(()),
        }
    }
}
