//! Drives whose truth is kept apart: a motion of the body over time, and what sensors of any rate, tick and delay report of it.

use std::f64::consts::{PI, TAU};

use agv_core::geometry::{Point, Pose, Twist, difference};
use agv_core::localizer::{Event, Localizer, OutputPredictor, Parameters, PoseFix, VehicleCapacities};
use agv_core::maps::Landmark;
use agv_core::measurement::{
    EncoderFault, EncoderFaults, EncoderSample, GyroSample, PoseIncrement, ReflectorObservation, Reflectors,
    SpeedSample, Time, WheelReading, WheelSample,
};
use agv_core::odometry::Vehicle;

use super::kind::{Kind, Running, STEERING_TICK};
use crate::support::walls::Noise;

/// Velocity of the body at a time, s: forward and to the left, m/s, and turn, rad/s.
pub type Motion = Box<dyn Fn(f64) -> (f64, f64, f64)>;

/// Step of the truth, s.
const STEP: f64 = 1e-3;
/// A NAV350 turns eight times a second.
pub const REVOLUTION: f64 = 0.125;
/// Noise of the laser: those that the localiser states.
const RANGE_NOISE: f64 = 4e-3;
const BEARING_NOISE: f64 = 8e-4;
/// Between the end of a revolution and its telegram, s; the same of a frame of the bus.
const LASER_DELAY: f64 = 0.01;
const BUS_DELAY: f64 = 0.002;
/// When everything is switched on.
const START: Time = Time::from_micros(100_000_000);

pub const LASER: Pose = Pose { x: 0.5, y: 0.1, theta: 0.2 };

/// How the odometry is not heard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outage {
    /// No report.
    Silence,
    /// Reports of faults instead.
    Faults,
}

/// In what the truth differs from what is believed, and the noise of the motion.
#[derive(Clone, Copy, Debug)]
pub struct Errors {
    /// What each wheel reports too much, as a share.
    pub wheels: [f64; 4],
    /// What is added to the reported steering angle, rad.
    pub steering: f64,
    /// What increments report of a turn too much, as a share.
    pub turn: f64,
    /// The laser, seen from where it is believed to be.
    pub laser: Pose,
    /// By how much the laser's times are late, s.
    pub clock: f64,
    /// Slip of a wheel, m for a root of a metre, walk of the heading, rad for a root of a metre.
    pub slip: f64,
    pub yaw: f64,
}

impl Errors {
    /// A third of the noise that is stated, and nothing that lasts.
    pub const SMALL: Self = Self {
        wheels: [0.0; 4],
        steering: 0.0,
        turn: 0.0,
        laser: Pose { x: 0.0, y: 0.0, theta: 0.0 },
        clock: 0.0,
        slip: 2e-3,
        yaw: 5e-4,
    };
}

/// A drive.
pub struct Drive {
    pub kind: Kind,
    /// Way for a tick of a drive encoder, m.
    pub tick: f64,
    /// Reports of the odometry a second.
    pub rate: f64,
    /// By how much the times of the odometry are off, even on both sides, as a share of its period.
    pub jitter: f64,
    pub delay: f64,
    /// Readings of the gyro a second; none without one.
    pub gyro: Option<f64>,
    pub gyro_latency: f64,
    pub motion: Motion,
    pub seconds: f64,
    /// From when for how long, s.
    pub outage: Option<(Outage, f64, f64)>,
    pub reflectors: Vec<Landmark>,
    /// Whether a reflector is in sight at a time.
    pub sees: Box<dyn Fn(f64, u16) -> bool>,
    pub errors: Errors,
    pub seed: u64,
}

/// An event with what it lends.
pub enum Told {
    Whole(Event<'static>),
    Seen(Vec<ReflectorObservation>),
}

/// What happened: events in the order of their arrival, and the truth each millisecond.
pub struct Happened {
    pub events: Vec<(f64, Told)>,
    truth: Vec<Pose>,
}

impl Happened {
    /// Where R was.
    pub fn truth(&self, time: Time) -> Pose {
        let place = (time.since(START) / STEP).clamp(0.0, (self.truth.len() - 1) as f64);
        let before = self.truth[place as usize];
        let after = self.truth[(place as usize + 1).min(self.truth.len() - 1)];
        before.compose(&before.between(&after).fraction(place.fract()))
    }
}

/// Reflectors on a ring around a place, unevenly, m.
pub fn ring(count: u16, x: f64, y: f64, radius: f64, seed: u64) -> Vec<Landmark> {
    let mut noise = Noise(0x2545_f491_4f6c_dd1d ^ seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let place = |id: u16| {
        let angle = TAU * (f64::from(id) + 0.7 * noise.uniform()) / f64::from(count);
        let radius = radius * (0.8 + 0.2 * noise.uniform());
        Landmark::reflector(id, Point::new(x + radius * angle.cos(), y + radius * angle.sin()), 0.002)
    };
    (0..count).map(place).collect()
}

pub fn time(seconds: f64) -> Time {
    START.offset(seconds)
}

impl Drive {
    /// A drive straight on at 0.8 m/s after six seconds of standing, at 100 Hz, among reflectors.
    pub fn new(kind: Kind) -> Self {
        Self {
            kind,
            tick: 1e-4,
            rate: 100.0,
            jitter: 0.0,
            delay: BUS_DELAY,
            gyro: None,
            gyro_latency: 0.0,
            motion: Box::new(|time| (0.8 * ramp(time, 6.0, 1.0), 0.0, 0.0)),
            seconds: 20.0,
            outage: None,
            reflectors: ring(16, 5.0, 0.0, 18.0, 1),
            sees: Box::new(|_, _| true),
            errors: Errors::SMALL,
            seed: 1,
        }
    }

    pub fn parameters(&self) -> Parameters {
        let mut parameters = Parameters::new(self.kind.vehicle(self.tick), LASER);
        parameters.gyro.is_fitted = self.gyro.is_some();
        parameters.gyro.latency = self.gyro_latency;
        parameters
    }

    /// Lets it happen.
    pub fn happen(&self) -> Happened {
        let mut noise = Noise(0x9e37_79b9_7f4a_7c15 ^ self.seed.wrapping_mul(0xd1b5_4a32_d192_ed03) | 1);
        // The first numbers of neighbouring seeds are alike.
        (0..16).for_each(|_| _ = noise.uniform());
        let steps = (self.seconds / STEP).round() as usize;
        let mut running = Running::new(self.kind);
        let mut truth = vec![Pose::default()];
        let mut rolled = vec![[0.0; 4]];
        let mut steered = vec![[0.0; 4]];
        let mut turned = vec![0.0];
        let mut reported = vec![Pose::default()];
        for step in 0..steps {
            let (along, aside, turn) = (self.motion)((step as f64 + 0.5) * STEP);
            let way = along.hypot(aside) * STEP;
            let walk = self.errors.yaw * way.sqrt() * noise.normal();
            let wanted = Twist { x: along * STEP, y: aside * STEP, theta: turn * STEP };
            let arc = Twist { theta: wanted.theta + walk, ..wanted };
            truth.push(truth[step].compose(&Pose::exp(&arc)));
            turned.push(turned[step] + arc.theta);
            let mut ways = rolled[step];
            for (way, (rolled, error)) in ways.iter_mut().zip(running.roll(&wanted).iter().zip(self.errors.wheels)) {
                *way += rolled * (1.0 + error) + self.errors.slip * rolled.abs().sqrt() * noise.normal();
            }
            rolled.push(ways);
            steered.push(running.steering);
            let scale = 1.0 + self.errors.wheels[0];
            let slip = self.errors.slip * way.sqrt() * noise.normal();
            let share = if way > 0.0 { scale + slip / way } else { 0.0 };
            let told =
                Twist { x: wanted.x * share, y: wanted.y * share, theta: wanted.theta * (1.0 + self.errors.turn) };
            reported.push(reported[step].compose(&Pose::exp(&told)));
        }
        let happened = Happened { events: Vec::new(), truth };
        let mut events = self.odometry(&rolled, &steered, &reported, &mut noise);
        events.extend(self.turns(&turned, &mut noise));
        events.extend(self.looks(&happened, &mut noise));
        events.sort_by(|a, b| a.0.total_cmp(&b.0));
        Happened { events, ..happened }
    }

    fn odometry(
        &self,
        rolled: &[[f64; 4]],
        steered: &[[f64; 4]],
        reported: &[Pose],
        noise: &mut Noise,
    ) -> Vec<(f64, Told)> {
        let mut events = Vec::new();
        let (mut last, mut last_at, mut was_silent) = (0, 0.0, false);
        let period = 1.0 / self.rate;
        for number in 0.. {
            let at = number as f64 * period;
            if at > self.seconds - 2.0 * period - STEP {
                break;
            }
            let step = (at / STEP).round() as usize;
            let stamp = time(at + self.jitter * period * (2.0 * noise.uniform() - 1.0));
            let out = self.outage.filter(|(_, from, lasts)| at > *from && at < *from + *lasts);
            let count = |way: f64| ((way / self.tick).floor() as i64 + 1_000_000).rem_euclid(1 << 32) as u32;
            let angle = |angle: f64| ((angle + self.errors.steering) / STEERING_TICK).round() as i64;
            let angle = |wheel: usize| angle(steered[step][wheel]).rem_euclid(1 << 32) as u32;
            let event = match (out, self.kind) {
                (Some((Outage::Silence, ..)), _) => None,
                (Some((Outage::Faults, ..)), _) => Some(Event::EncoderFaults(EncoderFaults {
                    time: stamp,
                    drive: Some(EncoderFault::Late),
                    steering: None,
                })),
                (None, Kind::Tricycle) => Some(Event::Encoders(EncoderSample {
                    time: stamp,
                    drive: count(rolled[step][0]),
                    steering: angle(0),
                })),
                (None, Kind::TricycleSpeed | Kind::CarSpeed) => {
                    let speed = if step > last { (rolled[step][0] - rolled[last][0]) / (at - last_at) } else { 0.0 };
                    Some(Event::Speed(SpeedSample {
                        time: stamp,
                        speed,
                        steering: steered[step][0] + self.errors.steering,
                    }))
                }
                (None, Kind::Increments) => Some(Event::Increment(PoseIncrement {
                    time: stamp,
                    displacement: reported[last].between(&reported[step]),
                })),
                (None, _) => {
                    let mut wheels = [WheelReading::default(); 4];
                    for (wheel, reading) in wheels.iter_mut().enumerate() {
                        *reading = WheelReading { count: count(rolled[step][wheel]), steering: angle(wheel) };
                    }
                    Some(Event::Wheels(WheelSample { time: stamp, wheels }))
                }
            };
            // Increments that nobody heard are lost, as the controller says that knows how often they come; a speed is the mean since the
            // report before.
            if was_silent && event.is_some() && self.kind == Kind::Increments {
                let faults = EncoderFaults { time: stamp, drive: Some(EncoderFault::Missing), steering: None };
                events.push((at + self.delay, Told::Whole(Event::EncoderFaults(faults))));
            }
            was_silent = event.is_none();
            (last, last_at) = (step, at);
            events.extend(event.map(|event| (at + self.delay, Told::Whole(event))));
        }
        events
    }

    fn turns(&self, turned: &[f64], noise: &mut Noise) -> Vec<(f64, Told)> {
        let Some(rate) = self.gyro else { return Vec::new() };
        let mut events = Vec::new();
        for number in 1.. {
            let at = number as f64 / rate;
            if at + self.gyro_latency > self.seconds - STEP {
                break;
            }
            let step = (at / STEP).round() as usize;
            let before = step.saturating_sub(((0.01_f64).min(1.0 / rate) / STEP).round() as usize);
            let mean =
                if step > before { (turned[step] - turned[before]) / ((step - before) as f64 * STEP) } else { 0.0 };
            // 8.7e-5 rad/s for a root of a hertz, and a bias.
            let rate = mean + 4e-3 + 8.7e-5 * rate.sqrt() * noise.normal();
            let sample = GyroSample { time: time(at + self.gyro_latency), rate };
            events.push((at + self.gyro_latency + 1e-3, Told::Whole(Event::Gyro(sample))));
        }
        events
    }

    fn looks(&self, happened: &Happened, noise: &mut Noise) -> Vec<(f64, Told)> {
        let mut events = Vec::new();
        for number in 0.. {
            let start = number as f64 * REVOLUTION;
            if start + REVOLUTION + LASER_DELAY > self.seconds {
                break;
            }
            let mut seen = Vec::new();
            for landmark in self.reflectors.iter().filter(|landmark| (self.sees)(start, landmark.id)) {
                let at = |share: f64| {
                    let sensor = happened.truth(time(start + share * REVOLUTION)).compose(&LASER);
                    let seen = sensor.compose(&self.errors.laser).inverse_transform(&landmark.position());
                    (seen.norm(), seen.y.atan2(seen.x))
                };
                let share = (0..4).fold(0.5, |share, _| (at(share).1 + PI) / TAU);
                let (range, bearing) = at(share);
                seen.push(ReflectorObservation {
                    time: time(start + share * REVOLUTION + self.errors.clock),
                    range: (range + RANGE_NOISE * noise.normal()) as f32,
                    bearing: difference(bearing + BEARING_NOISE * noise.normal(), 0.0) as f32,
                });
            }
            seen.sort_by_key(|one| one.time);
            events.push((start + REVOLUTION + LASER_DELAY, Told::Seen(seen)));
        }
        events
    }
}

/// From 0 to 1 within so many seconds from a time on.
pub fn ramp(time: f64, from: f64, within: f64) -> f64 {
    ((time - from) / within).clamp(0.0, 1.0)
}

/// A localiser and its predictor that are given events in the order of their arrival.
pub struct Given {
    pub localizer: Box<Localizer<VehicleCapacities>>,
    pub predictor: Box<OutputPredictor>,
    /// Events since the predictor was told what the localiser has said.
    behind: u32,
}

/// The localiser is busy with a scan for so many events.
const BUSY: u32 = 8;

impl Given {
    pub fn new(localizer: Box<Localizer<VehicleCapacities>>) -> Self {
        let predictor = Box::new(OutputPredictor::new(localizer.parameters()));
        Self { localizer, predictor, behind: 0 }
    }

    /// Where it starts, told exactly as well as a person with a tape would.
    pub fn set_pose(&mut self, time: Time, pose: &Pose) {
        let fix = PoseFix { time, pose: *pose, position_deviation: 0.01, heading_deviation: 0.003 };
        self.localizer.handle(&Event::SetPose(fix));
        self.follow();
    }

    pub fn take(&mut self, told: &Told) {
        match told {
            Told::Whole(event) => {
                match event {
                    Event::Encoders(sample) => self.predictor.encoders(sample),
                    Event::Wheels(sample) => self.predictor.wheels(sample),
                    Event::Speed(sample) => self.predictor.speed(sample),
                    Event::Increment(sample) => self.predictor.increment(sample),
                    Event::Gyro(sample) => self.predictor.gyro(sample),
                    Event::EncoderFaults(faults) => self.predictor.doubt_encoders(faults),
                    Event::Reflectors(_) | Event::Scan(_) | Event::SetPose(_) => {}
                }
                self.localizer.handle(event);
                self.behind += 1;
                if self.behind >= BUSY {
                    self.follow();
                }
            }
            Told::Seen(seen) => {
                self.localizer.handle(&Event::Reflectors(Reflectors::of_first(seen)));
                self.follow();
            }
        }
    }

    fn follow(&mut self) {
        self.behind = 0;
        self.predictor.update(&self.localizer.outputs().pose, &self.localizer.prediction_state());
    }
}

/// Whether the events of a drive are odometry.
pub fn is_odometry(told: &Told) -> bool {
    let Told::Whole(event) = told else { return false };
    matches!(event, Event::Encoders(_) | Event::Wheels(_) | Event::Speed(_) | Event::Increment(_))
}

/// Whether a vehicle has ticks.
pub fn is_counted(vehicle: &Vehicle) -> bool {
    matches!(vehicle, Vehicle::Tricycle(_) | Vehicle::Wheels(_))
}
