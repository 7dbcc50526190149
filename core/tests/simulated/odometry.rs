//! What single reports of the odometry make of a way.

use agv_core::geometry::Pose;
use agv_core::localizer::{Event, Localizer, Parameters, PoseFix, Reason, VehicleCapacities};
use agv_core::measurement::{PoseIncrement, Time, WheelReading, WheelSample};
use agv_core::odometry::{
    AngleEncoder, BiSteerable, CounterRange, DrivenWheel, SteeredWheel, Vehicle, VehicleOdometer, WheelVehicle,
};

use super::kind::Kind;
use super::run::{Course, course_by};
use super::simulator::{Drive, Errors, is_counted, ring};

/// Blind at 0.5 m/s, which is half of what the vehicle can do.
fn blind(kind: Kind, rate: f64, tick: f64, jitter: f64, fastest: f64) -> (Course, usize) {
    let drive = Drive {
        tick,
        rate,
        jitter,
        motion: Box::new(|time| (if time > 1.0 { 0.5 } else { 0.0 }, 0.0, 0.0)),
        seconds: 11.0,
        reflectors: ring(4, 0.0, 0.0, 20.0, 1),
        sees: Box::new(|_, _| false),
        errors: Errors { slip: 0.0, yaw: 0.0, ..Errors::SMALL },
        ..Drive::new(kind)
    };
    let mut parameters = drive.parameters();
    parameters.limits.fastest = fastest;
    let mut implausible = 0;
    let (course, _) = course_by(&drive, Box::new(Localizer::<VehicleCapacities>::new(parameters)), |_, outputs| {
        implausible += usize::from(outputs.pose.reason == Reason::OdometryImplausible);
    });
    (course, implausible)
}

#[test]
fn coarse_ticks_at_high_rates_tell_the_whole_way() {
    let mut wrong = Vec::new();
    for kind in Kind::ALL.into_iter().filter(|kind| is_counted(&kind.vehicle(1e-4))) {
        for rate in [20.0, 50.0, 100.0, 200.0, 500.0, 1000.0] {
            for tick in [5e-5, 1.1e-3, 2.2e-3, 6e-3] {
                for jitter in [0.0, 0.45] {
                    let (course, implausible) = blind(kind, rate, tick, jitter, 1.0);
                    let Course { last_error: error, last_level: level, above, lost, .. } = course;
                    if lost.is_some() || error > 5.0 * tick + 1e-3 + jitter / rate * 0.5 || implausible > 0 || above > 0
                    {
                        wrong.push(format!(
                            "{kind:?} {rate} Hz tick {tick} jitter {jitter}: {error:.4} m, level {level:.3}, implausible {implausible}, above {above}, lost {lost:?}"
                        ));
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}: {wrong:#?}", wrong.len());
}

/// A vehicle that is faster than it is said to be: what is refused widens the level, until the vehicle says that it is lost.
#[test]
fn refused_steps_are_never_silently_lost_way() {
    for rate in [20.0, 100.0, 1000.0] {
        for fastest in [0.45, 0.3] {
            let (course, refused) = blind(Kind::Tricycle, rate, 1e-4, 0.0, fastest);
            assert!(refused > 0, "{rate} Hz, fastest {fastest}: nothing was refused");
            assert_eq!(course.above, 0, "{rate} Hz, fastest {fastest}");
            assert!(matches!(course.lost, None | Some((_, Reason::Uncertain))), "{:?}", course.lost);
        }
    }
}

fn millis(millis: u64) -> Time {
    Time::from_micros(1000 * millis)
}

/// Closed form: both wheels stand along the vehicle, so it goes forward by the ticks.
#[test]
fn a_steering_counter_that_passes_the_end_of_its_range_turns_no_wheel_around() {
    const VALUES: u64 = 4096;
    let range = CounterRange::new(VALUES).unwrap();
    let turn = AngleEncoder { scale: 1e-3, range: CounterRange::BITS_32 };
    let steering = AngleEncoder { scale: std::f64::consts::TAU / VALUES as f64, range };
    let steered = |x: f64| SteeredWheel {
        x,
        y: 0.0,
        drive: DrivenWheel { radius: 0.1, turn },
        steering,
        steering_offset: std::f64::consts::PI,
    };
    let vehicle = Vehicle::Wheels(WheelVehicle::BiSteerable(BiSteerable { front: steered(0.7), rear: steered(-0.7) }));
    let parameters = Parameters::new(vehicle, Pose::default());
    for (from, to) in [(2046, 2050), (2050, 2046), (2044, 2047), (2049, 2052)] {
        let mut odometer = VehicleOdometer::new(&vehicle, &parameters.odometer());
        let sample = |time: u64, count: u32, steering: u32| {
            let mut wheels = [WheelReading::default(); 4];
            wheels[..2].fill(WheelReading { count, steering });
            WheelSample { time: millis(time), wheels }
        };
        assert!(odometer.wheels(&sample(0, 0, from)).is_err());
        let (motion, slip) = odometer.wheels_with_slip(&sample(10, 100, to)).unwrap();
        assert!((motion.displacement.x - 0.01).abs() < 1e-5, "{from} to {to}: {motion:?}");
        assert!(slip.abs() < 1e-4, "{from} to {to}: {slip}");
    }
}

/// Variance of the heading for a turn of 0.1 rad on the spot, whose random walk is 0.1 rad for a root of a radian.
#[test]
fn every_vehicle_that_turns_on_the_spot_walks_by_its_turn() {
    for kind in Kind::ALL.into_iter().filter(|kind| kind.turns_on_the_spot()) {
        let vehicle = kind.vehicle(1e-4);
        let mut parameters = Parameters::new(vehicle, Pose::default());
        let variance = |parameters: &Parameters| {
            let drive = Drive {
                motion: Box::new(|time| (0.0, 0.0, if time < 0.05 { 0.0 } else { 1.0 })),
                seconds: 0.2,
                reflectors: ring(3, 0.0, 0.0, 9.0, 1),
                sees: Box::new(|_, _| false),
                errors: Errors { slip: 0.0, yaw: 0.0, ..Errors::SMALL },
                ..Drive::new(kind)
            };
            let localizer = Box::new(Localizer::<VehicleCapacities>::new(*parameters));
            let before = 0.003_f64.powi(2);
            let mut turned = 0.0;
            let (_, given) = course_by(&drive, localizer, |_, outputs| turned = outputs.pose.pose.theta);
            (given.localizer.outputs().pose.covariance[5] - before) * 0.1 / turned
        };
        let own = variance(&parameters);
        parameters.odometry_noise.turn = 0.1;
        let walk = variance(&parameters);
        assert!(walk - own >= 0.99e-3, "{kind:?}: {own:e} {walk:e}");
        assert!(own > 0.0, "{kind:?} turns on the spot without noise");
    }
}

/// A pose for a time between the last report and what the laser has seen since: the report that follows is not taken twice.
#[test]
fn a_pose_given_within_the_extrapolated_span_stays() {
    use agv_core::geometry::Point;
    use agv_core::maps::Landmark;
    use agv_core::measurement::{ReflectorObservation, Reflectors};
    const SPEED: f64 = 1.5;
    let truth = |millis: f64| Pose::new(SPEED * millis * 1e-3, 0.0, 0.0);
    let at = |millis: f64| Time::from_micros((millis * 1e3) as u64);
    for given in [0.0, 5.0, 10.0, 20.0, 30.0, 39.0, 45.0] {
        let parameters = Parameters::new(Vehicle::Increments, Pose::new(0.5, 0.0, 0.0));
        let mut localizer = Box::new(Localizer::<VehicleCapacities>::new(parameters));
        let places = [(6.0, 4.0), (-2.0, 5.0), (9.0, -3.0), (1.0, -4.0)];
        let map: Vec<Landmark> =
            (0..).zip(places).map(|(id, (x, y))| Landmark::reflector(id, Point::new(x, y), 0.002)).collect();
        localizer.add_landmarks(&map).unwrap();
        let fix = |millis: f64| PoseFix {
            time: at(millis),
            pose: truth(millis),
            position_deviation: 0.01,
            heading_deviation: 0.003,
        };
        let step = |millis: f64, way: f64| {
            Event::Increment(PoseIncrement { time: at(millis), displacement: Pose::new(way, 0.0, 0.0) })
        };
        localizer.handle(&step(0.0, 0.0));
        localizer.handle(&Event::SetPose(fix(0.0)));
        for number in 1..=10 {
            localizer.handle(&step(50.0 * f64::from(number), SPEED * 0.05));
        }
        let seen: Vec<ReflectorObservation> = (0..)
            .zip(&map)
            .map(|(number, landmark)| {
                let time = 510.0 + 10.0 * f64::from(number);
                let seen = truth(time).compose(&Pose::new(0.5, 0.0, 0.0)).inverse_transform(&landmark.position());
                ReflectorObservation { time: at(time), range: seen.norm() as f32, bearing: seen.y.atan2(seen.x) as f32 }
            })
            .collect();
        localizer.handle(&Event::Reflectors(Reflectors::of_first(&seen)));
        localizer.handle(&Event::SetPose(fix(500.0 + given)));
        for time in [550.0, 600.0, 650.0] {
            let said = localizer.handle(&step(time, SPEED * 0.05)).pose;
            let off = said.pose.x - truth(said.time.seconds() * 1e3).x;
            assert!(off.abs() < 1e-6, "given at +{given} ms, at {time} ms: {off}");
        }
    }
}
