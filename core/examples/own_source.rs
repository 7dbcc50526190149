//! A source of one's own: an ultrasonic sensor at the front says how far away a known wall is.
//!
//! `cargo run --package agv-core --example own_source`

use agv_core::filter::{Ekf, Linearisation, Slots};
use agv_core::geometry::Pose;
use agv_core::localizer::{Event, Localizer, Parameters, PoseFix};
use agv_core::measurement::{PoseIncrement, Time};
use agv_core::odometry::Vehicle;
use agv_core::sources::Aid;
use nalgebra::{Matrix1, Vector1};

/// The wall stands across the x axis of W, here, m.
const WALL: f64 = 8.0;
/// The sensor sits that far before the logical point, m, and looks ahead.
const AHEAD: f64 = 0.5;
/// Its standard deviation, m.
const DEVIATION: f64 = 0.01;

struct DistanceToWall {
    time: Time,
    /// What the sensor said, m.
    distance: f64,
}

impl Aid<1> for DistanceToWall {
    fn time(&self) -> Time {
        self.time
    }

    fn linearise<S: Slots>(&self, state: &Ekf<S>) -> Option<Linearisation<1>> {
        let (sine, cosine) = state.pose.theta.sin_cos();
        // Along its beam the wall is `gap / cosine` away.
        let gap = WALL - state.pose.x - AHEAD * cosine;
        if cosine < 0.1 || gap <= 0.0 {
            return None;
        }
        let residual = Vector1::new(self.distance - gap / cosine);
        let by_heading = (AHEAD * sine * cosine + gap * sine) / (cosine * cosine);
        let covariance = Matrix1::new(DEVIATION * DEVIATION);
        Some(
            Linearisation::new(residual, covariance)
                .with(0, Vector1::new(-1.0 / cosine))
                .with(2, Vector1::new(by_heading)),
        )
    }

    fn gate(&self) -> f64 {
        // Chi-square with one degree of freedom, 99.7 per cent.
        8.81
    }
}

/// Drives towards the wall.
pub fn main() {
    let mut localizer: Box<Localizer> = Box::new(Localizer::new(Parameters::new(Vehicle::Increments, Pose::default())));
    let start = PoseFix {
        time: Time::from_micros(0),
        pose: Pose::new(0.0, 0.0, 0.1),
        position_deviation: 0.05,
        heading_deviation: 0.002,
    };
    localizer.handle(&Event::SetPose(start));
    // The vehicle goes 2 m ahead, and its odometry says 2 per cent too much.
    let (steps, step) = (200_u64, 0.01);
    let mut truth = start.pose;
    for number in 0..=steps {
        let time = Time::from_micros(number * 10_000);
        let moved = if number == 0 { Pose::default() } else { Pose::new(step, 0.0, 0.0) };
        truth = truth.compose(&moved);
        let displacement = Pose { x: 1.02 * moved.x, ..moved };
        localizer.handle(&Event::Increment(PoseIncrement { time, displacement }));
        if number % 10 == 0 {
            let distance = (WALL - truth.x - AHEAD * truth.theta.cos()) / truth.theta.cos();
            localizer.aid(&DistanceToWall { time, distance });
        }
    }
    let outputs = localizer.outputs();
    let (said, status) = (outputs.pose, outputs.sources.aids);
    println!("odometry alone: {:.3} m ahead of the truth", 0.02 * step * steps as f64);
    println!("with the wall:  {:.3} m, standard deviation {:.3} m", said.pose.x - truth.x, said.covariance[0].sqrt());
    println!(
        "last distance:  {} of {} used, test ratio {:.2}",
        status.accepted, status.observations, status.test_ratio
    );
    assert!((said.pose.x - truth.x).abs() < 0.01, "the wall has corrected what the odometry says too much");
}
