//! The experiment of K tables 5.1 and 5.2 in simulation.

use agv_core::calibration::{MountingSide, Offsets};
use rayon::prelude::*;
use serde::Serialize;

use super::course::{Course, Disturbance, TrueVehicle};
use super::thesis::{self, Printed};
use agv_host_sim::calibrate::design::{Design, Order};
use agv_host_sim::calibrate::drive::{Drive, Preparation};
use agv_host_sim::calibrate::found::{Found, Method, Question, find};
use agv_host_sim::calibrate::model::PARAMETERS;
use agv_host_sim::calibrate::refusal::Refusal;

/// One figure for each parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Figures {
    /// Steering offset forward, cdeg.
    pub alpha_forward_cdeg: f64,
    /// Steering offset backward, cdeg.
    pub alpha_backward_cdeg: f64,
    /// Drive scale, mm a tick.
    pub drive_scale_mm: f64,
    /// Laser, mm.
    pub laser_x_mm: f64,
    /// Laser, mm.
    pub laser_y_mm: f64,
    /// Laser, cdeg.
    pub laser_theta_cdeg: f64,
    /// Wheelbase, mm.
    pub wheelbase_mm: f64,
}

impl Figures {
    fn of(vector: &[f64; PARAMETERS]) -> Self {
        let cdeg = |angle: f64| 100.0 * angle.to_degrees();
        let &[forward, backward, scale, wheelbase, _, x, y, heading] = vector;
        Self {
            alpha_forward_cdeg: cdeg(forward),
            alpha_backward_cdeg: cdeg(backward),
            drive_scale_mm: 1e3 * scale,
            laser_x_mm: 1e3 * x,
            laser_y_mm: 1e3 * y,
            laser_theta_cdeg: cdeg(heading),
            wheelbase_mm: 1e3 * wheelbase,
        }
    }
}

/// How parameters are found in the experiment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Contender {
    /// Its name in the results.
    pub name: &'static str,
    method: Method,
    offsets: Offsets,
    is_wheelbase_free: bool,
}

/// The methods. Those with one offset drive a vehicle that has one, the others a vehicle that has two.
pub const CONTENDERS: [Contender; 5] = [
    Contender { name: "stc", method: Method::ClosedForm, offsets: Offsets::Common, is_wheelbase_free: false },
    Contender { name: "joint_stc", method: Method::Joint, offsets: Offsets::Common, is_wheelbase_free: false },
    Contender { name: "atc", method: Method::ClosedForm, offsets: Offsets::ForEachSense, is_wheelbase_free: false },
    Contender { name: "joint", method: Method::Joint, offsets: Offsets::ForEachSense, is_wheelbase_free: false },
    Contender {
        name: "joint_wheelbase",
        method: Method::Joint,
        offsets: Offsets::ForEachSense,
        is_wheelbase_free: true,
    },
];

/// What a method does in one row under one noise model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// The design.
    #[serde(flatten)]
    pub design: thesis::Design,
    /// Noise model.
    pub noise: &'static str,
    /// Method.
    pub method: &'static str,
    /// Runs with a result.
    pub runs: usize,
    /// Runs that were refused.
    pub refused: usize,
    /// Duration of the drive, s.
    pub duration_s: f64,
    /// Mean minus truth.
    pub bias: Figures,
    /// Standard deviation over the runs.
    pub std: Figures,
    /// Root mean square of the deviations that the runs state.
    pub stated: Figures,
    /// Printed deviations of this row.
    pub thesis_std: Printed,
}

/// Which rows, how often.
#[derive(Clone, Copy, Debug)]
pub struct Experiment {
    /// Runs of each row, noise model and method.
    pub runs: u32,
    /// First seed.
    pub seed: u64,
    /// Only this row of the table, from zero.
    pub row: Option<usize>,
}

/// Row of the table that is adopted in practice: eight arcs a phase, 18 to 50 degrees, half circles.
pub const ADOPTED_ROW: usize = 10;

/// Runs the experiment; `progress` is told of each row and noise model that is done.
///
/// # Errors
/// If a method has no result in any run of a row.
pub fn run(experiment: &Experiment, progress: impl Fn() + Sync) -> Result<Vec<Outcome>, Refusal> {
    let rows = thesis::TABLE.iter().enumerate().filter(|(index, _)| experiment.row.is_none_or(|row| row == *index));
    let mut outcomes = Vec::new();
    for (index, (design, printed)) in rows {
        let course = |vehicle| {
            let segments = planned(design).segments(vehicle_wheelbase(&vehicle), Order::Phases);
            Course::new(vehicle, &segments, 1e-3 * design.speed_mm_s, experiment.seed.wrapping_add(index as u64))
        };
        // K table 5.1 and 5.2, row 11.
        let symmetric = TrueVehicle::of_the_thesis(-0.7564, -0.7564);
        let asymmetric = TrueVehicle::of_the_thesis(-0.7270, -0.7747);
        let courses = [(symmetric, course(symmetric)), (asymmetric, course(asymmetric))];
        for disturbance in &Disturbance::ALL {
            for (offsets, (vehicle, course)) in [Offsets::Common, Offsets::ForEachSense].into_iter().zip(&courses) {
                let contenders: Vec<_> = CONTENDERS.iter().filter(|contender| contender.offsets == offsets).collect();
                let runs: Vec<Vec<Result<Found, Refusal>>> = (0..experiment.runs)
                    .into_par_iter()
                    .map(|run| {
                        let seed = experiment.seed.wrapping_add(1 + u64::from(run));
                        let drive = Drive::new(&course.log(disturbance, seed), &Preparation::default());
                        contenders
                            .iter()
                            .map(|contender| find(drive.as_ref().map_err(Clone::clone)?, &contender.question()))
                            .collect()
                    })
                    .collect();
                for (place, contender) in contenders.iter().enumerate() {
                    let results: Vec<_> = runs.iter().map(|run| &run[place]).collect();
                    let summary = summarise(vehicle, &results)?;
                    outcomes.push(Outcome {
                        design: *design,
                        noise: disturbance.name,
                        method: contender.name,
                        runs: summary.runs,
                        refused: results.len() - summary.runs,
                        duration_s: course.duration(),
                        bias: Figures::of(&summary.bias),
                        std: Figures::of(&summary.std),
                        stated: Figures::of(&summary.stated),
                        thesis_std: *printed,
                    });
                }
            }
            progress();
        }
    }
    Ok(outcomes)
}

impl Contender {
    fn question(&self) -> Question {
        Question {
            method: self.method,
            offsets: self.offsets,
            is_wheelbase_free: self.is_wheelbase_free,
            is_steering_ratio_free: false,
            side: Some(MountingSide::Front),
        }
    }
}

fn planned(design: &thesis::Design) -> Design {
    Design {
        arcs: design.n_seg as usize,
        steering: design.steering_deg.map(f64::to_radians),
        turn: design.beta_deg.to_radians(),
    }
}

fn vehicle_wheelbase(vehicle: &TrueVehicle) -> f64 {
    vehicle.tricycle.wheelbase
}

struct Summary {
    runs: usize,
    bias: [f64; PARAMETERS],
    std: [f64; PARAMETERS],
    stated: [f64; PARAMETERS],
}

fn summarise(vehicle: &TrueVehicle, results: &[&Result<Found, Refusal>]) -> Result<Summary, Refusal> {
    let truth = agv_host_sim::calibrate::model::VehicleModel::nominal(&vehicle.tricycle, &vehicle.laser).vector();
    let found: Vec<&Found> = results.iter().filter_map(|result| result.as_ref().ok()).collect();
    if found.is_empty() {
        let reason = results.iter().find_map(|result| result.as_ref().err().cloned());
        return Err(reason.unwrap_or(Refusal::TooFewSegments { found: 0, needed: 2 }));
    }
    let count = found.len() as f64;
    let mut summary = Summary { runs: found.len(), bias: [0.0; 8], std: [0.0; 8], stated: [0.0; 8] };
    for (index, truth) in truth.iter().enumerate() {
        let error = |found: &&Found| found.model.vector()[index] - truth;
        let mean = found.iter().map(error).sum::<f64>() / count;
        let squares = found.iter().map(|found| (error(found) - mean).powi(2)).sum::<f64>();
        let stated = found.iter().map(|found| found.deviations[index].powi(2)).sum::<f64>();
        summary.bias[index] = mean;
        summary.std[index] = (squares / (count - 1.0).max(1.0)).sqrt();
        summary.stated[index] = (stated / count).sqrt();
    }
    Ok(summary)
}
