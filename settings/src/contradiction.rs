//! Whether settings go together.

use agv_core::localizer::Parameters;
use agv_core::odometry::{Counted, MOST_COUNTERS};
use agv_wire::can::bit_timing::BIT_RATES;
use agv_wire::can::bus_load::MOST_LOAD;
use agv_wire::can::motion_frames::Place;

use crate::bus_load::bus_load;
use crate::{Network, Nodes, Settings, VehicleKind};

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
    /// The name of the one that it does not go with, where it is one.
    pub other: Option<&'static str>,
    /// Why.
    pub cause: Cause,
}

impl Settings {
    /// Whether the settings go together.
    ///
    /// # Errors
    /// The first setting that does not, and why.
    pub fn check(&self) -> Result<(), Contradiction> {
        let bounds = |leaf| Contradiction { leaf, other: None, cause: Cause::Bounds };
        self.check_believed().map_err(bounds)?;
        if !BIT_RATES.contains(&self.bit_rate) {
            return Err(bounds("can.bit_rate"));
        }
        self.check_nodes()?;
        self.check_frames().map_err(bounds)?;
        if bus_load(self) > MOST_LOAD {
            return Err(Contradiction { leaf: "can.publishing_period", other: None, cause: Cause::BusLoad });
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

    /// Two settings of which one must differ from the other, or not be larger, and is not so: for whoever sets up a vehicle. A controller
    /// that runs takes one setting after the other, and asks only for what it cannot compute with ([`Self::check`]).
    #[must_use]
    pub fn contradicting_pair(&self) -> Option<[&'static str; 2]> {
        let Parameters { features, dynamic_map, limits, alert_limits, .. } = &self.parameters;
        let Network { address, laser, log_port, service_port, .. } = &self.network;
        let (travel, docking) = (&alert_limits.travel, &alert_limits.docking);
        let pairs = [
            (features.nearest < features.farthest, ["features.nearest", "features.farthest"]),
            (dynamic_map.least_hits <= dynamic_map.most_hits, ["dynamic_map.least_hits", "dynamic_map.most_hits"]),
            (dynamic_map.first_hits <= dynamic_map.most_hits, ["dynamic_map.first_hits", "dynamic_map.most_hits"]),
            (limits.dead_reckoning_from <= limits.lost_after, ["limits.dead_reckoning_from", "limits.lost_after"]),
            (docking.position <= travel.position, ["alert_limits.docking.position", "alert_limits.travel.position"]),
            (docking.heading <= travel.heading, ["alert_limits.docking.heading", "alert_limits.travel.heading"]),
            (address != laser, ["nav350.address", "network.address"]),
            (log_port != service_port, ["log.port", "service.port"]),
        ];
        pairs.iter().find(|(goes_together, _)| !goes_together).map(|(_, pair)| *pair)
    }

    /// Whether no two that are heard have the same node.
    fn check_nodes(&self) -> Result<(), Contradiction> {
        const NODES: [&str; MOST_COUNTERS] =
            ["can.drive_node", "can.steering_node", "can.third_node", "can.fourth_node"];
        const PROFILES: [&str; MOST_COUNTERS] =
            ["can.drive_profile", "can.steering_profile", "can.third_profile", "can.fourth_profile"];
        let Nodes { controller, encoders, .. } = &self.nodes;
        let count = self.parameters.vehicle.counters().len();
        for (number, encoder) in encoders.iter().enumerate().take(count) {
            let name = |names: &[&'static str]| names.get(number).copied().unwrap_or_default();
            let taken = encoders.iter().take(number).position(|other| other.node == encoder.node);
            let other = match taken {
                Some(first) => NODES.get(first).copied(),
                None => (encoder.node == *controller).then_some("can.controller_node"),
            };
            if other.is_some() {
                return Err(Contradiction { leaf: name(&NODES), other, cause: Cause::Bounds });
            }
            if !matches!(encoder.profile, 402 | 406) {
                return Err(Contradiction { leaf: name(&PROFILES), other: None, cause: Cause::Bounds });
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
