//! What the monitor costs: the solutions that bound the error of the pose, alone and with all checks, in revolutions of so many reflectors on
//! a way with bends through a room.

use agv_core::geometry::{Point, Pose};
use agv_core::integrity::separation::{AssumedDeviations, LandmarkKey, Seen, SolutionSeparation};
use agv_core::integrity::{Estimate, InnovationMonitorParameters, Integrity};
use agv_core::maps::{LandmarkKind, Verdict};
use agv_core::measurement::{LaserId, ScanHead, Time};
use agv_core::odometry::Motion;
use agv_core::state::{LandmarkSource, LandmarkUse};
use agv_firmware::board::an500::stopwatch::Stopwatch;
use heapless::Vec;
use nalgebra::{Matrix2, Matrix3, Vector3};
use static_cell::{ConstStaticCell, StaticCell};

use super::Count;

static SEPARATION: StaticCell<SolutionSeparation> = StaticCell::new();
static INTEGRITY: StaticCell<Integrity> = StaticCell::new();
static RANGES: ConstStaticCell<[f32; BEAMS]> = ConstStaticCell::new([0.0; BEAMS]);

/// Revolutions that are counted, and how long each lasts, s.
const REVOLUTIONS: u16 = 200;
const REVOLUTION: f64 = 0.125;
/// Beams of a scan.
const BEAMS: usize = 1440;
/// The walls of the room, in x and in y, m.
const WALLS: (f64, f64) = (-12.0, 15.0);
/// Where the laser is on the vehicle.
const MOUNT: Pose = Pose { x: 0.8, y: 0.0, theta: 0.0 };
/// What the pose is known to.
const COVARIANCE: [f64; 3] = [1e-5, 1e-5, 1e-6];

/// Of six reflectors a revolution, and of twenty with a scan: the solutions, and the whole monitor.
pub fn count(stopwatch: &Stopwatch) -> [Count; 4] {
    let separation = || SolutionSeparation::new(AssumedDeviations::default(), Some(1.4));
    let integrity = || Integrity::new(InnovationMonitorParameters::default());
    let mut monitor = Monitor {
        separation: SEPARATION.init_with(separation),
        integrity: INTEGRITY.init_with(integrity),
        ranges: RANGES.take(),
    };
    let [six, whole_six] = monitor.revolve(stopwatch, 6, false);
    *monitor.separation = separation();
    *monitor.integrity = integrity();
    let [twenty, whole_twenty] = monitor.revolve(stopwatch, 20, true);
    [
        Count { name: "solutions of a revolution of 6 reflectors", ..six },
        Count { name: "solutions of a revolution of 20 reflectors", ..twenty },
        Count { name: "monitor of a revolution of 6 reflectors", ..whole_six },
        Count { name: "monitor of a revolution of 20 reflectors and its scan", ..whole_twenty },
    ]
}

struct Monitor {
    separation: &'static mut SolutionSeparation,
    integrity: &'static mut Integrity,
    ranges: &'static mut [f32; BEAMS],
}

impl Monitor {
    fn revolve(&mut self, stopwatch: &Stopwatch, reflectors: u16, has_scans: bool) -> [Count; 2] {
        let [mut solutions, mut whole] = [Count::new(""); 2];
        let mut pose = Pose::default();
        self.separation.begin(Time::default(), &pose, &[1e-4, 0.0, 1e-4, 0.0, 0.0, 1e-5], &pose);
        for revolution in 0..REVOLUTIONS {
            let turn = if revolution % 80 < 40 { 0.0 } else { 0.05 };
            let displacement = Pose::new(REVOLUTION, 0.0, turn);
            let start = Time::from_micros(125_000 * u64::from(revolution));
            let covariance = Matrix3::from_diagonal(&Vector3::new(4e-6, 1e-7, 2e-7));
            let motion =
                Motion { start, end: start.offset(REVOLUTION), displacement, covariance, distance: REVOLUTION };
            let before = pose;
            pose = pose.compose(&displacement);
            let by_solutions = self.separate(stopwatch, &motion, &pose, reflectors);
            let mut by_checks = self.check(stopwatch, motion.end, &pose, reflectors);
            if has_scans {
                by_checks += self.look_around(stopwatch, start, &before, &displacement);
            }
            solutions.add(by_solutions);
            whole.add(by_solutions + by_checks);
        }
        assert!(!self.integrity.is_motion_doubtful() && self.integrity.suspect().is_none(), "the vehicle is in order");
        [solutions, whole]
    }

    /// Lets all solutions take a revolution; returns the instructions.
    fn separate(&mut self, stopwatch: &Stopwatch, motion: &Motion, pose: &Pose, reflectors: u16) -> u64 {
        let separation = &mut self.separation;
        stopwatch.count(|| {
            separation.travel(motion, pose);
            separation.step(motion.end, pose);
            let laser = separation.laser(&MOUNT, pose);
            separation.begin_event();
            for number in 0..reflectors {
                let landmark = landmark(number);
                let seen = Seen {
                    position: pose.compose(&MOUNT).inverse_transform(&landmark),
                    covariance: Matrix2::identity() * 1e-4,
                    landmark,
                    landmark_variance: 4e-6,
                };
                separation.see(LandmarkKey::Reflector(number), &seen, &laser);
            }
            separation.end_event(pose, &laser, 1.0);
        })
    }

    /// Lets all checks take the reflectors of a revolution; returns the instructions.
    fn check(&mut self, stopwatch: &Stopwatch, now: Time, pose: &Pose, reflectors: u16) -> u64 {
        let uses: Vec<LandmarkUse, 20> = (0..reflectors).map(|number| seen(now, pose, number)).collect();
        let covariance = Matrix3::from_diagonal(&Vector3::from(COVARIANCE));
        let estimate = Estimate { pose: *pose, odometry_pose: *pose, covariance, is_sure: true, distance: 0.0 };
        let integrity = &mut self.integrity;
        let mut is_elsewhere = false;
        let count = stopwatch.count(|| {
            is_elsewhere = integrity.see_reflectors(LaserId::FIRST, now, &Pose::default(), &uses);
            integrity.compare_with_map(LaserId::FIRST, &uses);
            integrity.correct(&estimate, &estimate, &uses, true);
            integrity.judge_traction(&estimate, &estimate, &uses, now);
            integrity.innovations.add(uses.len(), uses.len(), uses.len(), 2.0 * uses.len() as f64);
        });
        assert!(!is_elsewhere, "reflectors stay where they are");
        count
    }

    /// Lets the checks take the scan of a revolution; returns the instructions.
    fn look_around(&mut self, stopwatch: &Stopwatch, start: Time, before: &Pose, displacement: &Pose) -> u64 {
        let step = core::f64::consts::TAU / BEAMS as f64;
        let sensor = |after: f64| {
            let part = after / REVOLUTION;
            let Pose { x, y, theta } = displacement;
            before.compose(&Pose::new(part * x, part * y, part * theta)).compose(&MOUNT)
        };
        let beam_interval = REVOLUTION / BEAMS as f64;
        for (beam, range) in self.ranges.iter_mut().enumerate() {
            *range = wall(&sensor(beam as f64 * beam_interval), beam as f64 * step) as f32;
        }
        let head = ScanHead { laser: LaserId::FIRST, start, beam_interval, first_bearing: 0.0, bearing_step: step };
        let scan = head.scan(self.ranges, &[]);
        let integrity = &mut self.integrity;
        let mut is_elsewhere = false;
        let count = stopwatch.count(|| is_elsewhere = integrity.see_scan(&scan, sensor));
        assert!(!is_elsewhere, "walls stay where they are");
        count
    }
}

/// Where a reflector is.
fn landmark(number: u16) -> Point {
    let (sine, cosine) = libm::sincos(f64::from(number));
    Point::new(5.0 + 8.0 * cosine, 5.0 + 9.0 * sine)
}

/// A reflector as it is seen.
fn seen(time: Time, pose: &Pose, number: u16) -> LandmarkUse {
    let landmark = landmark(number);
    let position = pose.compose(&MOUNT).inverse_transform(&landmark);
    LandmarkUse {
        time,
        laser: LaserId::FIRST,
        kind: LandmarkKind::Reflector,
        landmark: Some((LandmarkSource::Fixed, number)),
        verdict: Verdict::Accepted,
        position: [position.x as f32, position.y as f32],
        located: [landmark.x, landmark.y],
        residual: [0.0; 2],
        residual_deviation: [0.01, 0.001],
        test_ratio: 0.1,
    }
}

/// How far the wall of the room is from a laser in this direction, m.
fn wall(sensor: &Pose, bearing: f64) -> f64 {
    let (sine, cosine) = libm::sincos(sensor.theta + bearing);
    let along = |from: f64, direction: f64| {
        let wall = if direction > 0.0 { WALLS.1 } else { WALLS.0 };
        if direction == 0.0 { f64::INFINITY } else { (wall - from) / direction }
    };
    along(sensor.x, cosine).min(along(sensor.y, sine))
}
