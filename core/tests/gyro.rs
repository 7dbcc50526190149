//! A gyro: its turns against closed forms, its states against a filter with all of them, and drives whose truth is known.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is how a test fails")]

use agv_core::filter::{GyroState, KnownPose};
use agv_core::geometry::{Point, Pose, Twist, difference};
use agv_core::localizer::{Event, Localize, Localizer, Misuse, Mode, Parameters, PoseFix, Reason};
use agv_core::maps::Landmark;
use agv_core::measurement::{GyroSample, ReflectorObservation, Reflectors, Time, WheelReading, WheelSample};
use agv_core::odometry::{
    AngleEncoder, CounterRange, Differential, DrivenWheel, GyroErrors, GyroParameters, GyroRefusal, GyroTurn,
    GyroTurns, Motion, Vehicle, WheelVehicle,
};
use nalgebra::{Matrix3, Matrix5, Vector5};
use std::f64::consts::PI;

/// Numbers of a normal distribution, by the sum of twelve even ones.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

const FITTED: GyroParameters = GyroParameters {
    is_fitted: true,
    factor: 1.0,
    latency: 0.0,
    noise: 8.7e-5,
    bias: 8.7e-3,
    drift: 6.3e-6,
    scale: 3e-3,
    range: 4.36,
};

#[test]
fn turns_sum_up_to_the_integral_whatever_the_times_of_the_wheels() {
    // rate = 0.4 sin(t): the integral is 0.4 (1 - cos t).
    let rate = |seconds: f64| 0.4 * seconds.sin();
    let integral = |seconds: f64| 0.4 * (1.0 - seconds.cos());
    for (late, latency) in [(0.0, 0.0), (0.023, 0.0), (-0.013, 0.0), (0.004, 0.012)] {
        let mut turns = GyroTurns::new(&GyroParameters { latency, factor: -1.0, ..FITTED });
        let (mut sum, mut last, mut wheel) = (0.0, None::<f64>, 0.0);
        for step in 0..600 {
            let seconds = 0.01 * f64::from(step);
            // The gyro hangs upside down, and what it says is heard late.
            let heard = Time::from_seconds(10.0 + seconds + latency);
            turns.sample(&GyroSample { time: heard, rate: -rate(seconds) }).unwrap();
            while wheel <= seconds + late {
                if let Some(before) = last
                    && let Some(turn) = turns.turn(Time::from_seconds(10.0 + before), Time::from_seconds(10.0 + wheel))
                {
                    sum += turn.angle;
                    let expected = integral(wheel) - integral(0.02);
                    // What the held rate lacks behind the last sample is made up for later.
                    let held = 0.5 * 0.4 * (late.max(0.0) + latency + 0.02).powi(2);
                    assert!((sum - expected).abs() < held + 1e-5, "{sum} {expected} at {wheel}, late {late}");
                    last = Some(wheel);
                } else if wheel >= 0.02 - 1e-9 {
                    last = Some(wheel);
                }
                wheel += 0.02;
            }
        }
    }
}

#[test]
fn readings_that_tell_nothing_are_refused() {
    let mut turns = GyroTurns::new(&FITTED);
    let at =
        |milliseconds: u64, rate: f64| GyroSample { time: Time::from_micros(1_000_000 + 1000 * milliseconds), rate };
    assert_eq!(turns.sample(&at(0, 0.1)), Ok((0.1, None)));
    assert_eq!(turns.sample(&at(0, 0.1)), Err(GyroRefusal::OutOfOrder));
    assert_eq!(turns.sample(&at(10, 4.36)), Err(GyroRefusal::Clipped));
    assert_eq!(turns.sample(&at(20, f64::NAN)), Err(GyroRefusal::Clipped));
    assert_eq!(turns.turn(at(0, 0.0).time, at(10, 0.0).time), None);
    assert_eq!(turns.sample(&at(30, 0.2)), Ok((0.2, None)));
    assert_eq!(turns.sample(&at(40, 0.2)), Ok((0.2, Some(0.01))));
    let turn = turns.turn(at(30, 0.0).time, at(45, 0.0).time).unwrap();
    assert!((turn.angle - 0.003).abs() < 1e-15 && (turn.duration - 0.015).abs() < 1e-12);
    assert_eq!(turns.turn(at(45, 0.0).time, at(200, 0.0).time), None, "a silent gyro tells no turn");
}

#[test]
fn a_motion_takes_another_turn_as_an_arc_of_that_turn() {
    for (turn, other) in [(0.0, 0.02), (0.03, -0.01), (-0.05, -0.04)] {
        let arc = |turn: f64| Pose::exp(&Twist { x: 0.3, y: 0.0, theta: turn });
        let time = Time::from_micros(5);
        let covariance = Matrix3::new(4e-6, 1e-6, 0.0, 1e-6, 3e-6, 0.0, 0.0, 0.0, 2e-6);
        let motion = Motion { displacement: arc(turn), covariance, ..Motion::none(time) };
        let found = motion.with_turn(other, 1e-6);
        let expected = arc(other);
        assert!((found.displacement.x - expected.x).abs() < 2e-5 && (found.displacement.y - expected.y).abs() < 2e-5);
        assert!((found.displacement.theta - other).abs() < 1e-15);
        // By finite differences of the arc.
        let by = (arc(other + 1e-6).y - arc(other - 1e-6).y) / 2e-6;
        assert!((found.covariance.m23 - by * 1e-6).abs() < 2e-9, "{} {by}", found.covariance.m23);
        assert!((found.covariance.m33 - 1e-6).abs() < 1e-18);
        let by_x = (arc(other + 1e-6).x - arc(other - 1e-6).x) / 2e-6;
        let own = motion.covariance;
        for (name, entry, expected) in [
            ("xx", found.covariance.m11, own.m11 + by_x * by_x * 1e-6),
            ("xy", found.covariance.m12, own.m12 + by_x * by * 1e-6),
            ("yy", found.covariance.m22, own.m22 + by * by * 1e-6),
            ("xh", found.covariance.m13, by_x * 1e-6),
        ] {
            assert!((entry - expected).abs() < 3e-9, "{name}: {entry} {expected}");
        }
    }
}

/// A filter with all five states, with dense matrices and derivatives by differences.
struct Whole {
    state: Vector5<f64>,
    covariance: Matrix5<f64>,
}

impl Whole {
    fn step(&self, state: &Vector5<f64>, wheels: &Motion, turn: &GyroTurn) -> Vector5<f64> {
        let errors = GyroErrors { bias: state[3], scale: state[4] };
        let moved = wheels.with_turn(turn.corrected(&errors), 0.0);
        let pose = Pose { x: state[0], y: state[1], theta: state[2] };
        let (sine, cosine) = pose.theta.sin_cos();
        let Pose { x, y, theta } = moved.displacement;
        Vector5::new(
            pose.x + cosine * x - sine * y,
            pose.y + sine * x + cosine * y,
            pose.theta + theta,
            state[3],
            state[4],
        )
    }

    fn predict(&mut self, wheels: &Motion, turn: &GyroTurn, noise: f64, drift: f64) {
        let mut jacobian = Matrix5::zeros();
        for axis in 0..5 {
            let mut change = Vector5::zeros();
            change[axis] = 1e-6;
            let (more, less) = (self.state + change, self.state - change);
            jacobian.set_column(axis, &((self.step(&more, wheels, turn) - self.step(&less, wheels, turn)) / 2e-6));
        }
        let errors = GyroErrors { bias: self.state[3], scale: self.state[4] };
        let own = wheels.with_turn(turn.corrected(&errors), noise).covariance;
        let (sine, cosine) = self.state[2].sin_cos();
        let turned = Matrix3::new(cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0);
        let own = turned * own * turned.transpose();
        self.state = self.step(&self.state, wheels, turn);
        self.covariance = jacobian * self.covariance * jacobian.transpose();
        for row in 0..3 {
            for column in 0..3 {
                self.covariance[(row, column)] += own[(row, column)];
            }
        }
        self.covariance[(3, 3)] += drift * drift * turn.duration;
    }

    /// A pose that is told with that covariance.
    fn correct(&mut self, told: &Pose, noise: &Matrix3<f64>) {
        let block = self.covariance.fixed_view::<3, 3>(0, 0) + noise;
        let gain = self.covariance.fixed_columns::<3>(0) * block.try_inverse().unwrap();
        let rest = nalgebra::Vector3::new(told.x - self.state[0], told.y - self.state[1], told.theta - self.state[2]);
        self.state += gain * rest;
        self.covariance -= gain * self.covariance.fixed_rows::<3>(0);
    }

    fn known(&self) -> KnownPose {
        KnownPose {
            pose: Pose { x: self.state[0], y: self.state[1], theta: self.state[2] },
            covariance: self.covariance.fixed_view::<3, 3>(0, 0).into_owned(),
        }
    }
}

#[test]
fn bias_and_scale_are_those_of_a_filter_with_all_states() {
    let mut random = Random(5);
    let mut state = GyroState::new(&FITTED);
    let priors = [4e-4, 4e-4, 1e-4, FITTED.bias * FITTED.bias, FITTED.scale * FITTED.scale];
    let mut whole = Whole {
        state: Vector5::new(1.0, 2.0, 0.3, 0.0, 0.0),
        covariance: Matrix5::from_diagonal(&Vector5::from_row_slice(&priors)),
    };
    let (bias, scale) = (6e-3, -2e-3);
    for step in 0..2000 {
        let curvature = if step % 700 < 350 { 0.4 } else { -0.2 };
        let (duration, way) = (0.01_f64, 0.01);
        let turn = curvature * way;
        let displacement = Pose::exp(&Twist { x: way, y: 0.0, theta: turn });
        let (start, end) = (Time::from_micros(10_000 * step), Time::from_micros(10_000 * (step + 1)));
        let covariance = Matrix3::from_diagonal(&nalgebra::Vector3::new(3e-7, 1e-8, 1e-8));
        let wheels = Motion { start, end, displacement, covariance, distance: way };
        let noise = FITTED.noise * duration.sqrt();
        let angle = turn / (1.0 + scale) + bias * duration + noise * random.normal();
        let told = GyroTurn { angle, duration, variance: 0.0 };
        let motion = wheels.with_turn(told.corrected(state.errors()), noise * noise);
        let before = whole.known();
        // What the joint states add is what the pose of the whole filter has more than without them.
        let added = state.predict(before.pose.theta, &motion.displacement, duration, Some(&told));
        whole.predict(&wheels, &told, noise * noise, FITTED.drift);
        let alone = {
            let Pose { x, y, .. } = motion.displacement;
            let (sine, cosine) = before.pose.theta.sin_cos();
            let moved =
                Matrix3::new(1.0, 0.0, -(sine * x + cosine * y), 0.0, 1.0, cosine * x - sine * y, 0.0, 0.0, 1.0);
            let turned = Matrix3::new(cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0);
            moved * before.covariance * moved.transpose() + turned * (motion.covariance + added) * turned.transpose()
        };
        assert!((alone - whole.known().covariance).amax() < 1e-9 * whole.known().covariance.amax() + 1e-13);
        if step % 12 == 11 {
            let before = whole.known();
            let deviations = [5e-3, 5e-3, 1e-3];
            let seen = Pose {
                x: whole.state[0] + deviations[0] * random.normal(),
                y: whole.state[1] + deviations[1] * random.normal(),
                theta: whole.state[2] + deviations[2] * random.normal(),
            };
            let noise = Matrix3::from_diagonal(&nalgebra::Vector3::from(deviations.map(|one| one * one)));
            whole.correct(&seen, &noise);
            state.correct(&before, &whole.known());
        }
        let GyroErrors { bias, scale } = *state.errors();
        let own = state.covariance();
        assert!((bias - whole.state[3]).abs() < 1e-7 * FITTED.bias + 1e-9, "{step}: {bias} {}", whole.state[3]);
        assert!((scale - whole.state[4]).abs() < 1e-6 * FITTED.scale + 1e-8, "{step}: {scale} {}", whole.state[4]);
        assert!((own.m11 - whole.covariance[(3, 3)]).abs() < 1e-6 * whole.covariance[(3, 3)], "{step}");
        assert!((own.m22 - whole.covariance[(4, 4)]).abs() < 1e-6 * whole.covariance[(4, 4)], "{step}");
        assert!(own.m11 > 0.0);
    }
}

const TICK: f64 = 1e-4;
const RADIUS: f64 = 0.1;
const TRACK: f64 = 0.6;

fn vehicle() -> Vehicle {
    let turn = AngleEncoder { scale: TICK / RADIUS, range: CounterRange::BITS_16 };
    let wheel = DrivenWheel { radius: RADIUS, turn };
    Vehicle::Wheels(WheelVehicle::Differential(Differential { track: TRACK, left: wheel, right: wheel }))
}

fn parameters(gyro: GyroParameters) -> Parameters {
    let mut parameters = Parameters::new(vehicle(), Pose::new(0.5, 0.0, 0.0));
    parameters.gyro = gyro;
    parameters
}

/// What goes wrong.
#[derive(Clone, Copy, Default)]
struct Wrong {
    /// Share of the way of the left wheel that it turns too much.
    slip: f64,
    /// rad/s beside the bias.
    jump: f64,
    is_frozen: bool,
    is_silent: bool,
    is_clipped: bool,
}

/// A vehicle with two wheels, a gyro and a laser.
struct Drive {
    random: Random,
    localizer: Box<Localizer>,
    time: f64,
    truth: Pose,
    ways: [f64; 2],
    bias: f64,
    scale: f64,
    told: f64,
    wrong: Wrong,
    /// By how much the right wheel is larger than believed.
    larger: f64,
    /// How fast it turns, rad/s.
    turn: f64,
    sees: bool,
    reflectors: Vec<Point>,
    has_gyro: bool,
}

impl Drive {
    fn new(seed: u64, gyro: GyroParameters) -> Self {
        let reflectors: Vec<Point> = (0..12)
            .map(|number| {
                let angle = f64::from(number) * PI / 6.0 + 0.1 * f64::from(number % 5);
                Point::new(14.0 * angle.cos() + f64::from(number % 3), 14.0 * angle.sin())
            })
            .collect();
        let mut localizer: Box<Localizer> = Box::new(Localizer::new(parameters(gyro)));
        let landmarks: Vec<Landmark> =
            reflectors.iter().zip(0..).map(|(place, id)| Landmark::reflector(id, *place, 0.002)).collect();
        localizer.add_landmarks(&landmarks).unwrap();
        let truth = Pose::new(-3.0, 0.5, 0.1);
        let mut drive = Self {
            random: Random(seed),
            localizer,
            time: 1.0,
            truth,
            ways: [3.0, 5.0],
            bias: 5e-3,
            scale: 1.5e-3,
            told: 0.0,
            wrong: Wrong::default(),
            larger: 1e-3,
            turn: 0.0,
            sees: true,
            reflectors,
            has_gyro: gyro.is_fitted,
        };
        let fix = PoseFix { time: drive.now(), pose: truth, position_deviation: 0.02, heading_deviation: 0.01 };
        drive.localizer.handle(&Event::SetPose(fix));
        drive
    }

    fn now(&self) -> Time {
        Time::from_seconds(self.time)
    }

    fn said(&self) -> agv_core::state::PoseOutput {
        self.localizer.outputs().pose
    }

    /// Heading error, rad.
    fn heading_error(&self) -> f64 {
        difference(self.said().pose.theta, self.truth.theta)
    }

    /// Drives on for so many seconds; `look` is called behind each step, until it says that it has seen enough.
    fn go(&mut self, seconds: f64, speed: f64, turn: f64, mut look: impl FnMut(&Self) -> bool) -> bool {
        let steps = (seconds / 0.01).round() as usize;
        for _ in 0..steps {
            // It turns faster or slower by 2 rad/s^2.
            self.turn += (turn - self.turn).clamp(-0.02, 0.02);
            let (way, angle) = (0.01 * speed, 0.01 * self.turn);
            // The floor turns the vehicle a little.
            let walk = 3.5e-4 * way.abs().sqrt() * self.random.normal();
            self.truth = self.truth.compose(&Pose::exp(&Twist { x: way, y: 0.0, theta: angle + walk }));
            let slip = 5e-4 * way.abs().sqrt();
            self.ways[0] += (way - 0.5 * TRACK * angle) * (1.0 + self.wrong.slip) + slip * self.random.normal();
            self.ways[1] += (way + 0.5 * TRACK * angle) / (1.0 + self.larger) + slip * self.random.normal();
            self.time += 0.01;
            let rate = (angle + walk) / 0.01 / (1.0 + self.scale) + self.bias + self.wrong.jump;
            if self.has_gyro && !self.wrong.is_silent {
                let rate = rate + 8.7e-4 * self.random.normal();
                let quantised = (rate / 1.6e-4).round() * 1.6e-4;
                self.told = if self.wrong.is_frozen { self.told } else { quantised };
                let rate = if self.wrong.is_clipped { FITTED.range } else { self.told };
                self.localizer.handle(&Event::Gyro(GyroSample { time: self.now(), rate }));
            }
            let count =
                |way: f64| WheelReading { count: ((way / TICK).floor() as i64).rem_euclid(65_536) as u32, steering: 0 };
            let mut wheels = [WheelReading::default(); 4];
            (wheels[0], wheels[1]) = (count(self.ways[0]), count(self.ways[1]));
            self.localizer.handle(&Event::Wheels(WheelSample { time: self.now(), wheels }));
            if self.sees && ((self.time * 100.0).round() as u64).is_multiple_of(12) {
                self.revolve();
            }
            if look(self) {
                return true;
            }
        }
        false
    }

    fn revolve(&mut self) {
        let laser = self.truth.compose(&Pose::new(0.5, 0.0, 0.0));
        let (sine, cosine) = laser.theta.sin_cos();
        let time = self.now();
        let places = self.reflectors.clone();
        let mut seen: Vec<ReflectorObservation> = Vec::new();
        for place in places {
            let (x, y) = (place.x - laser.x, place.y - laser.y);
            let range = (x * x + y * y).sqrt() + 5e-3 * self.random.normal();
            let bearing = (cosine * y - sine * x).atan2(cosine * x + sine * y) + 8e-4 * self.random.normal();
            seen.push(ReflectorObservation { time, range: range as f32, bearing: bearing as f32 });
        }
        self.localizer.handle(&Event::Reflectors(Reflectors::of_first(&seen)));
    }

    fn stand(&mut self, seconds: f64) {
        self.go(seconds, 0.0, 0.0, |_| false);
    }
}

fn fitted(seed: u64) -> Drive {
    Drive::new(seed, FITTED)
}

#[test]
fn a_standing_vehicle_learns_the_bias() {
    let mut drive = fitted(1);
    drive.sees = false;
    drive.stand(30.0);
    let errors = drive.localizer.gyro_errors().unwrap();
    // 0.005 deg/s/sqrt(Hz) over 29.5 s.
    assert!((errors.bias - drive.bias).abs() < 4.0 * 8.7e-5 / 29.5_f64.sqrt(), "{errors:?}");
    assert!(drive.heading_error().abs() < 1e-9, "a vehicle that stands does not turn");
    assert_eq!(drive.said().reason, Reason::NoLandmarks);
}

#[test]
fn landmarks_teach_a_driving_vehicle_bias_and_scale() {
    let mut drive = fitted(2);
    for turn in [0.4, -0.4, 0.4, -0.4] {
        drive.go(16.0, 0.6, turn, |_| false);
    }
    let errors = drive.localizer.gyro_errors().unwrap();
    assert!((errors.bias - drive.bias).abs() < 3e-4, "{errors:?}");
    assert!((errors.scale - drive.scale).abs() < 1e-3, "{errors:?}");
    assert!(drive.heading_error().abs() < 2e-3, "{} {:?}", drive.heading_error(), drive.said());
    let said = drive.said();
    assert_eq!((said.mode, said.reason), (Mode::Reflectors, Reason::None));
}

#[test]
fn without_landmarks_the_heading_is_the_gyros() {
    for seed in 3..9 {
        let mut drive = fitted(seed);
        drive.stand(40.0);
        let before = drive.heading_error();
        drive.sees = false;
        drive.go(12.0, 1.0, 0.02, |_| false);
        let grown = (drive.heading_error() - before).to_degrees();
        assert!(grown.abs() < 0.1, "{seed}: {grown} deg");
        let mut wheels = Drive::new(seed, GyroParameters { is_fitted: false, ..FITTED });
        wheels.stand(40.0);
        let before = wheels.heading_error();
        wheels.sees = false;
        wheels.go(12.0, 1.0, 0.02, |_| false);
        let by_wheels = (wheels.heading_error() - before).to_degrees();
        assert!(by_wheels.abs() > 0.5, "the wheels alone are off by what their sizes differ: {by_wheels} deg");
    }
}

#[test]
fn slip_of_a_wheel_is_told_within_three_tenths_of_a_metre_and_ends() {
    for seed in 10..20 {
        let mut drive = fitted(seed);
        drive.stand(5.0);
        drive.go(4.0, 0.8, 0.1, |drive| {
            assert!(!matches!(drive.said().reason, Reason::WheelsSlip | Reason::GyroFault), "{:?}", drive.said());
            false
        });
        drive.sees = false;
        drive.wrong.slip = 0.2;
        let heading = drive.heading_error();
        let from = drive.truth;
        assert!(drive.go(1.0, 0.8, 0.0, |drive| drive.said().reason == Reason::WheelsSlip));
        let way = from.between(&drive.truth).x;
        assert!(way <= 0.3, "{seed}: told after {way} m");
        drive.go(1.0, 0.8, 0.0, |_| false);
        assert!((drive.heading_error() - heading).abs() < 2e-3, "the gyro is believed");
        let bound = drive.said().level.heading;
        assert!(drive.heading_error().abs() < bound, "{bound}");
        drive.wrong.slip = 0.0;
        drive.sees = true;
        drive.go(3.0, 0.8, 0.0, |_| false);
        assert_ne!(drive.said().reason, Reason::WheelsSlip, "{:?}", drive.said());
    }
}

#[test]
fn a_gyro_that_fails_is_told_and_the_wheels_are_believed() {
    let failures = [
        Wrong { is_frozen: true, ..Wrong::default() },
        Wrong { is_silent: true, ..Wrong::default() },
        Wrong { is_clipped: true, ..Wrong::default() },
    ];
    for wrong in failures {
        let mut drive = fitted(30);
        drive.stand(5.0);
        drive.go(2.0, 0.8, 0.0, |_| false);
        drive.sees = false;
        drive.wrong = wrong;
        let heading = drive.heading_error();
        assert!(drive.go(0.3, 0.8, 0.2, |drive| drive.said().reason == Reason::GyroFault), "{:?}", drive.said());
        drive.go(4.0, 0.8, 0.2, |_| false);
        // A tenth of a second of a wrong rate, and what the wheels' sizes differ on 3.4 m.
        assert!((drive.heading_error() - heading).abs() < 0.02 + 0.006 + 0.01, "{}", drive.heading_error());
        assert!(drive.heading_error().abs() < drive.said().level.heading);
        drive.wrong = Wrong::default();
        drive.go(2.0, 0.8, 0.0, |_| false);
        assert_ne!(drive.said().reason, Reason::GyroFault);
    }
}

#[test]
fn a_bias_that_jumps_is_bounded_while_driving_and_told_at_rest() {
    let mut drive = fitted(40);
    drive.stand(20.0);
    drive.go(5.0, 0.8, 0.0, |_| false);
    drive.sees = false;
    drive.wrong.jump = 0.5_f64.to_radians();
    drive.go(8.0, 0.8, 0.0, |drive| {
        let (error, level) = (drive.heading_error().abs(), drive.said().level.heading);
        assert!(error < level, "{error} {level}");
        false
    });
    let before = drive.heading_error();
    assert!(before.abs() > 0.05, "it has turned the pose: {before}");
    assert!(drive.go(2.0, 0.0, 0.0, |drive| drive.said().reason == Reason::GyroFault), "{:?}", drive.said());
    drive.stand(3.0);
    let errors = drive.localizer.gyro_errors().unwrap();
    assert!((errors.bias - drive.bias - drive.wrong.jump).abs() < 3e-4, "{errors:?}");
}

#[test]
fn a_gyro_that_is_switched_off_changes_no_bit() {
    let poses = |gyro: GyroParameters, is_on: bool| {
        let mut drive = fitted(50);
        let mut parameters = parameters(gyro);
        parameters.sources.gyro = is_on;
        *drive.localizer = Localizer::new(parameters);
        let landmarks: Vec<Landmark> =
            drive.reflectors.iter().zip(0..).map(|(place, id)| Landmark::reflector(id, *place, 0.002)).collect();
        drive.localizer.add_landmarks(&landmarks).unwrap();
        let fix = PoseFix { time: drive.now(), pose: drive.truth, position_deviation: 0.02, heading_deviation: 0.01 };
        drive.localizer.handle(&Event::SetPose(fix));
        let mut poses = Vec::new();
        drive.go(3.0, 0.8, 0.2, |drive| {
            poses.push(drive.said());
            false
        });
        poses
    };
    let without = poses(GyroParameters { is_fitted: false, ..FITTED }, true);
    assert_eq!(without, poses(FITTED, false));
    assert_ne!(without, poses(FITTED, true));
}

#[test]
fn a_gyro_that_nobody_knows_is_a_misuse() {
    let mut drive = Drive::new(60, GyroParameters::default());
    let time = drive.now().offset(0.01);
    assert_eq!(drive.localizer.handle(&Event::Gyro(GyroSample { time, rate: 0.0 })).misuse, Some(Misuse::WrongVehicle));
}

#[test]
fn a_turn_between_two_readings_is_a_share_of_theirs() {
    let mut turns = GyroTurns::new(&FITTED);
    let at = |milliseconds: u64| Time::from_micros(1_000_000 + 1000 * milliseconds);
    for (step, rate) in [0.1, 0.3, 0.3, -0.2].into_iter().enumerate() {
        turns.sample(&GyroSample { time: at(10 * step as u64), rate }).unwrap();
    }
    // Angles at the readings, by the trapezoidal rule: 0, 0.002, 0.005, 0.0055.
    for (from, to, angle) in [(4, 10, 0.0012), (10, 13, 0.0009), (13, 25, 0.00235), (20, 24, 0.0002), (0, 30, 0.0055)] {
        let turn = turns.turn(at(from), at(to)).unwrap();
        assert!((turn.angle - angle).abs() < 1e-15, "{from} to {to}: {} {angle}", turn.angle);
        assert!((turn.duration - 1e-3 * (to - from) as f64).abs() < 1e-12);
    }
}

#[test]
fn a_bias_that_nothing_tells_is_known_to_twice_its_prior_at_least() {
    let mut gyro = GyroState::new(&FITTED);
    let long = GyroTurn { angle: 0.0, duration: 1e5, variance: 0.0 };
    for hours in 1..200 {
        let _ = gyro.predict(0.0, &Pose::default(), 1e5, Some(&long));
        let walked = FITTED.bias.powi(2) + FITTED.drift.powi(2) * 1e5 * f64::from(hours);
        let expected = walked.sqrt().min(2.0 * FITTED.bias);
        assert!((gyro.deviations().0 / expected - 1.0).abs() < 1e-9, "{hours}: {:?} {expected}", gyro.deviations());
    }
    assert_eq!(gyro.deviations().0, 2.0 * FITTED.bias);
}

#[test]
fn rest_with_a_variance_that_is_no_number_tells_nothing() {
    let fresh = GyroState::new(&FITTED);
    for variance in [f64::NAN, f64::INFINITY, -FITTED.bias.powi(2), -1.0] {
        let mut gyro = fresh;
        gyro.see_rest(0.004, variance);
        assert_eq!((gyro.errors(), gyro.covariance()), (fresh.errors(), fresh.covariance()), "{variance}");
    }
}

/// What a controller sees of the localiser that it was lent.
#[test]
fn a_localiser_that_was_lent_says_what_it_has_learned_of_the_gyro() {
    fn errors(localizer: impl Localize) -> Option<GyroErrors> {
        localizer.gyro_errors()
    }
    for is_fitted in [false, true] {
        let mut localizer: Box<Localizer> =
            Box::new(Localizer::new(parameters(GyroParameters { is_fitted, ..FITTED })));
        for step in 0..200 {
            let time = Time::from_micros(1_000_000 + 10_000 * step);
            localizer.handle(&Event::Gyro(GyroSample { time, rate: 0.004 + 1e-5 * (step % 3) as f64 }));
            localizer.handle(&Event::Wheels(WheelSample { time, wheels: [WheelReading::default(); 4] }));
            if step == 2 {
                let pose = Pose::default();
                localizer.handle(&Event::SetPose(PoseFix {
                    time,
                    pose,
                    position_deviation: 0.01,
                    heading_deviation: 0.01,
                }));
            }
        }
        let learned = localizer.gyro_errors();
        assert_eq!(learned.is_some(), is_fitted);
        assert!(learned.is_none_or(|learned| (learned.bias - 0.00401).abs() < 2e-4), "{learned:?}");
        assert_eq!(errors(&mut *localizer), learned);
    }
}

/// What is known of a gyro that has told a turn to the left and, faster, one to the right: bias and scale are correlated with the pose,
/// each in its own way.
fn turned() -> GyroState {
    let mut state = GyroState::new(&FITTED);
    for (angle, duration) in [(1.0, 4.0), (-0.5, 0.3)] {
        let turn = GyroTurn { angle, duration, variance: 0.0 };
        let _ = state.predict(0.3, &Pose::new(1.0, 0.1, angle), duration, Some(&turn));
    }
    state
}

fn known(x: f64, theta: f64, variance: f64) -> KnownPose {
    KnownPose { pose: Pose::new(x, 0.0, theta), covariance: Matrix3::identity() * variance }
}

/// A pose that is said to be far surer than what the gyro has told of it would leave bias and scale with negative variances.
#[test]
fn a_correction_that_no_covariance_allows_changes_nothing() {
    let mut state = turned();
    let (errors, covariance) = (*state.errors(), *state.covariance());
    state.correct(&known(0.0, 0.0, 1e-9), &known(0.01, 0.01, 1e-12));
    assert_eq!((state.errors(), state.covariance()), (&errors, &covariance));
    state.correct(&known(0.0, 0.0, 1e-2), &known(0.01, 0.01, f64::NAN));
    assert_eq!((state.errors(), state.covariance()), (&errors, &covariance));
    // A sound one changes both.
    state.correct(&known(0.0, 0.0, 1e-2), &known(0.01, 0.01, 1e-3));
    assert!(state.errors().bias != errors.bias && state.errors().scale != errors.scale);
    assert!(state.covariance().m11 < covariance.m11 && state.covariance().m22 < covariance.m22);
}

#[test]
fn a_pose_that_begins_anew_says_nothing_of_the_gyro() {
    let mut state = turned();
    state.begin_pose();
    let (errors, covariance) = (*state.errors(), *state.covariance());
    state.correct(&known(0.0, 0.0, 1e-2), &known(0.01, 0.01, 1e-3));
    assert_eq!((state.errors(), state.covariance()), (&errors, &covariance));
}

/// What the turns of the way behind have in common with the bias says nothing of a pose that somebody gives.
#[test]
fn a_given_pose_that_is_wrong_teaches_the_gyro_nothing() {
    let mut drive = fitted(4);
    drive.sees = false;
    drive.go(10.0, 0.5, 0.3, |_| false);
    let pose = Pose { theta: drive.truth.theta + 0.05, ..drive.truth };
    let fix = PoseFix { time: drive.now(), pose, position_deviation: 0.05, heading_deviation: 0.09 };
    drive.localizer.handle(&Event::SetPose(fix));
    let before = drive.localizer.gyro_errors().unwrap();
    drive.revolve();
    let after = drive.localizer.gyro_errors().unwrap();
    assert!(drive.heading_error().abs() < 0.02, "the heading is put right: {}", drive.heading_error());
    assert!(
        (after.bias - before.bias).abs() < 1e-6 && (after.scale - before.scale).abs() < 1e-6,
        "{before:?} {after:?}"
    );
}

/// Whether a vehicle without odometry stands, nobody knows.
#[test]
fn while_the_wheels_tell_nothing_no_bias_is_learnt() {
    use agv_core::measurement::{EncoderFault, EncoderFaults};
    let mut drive = fitted(5);
    drive.sees = false;
    drive.stand(5.0);
    let mut before = None;
    for step in 1..=20 {
        let time = drive.now().offset(0.01 * f64::from(step));
        let faults = EncoderFaults { time, drive: Some(EncoderFault::Late), steering: None };
        drive.localizer.handle(&Event::EncoderFaults(faults));
        before = before.or(drive.localizer.gyro_errors());
        let rate = drive.told + 1e-4 * f64::from(step % 2);
        drive.localizer.handle(&Event::Gyro(GyroSample { time: time.offset(0.005), rate }));
    }
    assert_eq!(before, drive.localizer.gyro_errors());
}

/// A vehicle that turns on the spot as slowly as the bias may be does not stand.
#[test]
fn a_slow_turn_is_not_taken_for_the_bias() {
    let mut drive = fitted(6);
    drive.sees = false;
    drive.go(2.0, 0.3, 0.0, |_| false);
    let before = drive.localizer.gyro_errors().unwrap().bias;
    drive.go(10.0, 0.0, 0.01, |_| false);
    let after = drive.localizer.gyro_errors().unwrap().bias;
    assert!((after - before).abs() < 1e-3, "{before} {after}");
}

/// By finite differences of the displacement itself: what the turn's variance adds is along its derivative.
#[test]
fn the_covariance_of_another_turn_is_that_of_its_derivative() {
    let covariance = Matrix3::new(4e-4, 1e-4, 0.0, 1e-4, 3e-4, 0.0, 0.0, 0.0, 2e-4);
    let displacement = Pose::new(0.3, -0.4, 0.2);
    let motion = Motion { displacement, covariance, ..Motion::none(Time::from_micros(5)) };
    for (turn, variance) in [(0.2, 1e-2), (-0.5, 2e-2), (0.9, 5e-3)] {
        let at = |turn: f64| motion.with_turn(turn, variance).displacement;
        let (less, more) = (at(turn - 1e-6), at(turn + 1e-6));
        let by = nalgebra::Vector3::new((more.x - less.x) / 2e-6, (more.y - less.y) / 2e-6, 1.0);
        let mut own = covariance;
        own.m33 = 0.0;
        let expected = own + by * by.transpose() * variance;
        let found = motion.with_turn(turn, variance).covariance;
        assert!((found - expected).norm() < 1e-9, "{found} {expected}");
    }
}
