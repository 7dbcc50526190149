//! The leaves, by the rooms of the code that they are for.

use agv_core::localizer;
use agv_core::odometry::CounterRange;

use crate::leaf::{Leaf, Value, tricycle, tricycle_mut};

/// The bounds that the core has for a number; a name that it does not know ends the compilation.
const fn bounds(name: &str) -> (f64, f64) {
    match localizer::bounds(name) {
        Some(bounds) => bounds,
        None => panic!("the core has no bounds for a number of that name"),
    }
}

/// A measure.
macro_rules! number {
    ($key:literal, $name:literal, $unit:literal, $($field:ident).+) => {
        Leaf {
            key: $key,
            name: $name,
            unit: $unit,
            bounds: bounds($name),
            get: |settings| Some(Value::Number(settings.$($field).+.into())),
            set: |settings, value| {
                let Value::Number(number) = value else { return false };
                settings.$($field).+ = number as _;
                true
            },
        }
    };
}

/// A measure of a tricycle.
macro_rules! tricycle_number {
    ($key:literal, $name:literal, $unit:literal, $field:ident) => {
        Leaf {
            key: $key,
            name: $name,
            unit: $unit,
            bounds: bounds($name),
            get: |settings| Some(Value::Number(tricycle(&settings.parameters)?.$field)),
            set: |settings, value| match (tricycle_mut(&mut settings.parameters), value) {
                (Some(vehicle), Value::Number(number)) => {
                    vehicle.$field = number;
                    true
                }
                _ => false,
            },
        }
    };
}

/// A part of the first laser's mount.
macro_rules! mount {
    ($key:literal, $name:literal, $unit:literal, $field:ident) => {
        Leaf {
            key: $key,
            name: $name,
            unit: $unit,
            bounds: bounds($name),
            get: |settings| Some(Value::Number(settings.parameters.lasers.first().$field)),
            set: |settings, value| {
                let Value::Number(number) = value else { return false };
                settings.parameters.lasers.first_mut().$field = number;
                true
            },
        }
    };
}

/// How many values a counter of a tricycle takes.
macro_rules! counter {
    ($key:literal, $name:literal, $field:ident) => {
        Leaf {
            key: $key,
            name: $name,
            unit: "",
            bounds: (2.0, 4_294_967_296.0),
            get: |settings| Some(Value::Whole(tricycle(&settings.parameters)?.$field.values())),
            set: |settings, value| match (tricycle_mut(&mut settings.parameters), value) {
                (Some(vehicle), Value::Whole(values)) => {
                    CounterRange::new(values).map(|range| vehicle.$field = range).is_some()
                }
                _ => false,
            },
        }
    };
}

/// A number of things that the localiser counts.
macro_rules! count {
    ($key:literal, $name:literal, $($field:ident).+) => {
        Leaf { bounds: bounds($name), ..whole!($key, $name, "", 0.0, 0.0, $($field).+) }
    };
}

macro_rules! whole {
    ($key:literal, $name:literal, $unit:literal, $least:expr, $most:expr, $($field:ident).+) => {
        Leaf {
            key: $key,
            name: $name,
            unit: $unit,
            bounds: ($least, $most),
            get: |settings| Some(Value::Whole(settings.$($field).+.into())),
            set: |settings, value| {
                let Value::Whole(whole) = value else { return false };
                whole.try_into().map(|whole| settings.$($field).+ = whole).is_ok()
            },
        }
    };
}

/// A measure that the core does not know.
macro_rules! measure {
    ($key:literal, $name:literal, $unit:literal, $least:expr, $most:expr, $($field:ident).+) => {
        Leaf {
            key: $key,
            name: $name,
            unit: $unit,
            bounds: ($least, $most),
            get: |settings| Some(Value::Number(settings.$($field).+)),
            set: |settings, value| {
                let Value::Number(number) = value else { return false };
                settings.$($field).+ = number;
                true
            },
        }
    };
}

macro_rules! switch {
    ($key:literal, $name:literal, $($field:ident).+) => {
        Leaf {
            key: $key,
            name: $name,
            unit: "",
            bounds: (0.0, 1.0),
            get: |settings| Some(Value::Switch(settings.$($field).+)),
            set: |settings, value| {
                let Value::Switch(is_on) = value else { return false };
                settings.$($field).+ = is_on;
                true
            },
        }
    };
}

macro_rules! address {
    ($key:literal, $name:literal, $($field:ident).+) => {
        Leaf {
            key: $key,
            name: $name,
            unit: "",
            bounds: (0.0, 0.0),
            get: |settings| Some(Value::Address(settings.$($field).+)),
            set: |settings, value| {
                let Value::Address(address) = value else { return false };
                settings.$($field).+ = address;
                true
            },
        }
    };
}

/// Every setting. A key belongs to its setting for ever: a setting that goes leaves its key unused.
pub static LEAVES: [Leaf; 103] = [
    tricycle_number!(100, "vehicle.wheelbase", "m", wheelbase),
    tricycle_number!(101, "vehicle.drive_scale", "m/tick", drive_scale),
    tricycle_number!(102, "vehicle.steering_scale", "rad/tick", steering_scale),
    tricycle_number!(103, "vehicle.steering_offset_forward", "rad", steering_offset_forward),
    tricycle_number!(104, "vehicle.steering_offset_backward", "rad", steering_offset_backward),
    counter!(105, "vehicle.drive_counter_values", drive_range),
    counter!(106, "vehicle.steering_counter_values", steering_range),
    mount!(120, "laser.x", "m", x),
    mount!(121, "laser.y", "m", y),
    mount!(122, "laser.theta", "rad", theta),
    number!(140, "odometry.speed_deviation", "m/s", parameters.odometry_noise.speed),
    number!(141, "odometry.steering_deviation", "rad", parameters.odometry_noise.steering),
    number!(142, "odometry.slip", "m/sqrt(m)", parameters.odometry_noise.slip),
    number!(143, "odometry.side_slip", "m/sqrt(m)", parameters.odometry_noise.side_slip),
    number!(144, "odometry.yaw", "rad/sqrt(m)", parameters.odometry_noise.yaw),
    number!(145, "odometry.unknown_acceleration", "m/s^2", parameters.odometry_noise.unknown_acceleration),
    number!(146, "odometry.unknown_turn", "rad/s^2", parameters.odometry_noise.unknown_turn),
    number!(147, "odometry.turn", "rad/sqrt(rad)", parameters.odometry_noise.turn),
    switch!(150, "sources.reflectors", parameters.sources.reflectors),
    switch!(151, "sources.corners", parameters.sources.corners),
    switch!(152, "sources.end_points", parameters.sources.end_points),
    switch!(153, "sources.key_scans", parameters.sources.key_scans),
    switch!(154, "sources.given_pose", parameters.sources.given_pose),
    switch!(155, "sources.aids", parameters.sources.aids),
    switch!(156, "sources.gyro", parameters.sources.gyro),
    switch!(157, "sources.contours", parameters.sources.contours),
    switch!(330, "gyro.fitted", parameters.gyro.is_fitted),
    number!(331, "gyro.factor", "", parameters.gyro.factor),
    number!(332, "gyro.latency", "s", parameters.gyro.latency),
    number!(333, "gyro.noise", "rad/s/sqrt(Hz)", parameters.gyro.noise),
    number!(334, "gyro.bias", "rad/s", parameters.gyro.bias),
    number!(335, "gyro.drift", "rad/s/sqrt(s)", parameters.gyro.drift),
    number!(336, "gyro.scale", "", parameters.gyro.scale),
    number!(337, "gyro.range", "rad/s", parameters.gyro.range),
    switch!(160, "maps.reflectors", parameters.maps.reflectors),
    switch!(161, "maps.features", parameters.maps.features),
    switch!(162, "maps.dynamic", parameters.maps.dynamic),
    switch!(163, "maps.start_search", start_search),
    switch!(164, "maps.slam", parameters.maps.slam),
    number!(170, "reflectors.range_deviation", "m", parameters.reflectors.range_deviation),
    number!(171, "reflectors.bearing_deviation", "rad", parameters.reflectors.bearing_deviation),
    number!(180, "features.nearest", "m", parameters.features.nearest),
    number!(181, "features.farthest", "m", parameters.features.farthest),
    number!(182, "features.added_deviation", "m", parameters.features.added_deviation),
    switch!(183, "features.motion_correction", parameters.features.motion_correction),
    number!(200, "association.reflector_radius", "m", parameters.association.reflector_radius),
    number!(201, "association.feature_radius", "m", parameters.association.feature_radius),
    number!(202, "association.gate", "", parameters.association.gate),
    number!(203, "association.margin", "", parameters.association.margin),
    number!(204, "association.shared_map_error", "", parameters.association.shared_map_error),
    number!(220, "dynamic_map.update_rate", "", parameters.dynamic_map.update_rate),
    count!(221, "dynamic_map.first_hits", parameters.dynamic_map.first_hits),
    count!(222, "dynamic_map.most_hits", parameters.dynamic_map.most_hits),
    count!(223, "dynamic_map.least_hits", parameters.dynamic_map.least_hits),
    number!(224, "dynamic_map.deviation", "m", parameters.dynamic_map.deviation),
    number!(240, "consistency.memory", "", parameters.consistency.memory),
    number!(241, "consistency.least_remaining", "", parameters.consistency.least_remaining),
    number!(242, "consistency.least_observations", "", parameters.consistency.least_observations),
    number!(243, "consistency.least_acceptance", "", parameters.consistency.least_acceptance),
    number!(244, "consistency.largest_normalised_square", "", parameters.consistency.largest_normalised_square),
    number!(260, "limits.fastest", "m/s", parameters.limits.fastest),
    number!(261, "limits.dead_reckoning_from", "m", parameters.limits.dead_reckoning_from),
    number!(262, "limits.lost_after", "m", parameters.limits.lost_after),
    number!(263, "limits.largest_position_deviation", "m", parameters.limits.largest_position_deviation),
    number!(264, "limits.largest_heading_deviation", "rad", parameters.limits.largest_heading_deviation),
    number!(265, "limits.longest_extrapolation", "s", parameters.limits.longest_extrapolation),
    number!(280, "alert_limits.travel.position", "m", parameters.alert_limits.travel.position),
    number!(281, "alert_limits.travel.heading", "rad", parameters.alert_limits.travel.heading),
    number!(282, "alert_limits.docking.position", "m", parameters.alert_limits.docking.position),
    number!(283, "alert_limits.docking.heading", "rad", parameters.alert_limits.docking.heading),
    switch!(289, "integrity.protection", parameters.protection),
    number!(290, "assumed.mounting", "m", parameters.assumed.mounting),
    number!(291, "assumed.mounting_yaw", "rad", parameters.assumed.mounting_yaw),
    number!(292, "assumed.clock", "s", parameters.assumed.clock),
    number!(293, "assumed.scale", "", parameters.assumed.scale),
    number!(294, "assumed.steering", "rad", parameters.assumed.steering),
    number!(295, "assumed.turn", "", parameters.assumed.turn),
    whole!(300, "can.controller_node", "", 1.0, 95.0, nodes.controller),
    whole!(301, "can.drive_node", "", 1.0, 127.0, nodes.drive),
    whole!(302, "can.steering_node", "", 1.0, 127.0, nodes.steering),
    whole!(303, "can.encoder_period", "ms", 1.0, 50.0, encoder_period),
    whole!(304, "can.vendor", "", 0.0, 4_294_967_295.0, nodes.vendor),
    switch!(305, "can.nmt_master", nodes.is_master),
    switch!(306, "can.self_start", nodes.starts_itself),
    switch!(307, "can.accept_pose", nodes.accepts_pose),
    whole!(308, "can.bit_rate", "kbit/s", 125.0, 1000.0, bit_rate),
    whole!(309, "can.publishing_period", "ms", 5.0, 1000.0, publishing_period),
    whole!(310, "can.drive_profile", "", 402.0, 406.0, nodes.drive_profile),
    whole!(311, "can.steering_profile", "", 402.0, 406.0, nodes.steering_profile),
    switch!(312, "can.accept_settings", nodes.accepts_settings),
    whole!(313, "can.gyro_identifier", "", 0.0, 536_870_911.0, gyro_frame.identifier),
    switch!(314, "can.gyro_extended", gyro_frame.is_extended),
    whole!(315, "can.gyro_first_byte", "", 0.0, 7.0, gyro_frame.first_byte),
    whole!(316, "can.gyro_length", "", 2.0, 4.0, gyro_frame.length),
    whole!(317, "can.gyro_axis", "", 1.0, 3.0, gyro_frame.axis),
    measure!(318, "can.gyro_unit", "rad/s", -1.0, 1.0, gyro_frame.unit),
    address!(320, "network.address", network.address),
    whole!(321, "network.prefix", "", 0.0, 32.0, network.prefix),
    address!(322, "network.gateway", network.gateway),
    address!(323, "nav350.address", network.laser),
    whole!(324, "nav350.port", "", 1.0, 65_535.0, network.laser_port),
    whole!(325, "log.port", "", 1.0, 65_535.0, network.log_port),
    whole!(326, "service.port", "", 1.0, 65_535.0, network.service_port),
];

impl Leaf {
    /// The leaf with that name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        LEAVES.iter().find(|leaf| leaf.name == name)
    }

    /// The leaf with that key.
    #[must_use]
    pub fn keyed(key: u16) -> Option<&'static Self> {
        LEAVES.iter().find(|leaf| leaf.key == key)
    }
}
