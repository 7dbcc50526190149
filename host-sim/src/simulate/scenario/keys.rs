//! All numbers that a scenario can state: their units, their bounds, and what they mean. The book's reference is made of this
//! table, and a scenario is held against it.

/// A key that holds a number, or lists of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key {
    /// Its tables and its name, with dots between them.
    pub name: &'static str,
    /// Its unit, or empty.
    pub unit: &'static str,
    /// Least and greatest value.
    pub bounds: [f64; 2],
    /// What it means.
    pub meaning: &'static str,
}

const fn key(name: &'static str, unit: &'static str, bounds: [f64; 2], meaning: &'static str) -> Key {
    Key { name, unit, bounds, meaning }
}

/// Distances in a world, m.
const PLACE: [f64; 2] = [-1000.0, 1000.0];
/// Directions. Twice around lets a drawing count on.
const TURN: [f64; 2] = [-720.0, 720.0];
const SHARE: [f64; 2] = [0.0, 1.0];
/// Seeds: all whole numbers that TOML has.
const SEED: [f64; 2] = [0.0, 9.223_372_036_854_776e18];
const COUNTER: [f64; 2] = [2.0, 4_294_967_296.0];
/// Standard deviations of lengths, m.
const SPREAD: [f64; 2] = [0.0, 10.0];
/// Standard deviations of angles, deg.
const SPREAD_DEG: [f64; 2] = [0.0, 90.0];
const SECONDS: [f64; 2] = [0.0, 86_400.0];
/// Sizes of things, m.
const SIZE: [f64; 2] = [0.0, 1000.0];

/// Every key that holds numbers.
pub const KEYS: [Key; 123] = [
    key("seed", "", SEED, "seed of all random numbers"),
    key("world.seed", "", SEED, "seed of dimensions and positions; the scenario's if absent"),
    key("world.moved_share", "", SHARE, "block storage: share of the pallets that have been moved"),
    key("world.moved_by", "m", PLACE, "block storage: how far they have been moved"),
    key("world.filled_share", "", SHARE, "hall: share of the racks' places that are taken"),
    key("world.walls", "m", PLACE, "shapes: x and y of one end, x and y of the other"),
    key("world.rectangles.x", "m", PLACE, "centre of a box"),
    key("world.rectangles.y", "m", PLACE, "centre of a box"),
    key("world.rectangles.heading_deg", "deg", TURN, "direction of its length"),
    key("world.rectangles.length", "m", SIZE, "its length"),
    key("world.rectangles.width", "m", SIZE, "its width"),
    key("world.circles.x", "m", PLACE, "centre of a column"),
    key("world.circles.y", "m", PLACE, "centre of a column"),
    key("world.circles.radius", "m", SIZE, "its radius"),
    key("world.reflectors.x", "m", PLACE, "axis of a reflector"),
    key("world.reflectors.y", "m", PLACE, "axis of a reflector"),
    key("world.reflectors.radius", "m", SIZE, "its radius"),
    key("world.reflectors.farthest", "m", SIZE, "how far away it is detected"),
    key("world.reflectors.facing_deg", "deg", TURN, "middle of the directions from which it is seen; all if absent"),
    key("world.reflectors.half_width_deg", "deg", [0.0, 180.0], "half of the width of these directions"),
    key("path.start.x", "m", PLACE, "where a way of legs starts"),
    key("path.start.y", "m", PLACE, "where a way of legs starts"),
    key("path.start.heading_deg", "deg", TURN, "in which direction"),
    key("path.legs.segments.length", "m", [1e-6, 100_000.0], "length of a line or an arc"),
    key("path.legs.segments.curvature", "1/m", [-100.0, 100.0], "its curvature; positive to the left"),
    key("drive.speed", "m/s", [1e-3, 50.0], "speed of the logical point"),
    key("drive.acceleration", "m/s^2", [1e-3, 100.0], "acceleration"),
    key("drive.braking", "m/s^2", [1e-3, 100.0], "braking"),
    key("drive.start_standstill", "s", SECONDS, "standstill at the start"),
    key("drive.end_standstill", "s", SECONDS, "standstill at the end"),
    key("drive.stop_between_legs", "s", SECONDS, "standstill between two legs"),
    key("drive.steering_rate_deg", "deg/s", [1e-3, 100_000.0], "fastest turn of the driving wheel"),
    key("drive.carries.from", "s", SECONDS, "when the vehicle is lifted and set down, after the first event"),
    key("drive.carries.x", "m", PLACE, "how far forward"),
    key("drive.carries.y", "m", PLACE, "how far to the left"),
    key("drive.carries.heading_deg", "deg", TURN, "how far it is turned"),
    key("vehicle.believed.wheelbase", "m", [0.05, 50.0], "from the rear axle to the steering axis"),
    key("vehicle.believed.drive_scale", "m/tick", [1e-9, 1.0], "way of the driving wheel for one tick"),
    key("vehicle.believed.drive_counter", "", COUNTER, "values of the driving wheel's counter"),
    key("vehicle.believed.steering_counter", "", COUNTER, "values of the steering counter, which is one turn"),
    key("vehicle.believed.steering_offset_forward_deg", "deg", TURN, "steering offset forward"),
    key("vehicle.believed.steering_offset_backward_deg", "deg", TURN, "steering offset backward"),
    key("vehicle.believed.encoder_offset", "m", [-20.0, 20.0], "car: the wheel with the speed sensor, to the left"),
    key("vehicle.believed.track", "m", [0.05, 50.0], "distance of two wheels side by side, or opposite each other"),
    key("vehicle.true.drive_scale_error", "", [-0.999, 0.999], "true way a tick over the believed one, minus one"),
    key("vehicle.true.steering_offset_error_deg", "deg", TURN, "true steering offset minus the believed one"),
    key("vehicle.true.steering_offset_backward_error_deg", "deg", TURN, "what is added to that backward"),
    key(
        "vehicle.true.wheel_difference",
        "",
        [-0.5, 0.5],
        "several wheels: radius of the left or front ones over the others, minus one",
    ),
    key("vehicle.true.wheelbase_error", "m", [-50.0, 50.0], "true wheelbase minus the believed one"),
    key("vehicle.true.laser_error.x", "m", [-20.0, 20.0], "true mounting of the laser minus the believed one"),
    key("vehicle.true.laser_error.y", "m", [-20.0, 20.0], "the same"),
    key("vehicle.true.laser_error.heading_deg", "deg", TURN, "the same"),
    key("odometry.rate", "Hz", [0.1, 10_000.0], "samples a second"),
    key("odometry.slip", "m/sqrt(m)", SPREAD, "what the driving wheel turns too much or too little"),
    key("odometry.steering_noise_deg", "deg", SPREAD_DEG, "noise of a reading of the steering angle"),
    key("odometry.leg_steering_error_deg", "deg", SPREAD_DEG, "error of the steering angle that lasts for a leg"),
    key("odometry.leg_slip", "", SHARE, "slip that lasts for a leg, as a share of the way"),
    key("odometry.yaw_walk_deg", "deg/sqrt(m)", SPREAD_DEG, "walk of the heading"),
    key("odometry.side_slip", "m/sqrt(m)", SPREAD, "shift to the side"),
    key("odometry.slips.from", "s", SECONDS, "when a wheel begins to slip, after the first event"),
    key("odometry.slips.lasts", "s", SECONDS, "for how long"),
    key("odometry.slips.share", "", [-1.0, 10.0], "what it turns too much, as a share of its way"),
    key("odometry.slips.wheel", "", [0.0, 3.0], "which wheel, from 0; that of a tricycle drives"),
    key("gyro.rate", "Hz", [1.0, 1000.0], "readings a second"),
    key("gyro.noise_deg", "deg/s", SPREAD_DEG, "noise of a reading"),
    key("gyro.bias_deg", "deg/s", SPREAD_DEG, "bias at the start"),
    key("gyro.drift_deg_h", "deg/h", [0.0, 100_000.0], "what the bias walks in a minute"),
    key("gyro.scale_error", "", [0.0, 0.5], "error of the scale; the seed chooses its sign"),
    key("gyro.latency", "s", [0.0, 0.2], "from the end of a reading to when it is heard"),
    key("gyro.range_deg", "deg/s", [1.0, 10_000.0], "largest rate that it tells"),
    key("gyro.step_deg", "deg/s", [0.0, 10.0], "step of what it tells"),
    key("gyro.faults.from", "s", SECONDS, "when something goes wrong with it, after the first event"),
    key("gyro.faults.lasts", "s", SECONDS, "for how long"),
    key("gyro.faults.jump_deg", "deg/s", [-100.0, 100.0], "by how much its bias is another one"),
    key("laser.mounting.x", "m", [-20.0, 20.0], "believed mounting, S in R"),
    key("laser.mounting.y", "m", [-20.0, 20.0], "the same"),
    key("laser.mounting.heading_deg", "deg", TURN, "the same"),
    key("laser.beams", "", [1.0, 100_000.0], "beams a revolution"),
    key("laser.frequency", "Hz", [0.01, 1000.0], "revolutions a second"),
    key("laser.range_noise", "m", SPREAD, "noise of a range up to 30 m"),
    key("laser.far_range_noise", "m", SPREAD, "noise of a range beyond 30 m"),
    key("laser.bearing_noise_deg", "deg", SPREAD_DEG, "noise of a beam's direction"),
    key("laser.systematic.range_bias", "m", [-1.0, 1.0], "what each range is too long"),
    key("laser.systematic.range_scale", "", [-0.1, 0.1], "the same as a share of the range"),
    key(
        "laser.systematic.incidence",
        "m",
        [-1.0, 1.0],
        "what the range of a flat reflector is too long, seen from its edge",
    ),
    key("laser.systematic.first_harmonic_deg", "deg", SPREAD_DEG, "largest error of a direction by its first harmonic"),
    key("laser.systematic.first_phase_deg", "deg", TURN, "direction at which that begins to grow"),
    key("laser.systematic.second_harmonic_deg", "deg", SPREAD_DEG, "the same by the second harmonic"),
    key("laser.systematic.second_phase_deg", "deg", TURN, "direction at which that begins to grow"),
    key("laser.nearest", "m", SIZE, "nearest return"),
    key("laser.farthest", "m", [1e-3, 10_000.0], "farthest return"),
    key("laser.latency", "s", [0.0, 60.0], "from the last beam to the arrival of the scan"),
    key("laser.mixed_share", "", SHARE, "beams on an edge that report a distance between its sides"),
    key("laser.divergence_deg", "deg", [0.0, 45.0], "width of a beam, for mixing"),
    key("laser.lost_share", "", SHARE, "beams that are lost"),
    key("laser.knocks.from", "s", SECONDS, "when the laser is knocked, after the first event"),
    key("laser.knocks.lasts", "s", SECONDS, "how long that takes; 0 for a blow"),
    key("laser.knocks.steps", "", [0.0, 1000.0], "in how many blows; 0 for one motion"),
    key("laser.knocks.x", "m", PLACE, "how far forward, in S"),
    key("laser.knocks.y", "m", PLACE, "how far to the left, in S"),
    key("laser.knocks.heading_deg", "deg", TURN, "how far it is turned"),
    key(
        "laser.ages.from",
        "s",
        SECONDS,
        "when the laser's data begin to be older than they state, after the first event",
    ),
    key("laser.ages.lasts", "s", SECONDS, "how long it takes to come to that; 0 for a step"),
    key("laser.ages.seconds", "s", [-1.0, 1.0], "how old"),
    key("laser.dirty_sectors.from_deg", "deg", TURN, "where dirt on the window starts, counter-clockwise"),
    key("laser.dirty_sectors.to_deg", "deg", TURN, "where it ends"),
    key("laser.dirty_sectors.lost_share", "", SHARE, "beams that it swallows"),
    key("reflectors.range_noise", "m", SPREAD, "noise of a range"),
    key("reflectors.bearing_noise_deg", "deg", SPREAD_DEG, "noise of a direction"),
    key("reflectors.farthest", "m", [0.0, 10_000.0], "none is detected beyond"),
    key("reflectors.missing_share", "", SHARE, "visible reflectors that are missed"),
    key("reflectors.false_share", "", SHARE, "false reflectors for each detected one"),
    key("reflectors.survey_deviation", "m", SPREAD, "error of a surveyed position along each axis"),
    key("reflectors.correlated_survey", "m", SPREAD, "error along each axis that near reflectors share"),
    key("reflectors.survey_length", "m", [0.1, 1000.0], "distance over which it is correlated"),
    key("reflectors.latency", "s", [0.0, 60.0], "from the end of the revolution to their arrival"),
    key("floor.deviation", "m", [0.0, 1.0], "height of the floor's waves, standard deviation"),
    key("floor.length", "m", [0.1, 1000.0], "distance over which the height is correlated"),
    key("floor.laser_height", "m", [0.0, 20.0], "height of the laser above it"),
    key("start.position_deviation", "m", [0.0, 1000.0], "error of the start pose along each axis"),
    key("start.heading_deviation_deg", "deg", [0.0, 180.0], "error of its heading"),
    key("people.way", "m", PLACE, "corners of a closed way, x and y"),
    key("people.speed", "m/s", [-50.0, 50.0], "speed on it"),
];

/// What is chosen by a word or by yes and no: key, values, meaning.
pub const CHOICES: [[&str; 3]; 22] = [
    ["world.kind", "block_storage, warehouse_hall, shapes", "what stands where"],
    [
        "world.reflectors",
        "none, aisle, aisle_and_lane_end; true, false",
        "where a block storage, or whether a hall, has reflectors",
    ],
    ["path.kind", "p1, p2, p3, p4, mapping, hall_loop, legs", "the way"],
    ["path.legs.direction", "forward, backward", "sense of travel of a leg"],
    [
        "vehicle.reports",
        "encoders, tricycle_speed, speed, increments, differential, bi_steerable, ackermann, three_omnidirectional, omnidirectional, \
         mecanum",
        "what the vehicle reports of its motion",
    ],
    [
        "vehicle.true.random_signs",
        "true, false",
        "whether the seed chooses the signs of the errors of scale and offset",
    ],
    ["vehicle.true.drive_reversed", "true, false", "a mistake: the driving wheel's encoder counts the wrong way"],
    ["vehicle.true.steering_reversed", "true, false", "a mistake: the steering's encoder counts the wrong way"],
    ["vehicle.true.encoders_swapped", "true, false", "a mistake: each encoder is taken for the other"],
    ["odometry.slips", "list of tables", "when a wheel slips"],
    ["gyro.fitted", "true, false", "whether the vehicle has a gyro"],
    ["gyro.faults", "list of tables", "what goes wrong with the gyro"],
    ["gyro.faults.frozen", "true, false", "whether it tells the same rate all the time"],
    ["gyro.faults.silent", "true, false", "whether it tells nothing"],
    ["laser.scans", "true, false", "whether the localiser is given scans"],
    ["laser.intensities", "true, false", "whether strengths are reported"],
    ["laser.dirty_sectors", "list of tables", "where the window is dirty"],
    ["start.given", "true, false", "whether the localiser is told where it starts"],
    ["people", "list of tables", "who walks about"],
    ["people.shape", "torso, legs", "what the laser sees of somebody"],
    ["people.phase", "0 to 1", "share of the way that is behind at the start; the seed chooses if absent"],
    ["path.legs", "list of tables", "the legs, for a way of legs"],
];

/// The key of that name.
#[must_use]
pub fn find(name: &str) -> Option<&'static Key> {
    KEYS.iter().find(|key| key.name == name)
}
