//! The vehicle's own filter in a kept map of contours: a simulated drive whose truth is kept apart.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is how a test fails")]

use std::f64::consts::{PI, TAU};

use agv_core::contours::KeptMap;
use agv_core::geometry::{Point, Pose, difference};
use agv_core::localizer::{CapacitiesOf, Event, Localizer, Mode, Parameters, PoseFix, PoseOutput, SlamSlots};
use agv_core::maps::Landmark;
use agv_core::measurement::{LaserId, PoseIncrement, ReflectorObservation, Reflectors, Scan, Time};
use agv_core::odometry::Vehicle;
use agv_core::sources::{Contours, SourceStatus};

use super::support::kept_map::kept_map;
use super::support::walls::{Noise, Walls, corridor, range, room};

const BEAMS: usize = 720;
type Small = Localizer<CapacitiesOf<BEAMS, 16, 16, 4, SlamSlots, Contours<'static, 400, 4096>>>;

const LASER: Pose = Pose { x: 0.4, y: 0.05, theta: 0.2 };

/// Samples of the odometry in a revolution, and the time between them, us.
const SAMPLES: u64 = 12;
const INTERVAL: u64 = 10_000;
const REVOLUTION: f64 = (SAMPLES * INTERVAL) as f64 * 1e-6;

/// Random walks of the odometry: of the way, m for a root of a metre, and of the heading, rad for one.
const SLIP: f64 = 0.01;
const YAW: f64 = 0.005;

fn parameters() -> Parameters {
    let mut parameters = Parameters::new(Vehicle::Increments, LASER);
    parameters.odometry_noise.slip = SLIP;
    parameters.odometry_noise.side_slip = SLIP;
    parameters.odometry_noise.yaw = YAW;
    parameters
}

struct Drive {
    localizer: Box<Small>,
    walls: Walls,
    truth: Pose,
    sample: u64,
    noise: Noise,
    reflectors: Vec<Landmark>,
}

impl Drive {
    fn new(parameters: Parameters, walls: Walls, map: Option<KeptMap<'static>>, seed: u64) -> Self {
        let mut localizer = Box::new(Small::new(parameters));
        localizer.set_contours(map);
        let truth = Pose::new(0.0, 0.1, 0.05);
        let mut drive = Self { localizer, walls, truth, sample: 0, noise: Noise(seed), reflectors: Vec::new() };
        drive.report(&Pose::default());
        drive
    }

    /// The same, and it has been told where it is.
    fn told(parameters: Parameters, walls: Walls, map: Option<KeptMap<'static>>, seed: u64) -> Self {
        let mut drive = Self::new(parameters, walls, map, seed);
        drive.tell(drive.truth, 0.01, 0.003);
        drive
    }

    fn time(&self) -> Time {
        Time::from_micros(1_000_000 + self.sample * INTERVAL)
    }

    fn tell(&mut self, pose: Pose, position_deviation: f64, heading_deviation: f64) {
        let fix = PoseFix { time: self.time(), pose, position_deviation, heading_deviation };
        self.localizer.handle(&Event::SetPose(fix));
    }

    fn report(&mut self, displacement: &Pose) {
        let increment = PoseIncrement { time: self.time(), displacement: *displacement };
        self.localizer.handle(&Event::Increment(increment));
    }

    fn said(&self) -> PoseOutput {
        self.localizer.outputs().pose
    }

    fn status(&self) -> SourceStatus {
        self.localizer.outputs().sources.contours
    }

    /// What the vehicle is off by in its own frame.
    fn error(&self) -> Pose {
        self.truth.between(&self.said().pose)
    }

    /// Drives for a revolution at a speed, m/s, and a rate of turn, rad/s, and sees the walls by the way. `scale` is the
    /// reported way over the true one. Gives the pose after each event.
    fn revolve(&mut self, (speed, turn): (f64, f64), scale: f64) -> Vec<PoseOutput> {
        let (start, mut poses) = (self.time(), vec![self.truth]);
        let seconds = INTERVAL as f64 * 1e-6;
        let step = Pose::exp(&agv_core::geometry::Twist { x: speed * seconds, y: 0.0, theta: turn * seconds });
        let mut said = Vec::new();
        for _ in 0..SAMPLES {
            self.sample += 1;
            self.truth = self.truth.compose(&step);
            poses.push(self.truth);
            let root = step.x.abs().sqrt();
            let mut noise = |deviation: f64| deviation * root * self.noise.normal();
            let reported = Pose::new(scale * step.x + noise(SLIP), step.y + noise(SLIP), step.theta + noise(YAW));
            self.report(&reported);
            said.push(self.said());
        }
        let laser = |share: f64| {
            let sample = share * SAMPLES as f64;
            let before = (sample as usize).min(SAMPLES as usize - 1);
            let since = poses[before].between(&poses[before + 1]).fraction(sample - before as f64);
            poses[before].compose(&since).compose(&LASER)
        };
        let seen: Vec<_> = (0..self.reflectors.len())
            .map(|index| {
                let share = index as f64 / self.reflectors.len() as f64;
                let seen = laser(share).inverse_transform(&self.reflectors[index].position());
                let range = seen.norm() + 0.005 * self.noise.normal();
                let bearing = seen.y.atan2(seen.x) + 5e-4 * self.noise.normal();
                let time = start.offset(share * REVOLUTION);
                ReflectorObservation { time, range: range as f32, bearing: bearing as f32 }
            })
            .collect();
        if !seen.is_empty() {
            self.localizer.handle(&Event::Reflectors(Reflectors::of_first(&seen)));
            said.push(self.said());
        }
        let ranges: Vec<f32> = (0..BEAMS)
            .map(|beam| {
                let at = laser(beam as f64 / BEAMS as f64);
                let bearing = beam as f64 * TAU / BEAMS as f64 - PI;
                range(&self.walls, &Pose { theta: at.theta + bearing, ..at }, &mut self.noise)
            })
            .collect();
        let scan = Scan {
            laser: LaserId::FIRST,
            start,
            beam_interval: REVOLUTION / BEAMS as f64,
            first_bearing: -PI,
            bearing_step: TAU / BEAMS as f64,
            ranges: &ranges,
            intensities: &[],
        };
        self.localizer.handle(&Event::Scan(scan));
        said.push(self.said());
        said
    }
}

/// There and back in the room: speed and rate of turn of each revolution.
fn tour() -> Vec<(f64, f64)> {
    let legs = [(1.0, 0.0, 45), (0.4, 0.65, 40), (1.0, 0.0, 45), (0.4, 0.65, 40)];
    legs.into_iter().flat_map(|(speed, turn, count)| std::iter::repeat_n((speed, turn), count)).collect()
}

#[test]
fn a_vehicle_in_a_room_stays_where_the_map_has_it() {
    let map = kept_map(&room(), &Pose::default());
    let (mut squares, mut count) = (0.0, 0);
    for seed in 1..=3 {
        let mut drive = Drive::told(parameters(), room(), Some(map), seed);
        for motion in tour() {
            drive.revolve(motion, 1.0);
            let (error, said) = (drive.error(), drive.said());
            assert!(error.position().norm() < 0.02, "seed {seed}: {error:?} {said:?}");
            assert!(error.theta.abs() < 0.4_f64.to_radians(), "seed {seed}: {error:?}");
            assert!(said.level.position >= error.position().norm(), "seed {seed}: {error:?} {said:?}");
            assert_eq!(said.mode, Mode::Features, "seed {seed}: {said:?}");
            assert_eq!(drive.status().accepted, 1, "{:?}", drive.status());
            let [xx, xy, yy, xh, yh, hh] = said.covariance;
            let covariance = nalgebra::Matrix3::new(xx, xy, xh, xy, yy, yh, xh, yh, hh);
            let off = nalgebra::Vector3::new(
                said.pose.x - drive.truth.x,
                said.pose.y - drive.truth.y,
                difference(said.pose.theta, drive.truth.theta),
            );
            squares += off.dot(&covariance.cholesky().unwrap().solve(&off));
            count += 1;
        }
    }
    let mean = squares / f64::from(count);
    assert!((0.3..5.0).contains(&mean), "the normalised square is {mean} in the mean; 3 is expected");
}

#[test]
fn contours_that_are_switched_off_leave_no_trace() {
    let map = kept_map(&room(), &Pose::default());
    let mut without = parameters();
    without.sources.contours = false;
    let mut off = Drive::told(without, room(), Some(map), 7);
    // Where they are on, laser odometry bounds the way, map or not.
    let mut none = Drive::told(without, room(), None, 7);
    for motion in tour().into_iter().take(60) {
        assert_eq!(off.revolve(motion, 1.0), none.revolve(motion, 1.0));
    }
    assert_eq!((off.status().told, none.status().told), (None, None));
}

#[test]
fn in_a_corridor_the_free_axis_stays_free() {
    let map = kept_map(&corridor(None), &Pose::default());
    for seed in 1..=3 {
        let mut drive = Drive::told(parameters(), corridor(None), Some(map), seed);
        drive.truth = Pose { theta: 0.0, ..drive.truth };
        drive.tell(drive.truth, 0.01, 0.003);
        let mut before = drive.said().covariance[0];
        for _ in 0..100 {
            drive.revolve((1.0, 0.0), 1.002);
            let (error, said) = (drive.error(), drive.said());
            let [xx, _, yy, ..] = said.covariance;
            assert!(error.y.abs() < 0.02 && error.theta.abs() < 0.3_f64.to_radians(), "seed {seed}: {error:?}");
            // Twelve metres of 1 cm for a root of a metre, and 2 mm a metre.
            assert!(error.x.abs() < 0.024 + 4.0 * SLIP * 12.0_f64.sqrt(), "seed {seed}: {error:?}");
            assert!(said.level.position >= error.position().norm(), "seed {seed}: {error:?} {said:?}");
            assert!(xx > before && yy < 2e-4, "seed {seed}: {said:?}");
            before = xx;
        }
        // What is known of the way is what the odometry knows.
        let expected = 1e-4 + SLIP * SLIP * 12.0;
        assert!((0.7..1.4).contains(&(before / expected)), "seed {seed}: {before} instead of {expected}");
    }
}

/// A wall of the room and its cupboard have moved, by 5 to 50 cm.
#[test]
fn walls_that_have_moved_do_not_take_the_pose_along() {
    let map = kept_map(&room(), &Pose::default());
    for (wall, by) in [(0, (0.0, -0.05)), (0, (0.0, 0.12)), (1, (0.3, 0.0)), (5, (-0.5, 0.0))] {
        let mut walls = room();
        let [ax, ay, bx, by_] = &mut walls[wall];
        (*ax, *bx, *ay, *by_) = (*ax + by.0, *bx + by.0, *ay + by.1, *by_ + by.1);
        for cupboard in &mut walls[6..] {
            cupboard[0] -= 0.4;
            cupboard[2] -= 0.4;
        }
        let mut drive = Drive::told(parameters(), walls, Some(map), 3);
        for motion in tour() {
            drive.revolve(motion, 1.0);
            let (error, said) = (drive.error(), drive.said());
            assert!(error.position().norm() < 0.06, "wall {wall} by {by:?}: {error:?} {said:?}");
            assert!(said.level.position >= error.position().norm(), "wall {wall} by {by:?}: {error:?} {said:?}");
        }
    }
}

/// In an open hall all that is near are goods, and goods move; its walls are farther away than what is searched.
#[test]
fn the_walls_of_an_open_hall_hold_the_pose_where_all_that_is_near_has_moved() {
    let goods = |by: f64| -> Walls {
        [(3.0, 4.0), (-4.0, 3.0), (2.0, -5.0)]
            .into_iter()
            .flat_map(|(x, y): (f64, f64)| {
                let (x, y) = (x + by, y - 0.5 * by);
                [[x, y, x + 1.2, y], [x + 1.2, y, x + 1.2, y + 0.8], [x, y + 0.8, x + 1.2, y + 0.8], [x, y, x, y + 0.8]]
            })
            .collect()
    };
    let outline = [
        [-24.0, -19.0, 24.0, -19.0],
        [24.0, -19.0, 24.0, 19.0],
        [24.0, 19.0, -24.0, 19.0],
        [-24.0, 19.0, -24.0, -19.0],
    ];
    let hall = |by: f64| -> Walls { outline.into_iter().chain(goods(by)).collect() };
    for by in [0.0, 0.06, 0.12, 0.4] {
        let mut drive = Drive::told(parameters(), hall(by), Some(kept_map(&hall(0.0), &Pose::default())), 3);
        for number in 0..60 {
            drive.revolve((0.6, 0.3), 1.0);
            let error = drive.error();
            let is_settled = number >= 10;
            assert!(!is_settled || error.position().norm() < 0.02 && error.theta.abs() < 0.004, "by {by}: {error:?}");
        }
    }
}

/// The annex of a room is not mapped: what is seen there holds the pose until the map does again, and the deviation grows meanwhile.
#[test]
fn what_nobody_has_mapped_is_learnt_over_the_map() {
    let mapped = room();
    // Beyond the wall on the right, which is gone, are three more metres with a pillar.
    let mut walls = mapped.clone();
    walls.remove(1);
    walls.extend([
        [10.0, -3.0, 19.0, -3.0],
        [19.0, -3.0, 19.0, 6.0],
        [19.0, 6.0, 10.0, 6.0],
        [14.0, 1.0, 14.4, 1.0],
        [14.4, 1.0, 14.4, 1.4],
    ]);
    let map = kept_map(&mapped, &Pose::default());
    let drives = |learns: bool| {
        let mut drive = Drive::told(parameters(), walls.clone(), Some(map), 3);
        let (mut deviation, mut worst): (f64, f64) = (0.0, 0.0);
        for number in 0..170 {
            // Into the annex and back on an arc; the wheels tell a tenth too much.
            drive.revolve(if number < 100 { (1.0, 0.0) } else { (0.8, 0.5) }, 1.1);
            let (error, said) = (drive.error(), drive.said());
            assert!(said.level.position >= error.position().norm(), "{number}: {error:?} {said:?}");
            worst = worst.max(error.position().norm());
            deviation = deviation.max(said.covariance[0].sqrt());
            if !learns {
                drive.localizer.set_contours(Some(map));
            }
        }
        (worst, deviation)
    };
    let (with, without) = (drives(true), drives(false));
    assert!(with.0 < 0.1, "{with:?}");
    assert!(without.0 > 2.0 * with.0, "{with:?} {without:?}");
    // The way is not free of error.
    assert!(with.1 > 0.006, "{with:?}");
}

#[test]
fn a_start_that_is_wrong_is_put_right_and_said() {
    let map = kept_map(&room(), &Pose::default());
    for wrong in [Pose::new(0.3, -0.2, 0.26), Pose::new(-0.35, 0.1, -0.4), Pose::new(0.0, 0.4, 0.1)] {
        let mut drive = Drive::new(parameters(), room(), Some(map), 4);
        drive.tell(drive.truth.compose(&wrong), 0.1, 0.1);
        let resets = drive.said().resets;
        drive.revolve((0.5, 0.1), 1.0);
        let (error, said) = (drive.error(), drive.said());
        assert!(
            error.position().norm() < 0.03 && error.theta.abs() < 0.01,
            "{wrong:?}: {error:?} {:?}",
            drive.status()
        );
        assert_ne!(said.resets, resets, "{said:?}");
    }
}

/// Of a start 4 m off the map says nothing, or that it is wrong; it does not say that it is right.
#[test]
fn a_start_that_is_quite_wrong_is_not_believed() {
    let map = kept_map(&room(), &Pose::default());
    for wrong in [Pose::new(4.0, 1.0, 0.5), Pose::new(5.0, -1.0, 2.5), Pose::new(3.0, 2.5, -1.5)] {
        let mut drive = Drive::new(parameters(), room(), Some(map), 5);
        drive.tell(drive.truth.compose(&wrong), 0.1, 0.05);
        for revolution in 0..40 {
            drive.revolve((0.5, 0.1), 1.0);
            let (error, said) = (drive.error(), drive.said());
            let is_found = error.position().norm() < 0.03;
            let is_believed = said.mode == Mode::Features;
            assert!(is_found || !is_believed, "{wrong:?}, {revolution}: {error:?} {said:?} {:?}", drive.status());
        }
    }
}

#[test]
fn standing_in_front_of_one_map_makes_its_error_no_smaller() {
    let map = kept_map(&room(), &Pose::default());
    let mut drive = Drive::told(parameters(), room(), Some(map), 6);
    for _ in 0..300 {
        drive.revolve((0.0, 0.0), 1.0);
        let [xx, _, yy, _, _, heading] = drive.said().covariance;
        assert!(xx.min(yy) >= 0.004_f64.powi(2) && heading >= 0.0009_f64.powi(2), "{:?}", drive.said());
        assert!(drive.error().position().norm() < 0.015, "{:?}", drive.error());
    }
}

fn reflectors() -> Vec<Landmark> {
    let places = [(9.9, 4.1), (9.9, -1.3), (1.2, 4.9), (-1.9, 2.7), (3.4, -2.9)];
    (0..).zip(places).map(|(id, (x, y))| Landmark::reflector(id, Point::new(x, y), 0.002)).collect()
}

/// The map of contours lies 3 cm beside that of the reflectors.
#[test]
fn reflectors_go_before_contours_and_no_jump_between_them_goes_unsaid() {
    let map = kept_map(&room(), &Pose::new(0.02, 0.022, 0.0));
    let mut drive = Drive::told(parameters(), room(), Some(map), 8);
    assert_eq!(drive.localizer.add_landmarks(&reflectors()), Ok(()));
    let (mut last, mut used) = (drive.said(), 0);
    for (revolution, motion) in tour().into_iter().enumerate() {
        // Reflectors are in sight for 30 revolutions of 60.
        let in_sight = revolution % 60 < 30;
        drive.reflectors = if in_sight { reflectors() } else { Vec::new() };
        let said = drive.revolve(motion, 1.0);
        for pose in said {
            let expected = last.pose.compose(&last.smooth.between(&pose.smooth));
            let jump = (pose.pose.position() - expected.position()).norm();
            assert!(jump <= 0.01 || pose.resets != last.resets, "{revolution}: {jump} m, {pose:?}");
            last = pose;
        }
        used += usize::from(drive.status().used == drive.status().told);
        let error = drive.error().position().norm();
        if in_sight && revolution % 60 > 2 {
            assert_eq!(drive.status().accepted, 0, "{revolution}");
            assert!(error < 0.015, "{revolution}: {error}");
        }
        assert!(error < 0.05 && drive.said().level.position >= error, "{revolution}: {error} {:?}", drive.said());
    }
    assert!(used > 50, "contours were used {used} times");
}

/// Rows of uprights every 0.4 m between two walls: a scan fits as well 0.4 m further on.
#[test]
fn of_two_places_that_look_alike_the_one_where_the_vehicle_should_be_is_taken() {
    let mut walls = corridor(None);
    for upright in -40..60 {
        for side in [-1.0, 1.0] {
            let x = 0.4 * f64::from(upright);
            walls.push([x, side, x + 0.08, side]);
            walls.push([x, side, x, 1.2 * side]);
            walls.push([x + 0.08, side, x + 0.08, 1.2 * side]);
        }
    }
    let map = kept_map(&walls, &Pose::default());
    for seed in 1..=3 {
        let mut drive = Drive::told(parameters(), walls.clone(), Some(map), seed);
        drive.truth = Pose { theta: 0.0, ..drive.truth };
        drive.tell(drive.truth, 0.01, 0.003);
        for _ in 0..60 {
            drive.revolve((0.8, 0.0), 1.0);
            let (error, said) = (drive.error(), drive.said());
            assert!(error.position().norm() < 0.1, "seed {seed}: {error:?} {said:?} {:?}", drive.status());
        }
    }
}

/// A controller with room for few points of a map.
#[test]
fn surroundings_that_are_cut_are_said_to_be() {
    type Narrow = Localizer<CapacitiesOf<BEAMS, 16, 16, 4, SlamSlots, Contours<'static, 400, 256>>>;
    let map = kept_map(&room(), &Pose::default());
    let scan = Scan {
        laser: LaserId::FIRST,
        start: Time::from_micros(1_000_000),
        beam_interval: REVOLUTION / BEAMS as f64,
        first_bearing: -PI,
        bearing_step: TAU / BEAMS as f64,
        ranges: &[3.0; BEAMS],
        intensities: &[],
    };
    let fix = |pose| PoseFix { time: scan.start, pose, position_deviation: 0.01, heading_deviation: 0.003 };
    let mut narrow = Box::new(Narrow::new(parameters()));
    narrow.set_contours(Some(map));
    let mut wide = Box::new(Small::new(parameters()));
    wide.set_contours(Some(map));
    let increment = PoseIncrement { time: scan.end(), displacement: Pose::default() };
    for event in [Event::SetPose(fix(Pose::default())), Event::Increment(increment), Event::Scan(scan)] {
        narrow.handle(&event);
        wide.handle(&event);
    }
    assert_eq!((narrow.outputs().pose.overflows, wide.outputs().pose.overflows), (1, 0));
}

/// A search uses the memory of what was loaded around the vehicle. What the localiser says afterwards is the same as without one, to the last
/// bit: here the laser has left the tile in whose middle the surfaces were loaded.
#[test]
fn a_search_leaves_no_trace_in_what_is_said() {
    let said = |searches: bool| {
        let mut drive = Drive::told(parameters(), room(), Some(kept_map(&room(), &Pose::default())), 3);
        let mut said = Vec::new();
        for number in 0..14 {
            if number == 11 {
                let place = drive.truth.compose(&LASER);
                assert!(place.x < 0.0 && place.x > -0.3, "{place:?}");
                if searches {
                    let (_, contours) = drive.localizer.for_search();
                    contours.unwrap().1.begin(&Pose::new(3.0, 2.0, 1.0));
                }
                drive.tell(drive.truth, 0.01, 0.003);
            }
            said.extend(drive.revolve((-0.4, 0.0), 1.0).iter().map(|pose| format!("{pose:?}")));
            assert_eq!(drive.status().accepted, 1, "{number}");
        }
        said
    };
    assert_eq!(said(false), said(true));
}

/// What a controller asks any localiser.
fn has_map(mut localizer: impl agv_core::localizer::Localize) -> bool {
    localizer.for_search().1.is_some()
}

#[test]
fn any_localiser_tells_its_map_if_it_is_used() {
    let map = kept_map(&room(), &Pose::default());
    for (is_on, map) in [(true, Some(map)), (true, None), (false, Some(map))] {
        let mut parameters = parameters();
        parameters.sources.contours = is_on;
        let mut drive = Drive::new(parameters, room(), map, 1);
        let expected = is_on && map.is_some();
        assert_eq!(drive.localizer.contours().is_some(), expected);
        assert_eq!(has_map(&mut *drive.localizer), expected);
        assert_eq!(has_map(&mut &mut *drive.localizer), expected);
    }
}

/// The hall has reflectors, and the vehicle a map of its contours only.
#[test]
fn reflectors_of_which_there_is_no_map_are_nothing_against_contours() {
    let mut drive = Drive::told(parameters(), room(), Some(kept_map(&room(), &Pose::default())), 8);
    drive.reflectors = reflectors();
    for revolution in 0..20 {
        drive.revolve((0.4, 0.1), 1.0);
        let uses = &drive.localizer.outputs().uses;
        assert!(revolution == 0 || drive.said().mode == Mode::Features, "{revolution}: {:?}, {uses:?}", drive.said());
    }
}

/// The map of contours lies 20 cm beside that of the reflectors: what it says is compared, told to be further off than it should be, and not
/// used.
#[test]
fn contours_that_contradict_reflectors_are_told_and_not_used() {
    let map = kept_map(&room(), &Pose::new(0.15, 0.13, 0.0));
    let mut drive = Drive::told(parameters(), room(), Some(map), 8);
    assert_eq!(drive.localizer.add_landmarks(&reflectors()), Ok(()));
    drive.reflectors = reflectors();
    for revolution in 0..20 {
        drive.revolve((0.4, 0.1), 1.0);
        let status = drive.status();
        if revolution > 2 {
            assert_eq!((status.observations, status.gated, status.accepted), (1, 1, 0), "{revolution}: {status:?}");
        }
    }
}
