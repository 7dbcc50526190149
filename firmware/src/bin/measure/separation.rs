//! What the solutions cost that bound the error of the pose: revolutions of so many reflectors, on a way with bends.

use agv_core::geometry::{Point, Pose};
use agv_core::integrity::separation::{AssumedDeviations, LandmarkKey, Seen, SolutionSeparation};
use agv_core::measurement::Time;
use agv_core::odometry::Motion;
use agv_firmware::board::an500::stopwatch::Stopwatch;
use nalgebra::{Matrix2, Matrix3, Vector3};
use static_cell::StaticCell;

use super::Count;

static SEPARATION: StaticCell<SolutionSeparation> = StaticCell::new();

/// Revolutions that are counted.
const REVOLUTIONS: u16 = 200;

/// Of six reflectors a revolution, and of twenty.
pub fn count(stopwatch: &Stopwatch) -> [Count; 2] {
    let new = || SolutionSeparation::new(AssumedDeviations::default(), Some(1.4));
    let separation = SEPARATION.init_with(new);
    let six = revolve(stopwatch, separation, 6, "solutions of a revolution of 6 reflectors");
    *separation = new();
    [six, revolve(stopwatch, separation, 20, "solutions of a revolution of 20 reflectors")]
}

fn revolve(stopwatch: &Stopwatch, separation: &mut SolutionSeparation, reflectors: u16, name: &'static str) -> Count {
    let mut count = Count::new(name);
    let mount = Pose::new(0.8, 0.0, 0.0);
    let mut pose = Pose::default();
    separation.begin(Time::default(), &pose, &[1e-4, 0.0, 1e-4, 0.0, 0.0, 1e-5], &pose);
    for revolution in 0..REVOLUTIONS {
        let turn = if revolution % 80 < 40 { 0.0 } else { 0.05 };
        let displacement = Pose::new(0.125, 0.0, turn);
        let start = Time::from_micros(125_000 * u64::from(revolution));
        let end = start.offset(0.125);
        let covariance = Matrix3::from_diagonal(&Vector3::new(4e-6, 1e-7, 2e-7));
        pose = pose.compose(&displacement);
        count.add(stopwatch.count(|| {
            separation.travel(&Motion { start, end, displacement, covariance, distance: 0.125 }, &pose);
            separation.step(end, &pose);
            let laser = separation.laser(&mount, &pose);
            separation.begin_event();
            for number in 0..reflectors {
                let (sine, cosine) = libm::sincos(f64::from(number));
                let landmark = Point::new(5.0 + 8.0 * cosine, 5.0 + 9.0 * sine);
                let seen = Seen {
                    position: pose.compose(&mount).inverse_transform(&landmark),
                    covariance: Matrix2::identity() * 1e-4,
                    landmark,
                    landmark_variance: 4e-6,
                };
                separation.see(LandmarkKey::Reflector(number), &seen, &laser);
            }
            separation.end_event(&pose, &laser, 1.0);
        }));
    }
    count
}
