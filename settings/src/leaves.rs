//! The leaves, by the rooms of the code that they are for.

use agv_core::localizer;
use agv_core::odometry::CounterRange;
use agv_wire::can::encoder::CodeSequence;

use crate::VehicleKind::{self, Ackermann, BiSteerable, CarSpeed, Differential, Increments, Mecanum, Omni3, Omni4};
use crate::VehicleKind::{Tricycle, TricycleSpeed};
use crate::gyro_connection::GyroConnection;
use crate::laser::{LaserMode, LaserOrientation};
use crate::leaf::{Leaf, Value};

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
            kinds: &VehicleKind::ALL,
            choices: &[],
            get: |settings| Value::Number(settings.$($field).+.into()),
            set: |settings, value| {
                let Value::Number(number) = value else { return false };
                settings.$($field).+ = number as _;
                true
            },
        }
    };
}

/// A measure of the vehicle, with bounds of its own, or those of the core.
macro_rules! vehicle {
    ($key:literal, $name:literal, $unit:literal, $kinds:expr, $field:ident) => {
        Leaf { bounds: bounds($name), ..vehicle!($key, $name, $unit, $kinds, (0.0, 0.0), [$field]) }
    };
    ($key:literal, $name:literal, $unit:literal, $kinds:expr, $bounds:expr, [$($place:tt)+]) => {
        Leaf {
            key: $key,
            name: $name,
            unit: $unit,
            bounds: $bounds,
            kinds: $kinds,
            choices: &[],
            get: |settings| Value::Number(settings.vehicle.$($place)+),
            set: |settings, value| {
                let Value::Number(number) = value else { return false };
                settings.vehicle.$($place)+ = number;
                settings.take_vehicle();
                true
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
            kinds: &VehicleKind::ALL,
            choices: &[],
            get: |settings| Value::Number(settings.parameters.lasers.first().$field),
            set: |settings, value| {
                let Value::Number(number) = value else { return false };
                settings.parameters.lasers.first_mut().$field = number;
                true
            },
        }
    };
}

/// How many values a counter takes.
macro_rules! counter {
    ($key:literal, $name:literal, $kinds:expr, [$($place:tt)+]) => {
        Leaf {
            key: $key,
            name: $name,
            unit: "",
            bounds: (2.0, 4_294_967_296.0),
            kinds: $kinds,
            choices: &[],
            get: |settings| Value::Whole(settings.vehicle.$($place)+.values()),
            set: |settings, value| {
                let Value::Whole(values) = value else { return false };
                let Some(range) = CounterRange::new(values) else { return false };
                settings.vehicle.$($place)+ = range;
                settings.take_vehicle();
                true
            },
        }
    };
}

/// The node of a counter, or its profile.
macro_rules! encoder {
    ($key:literal, $name:literal, $kinds:expr, $bounds:expr, [$($place:tt)+]) => {
        Leaf {
            key: $key,
            name: $name,
            unit: "",
            bounds: $bounds,
            kinds: $kinds,
            choices: &[],
            get: |settings| Value::Whole(settings.nodes.encoders$($place)+.into()),
            set: |settings, value| {
                let Value::Whole(whole) = value else { return false };
                whole.try_into().map(|whole| settings.nodes.encoders$($place)+ = whole).is_ok()
            },
        }
    };
}

/// Which way a counter shall go.
macro_rules! code_sequence {
    ($key:literal, $name:literal, $kinds:expr, $number:literal) => {
        Leaf {
            key: $key,
            name: $name,
            unit: "",
            bounds: (0.0, (CODE_SEQUENCES.len() - 1) as f64),
            kinds: $kinds,
            choices: &["any", "rising_clockwise", "falling_clockwise"],
            get: |settings| {
                let set = settings.nodes.encoders[$number].code_sequence;
                Value::Whole(CODE_SEQUENCES.iter().position(|known| *known == set).unwrap_or(0) as u64)
            },
            set: |settings, value| {
                let Value::Whole(number) = value else { return false };
                let chosen = usize::try_from(number).ok().and_then(|number| CODE_SEQUENCES.get(number));
                chosen.map(|chosen| settings.nodes.encoders[$number].code_sequence = *chosen).is_some()
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
            kinds: &VehicleKind::ALL,
            choices: &[],
            get: |settings| Value::Whole(settings.$($field).+.into()),
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
            kinds: &VehicleKind::ALL,
            choices: &[],
            get: |settings| Value::Number(settings.$($field).+),
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
            kinds: &VehicleKind::ALL,
            choices: &[],
            get: |settings| Value::Switch(settings.$($field).+),
            set: |settings, value| {
                let Value::Switch(is_on) = value else { return false };
                settings.$($field).+ = is_on;
                true
            },
        }
    };
}

/// One of several, by the numbers of the enumeration.
macro_rules! choice {
    ($key:literal, $name:literal, $kind:ident, $($field:ident).+) => {
        Leaf {
            key: $key,
            name: $name,
            unit: "",
            bounds: (0.0, ($kind::NAMES.len() - 1) as f64),
            kinds: &VehicleKind::ALL,
            choices: &$kind::NAMES,
            get: |settings| Value::Whole(settings.$($field).+ as u64),
            set: |settings, value| {
                let Value::Whole(number) = value else { return false };
                $kind::of_number(number).map(|chosen| settings.$($field).+ = chosen).is_some()
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
            kinds: &VehicleKind::ALL,
            choices: &[],
            get: |settings| Value::Address(settings.$($field).+),
            set: |settings, value| {
                let Value::Address(address) = value else { return false };
                settings.$($field).+ = address;
                true
            },
        }
    };
}

/// The kinds with at least two, three and four driven wheels of equal standing.
const TWO_WHEELS: &[VehicleKind] = &[Differential, BiSteerable, Ackermann, Omni3, Omni4, Mecanum];
const THREE_WHEELS: &[VehicleKind] = &[Omni3, Omni4, Mecanum];
const FOUR_WHEELS: &[VehicleKind] = &[Omni4, Mecanum];
/// The kinds with at least two, three and four counters.
const TWO_COUNTERS: &[VehicleKind] = &[Tricycle, Differential, BiSteerable, Ackermann, Omni3, Omni4, Mecanum];
const THREE_COUNTERS: &[VehicleKind] = &[BiSteerable, Ackermann, Omni3, Omni4, Mecanum];
const FOUR_COUNTERS: &[VehicleKind] = &[BiSteerable, Omni4, Mecanum];
/// The kinds whose own controllers tell how they move.
const SPEEDS: &[VehicleKind] = &[TricycleSpeed, CarSpeed];
const FRAMES: &[VehicleKind] = &[TricycleSpeed, CarSpeed, Increments];

const LENGTH: (f64, f64) = (0.05, 50.0);
const PLACE: (f64, f64) = (-50.0, 50.0);
const ANGLE: (f64, f64) = (-core::f64::consts::TAU, core::f64::consts::TAU);
const SCALE: (f64, f64) = (-1.0, 1.0);
const NODE: (f64, f64) = (1.0, 127.0);
const PROFILE: (f64, f64) = (402.0, 406.0);
const CODE_SEQUENCES: [Option<CodeSequence>; 3] =
    [None, Some(CodeSequence::RisingClockwise), Some(CodeSequence::FallingClockwise)];

/// Every setting. A key belongs to its setting for ever: a setting that goes leaves its key unused.
pub static LEAVES: [Leaf; 160] = [
    Leaf {
        key: 107,
        name: "vehicle.kind",
        unit: "",
        bounds: (0.0, (VehicleKind::ALL.len() - 1) as f64),
        kinds: &VehicleKind::ALL,
        choices: &VehicleKind::NAMES,
        get: |settings| Value::Whole(settings.vehicle.kind as u64),
        set: |settings, value| {
            let Value::Whole(number) = value else { return false };
            let Some(kind) = u8::try_from(number).ok().and_then(VehicleKind::of_number) else { return false };
            settings.vehicle.kind = kind;
            settings.take_vehicle();
            true
        },
    },
    vehicle!(100, "vehicle.wheelbase", "m", &[Tricycle, TricycleSpeed, CarSpeed, Ackermann, Mecanum], wheelbase),
    vehicle!(108, "vehicle.track", "m", &[Differential, Ackermann, Mecanum], LENGTH, [track]),
    vehicle!(109, "vehicle.arm", "m", &[Omni3, Omni4], LENGTH, [arm]),
    vehicle!(110, "vehicle.first_wheel", "rad", &[Omni3, Omni4], ANGLE, [first_wheel]),
    vehicle!(111, "vehicle.speed_wheel", "m", &[CarSpeed], PLACE, [speed_wheel]),
    vehicle!(101, "vehicle.drive_scale", "m/tick", &[Tricycle], drive_scale),
    vehicle!(102, "vehicle.steering_scale", "rad/tick", &[Tricycle, Ackermann], steering_scale),
    vehicle!(
        103,
        "vehicle.steering_offset_forward",
        "rad",
        &[Tricycle, TricycleSpeed, Ackermann],
        steering_offset_forward
    ),
    vehicle!(104, "vehicle.steering_offset_backward", "rad", &[Tricycle], steering_offset_backward),
    counter!(105, "vehicle.drive_counter_values", &[Tricycle], [drive_range]),
    counter!(106, "vehicle.steering_counter_values", &[Tricycle, Ackermann], [steering_range]),
    vehicle!(400, "vehicle.wheel_1_scale", "m/tick", TWO_WHEELS, SCALE, [wheels[0].scale]),
    counter!(401, "vehicle.wheel_1_counter_values", TWO_WHEELS, [wheels[0].range]),
    vehicle!(402, "vehicle.wheel_1_x", "m", &[BiSteerable], PLACE, [wheels[0].x]),
    vehicle!(403, "vehicle.wheel_1_y", "m", &[BiSteerable], PLACE, [wheels[0].y]),
    vehicle!(404, "vehicle.wheel_1_steering_scale", "rad/tick", &[BiSteerable], SCALE, [wheels[0].steering_scale]),
    counter!(405, "vehicle.wheel_1_steering_counter_values", &[BiSteerable], [wheels[0].steering_range]),
    vehicle!(406, "vehicle.wheel_1_steering_offset", "rad", &[BiSteerable], ANGLE, [wheels[0].steering_offset]),
    vehicle!(420, "vehicle.wheel_2_scale", "m/tick", TWO_WHEELS, SCALE, [wheels[1].scale]),
    counter!(421, "vehicle.wheel_2_counter_values", TWO_WHEELS, [wheels[1].range]),
    vehicle!(422, "vehicle.wheel_2_x", "m", &[BiSteerable], PLACE, [wheels[1].x]),
    vehicle!(423, "vehicle.wheel_2_y", "m", &[BiSteerable], PLACE, [wheels[1].y]),
    vehicle!(424, "vehicle.wheel_2_steering_scale", "rad/tick", &[BiSteerable], SCALE, [wheels[1].steering_scale]),
    counter!(425, "vehicle.wheel_2_steering_counter_values", &[BiSteerable], [wheels[1].steering_range]),
    vehicle!(426, "vehicle.wheel_2_steering_offset", "rad", &[BiSteerable], ANGLE, [wheels[1].steering_offset]),
    vehicle!(440, "vehicle.wheel_3_scale", "m/tick", THREE_WHEELS, SCALE, [wheels[2].scale]),
    counter!(441, "vehicle.wheel_3_counter_values", THREE_WHEELS, [wheels[2].range]),
    vehicle!(460, "vehicle.wheel_4_scale", "m/tick", FOUR_WHEELS, SCALE, [wheels[3].scale]),
    counter!(461, "vehicle.wheel_4_counter_values", FOUR_WHEELS, [wheels[3].range]),
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
    choice!(338, "gyro.connection", GyroConnection, gyro_connection),
    switch!(160, "maps.reflectors", parameters.maps.reflectors),
    switch!(161, "maps.features", parameters.maps.features),
    switch!(162, "maps.dynamic", parameters.maps.dynamic),
    switch!(163, "maps.start_search", start_search),
    switch!(164, "maps.slam", parameters.maps.slam),
    whole!(165, "maps.identity", "", 0.0, 4_294_967_295.0, map_identity),
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
    encoder!(301, "can.drive_node", TWO_COUNTERS, NODE, [[0].node]),
    encoder!(302, "can.steering_node", TWO_COUNTERS, NODE, [[1].node]),
    encoder!(340, "can.third_node", THREE_COUNTERS, NODE, [[2].node]),
    encoder!(341, "can.fourth_node", FOUR_COUNTERS, NODE, [[3].node]),
    whole!(303, "can.encoder_period", "ms", 1.0, 50.0, encoder_period),
    whole!(304, "can.vendor", "", 0.0, 4_294_967_295.0, nodes.vendor),
    switch!(305, "can.nmt_master", nodes.is_master),
    switch!(306, "can.self_start", nodes.starts_itself),
    switch!(307, "can.accept_pose", nodes.accepts_pose),
    whole!(308, "can.bit_rate", "kbit/s", 125.0, 1000.0, bit_rate),
    whole!(309, "can.publishing_period", "ms", 5.0, 1000.0, publishing_period),
    encoder!(310, "can.drive_profile", TWO_COUNTERS, PROFILE, [[0].profile]),
    encoder!(311, "can.steering_profile", TWO_COUNTERS, PROFILE, [[1].profile]),
    encoder!(342, "can.third_profile", THREE_COUNTERS, PROFILE, [[2].profile]),
    encoder!(343, "can.fourth_profile", FOUR_COUNTERS, PROFILE, [[3].profile]),
    code_sequence!(374, "can.drive_code_sequence", TWO_COUNTERS, 0),
    code_sequence!(375, "can.steering_code_sequence", TWO_COUNTERS, 1),
    code_sequence!(376, "can.third_code_sequence", THREE_COUNTERS, 2),
    code_sequence!(377, "can.fourth_code_sequence", FOUR_COUNTERS, 3),
    switch!(312, "can.accept_settings", nodes.accepts_settings),
    whole!(313, "can.gyro_identifier", "", 0.0, 536_870_911.0, gyro_frame.identifier),
    switch!(314, "can.gyro_extended", gyro_frame.is_extended),
    whole!(315, "can.gyro_first_byte", "", 0.0, 7.0, gyro_frame.first_byte),
    whole!(316, "can.gyro_length", "", 2.0, 4.0, gyro_frame.length),
    whole!(317, "can.gyro_axis", "", 1.0, 3.0, gyro_frame.axis),
    measure!(318, "can.gyro_unit", "rad/s", -1.0, 1.0, gyro_frame.unit),
    Leaf {
        kinds: SPEEDS,
        ..whole!(350, "can.speed_identifier", "", 0.0, 536_870_911.0, motion_frames.speed.identifier)
    },
    Leaf { kinds: SPEEDS, ..whole!(351, "can.speed_first_byte", "", 0.0, 7.0, motion_frames.speed.first_byte) },
    Leaf { kinds: SPEEDS, ..whole!(352, "can.speed_length", "", 1.0, 8.0, motion_frames.speed.length) },
    Leaf { kinds: SPEEDS, ..measure!(353, "can.speed_unit", "m/s", -1.0, 1.0, motion_frames.speed.unit) },
    Leaf { kinds: SPEEDS, ..measure!(354, "can.speed_offset", "m/s", -1000.0, 1000.0, motion_frames.speed.offset) },
    Leaf {
        kinds: SPEEDS,
        ..whole!(355, "can.angle_identifier", "", 0.0, 536_870_911.0, motion_frames.angle.identifier)
    },
    Leaf { kinds: SPEEDS, ..whole!(356, "can.angle_first_byte", "", 0.0, 7.0, motion_frames.angle.first_byte) },
    Leaf { kinds: SPEEDS, ..whole!(357, "can.angle_length", "", 1.0, 8.0, motion_frames.angle.length) },
    Leaf { kinds: SPEEDS, ..measure!(358, "can.angle_unit", "rad", -1.0, 1.0, motion_frames.angle.unit) },
    Leaf { kinds: SPEEDS, ..measure!(359, "can.angle_offset", "rad", -1000.0, 1000.0, motion_frames.angle.offset) },
    Leaf {
        kinds: &[Increments],
        ..whole!(360, "can.increment_identifier", "", 0.0, 536_870_911.0, motion_frames.increment.identifier)
    },
    Leaf {
        kinds: &[Increments],
        ..whole!(361, "can.increment_first_byte", "", 0.0, 7.0, motion_frames.increment.first_byte)
    },
    Leaf { kinds: &[Increments], ..whole!(362, "can.increment_length", "", 1.0, 2.0, motion_frames.increment.length) },
    Leaf { kinds: &[Increments], ..measure!(363, "can.increment_unit", "m", -1.0, 1.0, motion_frames.increment.unit) },
    Leaf {
        kinds: &[Increments],
        ..measure!(364, "can.increment_turn_unit", "rad", -1.0, 1.0, motion_frames.increment_turn)
    },
    Leaf { kinds: FRAMES, ..switch!(365, "can.motion_extended", motion_frames.are_extended) },
    Leaf { kinds: FRAMES, ..switch!(366, "can.motion_big_endian", motion_frames.are_big_endian) },
    Leaf { kinds: FRAMES, ..switch!(367, "can.motion_signed", motion_frames.are_signed) },
    address!(320, "network.address", network.address),
    whole!(321, "network.prefix", "", 0.0, 32.0, network.prefix),
    address!(322, "network.gateway", network.gateway),
    address!(323, "nav350.address", network.laser),
    whole!(324, "nav350.port", "", 1.0, 65_535.0, network.laser_port),
    whole!(368, "nav350.password", "", 0.0, 4_294_967_295.0, laser.password),
    whole!(369, "nav350.layer", "", 0.0, 65_535.0, laser.layer),
    choice!(370, "nav350.mode", LaserMode, laser.mode),
    whole!(371, "nav350.landmark_filter", "", 0.0, 255.0, laser.landmark_filter),
    choice!(372, "nav350.orientation", LaserOrientation, laser.orientation),
    switch!(373, "nav350.tells_speed", laser.tells_speed),
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
