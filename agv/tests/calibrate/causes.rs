//! Mistakes that hands make, singly and in pairs, and what is named of them.
//!
//! What no drive tells apart, and what is expected then:
//! - A drive counter that counts the wrong way, with a steering offset of 180 degrees: the vehicle moves as it should, and nothing
//!   is wrong with it.
//! - A drive counter that counts the wrong way, with a steering offset of 90 degrees: an offset of -90 degrees is named beside them.
//! - Fewer than three reflectors at once, with anything else: the reflectors are named.
//! - Three to five at once, others all the time: they are no mistake. Where they cannot be followed, nothing is named. Where they
//!   can, mistakes of the wheelbase and of the laser's heading that are as small as the noise of such a drive are not named.

use std::f64::consts::PI;

use agv_core::geometry::difference;
use agv_core::odometry::Vehicle;
use agv_host_sim::calibrate::causes::{Cause, Explanation, explain};
use agv_host_sim::calibrate::drive::Drive as Log;
use agv_host_sim::calibrate::found::{Found, find_any};
use agv_host_sim::calibrate::log_input::LogInput;
use agv_lab::evaluate::calibration::course::Disturbance;

use super::truth::{JOINT, STC, calibrate, course, vehicle};

/// A mistake.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Mistake {
    Drive,
    Steering,
    Swap,
    /// Quarter turns.
    Offset(u8),
    /// Share of the wheelbase that the log believes too much.
    Wheelbase(f64),
    /// Degrees that the log believes too much.
    Yaw(f64),
    /// Reflectors that are left.
    Reflectors(usize),
}

use Mistake::{Drive, Offset, Reflectors, Steering, Swap, Wheelbase, Yaw};

const SINGLE: [Mistake; 25] = [
    Drive,
    Steering,
    Swap,
    Offset(1),
    Offset(2),
    Offset(3),
    Wheelbase(0.01),
    Wheelbase(-0.01),
    Wheelbase(0.03),
    Wheelbase(-0.03),
    Wheelbase(0.1),
    Wheelbase(-0.1),
    Yaw(1.0),
    Yaw(-1.0),
    Yaw(3.0),
    Yaw(-3.0),
    Yaw(90.0),
    Yaw(-90.0),
    Reflectors(0),
    Reflectors(1),
    Reflectors(2),
    Reflectors(3),
    Reflectors(4),
    Reflectors(5),
    Yaw(180.0),
];

fn group(mistake: Mistake) -> u8 {
    match mistake {
        Drive => 0,
        Steering => 1,
        Swap => 2,
        Offset(_) => 3,
        Wheelbase(_) => 4,
        Yaw(_) => 5,
        Reflectors(_) => 6,
    }
}

/// Makes a mistake. The exchange of the plugs comes last, as it takes the counts as they are.
fn make(input: &mut LogInput, mistake: Mistake) {
    let Vehicle::Tricycle(tricycle) = &mut input.parameters.vehicle else { panic!() };
    let within = |count: i64, values: u64| count.rem_euclid(values as i64) as u32;
    let (drive, steering) = (tricycle.drive_range.values(), tricycle.steering_range.values());
    let quarter = (0.5 * PI / tricycle.steering_scale).round() as i64;
    match mistake {
        Drive => input.encoders.iter_mut().for_each(|sample| sample.drive = within(-i64::from(sample.drive), drive)),
        Steering => {
            input
                .encoders
                .iter_mut()
                .for_each(|sample| sample.steering = within(-i64::from(sample.steering), steering));
        }
        Swap => input.encoders.iter_mut().for_each(|sample| std::mem::swap(&mut sample.drive, &mut sample.steering)),
        Offset(turns) => input.encoders.iter_mut().for_each(|sample| {
            sample.steering = within(i64::from(sample.steering) - i64::from(turns) * quarter, steering);
        }),
        Wheelbase(share) => tricycle.wheelbase *= 1.0 + share,
        Yaw(degrees) => input.parameters.lasers.first_mut().theta += degrees.to_radians(),
        Reflectors(left) => {
            input.revolutions.iter_mut().for_each(|seen| seen.truncate(left));
            input.revolutions.retain(|seen| !seen.is_empty());
        }
    }
}

fn with(base: &LogInput, mistakes: &[Mistake]) -> LogInput {
    let mut input = base.clone();
    let (last, first): (Vec<Mistake>, Vec<Mistake>) = mistakes.iter().partition(|mistake| **mistake == Swap);
    first.into_iter().chain(last).for_each(|mistake| make(&mut input, mistake));
    input
}

/// A vehicle without mistakes: what the log believes is the truth.
fn base(seed: u64) -> LogInput {
    let mut input = course(4).log(&Disturbance::MILD, seed);
    let truth = vehicle();
    let Vehicle::Tricycle(tricycle) = &mut input.parameters.vehicle else { panic!() };
    *tricycle = truth.tricycle;
    *input.parameters.lasers.first_mut() = truth.laser;
    input
}

/// Whether a cause is the mistake.
fn is_named(mistake: Mistake, cause: &Cause) -> bool {
    let near = |angle: f64, other: f64| difference(angle, other).abs() < 0.02;
    match (mistake, cause) {
        (Drive, Cause::DriveReversed) | (Steering, Cause::SteeringReversed) | (Swap, Cause::EncodersSwapped) => true,
        (Offset(turns), Cause::SteeringOffset(offset)) => near(*offset, f64::from(turns) * 0.5 * PI),
        (Wheelbase(_), Cause::Wheelbase(length)) => (length / vehicle().tricycle.wheelbase - 1.0).abs() < 0.003,
        (Yaw(degrees), Cause::LaserHeading(turn)) => near(*turn, -degrees.to_radians()),
        (Reflectors(count), Cause::FewReflectors(found)) => count == *found,
        _ => false,
    }
}

/// Everything that is named, each once.
fn names(explanations: &[Explanation]) -> Vec<Cause> {
    let is_same = |first: &Cause, second: &Cause| match (first, second) {
        (Cause::SteeringOffset(first), Cause::SteeringOffset(second)) => difference(*first, *second).abs() < 0.1,
        _ => std::mem::discriminant(first) == std::mem::discriminant(second),
    };
    let mut causes: Vec<Cause> = Vec::new();
    for cause in explanations.iter().flat_map(|explanation| &explanation.causes) {
        if !causes.iter().any(|known| is_same(known, cause)) {
            causes.push(*cause);
        }
    }
    causes
}

/// Whether a mistake is as small as what a drive among few reflectors does not tell.
fn is_small(mistake: Mistake) -> bool {
    match mistake {
        Wheelbase(share) => share.abs() < 0.06,
        Yaw(degrees) => degrees.abs() < 1.5,
        _ => false,
    }
}

/// The sets of mistakes of which one must be named.
fn expected(mistakes: &[Mistake]) -> Vec<Vec<Mistake>> {
    if let Some(few) = mistakes.iter().find(|mistake| matches!(mistake, Reflectors(0..=2))) {
        return vec![vec![*few]];
    }
    if mistakes == [Drive, Offset(2)] {
        return vec![Vec::new()];
    }
    // What is turned the wrong way is turned back before its offset is added.
    let told = |mistake: &Mistake| match mistake {
        Offset(turns) if mistakes.contains(&Steering) => Offset(4 - turns),
        other => *other,
    };
    // Enough reflectors are no mistake.
    let all: Vec<Mistake> = mistakes.iter().filter(|one| !matches!(one, Reflectors(_))).map(told).collect();
    let mut sets = vec![all.clone()];
    if all.len() < mistakes.len() {
        sets.push(all.into_iter().filter(|mistake| !is_small(*mistake)).collect());
    }
    sets
}

fn is_held(mistakes: &[Mistake], found: &[Explanation]) -> bool {
    if found.is_empty() {
        return mistakes.iter().any(|mistake| matches!(mistake, Reflectors(3..)));
    }
    expected(mistakes).iter().any(|expected| {
        found.iter().any(|explanation| {
            explanation.causes.len() == expected.len()
                && expected.iter().all(|mistake| explanation.causes.iter().any(|cause| is_named(*mistake, cause)))
        })
    })
}

/// The log without what is named.
fn without(input: &LogInput, causes: &[Cause]) -> LogInput {
    let mut right = input.clone();
    let Vehicle::Tricycle(believed) = input.parameters.vehicle else { panic!() };
    let range = believed.steering_range.values() as i64;
    let mut offset = 0;
    let has = |cause: &Cause| causes.contains(cause);
    let (swapped, turned, back) =
        (has(&Cause::EncodersSwapped), has(&Cause::SteeringReversed), has(&Cause::DriveReversed));
    for cause in causes {
        let Vehicle::Tricycle(tricycle) = &mut right.parameters.vehicle else { panic!() };
        let laser = right.parameters.lasers.first_mut();
        match *cause {
            Cause::SteeringOffset(angle) => offset = (angle / believed.steering_scale).round() as i64,
            Cause::Wheelbase(length) => tricycle.wheelbase = length,
            Cause::LaserHeading(turn) => laser.theta += turn,
            Cause::LaserPlace(x, y) => (laser.x, laser.y) = (laser.x + x, laser.y + y),
            _ => {}
        }
    }
    for sample in &mut right.encoders {
        if swapped {
            std::mem::swap(&mut sample.drive, &mut sample.steering);
        }
        let sign = |is_turned: bool| if is_turned { -1 } else { 1 };
        sample.drive = (sign(back) * i64::from(sample.drive)).rem_euclid(believed.drive_range.values() as i64) as u32;
        sample.steering = (sign(turned) * i64::from(sample.steering) + offset).rem_euclid(range) as u32;
    }
    right
}

/// What is left of noise, slip and steering, by that of another fit.
fn noise(found: &Found, usual: &Found) -> f64 {
    (found.noise.slip / usual.noise.slip).max(found.noise.steering / usual.noise.steering)
}

/// Every set that is named makes a good drive of the log: nothing is blamed that does not fit.
fn assert_fitting(input: &LogInput, found: &[Explanation], sound: &Found, mistakes: &[Mistake]) {
    for explanation in found.iter().filter(|one| !matches!(one.causes[..], [Cause::FewReflectors(_)])) {
        let right = without(input, &explanation.causes);
        let fitted = Log::among_few(&right).and_then(|drive| find_any(drive, &[JOINT, STC]));
        let (fitted, drive) = fitted.unwrap_or_else(|refusal| panic!("{mistakes:?}: {explanation:?}: {refusal}"));
        // What is followed from one of a few reflectors to the next is noisier, and refused if it is too much so.
        let most = if drive.is_from_stops() { 3.0 } else { f64::INFINITY };
        assert!(noise(&fitted, sound) < most, "{mistakes:?}: {explanation:?}: {:?}", fitted.noise);
    }
}

#[test]
fn a_vehicle_without_mistakes_is_blamed_for_none() {
    let found = explain(&base(1), |_| ());
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].causes, []);
}

/// Figures of many cases.
#[derive(Default)]
struct Tally {
    all: usize,
    crowded: usize,
    untold: usize,
    missed: Vec<String>,
}

fn tally<'a>(seed: u64, cases: impl Iterator<Item = &'a [Mistake]>) -> Tally {
    let base = base(seed);
    let sound = calibrate(&base, &JOINT).unwrap();
    let mut tally = Tally::default();
    for mistakes in cases {
        let input = with(&base, mistakes);
        let found = explain(&input, |_| ());
        assert_fitting(&input, &found, &sound, mistakes);
        tally.all += 1;
        tally.crowded += usize::from(names(&found).len() > 2);
        tally.untold += usize::from(found.is_empty());
        if !is_held(mistakes, &found) {
            tally.missed.push(format!("{mistakes:?}: {found:?}"));
        }
    }
    let Tally { all, crowded, untold, missed } = &tally;
    let held = all - missed.len() - untold;
    println!("seed {seed}: {held} of {all} hold the mistakes, {crowded} have more than two names, {untold} have none");
    tally
}

fn assert_named(Tally { all, crowded, missed, .. }: &Tally) {
    assert!(missed.is_empty(), "{} of {all}: {missed:#?}", missed.len());
    assert!(10 * crowded <= *all, "{crowded} of {all} with more than two names");
}

fn is_long() -> bool {
    std::env::var_os("AGV_LONG").is_some()
}

#[test]
fn every_single_mistake_is_named() {
    let seeds: &[u64] = if is_long() { &[1, 100_000, 100_001] } else { &[1] };
    for seed in seeds {
        assert_named(&tally(*seed, SINGLE.chunks(1)));
    }
}

/// Every eighteenth pair, and all of them where `AGV_LONG` is set.
#[test]
fn pairs_of_mistakes_are_named() {
    let pairs: Vec<[Mistake; 2]> = SINGLE
        .iter()
        .enumerate()
        .flat_map(|(index, first)| SINGLE[index + 1..].iter().map(|second| [*first, *second]))
        .filter(|[first, second]| group(*first) != group(*second))
        .collect();
    let (seed, stride) = if is_long() { (100_000, 1) } else { (1, 18) };
    assert_named(&tally(seed, pairs.iter().step_by(stride).map(|pair| &pair[..])));
}
