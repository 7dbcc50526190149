//! A vehicle of one's own: two driven wheels side by side, whose counters say how far each has gone.
//!
//! `cargo run --package agv-core --example own_vehicle`

use agv_core::geometry::{Pose, Twist};
use agv_core::localizer::{Event, Localizer, Parameters, PoseFix};
use agv_core::measurement::Time;
use agv_core::odometry::{Believed, Kinematics, Odometer, Step, Vehicle};

/// Both wheels on one axle; the logical point is in the middle between them.
#[derive(Clone, Copy, Debug)]
struct Differential {
    /// Distance between the wheels, m.
    track: f64,
    /// Distance travelled for one tick, m.
    scale: f64,
}

/// What it reports: ticks since it was switched on.
#[derive(Clone, Copy, Debug)]
struct Wheels {
    time: Time,
    left: i64,
    right: i64,
}

impl Kinematics for Differential {
    type Report = Wheels;

    fn time(report: &Wheels) -> Time {
        report.time
    }

    fn is_sound(&self, _: &Wheels) -> bool {
        true
    }

    fn step(&self, from: &Wheels, to: &Wheels, duration: f64, believed: &Believed) -> Step {
        let [left, right] = [to.left - from.left, to.right - from.right].map(|ticks| self.scale * ticks as f64);
        let (along, turn) = (0.5 * (left + right), (right - left) / self.track);
        let displacement = Pose::exp(&Twist { x: along, y: 0.0, theta: turn });
        let covariance = believed.noise.of_displacement(along.abs(), turn, duration);
        Step { displacement, covariance, distance: along.abs(), is_backward: along < 0.0, slip: 0.0 }
    }

    fn steering_lever(&self) -> Option<f64> {
        None
    }

    fn longest_interval(&self, _: f64) -> f64 {
        f64::INFINITY
    }

    fn resolution(&self) -> Option<f64> {
        Some(self.scale)
    }
}

/// Drives a quarter of a circle of 2 m.
pub fn main() {
    let vehicle = Differential { track: 0.5, scale: 1e-5 };
    // The localiser itself takes motions only.
    let parameters = Parameters::new(Vehicle::Increments, Pose::default());
    let mut odometer = Odometer::new(vehicle, &parameters.odometer());
    let mut localizer: Box<Localizer> = Box::new(Localizer::new(parameters));
    let start = Pose::default();
    let fix = PoseFix { time: Time::from_micros(0), pose: start, position_deviation: 0.01, heading_deviation: 0.005 };
    localizer.handle(&Event::SetPose(fix));
    let (radius, steps) = (2.0, 300_i64);
    let quarter = std::f64::consts::FRAC_PI_2;
    for number in 0..=steps {
        let turned = quarter * number as f64 / steps as f64;
        let ticks = |radius: f64| (turned * radius / vehicle.scale).round() as i64;
        let (left, right) = (ticks(radius - 0.5 * vehicle.track), ticks(radius + 0.5 * vehicle.track));
        let report = Wheels { time: Time::from_micros(10_000 * number as u64), left, right };
        localizer.travel(report.time, odometer.report(&report));
    }
    let said = localizer.outputs().pose;
    println!("{:.4} m, {:.4} m, {:.4} rad after a quarter of a circle", said.pose.x, said.pose.y, said.pose.theta);
    println!("standard deviations {:.4} m and {:.4} m", said.covariance[0].sqrt(), said.covariance[2].sqrt());
    let off = [said.pose.x - radius, said.pose.y - radius, said.pose.theta - quarter];
    assert!(off.iter().all(|off| off.abs() < 1e-3));
}
