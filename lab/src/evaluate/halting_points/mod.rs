//! The experiment of K 5.2.2: do vehicles that differ stop at the same points?

mod approach;

use agv_core::calibration::{MountingSide, Offsets};
use agv_core::geometry::{Point, Pose};
use agv_core::maps::{Landmark, LandmarkKind};
use agv_core::odometry::Tricycle;
use rayon::prelude::*;
use serde::Serialize;
use thiserror::Error;

use super::calibration::course::{Course, Disturbance, TrueVehicle};
use agv_host_sim::calibrate::design::{Design, Order};
use agv_host_sim::calibrate::drive::{Drive, Preparation};
use agv_host_sim::calibrate::found::{Method, Question, find};
use agv_host_sim::calibrate::model::VehicleModel;
use agv_host_sim::calibrate::refusal::Refusal;
use agv_host_sim::simulate::path::{Direction, Leg, PathSegment};
use agv_host_sim::simulate::random::{Random, Stream};

pub use approach::{Approach, drive};

/// How the vehicles were calibrated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Calibrated {
    /// By hand.
    Manual,
    /// From a drive, closed form with two offsets.
    Atc,
    /// From a drive, nonlinear fit.
    Joint,
}

/// One vehicle's results.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VehicleOutcome {
    /// Its name in K table 5.3.
    pub name: &'static str,
    /// Mean distance of its halts from the centres of all halts, mm.
    pub mean_distance_mm: f64,
}

/// Results of one way of calibrating.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// How.
    pub calibration: Calibrated,
    /// Ten points, so often.
    pub trials: u32,
    /// The vehicles.
    pub vehicles: Vec<VehicleOutcome>,
    /// Mean distance of all halts from the centre of the four vehicles' halts at the point, mm.
    pub mean_distance_mm: f64,
    /// The largest such distance, mm.
    pub largest_distance_mm: f64,
    /// Mean distance from where the vehicles were sent, mm.
    pub mean_error_mm: f64,
    /// Halts that were missed because the vehicle never arrived.
    pub missed: u32,
    /// K table 5.5: mean distances of the vehicle calibrated by hand, and of those calibrated from a drive, mm.
    pub thesis_mm: Vec<f64>,
}

/// Why the experiment has no result.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum HaltingError {
    /// A calibration drive was refused.
    #[error("the calibration of {vehicle} failed: {reason}")]
    Calibration {
        /// Which vehicle.
        vehicle: &'static str,
        /// Why.
        reason: Refusal,
    },
    /// No vehicle arrived anywhere.
    #[error("no vehicle arrived")]
    NoHalts,
}

/// K table 5.3, setting 2: steering offsets (cdeg), drive scale (mm a tick), laser (mm, mm, cdeg). The backward offset of
/// R31 is printed without its sign.
const VEHICLES: [(&str, [f64; 6]); 4] = [
    ("R32", [-120.65, -120.65, 0.251_885, 1310.0, 17.0, 140.0]),
    ("R30", [-107.32, -107.81, 0.251_801, 1293.0, 17.0, -75.0]),
    ("R31", [-111.12, -124.94, 0.252_952, 1317.0, 7.0, -131.0]),
    ("R36", [-107.53, -112.13, 0.253_143, 1294.0, 14.0, -62.0]),
];

/// What a calibration by hand leaves: it knows one steering offset only, and with these deviations the position is good to
/// about 10 mm, which K 5.2.2 says of the best calibrations by hand.
const MANUAL_OFFSET_DEG: f64 = 0.1;
const MANUAL_SCALE: f64 = 1e-3;
const MANUAL_LASER: f64 = 6e-3;
const MANUAL_LASER_DEG: f64 = 0.1;

/// Reflectors along a way, how far from it they stand, and how well they were surveyed, m.
const REFLECTORS: usize = 16;
const DISTANCES: [f64; 2] = [3.0, 9.0];
const SURVEY_DEVIATION: f64 = 2e-3;

fn true_vehicle(printed: &[f64; 6]) -> TrueVehicle {
    let &[forward, backward, scale, x, y, heading] = printed;
    let nominal = TrueVehicle::of_the_thesis(1e-2 * forward, 1e-2 * backward);
    TrueVehicle {
        tricycle: Tricycle { drive_scale: 1e-3 * scale, ..nominal.tricycle },
        laser: Pose::new(1e-3 * x, 1e-3 * y, (1e-2 * heading).to_radians()),
    }
}

/// Ways to the ten points: straights and curves, none of them sharp, forward and backward.
fn legs() -> Vec<Leg> {
    let line = |length| PathSegment { length, curvature: 0.0 };
    let arc = |angle_deg: f64, radius: f64| PathSegment {
        length: angle_deg.abs().to_radians() * radius,
        curvature: angle_deg.signum() / radius,
    };
    let shapes = [
        vec![line(8.0)],
        vec![line(3.0), arc(90.0, 3.0), line(3.0)],
        vec![line(3.0), arc(-90.0, 3.0), line(3.0)],
        vec![line(2.0), arc(30.0, 4.0), arc(-30.0, 4.0), line(2.0)],
        vec![line(4.0), arc(60.0, 4.0), line(1.5)],
    ];
    let senses = [Direction::Forward, Direction::Backward];
    senses
        .into_iter()
        .flat_map(|direction| shapes.iter().map(move |segments| Leg { direction, segments: segments.clone() }))
        .collect()
}

fn approaches(seed: u64) -> Vec<Approach> {
    let mut world = Random::new(seed, Stream::World);
    let mut survey = Random::new(seed, Stream::Survey);
    let approach = |leg: Leg| {
        let start = Pose::default();
        let length = leg.length();
        let reflectors: Vec<Point> = (0..REFLECTORS)
            .map(|index| {
                let beside = leg.pose(&start, length * index as f64 / (REFLECTORS - 1) as f64);
                let side = if index % 2 == 0 { 1.0 } else { -1.0 };
                beside
                    .transform(&Point::new(world.between(-2.0, 2.0), side * world.between(DISTANCES[0], DISTANCES[1])))
            })
            .collect();
        let map = reflectors
            .iter()
            .zip(0_u16..)
            .map(|(place, id)| Landmark {
                id,
                kind: LandmarkKind::Reflector,
                x: place.x + SURVEY_DEVIATION * survey.normal(),
                y: place.y + SURVEY_DEVIATION * survey.normal(),
                deviation: SURVEY_DEVIATION as f32,
            })
            .collect();
        Approach { start, leg, reflectors, map }
    };
    legs().into_iter().map(approach).collect()
}

fn believed(calibrated: Calibrated, truth: &TrueVehicle, seed: u64) -> Result<VehicleModel, Refusal> {
    let exact = VehicleModel::nominal(&truth.tricycle, &truth.laser);
    if calibrated == Calibrated::Manual {
        let mut random = Random::new(seed, Stream::Vehicle);
        let mut error = |deviation: f64| deviation * random.normal();
        let mean = 0.5 * (exact.offset_forward + exact.offset_backward);
        let offset = mean + error(MANUAL_OFFSET_DEG.to_radians());
        let laser = Pose::new(
            exact.laser.x + error(MANUAL_LASER),
            exact.laser.y + error(MANUAL_LASER),
            exact.laser.theta + error(MANUAL_LASER_DEG.to_radians()),
        );
        let drive_scale = exact.drive_scale * (1.0 + error(MANUAL_SCALE));
        return Ok(VehicleModel { offset_forward: offset, offset_backward: offset, drive_scale, laser, ..exact });
    }
    let design = Design { arcs: 8, steering: [18_f64.to_radians(), 50_f64.to_radians()], turn: std::f64::consts::PI };
    let segments = design.segments(truth.tricycle.wheelbase, Order::Phases);
    let log = Course::new(*truth, &segments, 1.0, seed).log(&Disturbance::MID, seed);
    let question = Question {
        method: if calibrated == Calibrated::Joint { Method::Joint } else { Method::ClosedForm },
        offsets: Offsets::ForEachSense,
        is_wheelbase_free: false,
        is_steering_ratio_free: false,
        side: Some(MountingSide::Front),
    };
    Ok(find(&Drive::new(&log, &Preparation::default())?, &question)?.model)
}

/// Halts of all vehicles at all points: `[point][vehicle]`, and the points.
type Halts = Vec<(Point, Vec<Option<Point>>)>;

fn trial(calibrated: Calibrated, seed: u64) -> Result<Halts, HaltingError> {
    let vehicles: Vec<TrueVehicle> = VEHICLES.iter().map(|(_, printed)| true_vehicle(printed)).collect();
    let mut models = Vec::new();
    for (index, vehicle) in vehicles.iter().enumerate() {
        let own_seed = seed.wrapping_mul(100).wrapping_add(index as u64);
        let model = believed(calibrated, vehicle, own_seed)
            .map_err(|reason| HaltingError::Calibration { vehicle: VEHICLES[index].0, reason })?;
        models.push(model);
    }
    let halt = |(point, approach): (usize, &Approach)| {
        let stops = vehicles.iter().zip(&models).zip(0..);
        let places = stops.map(|((vehicle, model), index): (_, u64)| {
            let own_seed = seed.wrapping_mul(1000).wrapping_add(10 * point as u64 + index);
            drive(approach, vehicle, model, &Disturbance::MID, own_seed).map(|pose| pose.position())
        });
        (approach.target().position(), places.collect())
    };
    Ok(approaches(seed).iter().enumerate().map(halt).collect())
}

/// Runs the experiment `trials` times for each way of calibrating.
///
/// # Errors
/// [`HaltingError`].
pub fn run(trials: u32, seed: u64, progress: impl Fn() + Sync) -> Result<Vec<Outcome>, HaltingError> {
    let mut outcomes = Vec::new();
    for calibrated in [Calibrated::Manual, Calibrated::Atc, Calibrated::Joint] {
        let halts: Vec<Halts> = (0..trials)
            .into_par_iter()
            .map(|trial_index| {
                let halts = trial(calibrated, seed.wrapping_add(u64::from(trial_index)));
                progress();
                halts
            })
            .collect::<Result<_, _>>()?;
        outcomes.push(outcome(calibrated, trials, halts.iter().flatten()).ok_or(HaltingError::NoHalts)?);
    }
    Ok(outcomes)
}

fn outcome<'a>(
    calibrated: Calibrated,
    trials: u32,
    points: impl Iterator<Item = &'a (Point, Vec<Option<Point>>)>,
) -> Option<Outcome> {
    let mut distances: Vec<Vec<f64>> = vec![Vec::new(); VEHICLES.len()];
    let (mut errors, mut missed) = (Vec::new(), 0);
    for (target, halts) in points {
        let arrived: Vec<&Point> = halts.iter().flatten().collect();
        missed += (halts.len() - arrived.len()) as u32;
        let centre = arrived.iter().fold(Point::zeros(), |sum, place| sum + **place) / arrived.len().max(1) as f64;
        for (distances, halt) in distances.iter_mut().zip(halts) {
            if let Some(place) = halt {
                distances.push(1e3 * (place - centre).norm());
                errors.push(1e3 * (place - target).norm());
            }
        }
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let all: Vec<f64> = distances.iter().flatten().copied().collect();
    let largest = all.iter().copied().reduce(f64::max)?;
    Some(Outcome {
        calibration: calibrated,
        trials,
        vehicles: VEHICLES
            .iter()
            .zip(&distances)
            .map(|((name, _), distances)| VehicleOutcome { name, mean_distance_mm: mean(distances) })
            .collect(),
        mean_distance_mm: mean(&all),
        largest_distance_mm: largest,
        mean_error_mm: mean(&errors),
        missed,
        thesis_mm: if calibrated == Calibrated::Manual { vec![8.1] } else { vec![5.9, 2.7, 6.9] },
    })
}
