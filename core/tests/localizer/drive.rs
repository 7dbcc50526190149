//! A vehicle that drives straight on between reflectors.

use agv_core::geometry::Pose;
use agv_core::localizer::{CapacitiesOf, Event, Localizer, Parameters, PoseFix, PoseOutput};
use agv_core::maps::{Landmark, LandmarkKind};
use agv_core::measurement::{EncoderSample, LaserId, ReflectorObservation, Reflectors, Scan, Time};
use agv_core::odometry::{CounterRange, Tricycle, Vehicle};

pub type Small = Localizer<CapacitiesOf<360, 64, 64, 32>>;

pub const TICK: f64 = 1e-4;

pub fn parameters() -> Parameters {
    let vehicle = Vehicle::Tricycle(Tricycle {
        wheelbase: 1.5,
        drive_scale: TICK,
        drive_range: CounterRange::BITS_32,
        steering_scale: 1e-3,
        steering_range: CounterRange::BITS_16,
        steering_offset_forward: 0.0,
        steering_offset_backward: 0.0,
    });
    Parameters::new(vehicle, Pose::new(0.9, 0.0, 0.0))
}

/// Reflectors in two uneven rows along a straight way.
pub fn reflectors() -> Vec<Landmark> {
    (0..24u16)
        .map(|id| Landmark {
            id,
            kind: LandmarkKind::Reflector,
            x: f64::from(id) * 3.1 + f64::from(id % 5) * 0.37 - 5.0,
            y: if id % 2 == 0 { 4.0 + f64::from(id % 3) } else { -3.5 - f64::from(id % 4) * 0.6 },
            deviation: 0.002,
        })
        .collect()
}

/// A vehicle that drives straight at 1 m/s from the origin, 100 encoder samples and 8 revolutions a second.
pub struct Drive {
    pub localizer: Box<Small>,
    pub step: u64,
    /// How far the true vehicle is beside what its encoders say, m.
    pub offset: f64,
    /// Encoder samples for which the vehicle has stood, before it drove.
    pub stood: u64,
    /// Where the laser really is in R.
    pub laser: Pose,
}

impl Drive {
    pub fn start() -> Self {
        let mut localizer = Box::new(Small::new(parameters()));
        localizer.add_landmarks(&reflectors()).unwrap();
        Self { localizer, step: 0, offset: 0.0, stood: 0, laser: *parameters().lasers.first() }
    }

    pub fn time(&self) -> Time {
        Time::from_micros(1_000_000 + self.step * 10_000)
    }

    pub fn truth(&self, time: Time) -> Pose {
        Pose::new(time.since(Time::from_micros(1_000_000 + self.stood * 10_000)), self.offset, 0.0)
    }

    pub fn set_pose(&mut self, pose: Pose) -> PoseOutput {
        let fix = PoseFix { time: self.time(), pose, position_deviation: 0.02, heading_deviation: 0.005 };
        self.localizer.handle(&Event::SetPose(fix)).pose
    }

    /// Drives for some revolutions; `sees` says which reflectors are seen, by their ids.
    pub fn revolutions(&mut self, count: usize, sees: impl Fn(u16) -> bool) -> PoseOutput {
        for _ in 0..count {
            let start = self.travel();
            self.see(start, &sees);
        }
        self.localizer.outputs().pose
    }

    /// Drives for the time of a revolution, and returns when it began.
    pub fn travel(&mut self) -> Time {
        let start = self.time();
        for _ in 0..12 {
            self.step += 1;
            let drive = ((self.step - self.stood) as f64 * 0.01 / TICK).round() as u32;
            self.localizer.handle(&Event::Encoders(EncoderSample { time: self.time(), drive, steering: 0 }));
        }
        start
    }

    /// Takes the reflectors of the revolution that has just ended.
    pub fn look(&mut self, sees: impl Fn(u16) -> bool) -> PoseOutput {
        let start = self.time().offset(-0.12);
        self.see(start, &sees);
        self.localizer.outputs().pose
    }

    pub fn see(&mut self, start: Time, sees: &impl Fn(u16) -> bool) {
        let observations: Vec<_> = reflectors()
            .iter()
            .filter(|reflector| sees(reflector.id))
            .filter_map(|reflector| self.observe(start, reflector))
            .collect();
        self.localizer.handle(&Event::Reflectors(Reflectors::of_first(&observations)));
    }

    /// A revolution of a vehicle that stands at the origin.
    pub fn stand(&mut self, sees: impl Fn(u16) -> bool) {
        let start = self.time();
        for _ in 0..12 {
            self.step += 1;
            self.stood += 1;
            self.localizer.handle(&Event::Encoders(EncoderSample { time: self.time(), drive: 0, steering: 0 }));
        }
        let laser = *parameters().lasers.first();
        let observations: Vec<_> = reflectors()
            .iter()
            .filter(|reflector| sees(reflector.id))
            .map(|reflector| laser.inverse_transform(&nalgebra::Vector2::new(reflector.x, reflector.y)))
            .map(|seen| ReflectorObservation {
                time: start.offset(0.06),
                range: seen.norm() as f32,
                bearing: seen.y.atan2(seen.x) as f32,
            })
            .collect();
        self.localizer.handle(&Event::Reflectors(Reflectors::of_first(&observations)));
    }

    pub fn observe(&self, start: Time, reflector: &Landmark) -> Option<ReflectorObservation> {
        // One look from the middle of the revolution gives the direction, and so the time, well enough.
        let bearing_at = |time: Time| {
            let laser = self.truth(time).compose(&self.laser);
            let seen = laser.inverse_transform(&nalgebra::Vector2::new(reflector.x, reflector.y));
            (seen.norm(), seen.y.atan2(seen.x))
        };
        let turn = bearing_at(start.offset(0.06)).1.rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU;
        let time = start.offset(0.12 * turn);
        let (range, bearing) = bearing_at(time);
        (range < 12.0).then_some(ReflectorObservation { time, range: range as f32, bearing: bearing as f32 })
    }
}

/// A scan of a revolution that has just ended: of walls without features, and of the reflectors that are seen.
pub fn scan_of(start: Time, seen: &[ReflectorObservation]) -> (Vec<f32>, Vec<u16>) {
    let mut ranges = vec![0.0; 360];
    let mut intensities = vec![0; 360];
    for one in seen {
        let beam = (one.time.since(start) / BEAM).round() as usize % 360;
        ranges[beam] = one.range;
        intensities[beam] = 200;
    }
    (ranges, intensities)
}

pub const BEAM: f64 = 0.12 / 360.0;

pub fn scan<'a>(start: Time, ranges: &'a [f32], intensities: &'a [u16]) -> Event<'a> {
    let bearing_step = std::f64::consts::TAU / 360.0;
    Event::Scan(Scan {
        laser: LaserId::FIRST,
        start,
        beam_interval: BEAM,
        first_bearing: 0.0,
        bearing_step,
        ranges,
        intensities,
    })
}
