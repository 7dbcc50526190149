//! Sources: each has its switch, and says what became of it; a model from outside corrects like any other.

use std::f64::consts::{FRAC_PI_2, PI};

use agv_core::contours::ContourMatch;
use agv_core::filter::{Ekf, Linearisation, Slots};
use agv_core::geometry::{Pose, difference};
use agv_core::localizer::{MapUse, Mode, Parameters};
use agv_core::maps::Verdict;
use agv_core::measurement::Time;
use agv_core::sources::{Aid, Source, Switches, pose_by_contours};
use nalgebra::{Matrix1, Matrix3, Vector1, Vector3};

use super::support::stage::{Stage, parameters};

/// Drives by reflectors, features and key scans.
fn driven(sources: Switches, slam: bool) -> Stage {
    let mut wanted: Parameters = parameters();
    wanted.sources = sources;
    wanted.maps = MapUse { slam, ..wanted.maps };
    let mut stage = Stage::new(wanted);
    stage.tell(stage.truth, 0.02, 0.01);
    for _ in 0..12 {
        let revolution = stage.revolve(0.6, 0.1);
        stage.glimpse(&revolution);
        stage.scan();
    }
    stage
}

fn without(source: Source) -> Switches {
    let mut switches = Switches::ALL;
    match source {
        Source::Reflectors => switches.reflectors = false,
        Source::Corners => switches.corners = false,
        Source::EndPoints => switches.end_points = false,
        Source::KeyScans => switches.key_scans = false,
        Source::Contours => switches.contours = false,
        Source::GivenPose => switches.given_pose = false,
        Source::Aids => switches.aids = false,
        Source::Gyro => switches.gyro = false,
    }
    switches
}

#[test]
fn a_source_that_is_switched_on_corrects_and_says_so() {
    let stage = driven(Switches::ALL, true);
    let statuses = stage.localizer.outputs().sources;
    for source in [Source::Reflectors, Source::Corners, Source::KeyScans, Source::GivenPose] {
        let status = statuses.of(source);
        assert!(status.told.is_some() && status.used.is_some(), "{source:?}: {status:?}");
        assert!(status.accepted > 0 && status.accepted <= status.observations, "{source:?}: {status:?}");
        assert!((0.0..=1.0).contains(&status.test_ratio), "{source:?}: {status:?}");
    }
    let reflectors = statuses.of(Source::Reflectors);
    assert!(reflectors.told <= reflectors.used && reflectors.used <= Some(stage.time()), "{reflectors:?}");
    assert_eq!(statuses.of(Source::Aids).told, None);
}

#[test]
fn a_source_that_is_switched_off_corrects_nothing() {
    for source in Source::ALL.iter().copied() {
        let stage = driven(without(source), true);
        let outputs = stage.localizer.outputs();
        assert_eq!(outputs.sources.of(source).used, None, "{source:?}");
        let is_known = source != Source::GivenPose;
        assert_eq!(stage.error().0 < 0.02, is_known, "{source:?}: {:?}", stage.said());
    }
}

/// One state is told as it is, but for an error.
struct Told {
    time: Time,
    state: usize,
    value: f64,
    deviation: f64,
}

impl Aid<1> for Told {
    fn time(&self) -> Time {
        self.time
    }

    fn linearise<S: Slots>(&self, state: &Ekf<S>) -> Option<Linearisation<1>> {
        let Pose { x, y, theta } = state.pose;
        let expected = [x, y, theta].get(self.state).copied()?;
        let linearisation =
            Linearisation::new(Vector1::new(self.value - expected), Matrix1::new(self.deviation * self.deviation));
        Some(linearisation.with(self.state, Vector1::new(1.0)))
    }

    fn gate(&self) -> f64 {
        9.0
    }
}

#[test]
fn an_aid_moves_the_pose_by_its_weight_and_is_gated_beyond_three_deviations() {
    let mut stage = Stage::new(parameters());
    stage.tell(stage.truth, 0.04, 0.01);
    let (time, before) = (stage.time(), stage.said());
    let told = |value: f64| Told { time, state: 0, value, deviation: 0.03 };
    // The residual's standard deviation is 5 cm: 15 cm are its gate.
    let far = stage.localizer.aid(&told(before.pose.x + 0.16));
    assert_eq!(far.verdict, Verdict::Gated);
    assert!(far.test_ratio.is_some_and(|ratio| (ratio - 0.16 * 0.16 / (9.0 * 0.0025)).abs() < 1e-9), "{far:?}");
    assert_eq!(stage.said().pose, before.pose);
    let near = stage.localizer.aid(&told(before.pose.x + 0.1));
    assert_eq!(near.verdict, Verdict::Accepted);
    let after = stage.said();
    assert!((after.pose.x - before.pose.x - 0.1 * 16.0 / 25.0).abs() < 1e-12, "{after:?}");
    assert!((after.covariance[0] - 0.0016 * 9.0 / 25.0).abs() < 1e-12, "{after:?}");
    let status = stage.localizer.outputs().sources.aids;
    assert_eq!((status.used, status.accepted, status.observations), (Some(time), 1, 1));
}

/// No solution of the level has used the aid: by as much as it moves the pose, the pose may be further off.
#[test]
fn what_an_aid_has_moved_widens_the_level() {
    let mut stage = Stage::new(parameters());
    stage.tell(stage.truth, 0.04, 0.01);
    let before = stage.said();
    let aid = Told { time: stage.time(), state: 0, value: before.pose.x + 0.1, deviation: 0.03 };
    assert_eq!(stage.localizer.aid(&aid).verdict, Verdict::Accepted);
    let after = stage.said();
    let moved = after.pose.x - before.pose.x;
    assert!((after.level.position - before.level.position - moved).abs() < 1e-9, "{after:?} {before:?}");
}

#[test]
fn an_aid_that_is_not_wanted_moves_nothing() {
    let of = |change: fn(&mut Parameters)| {
        let mut wanted = parameters();
        change(&mut wanted);
        Stage::told(wanted)
    };
    let mut lost = of(|_| {});
    // Two metres are more than the deviation above which a vehicle is lost.
    assert_eq!(lost.tell(lost.truth, 2.0, 0.01).mode, Mode::Lost);
    for mut stage in [of(|wanted| wanted.sources.aids = false), of(|wanted| wanted.maps.slam = true), lost] {
        let before = stage.said();
        let told = Told { time: stage.time(), state: 0, value: before.pose.x + 0.001, deviation: 0.03 };
        assert_eq!(stage.localizer.aid(&told).verdict, Verdict::OutOfTime);
        stage.report(&Pose::default());
        assert_eq!((stage.said().pose, stage.said().covariance), (before.pose, before.covariance));
        assert_eq!(stage.localizer.outputs().sources.aids.used, None);
    }
}

#[test]
fn one_kind_of_features_is_used_without_the_other() {
    for (kind, other) in [(Source::Corners, Source::EndPoints), (Source::EndPoints, Source::Corners)] {
        let statuses = driven(without(other), false).localizer.outputs().sources;
        assert!(statuses.of(kind).used.is_some(), "{kind:?} without {other:?}: {:?}", statuses.of(kind));
        assert_eq!(statuses.of(other).observations, 0, "{other:?}");
    }
}

#[test]
fn key_scans_are_compared_where_the_vehicle_was_in_the_middle_of_the_scan() {
    let mut wanted = parameters();
    wanted.maps.slam = true;
    wanted.reflectors.detection = None;
    let mut stage = Stage::told(wanted);
    let start = stage.time();
    // Twelve samples of 10 ms.
    let revolution = stage.revolve(0.5, 0.1);
    stage.sweep(&revolution);
    assert_eq!(stage.localizer.outputs().sources.key_scans.told, Some(start.offset(0.06)));
}

#[test]
fn a_match_of_contours_says_how_far_it_is_from_the_pose() {
    let share = 0.6;
    let found = |pose| ContourMatch {
        pose,
        information: Matrix3::identity() * 1e4,
        free_axis: None,
        facing: 0.0,
        share,
        scatter: 1.0,
        of_overlay: [0.0; 2],
    };
    // A laser half a metre in front and turned by a quarter, seen at (2, 3) looking back along x, belongs to a vehicle that
    // looks down along y from (2, 3.5).
    let mount = Pose::new(0.5, 0.0, -FRAC_PI_2);
    let seen = pose_by_contours(&found(Pose::new(2.0, 3.0, -PI)), &mount).unwrap();
    for (pose, expected) in [
        (Pose::new(2.0, 3.5, -FRAC_PI_2), [0.0, 0.0, 0.0]),
        (Pose::new(1.9, 3.3, -FRAC_PI_2 - 0.1), [0.1, 0.2, 0.1]),
        (Pose::new(-5.0, 8.0, FRAC_PI_2 + 0.2), [7.0, -4.5, PI - 0.2]),
    ] {
        let residual = seen.linearise(&Ekf::new(pose, 0.1, 0.1)).residual;
        assert!((residual - Vector3::from(expected)).norm() < 1e-9, "{pose:?}: {residual}");
    }
}

#[test]
fn an_aid_that_is_late_is_used_where_the_vehicle_was_then() {
    let mut stage = Stage::new(parameters());
    stage.tell(stage.truth, 0.04, 0.001);
    stage.drive(1.0, 0.0);
    let (then, there) = (stage.time(), stage.truth);
    stage.drive(1.0, 0.0);
    let told = Told { time: then, state: 0, value: there.x + 0.02, deviation: 1e-4 };
    assert_eq!(stage.localizer.aid(&told).verdict, Verdict::Accepted);
    assert!((stage.said().pose.x - stage.truth.x - 0.02).abs() < 1e-3, "{:?} {:?}", stage.said().pose, stage.truth);
    let never = Told { time: Time::from_micros(1), ..told };
    assert_eq!(stage.localizer.aid(&never).verdict, Verdict::OutOfTime);
    let nowhere = Told { state: 7, time: stage.time(), ..never };
    assert_eq!(stage.localizer.aid(&nowhere).verdict, Verdict::Unknown);
}

/// All of the pose, as it is.
struct WholePose(Time, Pose);

impl Aid<3> for WholePose {
    fn time(&self) -> Time {
        self.0
    }

    fn linearise<S: Slots>(&self, state: &Ekf<S>) -> Option<Linearisation<3>> {
        let off = [self.1.x - state.pose.x, self.1.y - state.pose.y, difference(self.1.theta, state.pose.theta)];
        let linearisation = Linearisation::new(off.into(), Matrix3::from_diagonal_element(1e-4));
        Some((0..3).fold(linearisation, |sum, state| sum.with(state, Vector3::ith(state, 1.0))))
    }

    fn gate(&self) -> f64 {
        16.0
    }
}

/// What says all of the pose is something to rest on; what says a part of it is not.
#[test]
fn a_vehicle_rests_on_an_aid_that_says_all_of_the_pose() {
    for (is_whole, mode) in [(true, Mode::Features), (false, Mode::DeadReckoning)] {
        let mut stage = Stage::told(parameters());
        for _ in 0..40 {
            stage.drive(0.8, 0.1);
            let (time, truth) = (stage.time(), stage.truth);
            let outcome = if is_whole {
                stage.localizer.aid(&WholePose(time, truth))
            } else {
                stage.localizer.aid(&Told { time, state: 0, value: truth.x, deviation: 0.01 })
            };
            assert_eq!(outcome.verdict, Verdict::Accepted);
        }
        assert_eq!(stage.said().mode, mode);
    }
}

#[test]
fn a_source_says_when_it_was_used_last_while_it_tells_nothing_of_use() {
    let mut stage = driven(Switches::ALL, false);
    let before = stage.localizer.outputs().sources.reflectors;
    assert!(before.used.is_some() && before.told.is_some());
    stage.drive(0.6, 0.1);
    let time = stage.time();
    stage.localizer.handle(&agv_core::localizer::Event::Reflectors(agv_core::measurement::Reflectors::of_first(&[
        agv_core::measurement::ReflectorObservation { time, range: 2.0, bearing: 0.7 },
    ])));
    let after = stage.localizer.outputs().sources.reflectors;
    assert_eq!((after.used, after.accepted, after.told), (before.used, 0, Some(time)));
}
