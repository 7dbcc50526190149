//! A vehicle in the hall that integrates its own motion, and a laser that sees everything at once.

use std::f64::consts::{PI, TAU};

use agv_core::filter::{PoseAndSlots, packed_entries, slot_states};
use agv_core::geometry::{Point, Pose, Twist, difference};
use agv_core::localizer::{CapacitiesOf, Event, Localizer, Outputs, Parameters, PoseFix, PoseOutput};
use agv_core::maps::{Landmark, LandmarkKind};
use agv_core::measurement::{LaserId, PoseIncrement, ReflectorObservation, Reflectors, Scan, Time};
use agv_core::odometry::Vehicle;

use super::hall::{cast, corners};
use super::standing_scan;

pub const BEAMS: usize = 1440;
const KEYS: usize = 2;
const PLACES: usize = 24;
const STATES: usize = slot_states(KEYS, PLACES);
pub type Small =
    Localizer<CapacitiesOf<BEAMS, 64, 64, 32, PoseAndSlots<KEYS, PLACES, STATES, { packed_entries(STATES) }>>>;

/// Samples of the odometry in a revolution, and the time between them, us.
const SAMPLES: u64 = 12;
const INTERVAL: u64 = 10_000;

pub const LASER: Pose = Pose { x: 0.6, y: 0.1, theta: 0.3 };

pub fn parameters() -> Parameters {
    Parameters::new(Vehicle::Increments, LASER)
}

/// Reflectors on the walls, unevenly.
pub fn reflectors() -> Vec<Landmark> {
    let places = [(-6.9, -1.3), (-6.9, 3.9), (-2.2, 5.9), (1.9, 5.9), (6.6, 5.9), (8.9, 2.4), (8.9, -2.7), (4.1, -4.9)];
    let more = [(0.3, -4.9), (-4.6, -4.9), (7.4, -4.9), (4.6, 5.9)];
    let of = |(id, (x, y)): (u16, (f64, f64))| Landmark::reflector(id, Point::new(x, y), 0.002);
    (0..).zip(places.into_iter().chain(more)).map(of).collect()
}

/// The corners of the hall, which may be seen as corners and as ends of walls.
pub fn features() -> Vec<Landmark> {
    let kinds = [LandmarkKind::Corner, LandmarkKind::EndPoint];
    let of = |(id, place): (u16, Point)| {
        kinds.map(|kind| Landmark { kind, ..Landmark::reflector(2 * id + u16::from(kind == kinds[0]), place, 0.002) })
    };
    (0..).zip(corners()).flat_map(of).collect()
}

/// The motion of a while at constant velocity.
fn arc(speed: f64, turn: f64, seconds: f64) -> Pose {
    Pose::exp(&Twist { x: speed * seconds, y: 0.0, theta: turn * seconds })
}

/// Time of a revolution, s.
const REVOLUTION: f64 = (SAMPLES * INTERVAL) as f64 * 1e-6;

/// A revolution of the laser on the way.
pub struct Revolution {
    start: Time,
    from: Pose,
    speed: f64,
    turn: f64,
    laser: Pose,
}

impl Revolution {
    /// True pose of S so many seconds after its start.
    fn sensor(&self, seconds: f64) -> Pose {
        self.from.compose(&arc(self.speed, self.turn, seconds)).compose(&self.laser)
    }

    /// The reflectors in the order of the map, each at its own time.
    pub fn reflectors(&self) -> Vec<ReflectorObservation> {
        let all = reflectors();
        let seconds = |index: usize| REVOLUTION * index as f64 / all.len() as f64;
        let observe = |(index, landmark): (usize, &Landmark)| {
            let seen = self.sensor(seconds(index)).inverse_transform(&landmark.position());
            let (range, bearing) = (seen.norm() as f32, seen.y.atan2(seen.x) as f32);
            ReflectorObservation { time: self.start.offset(seconds(index)), range, bearing }
        };
        all.iter().enumerate().map(observe).collect()
    }

    /// Ranges and strengths; a reflector is 8 cm wide and brighter than a wall.
    pub fn beams(&self) -> (Vec<f32>, Vec<u16>) {
        let all = reflectors();
        let beam = |index: usize| {
            let sensor = self.sensor(REVOLUTION * index as f64 / BEAMS as f64);
            let bearing = index as f64 * TAU / BEAMS as f64 - PI;
            let hit = all
                .iter()
                .map(|landmark| sensor.inverse_transform(&landmark.position()))
                .find(|seen| difference(seen.y.atan2(seen.x), bearing).abs() < 0.04 / seen.norm());
            hit.map_or_else(|| (cast(&sensor, bearing) as f32, 0), |seen| (seen.norm() as f32, 200))
        };
        (0..BEAMS).map(beam).unzip()
    }

    pub fn scan<'a>(&self, ranges: &'a [f32], intensities: &'a [u16]) -> Scan<'a> {
        Scan {
            laser: LaserId::FIRST,
            start: self.start,
            beam_interval: REVOLUTION / BEAMS as f64,
            first_bearing: -PI,
            bearing_step: TAU / BEAMS as f64,
            ranges,
            intensities,
        }
    }
}

pub struct Stage {
    pub localizer: Box<Small>,
    pub truth: Pose,
    /// Where the laser is in truth.
    pub laser: Pose,
    /// Reported motion over the true one.
    pub scale: f64,
    pub sample: u64,
}

impl Stage {
    /// A vehicle among reflectors and features that does not know where it is.
    pub fn new(parameters: Parameters) -> Self {
        let mut localizer = Box::new(Small::new(parameters));
        assert_eq!(localizer.add_landmarks(&reflectors()), Ok(()));
        assert_eq!(localizer.add_landmarks(&features()), Ok(()));
        let truth = Pose::new(-4.5, 0.4, 0.05);
        let mut stage = Self { localizer, truth, laser: LASER, scale: 1.0, sample: 0 };
        stage.report(&Pose::default());
        stage
    }

    /// The same, and it has been told where it is.
    pub fn told(parameters: Parameters) -> Self {
        let mut stage = Self::new(parameters);
        stage.tell(stage.truth, 0.005, 0.001);
        stage
    }

    pub fn time(&self) -> Time {
        Time::from_micros(1_000_000 + self.sample * INTERVAL)
    }

    pub fn said(&self) -> PoseOutput {
        self.localizer.outputs().pose
    }

    /// How far the pose is from the truth, m and rad.
    pub fn error(&self) -> (f64, f64) {
        let off = self.truth.between(&self.said().pose);
        (off.x.hypot(off.y), off.theta.abs())
    }

    pub fn tell(&mut self, pose: Pose, position_deviation: f64, heading_deviation: f64) -> PoseOutput {
        let fix = PoseFix { time: self.time(), pose, position_deviation, heading_deviation };
        self.localizer.handle(&Event::SetPose(fix)).pose
    }

    pub fn report(&mut self, displacement: &Pose) {
        let increment = PoseIncrement { time: self.time(), displacement: *displacement };
        self.localizer.handle(&Event::Increment(increment));
    }

    /// Drives for a revolution at that speed, m/s, and rate of turn, rad/s.
    pub fn drive(&mut self, speed: f64, turn: f64) {
        let interval = INTERVAL as f64 * 1e-6;
        for _ in 0..SAMPLES {
            self.sample += 1;
            let step = arc(speed, turn, interval);
            self.truth = self.truth.compose(&step);
            self.report(&Pose { x: self.scale * step.x, ..step });
        }
    }

    /// The same, to be seen from on the way.
    pub fn revolve(&mut self, speed: f64, turn: f64) -> Revolution {
        let (start, from) = (self.time(), self.truth);
        self.drive(speed, turn);
        Revolution { start, from, speed, turn, laser: self.laser }
    }

    pub fn sensor(&self) -> Pose {
        self.truth.compose(&self.laser)
    }

    /// A point of W as the laser sees it.
    pub fn observe(&self, point: &Point) -> ReflectorObservation {
        let seen = self.sensor().inverse_transform(point);
        ReflectorObservation { time: self.time(), range: seen.norm() as f32, bearing: seen.y.atan2(seen.x) as f32 }
    }

    pub fn see(&mut self, observations: &[ReflectorObservation]) -> &Outputs {
        self.localizer.handle(&Event::Reflectors(Reflectors::of_first(observations)))
    }

    /// All reflectors, in the order of their bearings.
    pub fn view(&self) -> Vec<ReflectorObservation> {
        let mut seen: Vec<_> = reflectors().iter().map(|reflector| self.observe(&reflector.position())).collect();
        seen.sort_by(|a, b| a.bearing.total_cmp(&b.bearing));
        seen
    }

    /// Sees all reflectors.
    pub fn look(&mut self) -> PoseOutput {
        let seen = self.view();
        self.see(&seen).pose
    }

    /// Sees all reflectors, one after the other.
    pub fn glimpse(&mut self, revolution: &Revolution) -> PoseOutput {
        let seen = revolution.reflectors();
        self.see(&seen).pose
    }

    /// Sees the walls, and the reflectors as bright places, one beam after the other.
    pub fn sweep(&mut self, revolution: &Revolution) -> PoseOutput {
        let (ranges, intensities) = revolution.beams();
        self.localizer.handle(&Event::Scan(revolution.scan(&ranges, &intensities))).pose
    }

    /// Sees the walls.
    pub fn scan(&mut self) -> PoseOutput {
        self.scan_as(|_, range| range)
    }

    /// The same, with something done to each beam's range.
    pub fn scan_as(&mut self, change: impl Fn(usize, f32) -> f32) -> PoseOutput {
        let change = |beam: usize, range: f64| f64::from(change(beam, range as f32));
        let ranges = standing_scan::ranges(&self.sensor(), BEAMS, change);
        self.localizer.handle(&Event::Scan(standing_scan::scan(self.time(), &ranges))).pose
    }
}
