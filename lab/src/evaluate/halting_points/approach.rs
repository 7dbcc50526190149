//! A vehicle that drives to a point and stops there, steered by its own estimate of the pose.

use std::f64::consts::{PI, TAU};

use agv_core::geometry::{Point, Pose, Twist, wrap};
use agv_core::localizer::{Event, Localizer, Parameters, PoseFix};
use agv_core::maps::Landmark;
use agv_core::measurement::{EncoderSample, ReflectorObservation, Reflectors, Time};
use agv_core::odometry::{Tricycle, Vehicle};

use crate::evaluate::calibration::course::{Disturbance, TrueVehicle};
use agv_host_sim::calibrate::model::VehicleModel;
use agv_host_sim::simulate::START;
use agv_host_sim::simulate::path::{Direction, Leg};
use agv_host_sim::simulate::random::{Random, Stream};
use agv_host_sim::simulate::vehicle::steering_command;

/// Revolutions of the laser a second, and samples of the encoders in each.
const FREQUENCY: f64 = 8.0;
const STEPS_A_REVOLUTION: usize = 6;
const STEP: f64 = 1.0 / (FREQUENCY * STEPS_A_REVOLUTION as f64);
/// Speed (m/s), acceleration and braking (m/s2), and the speed of the last millimetres.
const SPEED: f64 = 0.8;
const ACCELERATION: f64 = 0.3;
const CREEP: f64 = 0.01;
/// The vehicle stops when it believes to be so near, m.
const NEAR: f64 = 2e-4;
/// Fastest turn of the driving wheel, rad/s.
const STEERING_RATE: f64 = PI / 3.0;
/// Standstill before the way, s, in which the localiser settles.
const SETTLING: f64 = 3.0;
/// No way takes longer, s.
const LONGEST: f64 = 120.0;
/// Deviations of the start pose that the localiser is given, m and rad.
const START_DEVIATION: (f64, f64) = (5e-3, 5e-4);

/// The way to a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Approach {
    /// Where R starts.
    pub start: Pose,
    /// The way; its end is where the vehicle is to stop.
    pub leg: Leg,
    /// Reflectors along it.
    pub reflectors: Vec<Point>,
    /// The same as they were surveyed.
    pub map: Vec<Landmark>,
}

impl Approach {
    /// Where the vehicle is to stop.
    #[must_use]
    pub fn target(&self) -> Pose {
        self.leg.pose(&self.start, self.leg.length())
    }
}

/// What the vehicle is, in truth.
struct Plant<'a> {
    truth: &'a TrueVehicle,
    disturbance: &'a Disturbance,
    random: Random,
    pose: Pose,
    /// True angle of the driving wheel, rad.
    steering: f64,
    counted: f64,
    direction: Direction,
    /// Errors that last for the leg: of the steering angle (rad) and of the counted distance (share).
    lasting: [f64; 2],
    time: f64,
    seen: Vec<ReflectorObservation>,
}

impl<'a> Plant<'a> {
    /// A vehicle that stands beside its start, as exactly as it is told where it is.
    fn new(approach: &Approach, truth: &'a TrueVehicle, disturbance: &'a Disturbance, seed: u64) -> Self {
        let mut random = Random::new(seed, Stream::Odometry);
        let lasting = [
            disturbance.segment_steering_error_deg.to_radians() * random.normal(),
            disturbance.segment_slip * random.normal(),
        ];
        let counted = random.uniform();
        let mut given = Random::new(seed, Stream::Start);
        let mut off = |deviation: f64| deviation * given.normal();
        let (position, heading) = START_DEVIATION;
        Self {
            truth,
            disturbance,
            random,
            pose: approach.start.compose(&Pose::new(off(position), off(position), off(heading))),
            steering: 0.0,
            counted,
            direction: approach.leg.direction,
            lasting,
            time: 0.0,
            seen: Vec::new(),
        }
    }

    fn offset(&self) -> f64 {
        let tricycle = &self.truth.tricycle;
        match self.direction {
            Direction::Forward => tricycle.steering_offset_forward,
            Direction::Backward => tricycle.steering_offset_backward,
        }
    }

    fn encoders(&mut self) -> EncoderSample {
        let Tricycle { drive_scale, drive_range, steering_scale, steering_range, .. } = self.truth.tricycle;
        let noise = self.disturbance.steering_noise_deg.to_radians() * self.random.normal();
        let reading = self.steering - self.offset() + self.lasting[0] + noise;
        let count = |ticks: f64, values: u64| (ticks as i64).rem_euclid(values as i64) as u32;
        EncoderSample {
            time: START.offset(self.time),
            drive: count((self.counted / drive_scale).floor(), drive_range.values()),
            steering: count((reading / steering_scale).round(), steering_range.values()),
        }
    }

    /// Moves the driving wheel by `way` (m) while it turns to `steering` (rad), and looks at the reflectors that the beam
    /// passes meanwhile.
    fn step(&mut self, way: f64, steering: f64, reflectors: &[Point]) {
        let mean = 0.5 * (self.steering + steering);
        let along = way * mean.cos();
        let twist = Twist { x: along, y: 0.0, theta: way * mean.sin() / self.truth.tricycle.wheelbase };
        let slip = self.disturbance.slip * way.abs().sqrt() * self.random.normal();
        self.counted += way * (1.0 + self.lasting[1]) + slip;
        let before = self.pose;
        let moved = Pose::exp(&twist);
        self.pose = before.compose(&moved);
        self.steering = steering;
        let first = TAU * (self.time * FREQUENCY).fract() - PI;
        for place in reflectors {
            let bearing = bearing_range(&before.compose(&self.truth.laser), place).0;
            let lead = (bearing - first).rem_euclid(TAU) / TAU / FREQUENCY;
            if lead < STEP {
                let sensor = before.compose(&moved.fraction(lead / STEP)).compose(&self.truth.laser);
                let (bearing, range) = bearing_range(&sensor, place);
                let noise = self.disturbance.bearing_noise_deg.to_radians() * self.random.normal();
                self.seen.push(ReflectorObservation {
                    time: START.offset(self.time + lead),
                    range: (range + self.disturbance.range_noise * self.random.normal()) as f32,
                    bearing: wrap(bearing + noise) as f32,
                });
            }
        }
        self.time += STEP;
    }
}

fn bearing_range(sensor: &Pose, place: &Point) -> (f64, f64) {
    let seen = sensor.inverse_transform(place);
    (seen.y.atan2(seen.x), seen.norm())
}

/// Drives there with what the vehicle believes of itself, and gives where R really stops. None if it never arrives or its
/// map does not fit into the localiser.
#[must_use]
pub fn drive(
    approach: &Approach,
    truth: &TrueVehicle,
    believed: &VehicleModel,
    disturbance: &Disturbance,
    seed: u64,
) -> Option<Pose> {
    let tricycle = believed.apply(&truth.tricycle);
    let parameters = Parameters::new(Vehicle::Tricycle(tricycle), believed.laser);
    let mut localizer: Box<Localizer> = Box::new(Localizer::new(parameters));
    localizer.add_landmarks(&approach.map).ok()?;
    let direction = approach.leg.direction;
    let mut plant = Plant::new(approach, truth, disturbance, seed);
    let (position_deviation, heading_deviation) = START_DEVIATION;
    localizer.handle(&Event::SetPose(PoseFix {
        time: Time::from_micros(START.micros()),
        pose: approach.start,
        position_deviation,
        heading_deviation,
    }));
    let (mut way, mut speed) = (0.0, 0.0_f64);
    let mut steps = 0;
    loop {
        let sample = plant.encoders();
        let mut pose = localizer.handle(&Event::Encoders(sample)).pose.pose;
        if steps % STEPS_A_REVOLUTION == 0 && !plant.seen.is_empty() {
            let mut observations = std::mem::take(&mut plant.seen);
            observations.sort_by_key(|seen| seen.time);
            pose = localizer.handle(&Event::Reflectors(Reflectors::of_first(&observations))).pose.pose;
        }
        steps += 1;
        if plant.time > LONGEST {
            return None;
        }
        // How far along the way the vehicle believes to be.
        let sign = direction.sign();
        way += sign * approach.leg.pose(&approach.start, way).between(&pose).x;
        way = way.clamp(0.0, approach.leg.length() + 0.1);
        let rest = approach.leg.length() - way;
        if rest < NEAR {
            return Some(plant.pose);
        }
        let wanted = steering_command(&approach.leg, &approach.start, [way, way], &pose, believed.wheelbase);
        // What is commanded is a reading of the encoder.
        let believed_offset = if sign < 0.0 { believed.offset_backward } else { believed.offset_forward };
        let command = wanted - believed_offset + plant.offset();
        let turn = STEERING_RATE * STEP;
        let steering = plant.steering + (command - plant.steering).clamp(-turn, turn);
        let top = if plant.time < SETTLING { 0.0 } else { SPEED.min((2.0 * ACCELERATION * rest).sqrt()).max(CREEP) };
        speed = top.min(speed + ACCELERATION * STEP);
        plant.step(sign * speed * STEP / wanted.cos(), steering, &approach.reflectors);
    }
}
