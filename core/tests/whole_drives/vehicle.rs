//! A simulated vehicle in the hall: its truth is kept apart from what its sensors tell.

use std::f64::consts::{PI, TAU};

use agv_core::filter::{PoseAndSlots, packed_entries, slot_states};
use agv_core::geometry::{Point, Pose, Twist, difference};
use agv_core::localizer::{CapacitiesOf, Event, Localizer, OutputPredictor, Parameters, PoseFix};
use agv_core::maps::Landmark;
use agv_core::measurement::{
    EncoderSample, GyroSample, LaserId, PoseIncrement, ReflectorObservation, Reflectors, Scan, SpeedSample, Time,
    WheelReading, WheelSample,
};
use agv_core::odometry::{
    Ackermann, AckermannWheels, AngleEncoder, BiSteerable, CounterRange, Differential, DrivenWheel, GyroParameters,
    SteeredWheel, Tricycle, Vehicle, WheelVehicle,
};
use agv_core::sources::Contours;

use crate::support::hall::{cast, walls};
use crate::support::kept_map::kept_map;
use crate::support::stage::{features, reflectors};
use crate::support::walls::Noise;

const BEAMS: usize = 720;
const KEYS: usize = 2;
const PLACES: usize = 24;
const STATES: usize = slot_states(KEYS, PLACES);
type Slots = PoseAndSlots<KEYS, PLACES, STATES, { packed_entries(STATES) }>;
type Small = Localizer<CapacitiesOf<BEAMS, 64, 64, 32, Slots, Contours<'static, 600, 4096>>>;

/// Where the laser is believed to be in R.
const LASER: Pose = Pose { x: 0.6, y: 0.1, theta: 0.3 };

/// Samples of the odometry in a revolution, and the time between them, s.
const SAMPLES: usize = 12;
const INTERVAL: f64 = 0.01;
const REVOLUTION: f64 = SAMPLES as f64 * INTERVAL;

const WHEELBASE: f64 = 1.2;
const TRACK: f64 = 0.6;
const TICK: f64 = 1e-4;
const STEERING_TICK: f64 = 1e-4;

/// How a vehicle moves and reports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    Tricycle,
    Differential,
    BiSteerable,
    /// A car with counters of its rear wheels and of its steering.
    Car,
    /// A car that tells a speed and an angle.
    Speeds,
    Increments,
}

impl Kind {
    fn vehicle(self) -> Vehicle {
        let turn = AngleEncoder { scale: TICK / 0.1, range: CounterRange::BITS_16 };
        let wheel = DrivenWheel { radius: 0.1, turn };
        match self {
            Self::Tricycle => Vehicle::Tricycle(Tricycle {
                wheelbase: WHEELBASE,
                drive_scale: TICK,
                drive_range: CounterRange::BITS_16,
                steering_scale: STEERING_TICK,
                steering_range: CounterRange::BITS_16,
                steering_offset_forward: 0.0,
                steering_offset_backward: 0.0,
            }),
            Self::Differential => {
                Vehicle::Wheels(WheelVehicle::Differential(Differential { track: TRACK, left: wheel, right: wheel }))
            }
            Self::BiSteerable => {
                let steering = AngleEncoder { scale: STEERING_TICK, range: CounterRange::BITS_16 };
                let steered = |x: f64| SteeredWheel { x, y: 0.0, drive: wheel, steering, steering_offset: 0.0 };
                Vehicle::Wheels(WheelVehicle::BiSteerable(BiSteerable { front: steered(0.7), rear: steered(-0.7) }))
            }
            Self::Car => {
                let rear = Differential { track: TRACK, left: wheel, right: wheel };
                let steering = AngleEncoder { scale: STEERING_TICK, range: CounterRange::BITS_16 };
                let car = AckermannWheels { rear, wheelbase: WHEELBASE, steering, steering_offset: 0.0 };
                Vehicle::Wheels(WheelVehicle::Ackermann(car))
            }
            Self::Speeds => Vehicle::Ackermann(Ackermann { wheelbase: WHEELBASE, encoder_offset: 0.5 * TRACK }),
            Self::Increments => Vehicle::Increments,
        }
    }
}

/// What differs from what the localiser believes.
#[derive(Clone, Copy)]
pub struct Wrong {
    /// True place of the laser, as the localiser's believed one sees it.
    pub laser: Pose,
    /// Share by which the driving wheel, or the left one, tells too much.
    pub scale: f64,
    /// What is added to the steering angle, rad.
    pub steering: f64,
    /// By how much the laser's times are late, s.
    pub late: f64,
    /// Which reflectors are seen, by their numbers.
    pub sees: fn(u16) -> bool,
    /// Where a reflector really is.
    pub moved: fn(u16, Point) -> Point,
    /// How much slower the floor lets the vehicle turn than it steers, as a share.
    pub drift: f64,
    /// Whether scans are seen.
    pub scans: bool,
    /// What is added to the gyro's bias, rad/s.
    pub gyro: f64,
    /// Whether the gyro repeats itself.
    pub is_frozen: bool,
    /// Whether it tells nothing.
    pub is_mute: bool,
    /// How fast it is turned by hand, rad/s.
    pub spin: f64,
    /// Whether the odometry says nothing.
    pub is_silent: bool,
}

impl Wrong {
    pub const NOTHING: Self = Self {
        laser: Pose { x: 0.0, y: 0.0, theta: 0.0 },
        scale: 0.0,
        steering: 0.0,
        late: 0.0,
        sees: |_| true,
        moved: |_, place| place,
        drift: 0.0,
        scans: true,
        gyro: 0.0,
        is_frozen: false,
        is_mute: false,
        spin: 0.0,
        is_silent: false,
    };
    pub const BLIND: Self = Self { sees: |_| false, scans: false, ..Self::NOTHING };
    pub const REFLECTORS: Self = Self { scans: false, ..Self::NOTHING };
}

pub struct Drive {
    kind: Kind,
    pub localizer: Box<Small>,
    pub predictor: Box<OutputPredictor>,
    pub truth: Pose,
    pub wrong: Wrong,
    noise: Noise,
    sample: u64,
    /// What the wheels have travelled, m.
    ways: [f64; 2],
    steering: [f64; 2],
    speed: f64,
    turn: f64,
    told: f64,
    told_speed: f64,
    has_gyro: bool,
    /// True poses since the revolution began.
    poses: Vec<Pose>,
    /// True poses at all samples.
    truths: Vec<Pose>,
}

/// What a vehicle is equipped with.
#[derive(Clone, Copy)]
pub struct Equipment {
    pub kind: Kind,
    pub gyro: bool,
    pub landmarks: bool,
    pub contours: bool,
    /// Share by which the map is larger than the hall.
    pub stretch: f64,
    pub is_told: bool,
    pub set: fn(&mut Parameters),
}

impl Equipment {
    pub const STANDARD: Self = Self {
        kind: Kind::Tricycle,
        gyro: false,
        landmarks: true,
        contours: false,
        stretch: 0.0,
        is_told: true,
        set: |_| (),
    };
}

impl Drive {
    pub fn new(equipment: &Equipment, seed: u64) -> Self {
        let mut parameters = Parameters::new(equipment.kind.vehicle(), LASER);
        parameters.gyro = GyroParameters { is_fitted: equipment.gyro, ..GyroParameters::default() };
        (equipment.set)(&mut parameters);
        let mut localizer = Box::new(Small::new(parameters));
        let stretched = |landmark: Landmark| {
            let by = 1.0 + equipment.stretch;
            Landmark { x: landmark.x * by, y: landmark.y * by, ..landmark }
        };
        if equipment.landmarks {
            let all: Vec<_> = reflectors().into_iter().chain(features()).map(stretched).collect();
            localizer.add_landmarks(&all).unwrap();
        }
        localizer.set_contours(equipment.contours.then(|| kept_map(&walls(), &Pose::default())));
        let mut drive = Self {
            kind: equipment.kind,
            localizer,
            predictor: Box::new(OutputPredictor::new(&parameters)),
            truth: Pose::new(-4.5, 0.4, 0.05),
            wrong: Wrong::NOTHING,
            noise: Noise(0x9e37_79b9_7f4a_7c15 ^ seed),
            sample: 0,
            ways: [3.0, 5.0],
            steering: [0.0; 2],
            speed: 0.0,
            turn: 0.0,
            told: 0.0,
            told_speed: 0.0,
            has_gyro: equipment.gyro,
            poses: Vec::new(),
            truths: Vec::new(),
        };
        drive.truths.push(drive.truth);
        drive.report(&Pose::default());
        if equipment.is_told {
            drive.tell(drive.time(), drive.truth, 0.01, 0.003);
        }
        drive
    }

    pub fn time(&self) -> Time {
        Time::from_micros(1_000_000 + self.sample * 10_000)
    }

    /// Where it was at the newest sample at or before a time, carried on to it.
    pub fn truth_at(&self, time: Time) -> Pose {
        let samples = time.since(Time::from_micros(1_000_000)).max(0.0) / INTERVAL;
        let before = (samples as usize).min(self.truths.len() - 1);
        let after = (before + 1).min(self.truths.len() - 1);
        let since = self.truths[before].between(&self.truths[after]);
        self.truths[before].compose(&since.fraction(samples - before as f64))
    }

    pub fn tell(&mut self, time: Time, pose: Pose, position_deviation: f64, heading_deviation: f64) {
        let fix = PoseFix { time, pose, position_deviation, heading_deviation };
        self.handle(&Event::SetPose(fix));
    }

    fn handle(&mut self, event: &Event<'_>) {
        self.localizer.handle(event);
        // As on a vehicle whose localiser is busy with what the laser has seen: it speaks behind that.
        if !matches!(event, Event::SetPose(_) | Event::Reflectors(_) | Event::Scan(_)) {
            return;
        }
        let said = self.localizer.outputs().pose;
        self.predictor.update(&said, &self.localizer.prediction_state());
    }

    fn report(&mut self, displacement: &Pose) {
        let time = self.time();
        let count = |way: f64| ((way / TICK).floor() as i64).rem_euclid(65_536) as u32;
        let angle = |angle: f64| ((angle / STEERING_TICK).floor() as i64).rem_euclid(65_536) as u32;
        let reading =
            |wheel: usize| WheelReading { count: count(self.ways[wheel]), steering: angle(self.steering[wheel]) };
        match self.kind {
            Kind::Tricycle => {
                let sample = EncoderSample { time, drive: count(self.ways[0]), steering: angle(self.steering[0]) };
                self.predictor.encoders(&sample);
                self.handle(&Event::Encoders(sample));
            }
            Kind::Differential | Kind::BiSteerable | Kind::Car => {
                let mut wheels = [WheelReading::default(); 4];
                (wheels[0], wheels[1]) = (reading(0), reading(1));
                wheels[2].steering = angle(self.steering[0]);
                self.predictor.wheels(&WheelSample { time, wheels });
                self.handle(&Event::Wheels(WheelSample { time, wheels }));
            }
            Kind::Speeds => {
                let (speed, steering) = (self.told_speed, self.steering[0]);
                self.handle(&Event::Speed(SpeedSample { time, speed, steering }));
            }
            Kind::Increments => self.handle(&Event::Increment(PoseIncrement { time, displacement: *displacement })),
        }
    }

    /// One sample of the odometry on, towards a speed, m/s, and a rate of turn, rad/s.
    fn step(&mut self, speed: f64, turn: f64) {
        self.sample += 1;
        self.speed += (speed - self.speed).clamp(-0.02, 0.02);
        self.turn += (turn - self.turn).clamp(-0.02, 0.02);
        let (way, angle) = (INTERVAL * self.speed, INTERVAL * self.turn);
        let root = way.abs().sqrt();
        let walk = 4e-4 * root * self.noise.normal();
        let turned = angle * (1.0 - self.wrong.drift) + walk + INTERVAL * self.wrong.spin;
        self.truth = self.truth.compose(&Pose::exp(&Twist { x: way, y: 0.0, theta: turned }));
        self.poses.push(self.truth);
        self.truths.push(self.truth);
        let mut slip = || 5e-4 * root * self.noise.normal();
        let told = |way: f64, wrong: f64| way * (1.0 + wrong);
        match self.kind {
            Kind::Tricycle => {
                let across = WHEELBASE * angle;
                self.ways[0] += told(way.hypot(across).copysign(way), self.wrong.scale) + slip();
                if way != 0.0 {
                    self.steering[0] = (across / way).atan() + self.wrong.steering;
                }
            }
            Kind::Differential | Kind::Car | Kind::Speeds => {
                let left = told(way - 0.5 * TRACK * angle, self.wrong.scale) + slip();
                self.ways[0] += left;
                self.ways[1] += way + 0.5 * TRACK * angle + slip();
                self.told_speed = left / INTERVAL;
                if way != 0.0 {
                    self.steering[0] = (WHEELBASE * angle / way).atan() + self.wrong.steering;
                }
            }
            Kind::BiSteerable => {
                for (wheel, x) in [(0, 0.7), (1, -0.7)] {
                    let across = x * angle;
                    self.ways[wheel] += told(way.hypot(across).copysign(way), self.wrong.scale) + slip();
                    if way != 0.0 {
                        self.steering[wheel] = (across / way).atan() + self.wrong.steering;
                    }
                }
            }
            Kind::Increments => (),
        }
        let displacement = Pose::exp(&Twist { x: told(way, self.wrong.scale) + slip(), y: 0.0, theta: angle });
        if self.has_gyro && !self.wrong.is_mute {
            let rate = turned / INTERVAL + 4e-3 + self.wrong.gyro + 8.7e-4 * self.noise.normal();
            self.told = if self.wrong.is_frozen { self.told } else { (rate / 1.6e-4).round() * 1.6e-4 };
            let sample = GyroSample { time: self.time().offset(-0.003), rate: self.told };
            self.predictor.gyro(&sample);
            self.handle(&Event::Gyro(sample));
        }
        if !self.wrong.is_silent {
            self.report(&displacement);
        }
    }

    /// A revolution: the odometry on the way, and what the laser has seen meanwhile. Gives whoever looks each sample.
    pub fn revolve(&mut self, (speed, turn): (f64, f64), mut look: impl FnMut(&Self)) {
        let start = self.time().offset(self.wrong.late);
        self.poses = vec![self.truth];
        for _ in 0..SAMPLES {
            self.step(speed, turn);
            look(self);
        }
        let seen = self.reflectors(start);
        if !seen.is_empty() {
            self.handle(&Event::Reflectors(Reflectors::of_first(&seen)));
            look(self);
        }
        if self.wrong.scans {
            let ranges = self.ranges();
            self.handle(&Event::Scan(Scan {
                laser: LaserId::FIRST,
                start,
                beam_interval: REVOLUTION / BEAMS as f64,
                first_bearing: -PI,
                bearing_step: TAU / BEAMS as f64,
                ranges: &ranges,
                intensities: &[],
            }));
            look(self);
        }
    }

    /// True pose of S when such a share of the revolution had passed.
    fn sensor(&self, share: f64) -> Pose {
        let sample = share * SAMPLES as f64;
        let before = (sample as usize).min(SAMPLES - 1);
        let since = self.poses[before].between(&self.poses[before + 1]).fraction(sample - before as f64);
        self.poses[before].compose(&since).compose(&LASER).compose(&self.wrong.laser)
    }

    /// The reflectors in the order of their bearings, each at its own time.
    fn reflectors(&mut self, start: Time) -> Vec<ReflectorObservation> {
        let Wrong { sees, moved, .. } = self.wrong;
        let mut seen: Vec<ReflectorObservation> = Vec::new();
        for landmark in reflectors().iter().filter(|landmark| sees(landmark.id)) {
            let place = moved(landmark.id, landmark.position());
            let bearing_at = |share: f64| {
                let seen = self.sensor(share).inverse_transform(&place);
                (seen.norm(), seen.y.atan2(seen.x))
            };
            let share = (0..3).fold(0.5, |share, _| (bearing_at(share).1 + PI) / TAU);
            let (range, bearing) = bearing_at(share);
            let range = range + 4e-3 * self.noise.normal();
            let bearing = difference(bearing + 8e-4 * self.noise.normal(), 0.0);
            let time = start.offset(share * REVOLUTION);
            seen.push(ReflectorObservation { time, range: range as f32, bearing: bearing as f32 });
        }
        seen.sort_by_key(|one| one.time);
        seen
    }

    fn ranges(&mut self) -> Vec<f32> {
        let range = |beam: usize| {
            let bearing = beam as f64 * TAU / BEAMS as f64 - PI;
            cast(&self.sensor(beam as f64 / BEAMS as f64), bearing)
        };
        let exact: Vec<f64> = (0..BEAMS).map(range).collect();
        exact.into_iter().map(|range| (range + 8e-3 * self.noise.normal()) as f32).collect()
    }
}
