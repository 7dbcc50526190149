//! A calibration drive in simulation, at the level of encoder samples and reflector observations.

use agv_core::geometry::{Point, Pose, wrap};
use agv_core::localizer::Parameters;
use agv_core::measurement::ReflectorObservation;
use agv_core::odometry::{CounterRange, Tricycle, Vehicle};

use agv_host_sim::calibrate::design::{PlannedSegment, path};
use agv_host_sim::calibrate::log_input::LogInput;
use agv_host_sim::simulate::START;
use agv_host_sim::simulate::laser::LaserTrack;
use agv_host_sim::simulate::odometer;
use agv_host_sim::simulate::random::{Random, Stream};
use agv_host_sim::simulate::scenario::{DriveOptions, OdometryOptions};
use agv_host_sim::simulate::vehicle::{Motion, drive};

/// What disturbs a drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disturbance {
    /// Its name.
    pub name: &'static str,
    /// Slip, a random walk, m for the root of a metre.
    pub slip: f64,
    /// Slip that lasts for a segment, as a share of the way.
    pub segment_slip: f64,
    /// White noise of the steering angle, degrees.
    pub steering_noise_deg: f64,
    /// Error of the steering angle that lasts for a segment, degrees.
    pub segment_steering_error_deg: f64,
    /// Noise of a reflector's distance, m.
    pub range_noise: f64,
    /// Noise of its direction, degrees.
    pub bearing_noise_deg: f64,
    /// Error of a reflector's place along each axis that lasts for a segment and its stop, m.
    pub lasting_reflector_error: f64,
}

impl Disturbance {
    /// Nothing but the encoders' resolution.
    pub const NONE: Self = Self {
        name: "none",
        slip: 0.0,
        segment_slip: 0.0,
        steering_noise_deg: 0.0,
        segment_steering_error_deg: 0.0,
        range_noise: 0.0,
        bearing_noise_deg: 0.0,
        lasting_reflector_error: 0.0,
    };
    /// Slip is a random walk of 0.05 % at a metre; the steering's noise is white.
    pub const MILD: Self = Self {
        name: "mild",
        slip: 5e-4,
        steering_noise_deg: 0.01,
        range_noise: 8e-3,
        bearing_noise_deg: 0.05,
        ..Self::NONE
    };
    /// And each segment has an error of the steering angle.
    pub const MID: Self = Self { name: "mid", segment_steering_error_deg: 0.01, ..Self::MILD };
    /// And each segment has slip of 0.05 %, and reflectors are off by 3 mm that do not average.
    pub const HARD: Self = Self { name: "hard", segment_slip: 5e-4, lasting_reflector_error: 3e-3, ..Self::MID };
    /// The three models of the study in simulation.
    pub const ALL: [Self; 3] = [Self::MILD, Self::MID, Self::HARD];

    fn odometry(&self) -> OdometryOptions {
        OdometryOptions {
            rate: RATE,
            slip: self.slip,
            steering_noise_deg: self.steering_noise_deg,
            leg_steering_error_deg: self.segment_steering_error_deg,
            leg_slip: self.segment_slip,
            ..OdometryOptions::perfect()
        }
    }
}

/// Samples of the encoders a second.
const RATE: f64 = 50.0;
/// Revolutions of the laser a second.
const FREQUENCY: f64 = 8.0;
/// Revolutions at a stop; one before and one after are not whole.
const SCANS_A_STOP: f64 = 64.0;
/// Reflectors stand at equal angles around the drive, and so far outside of it, m.
const REFLECTORS: usize = 16;
const DISTANCES: [f64; 2] = [4.0, 12.0];

/// A vehicle as it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueVehicle {
    /// Its parameters.
    pub tricycle: Tricycle,
    /// Its laser.
    pub laser: Pose,
}

impl TrueVehicle {
    /// The vehicle of K tables 5.1 and 5.2, with a steering offset (degrees) forward and backward. K does not print its
    /// wheelbase; 1.5 m is what the dependence of its drive scale on it suggests.
    #[must_use]
    pub fn of_the_thesis(forward_deg: f64, backward_deg: f64) -> Self {
        let tricycle = Tricycle {
            wheelbase: 1.5,
            drive_scale: 0.249_75e-3,
            drive_range: CounterRange::BITS_16,
            steering_scale: std::f64::consts::TAU / 65536.0,
            steering_range: CounterRange::BITS_16,
            steering_offset_forward: forward_deg.to_radians(),
            steering_offset_backward: backward_deg.to_radians(),
        };
        Self { tricycle, laser: Pose::new(0.389_23, 0.002_79, 0.4046_f64.to_radians()) }
    }

    /// What a log of it believes before any calibration.
    #[must_use]
    pub fn believed(&self) -> Parameters {
        let tricycle = Tricycle {
            drive_scale: 0.25e-3,
            steering_offset_forward: 0.0,
            steering_offset_backward: 0.0,
            ..self.tricycle
        };
        let round = |value: f64| (value * 50.0).round() / 50.0;
        Parameters::new(Vehicle::Tricycle(tricycle), Pose::new(round(self.laser.x), round(self.laser.y), 0.0))
    }
}

/// One observation without noise.
#[derive(Clone, Copy, Debug)]
struct Exact {
    time: f64,
    range: f64,
    bearing: f64,
    reflector: usize,
}

/// A reflector that somebody moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReflectorMove {
    /// Which, from zero to fifteen.
    pub reflector: usize,
    /// When, s since the start of the drive.
    pub time: f64,
    /// How far, m.
    pub shift: Point,
}

/// A drive without noise, ready to be disturbed as often as one likes.
#[derive(Clone, Debug)]
pub struct Course {
    vehicle: TrueVehicle,
    motion: Motion,
    reflectors: Vec<Point>,
    revolutions: Vec<(usize, Vec<Exact>)>,
}

impl Course {
    /// Drives `segments` with a driving wheel of `speed` (m/s) among reflectors that `seed` places.
    #[must_use]
    pub fn new(vehicle: TrueVehicle, segments: &[PlannedSegment], speed: f64, seed: u64) -> Self {
        Self::with_moved_reflectors(vehicle, segments, speed, seed, &[])
    }

    /// The same, with reflectors that are moved during the drive.
    #[must_use]
    pub fn with_moved_reflectors(
        vehicle: TrueVehicle,
        segments: &[PlannedSegment],
        speed: f64,
        seed: u64,
        moves: &[ReflectorMove],
    ) -> Self {
        let wheelbase = vehicle.tricycle.wheelbase;
        let path = path(segments, wheelbase, Pose::default());
        let mean = segments.iter().map(|segment| segment.steering.cos()).sum::<f64>() / segments.len().max(1) as f64;
        let standstill = (SCANS_A_STOP + 2.0) / FREQUENCY;
        let options = DriveOptions {
            speed: speed * mean,
            start_standstill: standstill,
            end_standstill: standstill,
            stop_between_legs: standstill,
            ..DriveOptions::default()
        };
        let perfect = OdometryOptions { rate: RATE, ..OdometryOptions::perfect() };
        let mut random = Random::new(seed, Stream::Odometry);
        let motion = drive(&path, wheelbase, &options, &perfect, 1.0 / RATE, &mut random);
        let reflectors = reflectors(&motion, seed);
        let track = LaserTrack::new(&motion, |_, _| vehicle.laser);
        let count = (track.duration() * FREQUENCY) as usize;
        let revolution = |index: usize| {
            let start = index as f64 / FREQUENCY;
            let moved = |name: usize| {
                let done = moves.iter().filter(|one| one.reflector == name && start >= one.time);
                done.fold(Point::zeros(), |sum, one| sum + one.shift)
            };
            let mut seen: Vec<Exact> = reflectors
                .iter()
                .enumerate()
                .map(|(name, place)| exact(&track, start, name, &(place + moved(name))))
                .collect();
            seen.sort_by(|first, second| first.time.total_cmp(&second.time));
            let state = ((start + 0.5 / FREQUENCY) * RATE) as usize;
            (motion.states[state.min(motion.states.len() - 1)].leg, seen)
        };
        let revolutions = (0..count).map(revolution).collect();
        Self { vehicle, motion, reflectors, revolutions }
    }

    /// Where the reflectors stand at the beginning, in W, where R starts in the origin.
    #[must_use]
    pub fn reflectors(&self) -> &[Point] {
        &self.reflectors
    }

    /// Duration, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.motion.interval * (self.motion.states.len().saturating_sub(1)) as f64
    }

    /// What the sensors say with the disturbances that `seed` draws.
    #[must_use]
    pub fn log(&self, disturbance: &Disturbance, seed: u64) -> LogInput {
        let mut input = LogInput::new(self.vehicle.believed());
        let mut random = Random::new(seed, Stream::Odometry);
        let options = disturbance.odometry();
        input.encoders = odometer::encoders(&self.motion, &self.vehicle.tricycle, &options, START, &mut random);
        let mut random = Random::new(seed, Stream::Reflectors);
        let lasting = disturbance.lasting_reflector_error;
        let bearing_noise = disturbance.bearing_noise_deg.to_radians();
        let mut errors = [[0.0; 2]; REFLECTORS];
        let mut of_leg = None;
        for (leg, revolution) in &self.revolutions {
            if lasting > 0.0 && of_leg.replace(*leg) != Some(*leg) {
                errors = std::array::from_fn(|_| [lasting * random.normal(), lasting * random.normal()]);
            }
            let observation = |seen: &Exact| {
                let [along, across] = errors[seen.reflector];
                ReflectorObservation {
                    time: START.offset(seen.time),
                    range: (seen.range + along + disturbance.range_noise * random.normal()) as f32,
                    bearing: wrap(seen.bearing + across / seen.range + bearing_noise * random.normal()) as f32,
                }
            };
            input.revolutions.push(revolution.iter().map(observation).collect());
        }
        input
    }
}

/// Reflectors around the drive.
fn reflectors(motion: &Motion, seed: u64) -> Vec<Point> {
    let mut random = Random::new(seed, Stream::World);
    let (mut low, mut high) = (Point::repeat(f64::INFINITY), Point::repeat(f64::NEG_INFINITY));
    for state in &motion.states {
        (low, high) = (low.inf(&state.pose.position()), high.sup(&state.pose.position()));
    }
    let (centre, radius) = (0.5 * (low + high), 0.5 * (high - low).norm());
    let place = |index: usize| {
        let angle = (index as f64 + 0.6 * random.uniform()) / REFLECTORS as f64 * std::f64::consts::TAU;
        let distance = radius + random.between(DISTANCES[0], DISTANCES[1]);
        centre + Point::new(angle.cos(), angle.sin()) * distance
    };
    (0..REFLECTORS).map(place).collect()
}

/// When the beam of the revolution that starts at `start` (s) crosses a reflector, and where it is then.
fn exact(track: &LaserTrack, start: f64, reflector: usize, place: &Point) -> Exact {
    let look = |time: f64| {
        let (origin, heading) = track.at(time);
        let offset = place - origin;
        (offset.norm(), libm::atan2(offset.y, offset.x) - heading)
    };
    let mut time = start + 0.5 / FREQUENCY;
    for _ in 0..4 {
        let (_, bearing) = look(time);
        time = start + (0.5 + wrap(bearing) / std::f64::consts::TAU) / FREQUENCY;
    }
    let (range, bearing) = look(time);
    Exact { time, range, bearing: wrap(bearing), reflector }
}
