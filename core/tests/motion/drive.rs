//! A vehicle with an exact path, in a hall with reflectors, and the events that it gives.

use agv_core::geometry::{Point, Pose};
use agv_core::localizer::{CapacitiesOf, Event, Localizer, Parameters, PoseFix, PoseOutput};
use agv_core::maps::{Landmark, LandmarkKind};
use agv_core::measurement::{EncoderSample, PoseIncrement, ReflectorObservation, Reflectors, SpeedSample, Time};
use agv_core::odometry::{Ackermann, CounterRange, Tricycle, Vehicle};

pub type Hall = Localizer<CapacitiesOf<360, 128, 16, 16>>;

const WHEELBASE: f64 = 1.5;
const TICK: f64 = 1e-4;
const STEERING_TICK: f64 = 1e-4;
/// Time of the path's beginning, us.
const START: u64 = 1_000_000;
/// Time of a revolution, us.
pub const REVOLUTION: u64 = 125_000;
/// Steps of the path in a second.
const FINE: f64 = 1e4;

/// How the vehicle tells its motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    Encoders,
    Speeds,
    Increments,
}

pub const KINDS: [Kind; 3] = [Kind::Encoders, Kind::Speeds, Kind::Increments];

/// Where a steered wheel leads, from its speed and its angle at any time.
pub struct Path {
    control: fn(f64) -> (f64, f64),
    poses: Vec<(Pose, f64)>,
}

impl Path {
    pub fn new(seconds: f64, control: fn(f64) -> (f64, f64)) -> Self {
        let mut poses = vec![(Pose::default(), 0.0)];
        for step in 0..(seconds * FINE) as usize {
            let (speed, steering) = control((step as f64 + 0.5) / FINE);
            let (pose, way) = poses[step];
            let wheel = speed / FINE;
            let turn = wheel / WHEELBASE * steering.sin();
            let along = wheel * steering.cos();
            let step = Pose::new(along * (0.5 * turn).cos(), along * (0.5 * turn).sin(), turn);
            poses.push((pose.compose(&step), way + wheel));
        }
        Self { control, poses }
    }

    /// One metre a second, straight on.
    pub fn straight(seconds: f64) -> Self {
        Self::new(seconds, |_| (1.0, 0.0))
    }

    /// Pose and way of the wheel.
    fn at(&self, time: Time) -> (Pose, f64) {
        let place = (time.since(Time::from_micros(START)) * FINE).clamp(0.0, (self.poses.len() - 2) as f64);
        let (index, share) = (place as usize, place.fract());
        let ((before, way), (after, next)) = (self.poses[index], self.poses[index + 1]);
        (before.compose(&before.between(&after).fraction(share)), way + share * (next - way))
    }

    pub fn pose(&self, time: Time) -> Pose {
        self.at(time).0
    }

    /// Distance of a stated position from the path, m.
    pub fn error(&self, output: &PoseOutput) -> f64 {
        (output.pose.position() - self.pose(output.time).position()).norm()
    }
}

/// Reflectors in an uneven grid, none of them at the same distance from its neighbours.
pub fn reflectors() -> Vec<Landmark> {
    (0..99u16)
        .map(|id| Landmark {
            id,
            kind: LandmarkKind::Reflector,
            x: f64::from(id % 11) * 6.0 - 14.0 + 1.6 * noise(u64::from(id), 1),
            y: f64::from(id / 11) * 6.0 - 20.0 + 1.6 * noise(u64::from(id), 2),
            deviation: 0.002,
        })
        .collect()
}

/// A number between -1 and 1 that looks random.
fn noise(a: u64, b: u64) -> f64 {
    let mixed = (a << 32 | b).wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mixed = (mixed ^ mixed >> 29).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    ((mixed ^ mixed >> 32) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

pub fn parameters(kind: Kind, slam: bool) -> Parameters {
    let vehicle = match kind {
        Kind::Encoders => Vehicle::Tricycle(Tricycle {
            wheelbase: WHEELBASE,
            drive_scale: TICK,
            drive_range: CounterRange::BITS_32,
            steering_scale: STEERING_TICK,
            steering_range: CounterRange::BITS_16,
            steering_offset_forward: 0.0,
            steering_offset_backward: 0.0,
        }),
        Kind::Speeds => Vehicle::Ackermann(Ackermann { wheelbase: WHEELBASE, encoder_offset: 0.0 }),
        Kind::Increments => Vehicle::Increments,
    };
    let mut parameters = Parameters::new(vehicle, Pose::new(0.9, 0.0, 0.0));
    parameters.maps.slam = slam;
    parameters.maps.features = false;
    parameters
}

/// A drive along a path.
pub struct Drive<'a> {
    pub path: &'a Path,
    pub localizer: Box<Hall>,
    kind: Kind,
    /// Time between two samples of the odometry, us.
    period: u64,
    /// Share by which the odometry says too little.
    pub scale: f64,
    /// How late the laser's revolutions come, us.
    pub latency: u64,
    pub is_odometry_silent: bool,
    pub is_laser_silent: bool,
    /// By how much the laser's clock is ahead, s.
    pub laser_ahead: f64,
    /// Time since the path's beginning, us.
    now: u64,
    said: u64,
}

impl<'a> Drive<'a> {
    /// Begins with a pose that is nearly right.
    pub fn start(path: &'a Path, kind: Kind, slam: bool, rate: u64) -> Self {
        let mut localizer = Box::new(Hall::new(parameters(kind, slam)));
        localizer.add_landmarks(&reflectors()).unwrap();
        let period = 1_000_000 / rate;
        let mut drive = Self {
            path,
            localizer,
            kind,
            period,
            scale: 0.0,
            latency: 0,
            is_odometry_silent: false,
            is_laser_silent: false,
            laser_ahead: 0.0,
            now: 0,
            said: 0,
        };
        drive.tell_odometry(0);
        drive.set_pose(0.0);
        drive
    }

    pub fn time(&self) -> Time {
        Time::from_micros(START + self.now)
    }

    pub fn said(&self) -> PoseOutput {
        self.localizer.outputs().pose
    }

    /// Tells where the vehicle was that many seconds ago.
    pub fn set_pose(&mut self, ago: f64) -> PoseOutput {
        let time = self.time().offset(-ago);
        let fix = PoseFix { time, pose: self.path.pose(time), position_deviation: 0.01, heading_deviation: 0.003 };
        self.localizer.handle(&Event::SetPose(fix)).pose
    }

    /// What the odometry says at a time since the path's beginning, us.
    pub fn sample(&self, micros: u64) -> Event<'static> {
        let time = Time::from_micros(START + micros);
        let (speed, steering) = (self.path.control)(micros as f64 * 1e-6);
        let (pose, way) = self.path.at(time);
        let less = 1.0 / (1.0 + self.scale);
        match self.kind {
            Kind::Encoders => Event::Encoders(EncoderSample {
                time,
                drive: (less * way / TICK).round() as i64 as u32,
                steering: (steering / STEERING_TICK).round() as i64 as u32 & 0xFFFF,
            }),
            Kind::Speeds => Event::Speed(SpeedSample { time, speed: less * speed * steering.cos(), steering }),
            Kind::Increments => {
                let step = self.path.pose(Time::from_micros(START + self.said)).between(&pose);
                let displacement = Pose { x: less * step.x, y: less * step.y, theta: step.theta };
                Event::Increment(PoseIncrement { time, displacement })
            }
        }
    }

    fn tell_odometry(&mut self, micros: u64) {
        let event = self.sample(micros);
        self.said = micros;
        self.localizer.handle(&event);
    }

    /// The reflectors that are seen in a revolution, each at its own time.
    pub fn revolution(&self, index: u64) -> Vec<ReflectorObservation> {
        let start = Time::from_micros(START + index * REVOLUTION);
        let laser = *self.localizer.parameters().lasers.first();
        let mut seen: Vec<_> = reflectors()
            .iter()
            .filter_map(|reflector| {
                let at = |time: Time| {
                    let laser = self.path.pose(time).compose(&laser);
                    laser.inverse_transform(&Point::new(reflector.x, reflector.y))
                };
                let mut turn = 0.5;
                for _ in 0..4 {
                    let place = at(start.offset(turn * REVOLUTION as f64 * 1e-6));
                    turn = place.y.atan2(place.x).rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU;
                }
                let time = start.offset(turn * REVOLUTION as f64 * 1e-6);
                let place = at(time);
                let id = u64::from(reflector.id);
                let range = place.norm() + 0.008 * noise(index * 3 + 7, id);
                let bearing = place.y.atan2(place.x) + 0.0008 * noise(index * 3 + 8, id);
                (range < 12.0).then_some(ReflectorObservation { time, range: range as f32, bearing: bearing as f32 })
            })
            .collect();
        seen.sort_by_key(|seen| seen.time);
        seen
    }

    fn tell_revolution(&mut self, index: u64) {
        let mut observations = self.revolution(index);
        for seen in &mut observations {
            seen.time = seen.time.offset(self.laser_ahead);
        }
        self.localizer.handle(&Event::Reflectors(Reflectors::of_first(&observations)));
    }

    /// Goes on for some seconds; `hear` is given what is said after each sample of the odometry.
    pub fn go(&mut self, seconds: f64, mut hear: impl FnMut(&Self)) {
        let end = self.now + (seconds * 1e6).round() as u64;
        loop {
            let sample = (self.now / self.period + 1) * self.period;
            // The first revolution that has not been complete for the latency yet.
            let revolution = (self.now.saturating_sub(self.latency) / REVOLUTION + 1) * REVOLUTION;
            let revolution =
                if self.now < self.latency { REVOLUTION + self.latency } else { revolution + self.latency };
            let next = sample.min(revolution);
            if next > end {
                self.now = end;
                return;
            }
            self.now = next;
            if next == sample && !self.is_odometry_silent {
                self.tell_odometry(next);
                hear(self);
            }
            if next == revolution && !self.is_laser_silent {
                self.tell_revolution((next - self.latency) / REVOLUTION - 1);
            }
        }
    }
}
