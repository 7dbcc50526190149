//! Mapping while driving, in the localiser as a whole: a hall whose corners and reflectors are known to the test.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::support::hall::{cast, corners};
use agv_core::filter::{PoseAndSlots, packed_entries, slot_states};
use agv_core::geometry::{Point, Pose};
use agv_core::localizer::{CapacitiesOf, Event, Localizer, Mode, Parameters, PoseFix, PoseOutput};
use agv_core::maps::LandmarkKind;
use agv_core::measurement::{LaserId, PoseIncrement, ReflectorObservation, Reflectors, Scan, Time};
use agv_core::odometry::Vehicle;
use agv_core::sensing::ReflectorDetection;

const BEAMS: usize = 1440;
const KEYS: usize = 2;
const PLACES: usize = 16;
const STATES: usize = slot_states(KEYS, PLACES);
type Mapper = Localizer<CapacitiesOf<BEAMS, 64, 64, 4, PoseAndSlots<KEYS, PLACES, STATES, { packed_entries(STATES) }>>>;

/// Seconds of a revolution, and samples of the odometry in it.
const REVOLUTION: f64 = 0.125;
const SAMPLES: u64 = 10;

fn parameters() -> Parameters {
    let mut parameters = Parameters::new(Vehicle::Increments, Pose::new(0.9, 0.0, 0.0));
    parameters.maps.slam = true;
    parameters
}

/// A vehicle that drives straight along the first axis from the origin, and has been told where it is.
struct Drive {
    localizer: Box<Mapper>,
    speed: f64,
    /// True way over the one that is reported, minus one.
    scale: f64,
    sample: u64,
    way: f64,
}

impl Drive {
    fn start(parameters: Parameters, speed: f64) -> Self {
        let mut drive = Self { localizer: Box::new(Mapper::new(parameters)), speed, scale: 0.0, sample: 0, way: 0.0 };
        drive.report(0.0);
        drive.set_pose();
        drive
    }

    fn time(&self) -> Time {
        Time::from_micros(1_000_000).offset(self.sample as f64 * REVOLUTION / SAMPLES as f64)
    }

    fn set_pose(&mut self) {
        let pose = Pose::new(self.way, 0.0, 0.0);
        let fix = PoseFix { time: self.time(), pose, position_deviation: 0.01, heading_deviation: 1e-3 };
        self.localizer.handle(&Event::SetPose(fix));
    }

    fn report(&mut self, way: f64) {
        let displacement = Pose::new(way, 0.0, 0.0);
        self.localizer.handle(&Event::Increment(PoseIncrement { time: self.time(), displacement }));
    }

    /// Drives for one revolution and gives when it began.
    fn drive(&mut self) -> Time {
        let start = self.time();
        for _ in 0..SAMPLES {
            let way = self.speed * REVOLUTION / SAMPLES as f64;
            self.sample += 1;
            self.way += way;
            self.report(way / (1.0 + self.scale));
        }
        start
    }

    /// True pose of S.
    fn sensor(&self, time: Time) -> Pose {
        let way = self.way - self.speed * self.time().since(time);
        Pose::new(way, 0.0, 0.0).compose(parameters().lasers.first())
    }

    /// Takes what is seen of these points in the revolution that began at `start`.
    fn see(&mut self, start: Time, points: &[Point]) -> PoseOutput {
        let mut observations: Vec<_> = points
            .iter()
            .map(|point| {
                let bearing_at = |time| {
                    let seen = self.sensor(time).inverse_transform(point);
                    (seen.norm(), seen.y.atan2(seen.x))
                };
                let share = (bearing_at(start.offset(0.5 * REVOLUTION)).1 + PI) / TAU;
                let time = start.offset(share * REVOLUTION);
                let (range, bearing) = bearing_at(time);
                ReflectorObservation { time, range: range as f32, bearing: bearing as f32 }
            })
            .collect();
        observations.sort_by_key(|seen| seen.time);
        self.localizer.handle(&Event::Reflectors(Reflectors::of_first(&observations))).pose
    }

    /// How far the believed position is from the true one, m.
    fn error(&self) -> f64 {
        let output = self.localizer.outputs().pose;
        (output.pose.x - self.way).hypot(output.pose.y)
    }
}

/// Drives past the hall at 3 m/s with so many beams a revolution, holds every feature against the true corners, and gives how
/// many scans were too large.
fn features_are_at_corners(beams: usize, detection: Option<ReflectorDetection>) -> u8 {
    let step = TAU / beams as f64;
    let reflector = Point::new(1.5, 6.0);
    let mut parameters = parameters();
    parameters.reflectors.detection = detection;
    let mut drive = Drive::start(parameters, 3.0);
    let (mut features, mut reflectors) = (0, 0);
    let mut directions = [false; 4];
    for _ in 0..4 {
        let start = drive.drive();
        let beam_interval = REVOLUTION / beams as f64;
        let (ranges, intensities): (Vec<f32>, Vec<u16>) = (0..beams)
            .map(|beam| {
                let sensor = drive.sensor(start.offset(beam as f64 * beam_interval));
                let bearing = -FRAC_PI_2 + beam as f64 * step;
                let range = cast(&sensor, bearing);
                let (sine, cosine) = (sensor.theta + bearing).sin_cos();
                let hit = sensor.position() + range * Point::new(cosine, sine);
                (range as f32, u16::from((hit - reflector).norm() < 0.06))
            })
            .unzip();
        let first_bearing = -FRAC_PI_2;
        let scan = Scan {
            laser: LaserId::FIRST,
            start,
            beam_interval,
            first_bearing,
            bearing_step: step,
            ranges: &ranges,
            intensities: &intensities,
        };
        let uses = drive.localizer.handle(&Event::Scan(scan)).uses.clone();
        reflectors += uses.iter().filter(|seen| seen.kind == LandmarkKind::Reflector).count();
        for seen in uses.iter().filter(|seen| seen.kind == LandmarkKind::Corner) {
            let located = Point::from(seen.located);
            let error = corners().map(|corner| (corner - located).norm()).fold(f64::INFINITY, f64::min);
            assert!(error < 0.06, "{located} is {error} m from the nearest corner, {detection:?}");
            features += 1;
            let [x, y] = seen.position;
            directions[usize::from(x > 0.0) + 2 * usize::from(y > 0.0)] = true;
        }
    }
    assert!(features > 12, "{features}");
    assert_eq!(reflectors, if detection.is_some() { 4 } else { 0 });
    assert!(directions.iter().all(|seen| *seen), "no features in a quarter: {directions:?}");
    drive.localizer.outputs().pose.overflows
}

#[test]
fn features_are_seen_from_where_the_laser_was_with_and_without_reflectors_in_the_scan() {
    for detection in [None, Some(ReflectorDetection::default())] {
        assert_eq!(features_are_at_corners(BEAMS, detection), 0);
    }
}

#[test]
fn a_scan_with_too_many_beams_is_thinned_and_counted() {
    for beams in [BEAMS + 1, 2880, 4320] {
        assert_eq!(features_are_at_corners(beams, Some(ReflectorDetection::default())), 4, "{beams} beams");
    }
}

/// A number between 0 and 1 that looks random.
fn noise(a: u64, b: u64) -> f64 {
    let mixed = (a << 32 | b).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mixed = (mixed ^ mixed >> 29).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    ((mixed ^ mixed >> 32) >> 11) as f64 / (1_u64 << 53) as f64
}

/// Reflectors of an endless aisle within sight of a vehicle.
fn aisle(way: f64) -> Vec<Point> {
    let middle = (way / 2.7) as i32;
    let all = (middle - 5..middle + 6).map(|index| {
        let x = 2.7 * f64::from(index) + 0.4 * f64::from(index.rem_euclid(4));
        Point::new(x, if index % 2 == 0 { 3.1 + 0.3 * f64::from(index.rem_euclid(3)) } else { -2.8 })
    });
    all.filter(|point| (point.x - way).abs() < 8.0).collect()
}

#[test]
fn false_reflectors_do_not_stay_in_a_map_of_reflectors_alone() {
    let mut parameters = parameters();
    parameters.maps.features = false;
    let mut drive = Drive::start(parameters, 1.0);
    for revolution in 0..400_u64 {
        let start = drive.drive();
        let mut points = aisle(drive.way);
        let false_one = Point::new(12.0 * noise(revolution, 1) - 6.0, 2.4 * noise(revolution, 2) - 1.2);
        points.push(drive.sensor(drive.time()).position() + false_one);
        let output = drive.see(start, &points);
        assert!(revolution < 4 || output.mode == Mode::Reflectors, "{revolution}: {:?}", output.reason);
        let is_true = |place: &Point| aisle(place.x).iter().any(|point| (point - place).norm() < 0.3);
        let (kept, wrong): (Vec<_>, Vec<_>) = drive.localizer.state_landmarks().partition(|(_, place)| is_true(place));
        assert!(wrong.len() <= 6, "{revolution}: {} false ones, {} true ones", wrong.len(), kept.len());
        let seen = points.len() - 1;
        let known =
            aisle(drive.way).iter().filter(|point| kept.iter().any(|(_, at)| (at - *point).norm() < 0.3)).count();
        assert!(known + 1 >= seen, "{revolution}: {known} of {seen}");
    }
    // Fifty metres on landmarks that were found on the way.
    assert!(drive.error() < 0.25, "{} m", drive.error());
}

/// How wrong the believed way is after ten metres without landmarks, m.
fn blind_error(drive: &Drive) -> f64 {
    let mut blind = Drive { localizer: drive.localizer.clone(), ..*drive };
    let offset = |drive: &Drive| drive.localizer.outputs().pose.pose.x - drive.way;
    let before = offset(&blind);
    for _ in 0..80 {
        blind.drive();
    }
    offset(&blind) - before
}

#[test]
fn a_scale_that_changes_is_learnt_again_on_the_way_and_at_once_when_a_pose_is_given() {
    let mut parameters = parameters();
    parameters.maps.features = false;
    let mut drive = Drive::start(parameters, 1.0);
    let drive_for = |drive: &mut Drive, revolutions: usize| {
        for _ in 0..revolutions {
            let start = drive.drive();
            drive.see(start, &aisle(drive.way));
        }
    };
    drive.scale = 0.004;
    drive_for(&mut drive, 3200);
    assert!(blind_error(&drive).abs() < 0.005, "{} m", blind_error(&drive));
    // The wheel is worn or loaded by as much as it was wrong before, to the other side.
    drive.scale = -0.004;
    let mut told = Drive { localizer: drive.localizer.clone(), ..drive };
    assert!(blind_error(&drive) > 0.07);
    drive_for(&mut drive, 4800);
    assert!(blind_error(&drive).abs() < 0.015, "after 600 m: {} m", blind_error(&drive));
    told.set_pose();
    drive_for(&mut told, 200);
    assert!(blind_error(&told).abs() < 0.01, "25 m after it was told: {} m", blind_error(&told));
}

/// What a controller asks any localiser: the same as of the one behind it.
fn asked(localizer: &impl agv_core::localizer::Localize) -> agv_core::odometry::OdometryBias {
    localizer.prediction_state().bias
}

#[test]
fn any_localiser_tells_the_bias_that_it_has_learnt() {
    let mut parameters = parameters();
    parameters.maps.features = false;
    let mut drive = Drive::start(parameters, 1.0);
    drive.scale = 0.004;
    for _ in 0..400 {
        let start = drive.drive();
        drive.see(start, &aisle(drive.way));
    }
    let bias = drive.localizer.odometry_bias();
    assert!(bias.scale.abs() > 1e-3, "{bias:?}");
    assert_eq!(asked(&*drive.localizer), bias);
    assert_eq!(asked(&&mut *drive.localizer), bias);
}
