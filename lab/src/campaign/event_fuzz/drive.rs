//! Events of a drive through a small hall, and what may become of them.

use core::f64::consts::TAU;

use agv_core::geometry::{Point, Pose};
use agv_core::localizer::{Event, Parameters};
use agv_core::measurement::{
    EncoderFault, EncoderFaults, EncoderSample, LaserId, PoseFix, PoseIncrement, ReflectorObservation, Reflectors,
    Scan, SpeedSample, Time,
};
use agv_core::odometry::{Control, Vehicle};

use super::dice::{Dice, Source};
use super::setup::{BOXES, HALL, reflectors};

/// What one event borrows from.
#[derive(Default)]
pub struct Lists {
    ranges: Vec<f32>,
    intensities: Vec<u16>,
    observations: Vec<ReflectorObservation>,
}

/// A vehicle that drives, and tells more or less of it.
pub struct Drive {
    parameters: Parameters,
    truth: Pose,
    now: Time,
    drive: f64,
    speed: f64,
    steering: f64,
    /// One event in so many is not what it should be.
    oddness: u8,
}

/// Time between two samples, s.
const SAMPLE: f64 = 0.01;

const FAULTS: [EncoderFault; 9] = [
    EncoderFault::Late,
    EncoderFault::Missing,
    EncoderFault::Frozen,
    EncoderFault::Jumped,
    EncoderFault::OutOfRange,
    EncoderFault::Reported,
    EncoderFault::HeartbeatLost,
    EncoderFault::WrongRange,
    EncoderFault::WrongDirection,
];

impl Drive {
    /// A vehicle in the middle of the hall.
    pub fn new(parameters: Parameters, dice: &mut Dice<impl Source>) -> Self {
        // Not too near to an end of time, but sometimes near.
        let now = [1_000_000, 5, u64::MAX / 2, u64::MAX - 20_000_000][usize::from(dice.below(4))];
        let oddness = [255, 60, 12, 3][usize::from(dice.below(4))];
        Self {
            parameters,
            truth: Pose::new(0.0, 0.0, dice.between(-3.0, 3.0)),
            now: Time::from_micros(now),
            drive: 0.0,
            speed: 0.5,
            steering: 0.0,
            oddness,
        }
    }

    /// The first event, most often a pose.
    pub fn start(&mut self, dice: &mut Dice<impl Source>) -> Event<'static> {
        if dice.once_in(8) { self.odometry(dice) } else { Event::SetPose(self.fix(dice)) }
    }

    /// The next event.
    pub fn event<'a>(&mut self, dice: &mut Dice<impl Source>, lists: &'a mut Lists) -> Event<'a> {
        let choice = dice.byte();
        match choice {
            0..=199 => self.odometry(dice),
            200..=215 => self.reflectors(dice, lists),
            216..=231 => self.scan(dice, lists),
            232..=240 => Event::SetPose(self.fix(dice)),
            241..=247 => Event::EncoderFaults(self.faults(dice)),
            // What the vehicle, as it is described, does not send.
            _ => self.foreign(dice),
        }
    }

    fn is_odd(&mut self, dice: &mut Dice<impl Source>) -> bool {
        self.oddness < 255 && dice.once_in(self.oddness)
    }

    /// The present, or some other time.
    fn time(&mut self, dice: &mut Dice<impl Source>) -> Time {
        if !self.is_odd(dice) {
            return self.now;
        }
        match dice.below(8) {
            0 => Time::default(),
            1 => Time::from_micros(u64::MAX),
            2 => Time::from_micros(u64::from(dice.word()) << 32 | u64::from(dice.word())),
            3 => self.now.offset(-dice.between(0.0, 3600.0)),
            // A clock that was set, and goes on from there.
            4 => {
                self.now = self.now.offset(dice.between(-10.0, 1000.0));
                self.now
            }
            5 => self.now.offset(dice.between(0.0, 2.0)),
            _ => self.now.offset(-dice.between(0.0, 0.6)),
        }
    }

    fn odometry(&mut self, dice: &mut Dice<impl Source>) -> Event<'static> {
        let pause = if dice.once_in(100) { dice.between(0.0, 3.0) } else { SAMPLE };
        self.now = self.now.offset(pause);
        if dice.once_in(20) {
            self.speed = dice.between(-1.5, 1.5);
        }
        if dice.once_in(10) {
            self.steering = dice.between(-1.4, 1.4);
        }
        // The walls hold it.
        let ahead = self.truth.transform(&Point::new(self.speed.signum() * 1.5, 0.0));
        if ahead.x.abs() > HALL.0 || ahead.y.abs() > HALL.1 {
            self.speed = -self.speed;
        }
        let distance = self.speed * pause;
        let control = Control { distance, steering_start: self.steering, steering_end: self.steering };
        let before = self.truth;
        let wheelbase = match self.parameters.vehicle {
            Vehicle::Tricycle(vehicle) => vehicle.wheelbase,
            Vehicle::Ackermann(vehicle) => vehicle.wheelbase,
            Vehicle::TricycleSpeed(vehicle) => vehicle.wheelbase,
            Vehicle::Increments | Vehicle::Wheels(_) => 1.5,
        };
        self.truth = self.truth.compose(&control.displacement(wheelbase, self.parameters.integration));
        match self.parameters.vehicle {
            Vehicle::Tricycle(_) => self.encoders(dice, distance),
            Vehicle::Ackermann(_) | Vehicle::TricycleSpeed(_) => self.speed(dice),
            Vehicle::Increments => self.increment(dice, before.between(&self.truth)),
            Vehicle::Wheels(_) => self.foreign(dice),
        }
    }

    fn encoders(&mut self, dice: &mut Dice<impl Source>, distance: f64) -> Event<'static> {
        let Vehicle::Tricycle(vehicle) = self.parameters.vehicle else { return self.foreign(dice) };
        self.drive += distance / vehicle.drive_scale;
        let reading = |ticks: f64, values: u64| (ticks as i64).rem_euclid(values as i64) as u32;
        let mut drive = reading(self.drive, vehicle.drive_range.values());
        let mut steering = reading(self.steering / vehicle.steering_scale, vehicle.steering_range.values());
        if self.is_odd(dice) {
            match dice.below(4) {
                0 => drive = dice.word(),
                1 => steering = dice.word(),
                2 => self.drive += dice.between(-1e6, 1e6),
                _ => (drive, steering) = (u32::MAX, u32::MAX),
            }
        }
        Event::Encoders(EncoderSample { time: self.time(dice), drive, steering })
    }

    fn speed(&mut self, dice: &mut Dice<impl Source>) -> Event<'static> {
        let (mut speed, mut steering) = (self.speed, self.steering);
        if self.is_odd(dice) {
            (speed, steering) = (dice.maybe_strange(speed, 2), dice.maybe_strange(steering, 2));
        }
        Event::Speed(SpeedSample { time: self.time(dice), speed, steering })
    }

    fn increment(&mut self, dice: &mut Dice<impl Source>, displacement: Pose) -> Event<'static> {
        let displacement = if self.is_odd(dice) { strange_pose(dice, displacement) } else { displacement };
        Event::Increment(PoseIncrement { time: self.time(dice), displacement })
    }

    fn foreign(&mut self, dice: &mut Dice<impl Source>) -> Event<'static> {
        let time = self.time(dice);
        match dice.below(3) {
            0 => Event::Encoders(EncoderSample { time, drive: dice.word(), steering: dice.word() }),
            1 => Event::Speed(SpeedSample { time, speed: dice.strange(), steering: dice.strange() }),
            _ => Event::Increment(PoseIncrement { time, displacement: strange_pose(dice, Pose::default()) }),
        }
    }

    fn faults(&mut self, dice: &mut Dice<impl Source>) -> EncoderFaults {
        let time = self.time(dice);
        let mut fault = || FAULTS.get(usize::from(dice.below(16))).copied();
        EncoderFaults { time, drive: fault(), steering: fault() }
    }

    fn fix(&mut self, dice: &mut Dice<impl Source>) -> PoseFix {
        let mut fix =
            PoseFix { time: self.time(dice), pose: self.truth, position_deviation: 0.02, heading_deviation: 0.005 };
        if self.is_odd(dice) {
            match dice.below(4) {
                0 => fix.pose = strange_pose(dice, fix.pose),
                1 => fix.position_deviation = dice.strange(),
                2 => fix.heading_deviation = dice.strange(),
                _ => (fix.position_deviation, fix.heading_deviation) = (0.0, 0.0),
            }
        }
        fix
    }

    fn reflectors<'a>(&mut self, dice: &mut Dice<impl Source>, lists: &'a mut Lists) -> Event<'a> {
        let start = self.time(dice);
        let sensor = self.truth.compose(self.parameters.lasers.first());
        let observations = &mut lists.observations;
        observations.clear();
        for (landmark, number) in reflectors().zip(0_u32..) {
            let seen = sensor.inverse_transform(&landmark.position());
            observations.push(ReflectorObservation {
                time: start.offset(f64::from(number) * 1e-3),
                range: seen.norm() as f32,
                bearing: seen.y.atan2(seen.x) as f32,
            });
        }
        if self.is_odd(dice) {
            match dice.below(5) {
                0 => observations.clear(),
                // More than there is room for.
                1 => *observations = observations.iter().copied().cycle().take(200).collect(),
                2 => observations.reverse(),
                3 => observations.iter_mut().for_each(|seen| seen.bearing += 0.3),
                _ => {
                    for seen in observations.iter_mut() {
                        seen.range = dice.maybe_strange(f64::from(seen.range), 4) as f32;
                        seen.bearing = dice.maybe_strange(f64::from(seen.bearing), 4) as f32;
                    }
                }
            }
        }
        if dice.once_in(4) {
            let few = usize::from(dice.below(8));
            observations.truncate(few);
        }
        Event::Reflectors(Reflectors::of_first(observations))
    }

    fn scan<'a>(&mut self, dice: &mut Dice<impl Source>, lists: &'a mut Lists) -> Event<'a> {
        let start = self.time(dice);
        let beams = [360, 90, 512, 600][usize::from(dice.below(4))];
        let is_backward = dice.once_in(4);
        let mut bearing_step = if is_backward { -TAU } else { TAU } / beams as f64;
        let mut first_bearing = dice.between(-3.2, 3.2);
        let mut beam_interval = if dice.once_in(4) { 0.0 } else { 0.125 / beams as f64 };
        let sensor = self.truth.compose(self.parameters.lasers.first());
        let Lists { ranges, intensities, .. } = lists;
        // Noise that costs no choices: one seed for all beams.
        let mut noise = u32::from(dice.byte());
        ranges.clear();
        intensities.clear();
        for beam in 0..beams {
            noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let direction = sensor.theta + first_bearing + beam as f64 * bearing_step;
            let range = range(sensor.position(), direction) + f64::from(noise >> 16) / 65_536.0 * 0.01;
            let place = sensor.position() + Point::new(direction.cos(), direction.sin()) * range;
            let is_reflector = reflectors().any(|landmark| (landmark.position() - place).norm() < 0.06);
            ranges.push(range as f32);
            intensities.push(if is_reflector { 900 } else { 100 });
        }
        if dice.once_in(2) {
            intensities.clear();
        }
        if self.is_odd(dice) {
            match dice.below(9) {
                0 => ranges.clear(),
                1 => ranges.truncate(usize::from(dice.below(5))),
                2 => ranges.extend_from_within(..),
                3 => intensities.truncate(7),
                4 => bearing_step = dice.strange(),
                5 => first_bearing = dice.strange(),
                6 => beam_interval = dice.strange(),
                7 => {
                    let number = dice.strange() as f32;
                    ranges.iter_mut().step_by(1 + usize::from(dice.below(16))).for_each(|range| *range = number);
                }
                _ => {
                    for range in ranges.iter_mut() {
                        *range = dice.maybe_strange(f64::from(*range), 8) as f32;
                    }
                }
            }
        }
        Event::Scan(Scan {
            laser: LaserId::FIRST,
            start,
            beam_interval,
            first_bearing,
            bearing_step,
            ranges,
            intensities,
        })
    }
}

fn strange_pose(dice: &mut Dice<impl Source>, pose: Pose) -> Pose {
    Pose {
        x: dice.maybe_strange(pose.x, 2),
        y: dice.maybe_strange(pose.y, 2),
        theta: dice.maybe_strange(pose.theta, 2),
    }
}

/// How far it is from a place in the hall to a wall or a box, m.
fn range(from: Point, direction: f64) -> f64 {
    let (sine, cosine) = direction.sin_cos();
    let axis = |from: f64, way: f64, low: f64, high: f64| {
        let (a, b) = ((low - from) / way, (high - from) / way);
        (a.min(b), a.max(b))
    };
    let box_at = |[left, low, right, high]: [f64; 4]| {
        let (enter_x, leave_x) = axis(from.x, cosine, left, right);
        let (enter_y, leave_y) = axis(from.y, sine, low, high);
        (enter_x.max(enter_y), leave_x.min(leave_y))
    };
    let (_, wall) = box_at([-HALL.0, -HALL.1, HALL.0, HALL.1]);
    let boxes = BOXES.iter().map(|corners| box_at(*corners)).filter(|(enter, leave)| *enter > 0.0 && enter < leave);
    boxes.map(|(enter, _)| enter).fold(wall, f64::min)
}
