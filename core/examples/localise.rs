//! A tricycle that reports the counters of its two encoders a hundred times a second, and a laser that sees reflectors eight
//! times a second.
#![allow(clippy::expect_used, reason = "a panic is how an example ends that does not do what it says")]

use agv_core::geometry::{Point, Pose, Twist};
use agv_core::localizer::{Event, Localizer, Mode, Parameters, PoseFix};
use agv_core::maps::Landmark;
use agv_core::measurement::{EncoderSample, ReflectorObservation, Reflectors, Time};
use agv_core::odometry::{CounterRange, Tricycle, Vehicle};

/// The vehicle: a wheel of 0.1 mm a tick that steers 1.5 m before the rear axle, and a laser above it.
const TRICYCLE: Tricycle = Tricycle {
    wheelbase: 1.5,
    drive_scale: 1e-4,
    drive_range: CounterRange::BITS_32,
    steering_scale: 1e-4,
    steering_range: CounterRange::BITS_16,
    steering_offset_forward: 0.0,
    steering_offset_backward: 0.0,
};
const LASER: Pose = Pose { x: 1.5, y: 0.0, theta: 0.0 };

/// What the laser sees at `time` from a vehicle at `pose`.
fn look(pose: &Pose, map: &[Landmark], time: Time) -> Vec<ReflectorObservation> {
    let sensor = pose.compose(&LASER);
    let seen = map.iter().map(|landmark| sensor.inverse_transform(&landmark.position()));
    seen.map(|at| ReflectorObservation { time, range: at.norm() as f32, bearing: at.y.atan2(at.x) as f32 }).collect()
}

/// Drives a curve of 10 m and compares the pose with the truth.
pub fn main() {
    let parameters = Parameters::new(Vehicle::Tricycle(TRICYCLE), LASER);
    parameters.check().expect("sound parameters");
    let mut localizer: Box<Localizer> = Box::new(Localizer::new(parameters));
    let places = [(6.0, 4.0), (-2.0, 5.0), (9.0, -3.0), (1.0, -4.0), (12.0, 5.0)];
    let map: Vec<Landmark> =
        (0..).zip(places).map(|(id, (x, y))| Landmark::reflector(id, Point::new(x, y), 0.002)).collect();
    localizer.add_landmarks(&map).expect("room for five reflectors");
    // Somebody says where the vehicle stands, and how well that is known.
    let start =
        PoseFix { time: Time::default(), pose: Pose::default(), position_deviation: 0.05, heading_deviation: 0.02 };
    localizer.handle(&Event::SetPose(start));
    let (steering, mut pose, mut ticks) = (0.1_f64, Pose::default(), 0.0);
    for sample in 0..1000_u64 {
        let time = Time::from_micros(10_000 * sample);
        let counters =
            EncoderSample { time, drive: ticks as u32, steering: (steering / TRICYCLE.steering_scale) as u32 };
        localizer.handle(&Event::Encoders(counters));
        if sample % 12 == 0 {
            let observations = look(&pose, &map, time);
            let output = localizer.handle(&Event::Reflectors(Reflectors::of_first(&observations))).pose;
            let error = (output.pose.x - pose.x).hypot(output.pose.y - pose.y);
            println!(
                "{:.2} s {:?} x {:.3} m, y {:.3} m, off {error:.4} m",
                time.seconds(),
                output.mode,
                output.pose.x,
                output.pose.y
            );
            assert!(error < 0.01 && (sample == 0 || output.mode == Mode::Reflectors));
        }
        // The wheel goes 1 cm along the direction in which it is steered.
        let step = Twist { x: 0.01 * steering.cos(), y: 0.0, theta: 0.01 * steering.sin() / TRICYCLE.wheelbase };
        (pose, ticks) = (pose.compose(&Pose::exp(&step)), ticks + 0.01 / TRICYCLE.drive_scale);
    }
}
