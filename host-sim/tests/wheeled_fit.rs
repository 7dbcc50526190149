//! The joint fit of every kinematics on simulated drives: exact without noise, and as uncertain as it says with noise.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, reason = "a panic is how a test fails")]

use agv_core::geometry::{Pose, Twist};
use agv_core::odometry::{
    AckermannWheels, AngleEncoder, Contact, CounterRange, Differential, DrivenWheel, Mecanum, Omnidirectional, Wheel,
    WheelBased, WheelMotion,
};
use agv_host_sim::calibrate::wheeled::drive::{WheelDrive, WheelStep};
use agv_host_sim::calibrate::wheeled::fit::{WheeledFit, WheeledFitError, fit};
use agv_host_sim::calibrate::wheeled::unknowns::{Kind, Unknown, WheeledModel};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rayon::prelude::*;

const ENCODER: AngleEncoder = AngleEncoder { scale: 1.0, range: CounterRange::BITS_32 };
const DRIVEN: DrivenWheel = DrivenWheel { radius: 0.1, turn: ENCODER };
/// Length of a step, s, and steps of a drive.
const STEP: f64 = 0.1;
const STEPS: usize = 300;
/// The clock of the odometry.
const OFFSET: f64 = 0.3;
const RATE: f64 = 0.01;

struct Random(ChaCha8Rng);

impl Random {
    fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, least: f64, most: f64) -> f64 {
        least + (most - least) * self.uniform()
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.uniform()).ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

fn steered(x: f64) -> Wheel {
    Wheel { steering: Some(ENCODER), ..DRIVEN.at(x, 0.0, 0.0, Contact::Tyre) }
}

fn kinds() -> Vec<(&'static str, Kind, Vec<Wheel>)> {
    let dragged = Wheel { turn: None, ..DRIVEN.at(0.0, 0.0, 0.0, Contact::Tyre) };
    let differential = Differential { track: 0.5, left: DRIVEN, right: DRIVEN };
    let car = AckermannWheels { rear: differential, wheelbase: 1.0, steering: ENCODER, steering_offset: 0.0 };
    let three = Omnidirectional { arm: 0.2, first: 1.0, driven: [DRIVEN; 3] };
    let four = Omnidirectional { arm: 0.2, first: 0.7, driven: [DRIVEN; 4] };
    let mecanum = Mecanum { wheelbase: 0.4, track: 0.5, driven: [DRIVEN; 4] };
    vec![
        ("tricycle", Kind::Tricycle, vec![steered(1.0), dragged]),
        ("differential", Kind::Differential, differential.wheels().as_ref().to_vec()),
        ("bi-steerable", Kind::BiSteerable, vec![steered(0.6), steered(-0.6)]),
        ("car", Kind::Ackermann, car.wheels().as_ref().to_vec()),
        ("three omnidirectional wheels", Kind::Omnidirectional, three.wheels().as_ref().to_vec()),
        ("four omnidirectional wheels", Kind::Omnidirectional, four.wheels().as_ref().to_vec()),
        ("mecanum", Kind::Omnidirectional, mecanum.wheels().as_ref().to_vec()),
    ]
}

/// What a wheel does while R moves by that twist, by plane rigid kinematics.
fn wheel_motion(wheel: &Wheel, twist: &Twist) -> WheelMotion {
    let (x, y) = (twist.x - twist.theta * wheel.y, twist.y + twist.theta * wheel.x);
    let direction = match wheel.steering {
        // A steered wheel turns by a quarter at most, and drives backward instead.
        Some(_) if x < 0.0 => (-y).atan2(-x),
        Some(_) => y.atan2(x),
        None => wheel.heading,
    };
    let along = x * direction.cos() + y * direction.sin();
    let across = y * direction.cos() - x * direction.sin();
    let way = match wheel.contact {
        Contact::Tyre => along,
        Contact::Rollers(angle) => along + across * angle.tan(),
    };
    let ratio = wheel.steering.map_or(1.0, |encoder| encoder.scale);
    let steering = if wheel.steering.is_some() { (direction - wheel.heading) / ratio } else { 0.0 };
    let turn = if wheel.turn.is_some() { way / wheel.radius } else { 0.0 };
    WheelMotion { turn, steering_start: steering, steering_end: steering }
}

/// Noise of a drive: slip of each wheel, m for a square root of a metre; poses, m and rad.
struct Noise {
    slip: f64,
    position: f64,
    heading: f64,
}

const EXACT: Noise = Noise { slip: 0.0, position: 0.0, heading: 0.0 };

/// A drive of that vehicle: velocities that change every second, forward and backward, along curves and, where it can, sideways.
fn drive(model: &WheeledModel, is_holonomic: bool, noise: &Noise, count: usize, random: &mut Random) -> WheelDrive {
    let mut robot = Pose::default();
    let mut twist = Twist::default();
    let (mut steps, mut poses) = (Vec::new(), Vec::new());
    for index in 0..=count {
        let end = index as f64 * STEP;
        if index > 0 {
            if index % 10 == 1 {
                let speed = random.between(0.1, 0.8) * if random.uniform() < 0.3 { -1.0 } else { 1.0 };
                let across = if is_holonomic { random.between(-0.5, 0.5) } else { 0.0 };
                let turn = random.between(-0.6, 0.6);
                twist = Twist { x: speed * STEP, y: across * STEP, theta: turn * STEP };
            }
            robot = robot.compose(&Pose::exp(&twist));
            let motions = model.wheels.iter().map(|wheel| {
                let mut motion = wheel_motion(wheel, &twist);
                let way = (motion.turn * wheel.radius).abs();
                let slip = noise.slip * way.sqrt() * random.normal();
                motion.turn += if wheel.turn.is_some() { slip / wheel.radius } else { 0.0 };
                motion
            });
            steps.push(WheelStep { end, motions: motions.collect() });
        }
        let mut sensor = robot.compose(&model.sensor);
        sensor.x += noise.position * random.normal();
        sensor.y += noise.position * random.normal();
        sensor.theta += noise.heading * random.normal();
        poses.push(((end + OFFSET) / (1.0 - RATE), sensor));
    }
    WheelDrive::new(steps, poses)
}

/// A vehicle that differs from the nominal one by a few per cent in everything that is unknown.
fn true_model(nominal: &WheeledModel, unknowns: &[Unknown], random: &mut Random) -> (WheeledModel, Vec<f64>) {
    let changes: Vec<f64> = unknowns.iter().map(|unknown| 0.15 * unknown.prior * random.between(-1.0, 1.0)).collect();
    (nominal.changed(unknowns, &changes), changes)
}

fn fitted(
    kind: Kind,
    wheels: &[Wheel],
    noise: &Noise,
    steps: usize,
    truth: u64,
    seed: u64,
) -> (Vec<f64>, Result<WheeledFit, WheeledFitError>) {
    let nominal = WheeledModel { wheels: wheels.to_vec(), sensor: Pose::new(0.3, 0.1, 0.2) };
    let unknowns = Unknown::of(kind, wheels, true);
    let (model, changes) = true_model(&nominal, &unknowns, &mut Random(ChaCha8Rng::seed_from_u64(truth)));
    let is_holonomic = !matches!(kind, Kind::Tricycle | Kind::Differential | Kind::Ackermann);
    let drive = drive(&model, is_holonomic, noise, steps, &mut Random(ChaCha8Rng::seed_from_u64(seed)));
    (changes, fit(&[drive], &nominal, &unknowns, true))
}

#[test]
fn without_noise_every_parameter_comes_back() {
    for (name, kind, wheels) in kinds() {
        for seed in 1..4 {
            let (changes, found) = fitted(kind, &wheels, &EXACT, STEPS, seed, seed);
            let found = found.unwrap();
            for (fitted, change) in found.fitted.iter().zip(changes) {
                assert!((fitted.change - change).abs() < 1e-9, "{name}, seed {seed}: {fitted:?}, truly {change}");
            }
            let clock = found.clocks[0];
            assert!((clock.offset_s - OFFSET).abs() < 1e-9 && (clock.rate - RATE).abs() < 1e-9, "{name}: {clock:?}");
        }
    }
}

/// The spread of 100 drives is that which each of them states, on average.
#[test]
fn with_noise_every_parameter_is_as_uncertain_as_it_says() {
    const DRIVES: u64 = 100;
    let noise = Noise { slip: 2e-3, position: 1e-3, heading: 1e-3 };
    for (name, kind, wheels) in kinds() {
        let fits: Vec<_> =
            (0..DRIVES).into_par_iter().map(|seed| fitted(kind, &wheels, &noise, STEPS, 1, 1000 + seed)).collect();
        for (index, change) in fits[0].0.iter().enumerate() {
            let of = |fit: &(Vec<f64>, Result<WheeledFit, _>)| {
                let fitted = &fit.1.as_ref().unwrap().fitted[index];
                (fitted.change - change, fitted.deviation)
            };
            let found: Vec<(f64, f64)> = fits.iter().map(of).collect();
            let mean = found.iter().map(|(error, _)| error).sum::<f64>() / DRIVES as f64;
            let squares = found.iter().map(|(error, _)| (error - mean).powi(2)).sum::<f64>();
            let spread = (squares / (DRIVES - 1) as f64).sqrt();
            let stated = (found.iter().map(|(_, deviation)| deviation.powi(2)).sum::<f64>() / DRIVES as f64).sqrt();
            let what = &fits[0].1.as_ref().unwrap().fitted[index];
            println!("{name}: {}: mean error {mean:.2e}, spread {spread:.2e}, stated {stated:.2e}", what.name);
            assert!(spread < 1.5 * stated && stated < 1.5 * spread, "{name}: {}: {spread} {stated}", what.name);
            assert!(!what.is_open, "{name}: {}", what.name);
        }
    }
}

/// In a drive of two minutes some pose lies on the border between two steps of the odometry at every clock, where the way has a kink.
#[test]
fn long_drives_are_fitted() {
    let noise = Noise { slip: 2e-3, position: 1e-3, heading: 1e-3 };
    let (_, kind, wheels) = kinds().swap_remove(0);
    for seed in 100_020..100_030 {
        let (changes, found) = fitted(kind, &wheels, &noise, 4 * STEPS, 100_000, seed);
        for (fitted, change) in found.unwrap().fitted.iter().zip(changes) {
            let error = (fitted.change - change).abs();
            assert!(error < 5.0 * fitted.deviation, "seed {seed}: {fitted:?}, truly {change}");
        }
    }
}

/// A vehicle that only goes straight ahead tells its radii, and neither its track nor where the sensor is.
#[test]
fn what_a_drive_does_not_tell_is_left_as_it_was_and_said() {
    let (_, kind, wheels) = kinds().swap_remove(1);
    let nominal = WheeledModel { wheels: wheels.clone(), sensor: Pose::new(0.3, 0.1, 0.2) };
    let unknowns = Unknown::of(kind, &wheels, true);
    let mut random = Random(ChaCha8Rng::seed_from_u64(5));
    let steps: Vec<WheelStep> = (1..=STEPS)
        .map(|index| {
            let turn = 0.5 + 0.2 * (index as f64 * 0.05).sin();
            let motions = vec![WheelMotion { turn, ..WheelMotion::default() }; 2];
            WheelStep { end: index as f64 * STEP, motions }
        })
        .collect();
    let mut way = 0.0;
    let poses = steps.iter().map(|step| {
        way += 0.1 * step.motions[0].turn;
        let noise = 1e-3 * random.normal();
        (step.end, Pose::new(way + noise, noise, 0.2 + noise))
    });
    let drive = WheelDrive::new(steps.clone(), poses.collect::<Vec<_>>());
    let found = fit(&[drive], &nominal, &unknowns, true).unwrap();
    let open: Vec<&str> =
        found.fitted.iter().filter(|fitted| fitted.is_open).map(|fitted| fitted.name.as_str()).collect();
    assert_eq!(open, ["track m", "sensor x m", "sensor y m"]);
    assert!((found.model.wheels[0].y - wheels[0].y).abs() < 1e-3);
}

#[test]
fn a_drive_that_is_too_short_is_refused() {
    let (_, kind, wheels) = kinds().swap_remove(1);
    let nominal = WheeledModel { wheels: wheels.clone(), sensor: Pose::default() };
    let found = fit(&[WheelDrive::default()], &nominal, &Unknown::of(kind, &wheels, true), true);
    assert_eq!(found, Err(WheeledFitError::TooShort));
}
