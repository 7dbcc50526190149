//! What watches over the pose: motion of the laser against the odometry, and corrections.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is how a test fails")]

use agv_core::geometry::{Point, Pose};
use agv_core::integrity::{InnovationMonitorParameters, Integrity, MountingCheck, SlipCheck, Suspect};
use agv_core::maps::{LandmarkKind, Verdict};
use agv_core::measurement::{LaserId, Scan, Time};
use agv_core::state::LandmarkUse;
use proptest::prelude::*;

/// Reflectors of a hall, in W.
fn hall() -> Vec<Point> {
    let row = |y: f64| (0..8).map(move |k| Point::new(3.1 * f64::from(k) - 7.0 + 0.37 * y, y));
    row(-4.0).chain(row(5.0)).collect()
}

/// A vehicle that turns and goes on by a tenth of a metre a revolution.
fn odometry(revolution: u32) -> Pose {
    let step = Pose::new(0.15, 0.0, 0.01);
    (0..revolution).fold(Pose::default(), |pose, _| pose.compose(&step))
}

/// The verdicts of revolutions in which the laser sees the hall from `truth`, and the odometry is `odometry`. Of the
/// reflectors those are seen for which `is_seen` holds.
fn verdicts(
    count: u32,
    truth: impl Fn(u32) -> Pose,
    is_seen: impl Fn(u32, usize) -> bool,
    extra: impl Fn(u32) -> Vec<Point>,
) -> Vec<bool> {
    let mut check = SlipCheck::new();
    (0..count)
        .map(|revolution| {
            check.begin(Time::from_micros(u64::from(revolution) * 125_000 + 1_000_000));
            let seen = hall()
                .into_iter()
                .enumerate()
                .filter(|(index, _)| is_seen(revolution, *index))
                .map(|(_, place)| truth(revolution).inverse_transform(&place))
                .chain(extra(revolution));
            for in_robot in seen {
                check.see(&odometry(revolution).transform(&in_robot), in_robot.norm());
            }
            check.disagrees()
        })
        .collect()
}

fn all(_: u32, _: usize) -> bool {
    true
}

fn none(_: u32) -> Vec<Point> {
    Vec::new()
}

/// A number between 0 and 1 that looks random.
fn noise(a: u32, b: usize) -> f64 {
    let mixed = (u64::from(a) << 32 | b as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mixed = (mixed ^ mixed >> 29).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    ((mixed ^ mixed >> 32) >> 11) as f64 / (1_u64 << 53) as f64
}

#[test]
fn a_laser_that_moves_as_the_odometry_says_is_believed() {
    assert!(!verdicts(50, odometry, all, none).contains(&true));
}

#[test]
fn hidden_and_false_reflectors_are_no_motion() {
    let hidden = |revolution, index| noise(revolution, index) > 0.7;
    assert!(!verdicts(400, odometry, hidden, none).contains(&true));
    let rain = |revolution| {
        (0..12).map(move |k| {
            Point::new(30.0 * noise(revolution, 100 + k) - 15.0, 20.0 * noise(revolution, 200 + k) - 10.0)
        })
    };
    assert!(!verdicts(400, odometry, all, |revolution| rain(revolution).collect()).contains(&true));
}

proptest! {
    #[test]
    fn a_jump_is_seen_in_the_second_revolution(
        x in -3.0f64..3.0, y in -3.0f64..3.0, degrees in -40.0f64..40.0,
    ) {
        let jump = Pose::new(x, y, degrees.to_radians());
        // Of jumps by a whole distance between reflectors nobody can know.
        prop_assume!(x.hypot(y) > 0.3 || degrees.abs() > 6.0);
        prop_assume!(degrees.abs() > 4.0 || (y.abs() > 0.5 || (x.abs() - 3.1).abs() > 0.5));
        let truth = |revolution| if revolution < 20 { odometry(revolution) } else { odometry(revolution).compose(&jump) };
        let verdicts = verdicts(22, truth, all, none);
        prop_assert_eq!(verdicts.iter().position(|is_wrong| *is_wrong), Some(21));
    }
}

#[test]
fn one_wrong_revolution_decides_nothing() {
    let truth = |revolution| {
        let jump = Pose::new(0.0, 0.0, if revolution == 20 { 0.3 } else { 0.0 });
        odometry(revolution).compose(&jump)
    };
    assert!(!verdicts(40, truth, all, none).contains(&true));
}

/// Straight on for a while, then round a bend.
fn motions() -> impl Iterator<Item = Pose> {
    let straight = std::iter::repeat_n(Pose::new(0.15, 0.0, 0.0), 40);
    straight.chain(std::iter::repeat_n(Pose::new(0.15, 0.0, 0.06), 26))
}

/// What is suspected after a drive whose corrections follow from the motion.
fn suspected(correction: impl Fn(&Pose) -> Pose) -> Option<Suspect> {
    let mut check = MountingCheck::new();
    for motion in motions() {
        check.add(&motion, &correction(&motion));
    }
    check.suspect()
}

#[test]
fn corrections_tell_which_is_wrong() {
    assert_eq!(suspected(|_| Pose::default()), None);
    let small = |motion: &Pose| Pose::new(0.01 * motion.x, 0.002 * motion.x, 0.002 * motion.x);
    assert_eq!(suspected(small), None);
    // A laser that looks askew by one degree makes the vehicle seem to drive askew.
    for degrees in [1.0_f64, -1.0] {
        let askew = degrees.to_radians();
        assert_eq!(suspected(|motion| Pose::new(0.0, askew * motion.x, 0.0)), Some(Suspect::Laser));
    }
    // One that stands 13 cm further forward, or to the side, is swung about in a bend only.
    assert_eq!(suspected(|motion| Pose::new(0.0, 0.13 * motion.theta, 0.0)), Some(Suspect::Laser));
    assert_eq!(suspected(|motion| Pose::new(0.13 * motion.theta, 0.0, 0.0)), Some(Suspect::Laser));
    // A wheel that is 5 % too large, and a steering that is bent by two degrees on 1.5 m.
    assert_eq!(suspected(|motion| Pose::new(-0.05 * motion.x, 0.0, 0.0)), Some(Suspect::Odometry));
    let bend = 2_f64.to_radians().tan() / 1.5;
    assert_eq!(suspected(|motion| Pose::new(0.0, 0.0, bend * motion.x)), Some(Suspect::Odometry));
}

#[test]
fn a_suspicion_of_the_laser_lasts_until_the_vehicle_has_driven_and_turned() {
    let mut check = MountingCheck::new();
    check.suspect_laser();
    check.restart();
    assert_eq!(check.suspect(), Some(Suspect::Laser));
    for _ in 0..100 {
        check.add(&Pose::new(0.15, 0.0, 0.0), &Pose::default());
    }
    assert_eq!(check.suspect(), Some(Suspect::Laser), "straight on, a shift is not seen");
    for _ in 0..20 {
        check.add(&Pose::new(0.15, 0.0, 0.06), &Pose::default());
    }
    assert_eq!(check.suspect(), None);
}

#[test]
fn a_suspicion_of_the_laser_ends_in_a_bend_of_any_radius_in_which_it_could_be_found() {
    let step = 0.15;
    for radius in [0.5, 1.0, 1.5, 2.5, 4.0, 5.0, 6.0] {
        let motion = Pose::new(step, 0.0, step / radius);
        // 1.2 m, and 26 degrees in a memory that fades by 1/e in 2.5 m and in 1.5 rad, or 77 degrees in all.
        let remaining = libm::exp(-step / 2.5 - motion.theta / 1.5);
        let in_memory = libm::log(1.0 - 0.45 * (1.0 - remaining) / motion.theta) / libm::log(remaining);
        let turned = in_memory.min(1.35 / motion.theta);
        let expected = (1.2 / step).max(turned);
        let mut check = MountingCheck::new();
        check.suspect_laser();
        let ended = (1..100).find(|_| {
            check.add(&motion, &Pose::default());
            check.suspect().is_none()
        });
        assert!(
            ended.is_some_and(|ended| (f64::from(ended) - expected).abs() <= 2.0),
            "{radius}: {ended:?}, {expected}"
        );
        // Not while the laser stands elsewhere by twice what is found.
        check.suspect_laser();
        for _ in 0..100 {
            check.add(&motion, &Pose::new(0.0, 0.2 * motion.theta, 0.0));
        }
        assert_eq!(check.suspect(), Some(Suspect::Laser), "{radius} m");
    }
}

/// What is seen of reflectors that were seen three times and are gone.
#[derive(Clone, Copy, PartialEq)]
enum Afterwards {
    Nothing,
    /// As many, elsewhere.
    Others,
}

/// Whether a move is told: so many reflectors around a laser that stands were seen three times and are gone, though nothing hides them.
/// Every beam ends at these ranges, m, while they are seen and afterwards.
fn is_told_gone(count: usize, ranges: [f32; 2], afterwards: Afterwards) -> bool {
    let mut integrity = Integrity::new(InnovationMonitorParameters::default());
    (0..8).any(|revolution| {
        let time = Time::from_micros(revolution * 125_000 + 1_000_000);
        let is_there = revolution < 3;
        let see = |index: usize| {
            let turned = if is_there { 0.4 } else { 0.7 };
            let angle = turned + std::f64::consts::TAU * index as f64 / count as f64;
            let located = [5.0 * angle.cos(), 5.0 * angle.sin()];
            LandmarkUse {
                time,
                laser: LaserId::FIRST,
                kind: LandmarkKind::Reflector,
                landmark: None,
                verdict: Verdict::Accepted,
                position: located.map(|coordinate| coordinate as f32),
                located,
                residual: [0.0; 2],
                residual_deviation: [0.0; 2],
                test_ratio: 0.0,
            }
        };
        let uses: Vec<_> = (0..count).filter(|_| is_there || afterwards == Afterwards::Others).map(see).collect();
        let ranges = [ranges[usize::from(!is_there)]; 720];
        let scan = Scan {
            laser: LaserId::FIRST,
            start: time,
            beam_interval: 0.0,
            first_bearing: -std::f64::consts::PI,
            bearing_step: std::f64::consts::TAU / 720.0,
            ranges: &ranges,
            intensities: &[],
        };
        let slips = integrity.see_reflectors(LaserId::FIRST, time, &Pose::default(), &uses);
        let is_told = integrity.see_scan(&scan, |_| Pose::default()) || slips;
        assert!(!(is_told && is_there));
        is_told
    })
}

/// At the end of an aisle a few flat reflectors turn out of sight at once.
#[test]
fn few_reflectors_that_are_gone_are_no_motion_where_the_surfaces_have_stayed() {
    let is_told = |count, ranges| is_told_gone(count, ranges, Afterwards::Nothing);
    assert!(!is_told(4, [8.0, 8.0]));
    assert!(!is_told(6, [8.0, 8.0]));
    // Many, surfaces that have moved, and surfaces too far away to tell.
    assert!(is_told(7, [8.0, 8.0]));
    assert!(is_told(4, [8.0, 9.0]));
    assert!(is_told(4, [20.0, 20.0]));
}

/// None turns out of sight while as many come into it: in a corridor the surfaces stay though the vehicle moves otherwise.
#[test]
fn few_reflectors_that_are_gone_are_a_motion_where_others_are_seen() {
    for count in [4, 5, 6, 7] {
        assert!(is_told_gone(count, [8.0, 8.0], Afterwards::Others), "{count}");
    }
    // What hides them has come nearer than they are.
    assert!(!is_told_gone(4, [3.0, 3.0], Afterwards::Others));
}
