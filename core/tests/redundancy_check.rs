//! Redundant wheels that do not fit each other: a wheel that slips, and nothing else, is told.

use agv_core::integrity::{RedundancyCheck, WheelErrors};
use agv_core::measurement::{Time, WheelReading, WheelSample};
use agv_core::odometry::{
    AngleEncoder, BiSteerable, CounterRange, DrivenWheel, Integration, Motion, Odometer, OdometerParameters,
    OdometryNoise, Omnidirectional, SteeredWheel, WheelBased,
};

/// Way of one tick, m.
const TICK: f64 = 1e-5;
/// Way of the vehicle between two samples, m.
const STEP: f64 = 0.01;
/// What lasts, as a share of the way.
const LASTING: f64 = 2.2e-3;
const ERRORS: WheelErrors = WheelErrors { slip: 6e-3, lasting: LASTING * LASTING, step: 3e-4 };

const DRIVEN: DrivenWheel =
    DrivenWheel { radius: 1.0, turn: AngleEncoder { scale: TICK, range: CounterRange::BITS_32 } };

fn bi_steerable() -> BiSteerable {
    let steering = AngleEncoder { scale: 1e-4, range: CounterRange::BITS_16 };
    let wheel = |x| SteeredWheel { x, y: 0.0, drive: DRIVEN, steering, steering_offset: 0.0 };
    BiSteerable { front: wheel(0.7), rear: wheel(-0.7) }
}

/// Its wheels stand at 45, 135, 225 and 315 degrees.
fn omni() -> Omnidirectional<4> {
    Omnidirectional { arm: 0.4, first: std::f64::consts::FRAC_PI_4, driven: [DRIVEN; 4] }
}

/// Ways of the wheels for a metre straight ahead, by hand: the wheels of a bi-steerable vehicle roll forward; those of the
/// other roll at right angles to their places, the first two backward.
const BI_STEERABLE: [f64; 4] = [1.0, 1.0, 0.0, 0.0];
const OMNI: [f64; 4] = [
    -std::f64::consts::FRAC_1_SQRT_2,
    -std::f64::consts::FRAC_1_SQRT_2,
    std::f64::consts::FRAC_1_SQRT_2,
    std::f64::consts::FRAC_1_SQRT_2,
];

/// About normal: the sum of twelve even numbers has the variance one.
fn normal(state: &mut u64) -> f64 {
    let mut even = || {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..12).map(|_| even()).sum::<f64>() - 6.0
}

/// Drives straight ahead; `too_much` gives what each wheel turns too much of its way, m, from the way of the vehicle and of the
/// wheel. Gives the way of the vehicle at which a slip was told first, m.
fn told<V: WheelBased>(
    vehicle: V,
    ways: [f64; 4],
    length: f64,
    mut too_much: impl FnMut(f64, usize, f64) -> f64,
) -> Option<f64> {
    let parameters = OdometerParameters {
        noise: OdometryNoise::default(),
        integration: Integration::default(),
        fastest: 5.0,
        longest_interval: 0.25,
    };
    let mut odometer = Odometer::new(vehicle, &parameters);
    let mut check = RedundancyCheck::new();
    let mut turned = [0.0; 4];
    for step in 0..(length / STEP) as u32 {
        let driven = f64::from(step) * STEP;
        let time = Time::from_micros(1_000_000 + 10_000 * u64::from(step));
        let wheels = turned.map(|way: f64| WheelReading { count: (way / TICK).round() as i64 as u32, steering: 0 });
        if let Ok((motion, slip)) = odometer.report_with_slip(&WheelSample { time, wheels }) {
            check.travel(&motion, slip, &ERRORS);
            if check.slips(time) {
                return Some(driven);
            }
        }
        for (wheel, (turned, share)) in turned.iter_mut().zip(ways).enumerate() {
            let way = share * STEP;
            *turned += way + too_much(driven, wheel, way);
        }
    }
    None
}

#[test]
fn a_wheel_that_slips_by_a_fifth_is_told_within_three_tenths_of_a_metre() {
    for wheel in 0..4 {
        for share in [0.2, -0.2] {
            let slipping =
                |driven: f64, number: usize, way: f64| if number == wheel && driven >= 2.0 { share * way } else { 0.0 };
            let found = told(omni(), OMNI, 4.0, slipping).expect("it is told") - 2.0;
            assert!(found > 0.0 && found <= 0.3, "wheel {wheel}, {share}: {found}");
            if wheel < 2 {
                let found = told(bi_steerable(), BI_STEERABLE, 4.0, slipping).expect("it is told") - 2.0;
                assert!(found > 0.0 && found <= 0.3, "wheel {wheel}, {share}: {found}");
            }
        }
    }
}

/// How many of five vehicles whose wheels slip by that share of what is stated are told to slip within 2 km each.
fn told_of_five(share: f64) -> usize {
    let drive = |seed: &u64| {
        let mut state = *seed;
        // And a radius that is wrong by what may last.
        let noise = |_: f64, number: usize, way: f64| {
            let lasting = if number == 0 { LASTING * way } else { 0.0 };
            lasting + share * ERRORS.slip * way.abs().sqrt() * normal(&mut state)
        };
        told(omni(), OMNI, 2000.0, noise).is_some()
    };
    (1..=5).filter(drive).count()
}

#[test]
fn wheels_that_slip_by_half_of_what_is_stated_are_not_told_in_ten_kilometres() {
    assert_eq!(told_of_five(0.5), 0);
}

/// The wheel goes half of the way of the vehicle, as one on the inside of a curve; the others slip as wheels do.
#[test]
fn a_wheel_on_the_inside_of_a_curve_is_told_once_it_is_known_how_wheels_slip() {
    for seed in 1..=20 {
        let mut state = seed;
        let slipping = |driven: f64, number: usize, way: f64| {
            let slip = if number == 0 && driven >= 8.0 { 0.12 * way } else { 0.0 };
            slip + 0.5 * ERRORS.slip * way.abs().sqrt() * normal(&mut state)
        };
        let found = told(omni(), OMNI, 10.0, slipping).expect("it is told") - 8.0;
        assert!(found > 0.0 && found <= 0.3 + STEP, "seed {seed}: {found} m");
    }
}

#[test]
fn wheels_that_slip_by_all_that_is_stated_are_hardly_told() {
    assert!(told_of_five(1.0) <= 1, "{}", told_of_five(1.0));
}

/// A hundred kilometres of each, two kilometres at a time.
#[test]
#[ignore = "takes minutes: how often wheels in order are told to slip"]
fn false_alarms_in_a_hundred_kilometres() {
    for share in [0.3, 0.5, 0.7, 1.0] {
        let mut alarms = 0;
        for seed in 101..=150_u64 {
            let mut state = seed;
            let noise = |_: f64, number: usize, way: f64| {
                let lasting = if number == 0 { LASTING * way } else { 0.0 };
                lasting + share * ERRORS.slip * way.abs().sqrt() * normal(&mut state)
            };
            alarms += usize::from(told(omni(), OMNI, 2000.0, noise).is_some());
        }
        println!("slip of {share} of that stated: {alarms} of 50 drives of 2 km");
        assert!(alarms <= 1, "{alarms}");
    }
}

/// Two ticks of a quarter of a millimetre that fall together when a vehicle drives off are all of a short way.
#[test]
fn ticks_are_no_slip() {
    let mut check = RedundancyCheck::new();
    let motion = |number: u64, distance: f64| {
        let at = |number: u64| Time::from_micros(1_000_000 + 10_000 * number);
        Motion { start: at(number), distance, ..Motion::none(at(number + 1)) }
    };
    // Wheels that slip by half of what is stated, to and fro, for thirty metres.
    for number in 0..3000 {
        let slip = 0.5 * ERRORS.slip * STEP.sqrt() * if number % 2 == 0 { 1.0 } else { -1.0 };
        check.travel(&motion(number, STEP), slip, &ERRORS);
    }
    check.clear();
    let ticks = motion(3000, 1.25e-4);
    check.travel(&ticks, 2.5e-4, &ERRORS);
    assert!(!check.slips(ticks.end));
}

#[test]
fn what_wanders_to_and_fro_is_no_slip() {
    // A fifth too much and a fifth too little, in turns.
    let mut sign = 1.0;
    let shaking = |_: f64, number: usize, way: f64| {
        if number != 0 {
            return 0.0;
        }
        sign = -sign;
        0.2 * sign * way
    };
    assert_eq!(told(omni(), OMNI, 20.0, shaking), None);
}

/// What does not fit is the same on each metre; the way goes on.
fn even(check: &mut RedundancyCheck, way: f64, slip: f64, errors: &WheelErrors, steps: u32) -> bool {
    let at = |number: u32| Time::from_micros(1_000_000 + 10_000 * u64::from(number));
    (0..steps).any(|number| {
        let mut motion = Motion { start: at(number), ..Motion::none(at(number + 1)) };
        motion.distance = way;
        check.travel(&motion, slip, errors);
        check.slips(motion.end)
    })
}

/// A window of 0.3 m: the sum of `n` steps has the variance of so much way, that of what lasts, and a step of a wheel.
#[test]
fn the_limit_is_that_of_the_stated_errors() {
    for errors in [
        ERRORS,
        WheelErrors { slip: 0.0, lasting: LASTING * LASTING, step: 3e-4 },
        WheelErrors { slip: 6e-3, lasting: 0.0, step: 3e-4 },
    ] {
        let way: f64 = 0.15;
        // One step: what was learnt is still what is stated.
        let limit = 5.6 * (errors.slip.powi(2) * way + errors.lasting * way * way + 3e-4_f64.powi(2)).sqrt();
        for sign in [1.0, -1.0] {
            assert!(!even(&mut RedundancyCheck::new(), way, sign * 0.99 * limit, &errors, 1), "{errors:?}");
            assert!(even(&mut RedundancyCheck::new(), way, sign * 1.01 * limit, &errors, 1), "{errors:?}");
        }
    }
}

#[test]
fn what_is_behind_a_new_pose_is_forgotten() {
    let errors = WheelErrors { slip: 0.0, lasting: 0.0, step: 3e-4 };
    // Three steps of 0.6 times the limit of a step: two are too much, one is not.
    let slip = 0.6 * 5.6 * 3e-4;
    let mut check = RedundancyCheck::new();
    assert!(!even(&mut check, 0.01, slip, &errors, 1));
    check.clear();
    assert!(!even(&mut check, 0.01, slip, &errors, 1));
    assert!(even(&mut check, 0.01, slip, &errors, 1));
}

/// Wheels that fit are known to slip by half of what is stated, after ten metres; then less is told.
#[test]
fn wheels_that_fit_are_held_to_less() {
    let errors = WheelErrors { slip: 6e-3, lasting: 0.0, step: 3e-4 };
    let limit = |slip: f64, way: f64| 5.6 * (slip * slip * way + 3e-4_f64.powi(2)).sqrt();
    let mut check = RedundancyCheck::new();
    // 9 m without slip: (0 + 3.6e-5 1) / (9 + 1) is below a quarter of what is stated, which is the least.
    assert!(!even(&mut check, 0.3, 0.0, &errors, 30));
    let mut unlearnt = RedundancyCheck::new();
    let slip = 1.02 * limit(3e-3, 0.3);
    assert!(slip < 0.9 * limit(6e-3, 0.3));
    assert!(!even(&mut unlearnt, 0.3, slip, &errors, 1));
    // The window of that step begins with it, the others are longer.
    assert!(even(&mut check, 0.3, slip, &errors, 1));
}

/// Half of the way to what was learnt: as much as was seen, and what is stated for a metre.
#[test]
fn what_was_seen_for_a_metre_weighs_as_much_as_what_is_stated() {
    let errors = WheelErrors { slip: 6e-3, lasting: 0.0, step: 3e-4 };
    // Three metres in twelve steps, the first two of which are off to either side, so that nothing is told.
    let (off, way): (f64, f64) = (6e-3, 0.25);
    let mut check = RedundancyCheck::new();
    let mut learnt = (0.0, 0.0);
    for step in 0..12 {
        let slip = [off, -off].get(step).copied().unwrap_or(0.0);
        assert!(!even(&mut check, way, slip, &errors, 1));
        // Each step forgets a fortieth of what was before.
        let kept = 1.0 - way / 10.0;
        learnt = (kept * learnt.0 + slip * slip, kept * learnt.1 + way);
    }
    let variance = (learnt.0 + 3.6e-5) / (learnt.1 + 1.0);
    assert!(variance > 0.25 * 3.6e-5 && variance < 3.6e-5);
    let limit = 5.6 * (variance * 0.25 + 3e-4_f64.powi(2)).sqrt();
    assert!(!even(&mut check.clone(), 0.25, 0.99 * limit, &errors, 1));
    assert!(even(&mut check, 0.25, 1.01 * limit, &errors, 1));
}

/// The sums begin anew all along the way: what was driven long ago does not hide what slips now.
#[test]
fn a_long_way_behind_hides_no_slip() {
    let errors = WheelErrors { slip: 0.0, lasting: LASTING * LASTING, step: 3e-4 };
    let mut check = RedundancyCheck::new();
    assert!(!even(&mut check, 0.01, 0.0, &errors, 2000));
    // 20 m: what lasts may be 44 mm; of 0.3 m it is below a millimetre.
    assert!(even(&mut check, 0.01, 3e-4, &errors, 30));
}

/// The localiser asks the check, and says what it finds; a pause forgets the way behind.
#[test]
fn a_localiser_says_that_a_wheel_slips() {
    use agv_core::geometry::Pose;
    use agv_core::localizer::{Event, Localizer, Parameters, PoseFix, Reason, SlamCapacities};
    use agv_core::odometry::{Vehicle, WheelVehicle};
    let vehicle = Vehicle::Wheels(WheelVehicle::FourOmnidirectional(omni()));
    let mut localizer = Box::new(Localizer::<SlamCapacities>::new(Parameters::new(vehicle, Pose::default())));
    let mut turned = [0.0; 4];
    let mut said = Vec::new();
    for step in 0..200_u64 {
        let time = Time::from_micros(1_000_000 + 10_000 * step);
        let wheels = turned.map(|way: f64| WheelReading { count: (way / TICK).round() as i64 as u32, steering: 0 });
        let reason = localizer.handle(&Event::Wheels(WheelSample { time, wheels })).pose.reason;
        if step == 0 {
            let fix = PoseFix { time, pose: Pose::default(), position_deviation: 0.01, heading_deviation: 0.003 };
            localizer.handle(&Event::SetPose(fix));
        }
        if reason == Reason::WheelsSlip {
            said.push(step);
        }
        for (number, (turned, share)) in turned.iter_mut().zip(OMNI).enumerate() {
            let slips = number == 1 && step >= 100;
            *turned += share * STEP * if slips { 1.3 } else { 1.0 };
        }
    }
    assert!(said.first().is_some_and(|first| (101..140).contains(first)), "{said:?}");
}
