//! The vehicles of several wheels that parameters can describe: where their wheels stand, against the inverse kinematics of
//! textbooks (Siegwart, Nourbakhsh, Scaramuzza: Introduction to Autonomous Mobile Robots, 3.2), and which of them are sound.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use agv_core::geometry::{Pose, Twist, difference};
use agv_core::odometry::{
    AckermannWheels, AngleEncoder, BiSteerable, CounterRange, Differential, DrivenWheel, Integration, Mecanum,
    OdometryNoise, Omnidirectional, SteeredWheel, WheelBased, WheelMotion, WheelPath, WheelSet, WheelVehicle,
};

const RADIUS: f64 = 0.1;
const ENCODER: AngleEncoder = AngleEncoder { scale: 1e-3, range: CounterRange::BITS_16 };
const DRIVEN: DrivenWheel = DrivenWheel { radius: RADIUS, turn: ENCODER };

/// Along x, along y, on the spot, and all at once: m, m, rad.
const MOTIONS: [[f64; 3]; 4] = [[0.2, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.3], [0.15, -0.1, 0.25]];

/// What a vehicle makes of wheels whose contacts have gone those ways, m, is that motion.
fn assert_moves(vehicle: impl WheelBased, ways: &[f64], [x, y, theta]: [f64; 3]) {
    let motions: Vec<_> = ways.iter().map(|way| WheelMotion { turn: way / RADIUS, ..WheelMotion::default() }).collect();
    let noise = OdometryNoise::default();
    let wheels = vehicle.wheels();
    let set = WheelSet::of(wheels.as_ref());
    let path = WheelPath::new(&set, &motions, &noise, Integration::Arc).unwrap();
    let (found, expected) = (path.displacement(), Pose::exp(&Twist { x, y, theta }));
    let off = (found.x - expected.x).hypot(found.y - expected.y);
    assert!(off < 1e-12 && difference(found.theta, expected.theta).abs() < 1e-12, "{found:?} {expected:?}");
    assert!(path.fit().slip.abs() < 1e-12, "{vehicle:?} contradicts itself by {} m", path.fit().slip);
}

#[test]
fn mecanum_wheels_turn_as_their_inverse_kinematics_say() {
    let (wheelbase, track) = (0.8, 0.5);
    let vehicle = Mecanum { wheelbase, track, driven: [DRIVEN; 4] };
    for [x, y, turn] in MOTIONS {
        // Front left, front right, rear left, rear right.
        let around = 0.5 * (wheelbase + track) * turn;
        assert_moves(vehicle, &[x - y - around, x + y + around, x + y - around, x - y + around], [x, y, turn]);
    }
}

#[test]
fn omnidirectional_wheels_turn_as_their_inverse_kinematics_say() {
    let (arm, first) = (0.3, 0.4);
    let ways = |count: u32, [x, y, turn]: [f64; 3]| -> Vec<f64> {
        let along = |number: u32| {
            let place = (first + 360.0_f64.to_radians() / f64::from(count) * f64::from(number)).sin_cos();
            y * place.1 - x * place.0 + arm * turn
        };
        (0..count).map(along).collect()
    };
    for motion in MOTIONS {
        assert_moves(Omnidirectional { arm, first, driven: [DRIVEN; 3] }, &ways(3, motion), motion);
        assert_moves(Omnidirectional { arm, first, driven: [DRIVEN; 4] }, &ways(4, motion), motion);
    }
}

const DIFFERENTIAL: Differential = Differential { track: 0.5, left: DRIVEN, right: DRIVEN };
const FRONT: SteeredWheel = SteeredWheel { x: 0.7, y: 0.1, drive: DRIVEN, steering: ENCODER, steering_offset: 0.01 };
const CAR: AckermannWheels =
    AckermannWheels { rear: DIFFERENTIAL, wheelbase: 1.2, steering: ENCODER, steering_offset: 0.0 };

#[test]
fn vehicles_of_usual_measures_are_sound() {
    let vehicles = [
        WheelVehicle::Differential(DIFFERENTIAL),
        WheelVehicle::BiSteerable(BiSteerable { front: FRONT, rear: SteeredWheel { x: -0.7, ..FRONT } }),
        WheelVehicle::Ackermann(CAR),
        WheelVehicle::ThreeOmnidirectional(Omnidirectional { arm: 0.3, first: 0.0, driven: [DRIVEN; 3] }),
        WheelVehicle::FourOmnidirectional(Omnidirectional { arm: 0.3, first: 0.0, driven: [DRIVEN; 4] }),
        WheelVehicle::Mecanum(Mecanum { wheelbase: 0.8, track: 0.5, driven: [DRIVEN; 4] }),
        // Its wheels are 50 m beside R: as far as is allowed.
        WheelVehicle::Differential(Differential { track: 100.0, ..DIFFERENTIAL }),
    ];
    for vehicle in vehicles {
        assert!(vehicle.is_sound(), "{vehicle:?}");
    }
}

#[test]
fn a_vehicle_with_one_number_that_nothing_can_be_computed_with_is_not_sound() {
    let unscaled = |scale| AngleEncoder { scale, ..ENCODER };
    let wheel = |radius, scale| DrivenWheel { radius, turn: unscaled(scale) };
    let with_left = |left| WheelVehicle::Differential(Differential { left, ..DIFFERENTIAL });
    let with_steering = |scale| WheelVehicle::Ackermann(AckermannWheels { steering: unscaled(scale), ..CAR });
    let vehicles = [
        WheelVehicle::Differential(Differential { track: 100.1, ..DIFFERENTIAL }),
        WheelVehicle::Differential(Differential { track: f64::NAN, ..DIFFERENTIAL }),
        WheelVehicle::Ackermann(AckermannWheels { wheelbase: -50.1, ..CAR }),
        WheelVehicle::Ackermann(AckermannWheels { steering_offset: f64::INFINITY, ..CAR }),
        with_left(wheel(0.0, 1e-3)),
        with_left(wheel(50.1, 1e-3)),
        with_left(wheel(RADIUS, 0.0)),
        with_left(wheel(RADIUS, f64::NAN)),
        with_steering(0.0),
        with_steering(f64::NEG_INFINITY),
    ];
    for vehicle in vehicles {
        assert!(!vehicle.is_sound(), "{vehicle:?}");
    }
}
