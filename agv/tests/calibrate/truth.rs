//! Drives with known parameters.

use agv_core::calibration::{MountingSide, Offsets};
use agv_core::geometry::wrap;
use agv_host_sim::calibrate::design::{Design, Order, PlannedSegment};
use agv_host_sim::calibrate::drive::{Drive, Preparation};
use agv_host_sim::calibrate::found::{Found, Method, Question, find};
use agv_host_sim::calibrate::log_input::LogInput;
use agv_host_sim::calibrate::model::VehicleModel;
use agv_host_sim::calibrate::refusal::Refusal;
use agv_lab::evaluate::calibration::course::{Course, TrueVehicle};

pub const JOINT: Question = Question {
    method: Method::Joint,
    offsets: Offsets::ForEachSense,
    is_wheelbase_free: false,
    is_steering_ratio_free: false,
    side: Some(MountingSide::Front),
};

pub const ATC: Question = Question { method: Method::ClosedForm, ..JOINT };

pub const STC: Question = Question { offsets: Offsets::Common, ..ATC };

/// The vehicle of K table 5.2.
pub fn vehicle() -> TrueVehicle {
    TrueVehicle::of_the_thesis(-0.7270, -0.7747)
}

pub fn segments(arcs: usize) -> Vec<PlannedSegment> {
    let design = Design { arcs, steering: [0.314, 0.873], turn: std::f64::consts::PI };
    design.segments(vehicle().tricycle.wheelbase, Order::ForthAndBack)
}

pub fn course(arcs: usize) -> Course {
    Course::new(vehicle(), &segments(arcs), 1.0, 1)
}

pub fn calibrate(input: &LogInput, question: &Question) -> Result<Found, Refusal> {
    find(&Drive::new(input, &Preparation::default())?, question)
}

/// Errors of all parameters in standard deviations; those that were held must be right.
pub fn errors(found: &Found, truth: &TrueVehicle) -> Vec<f64> {
    let truth = VehicleModel::nominal(&truth.tricycle, &truth.laser).vector();
    let found_values = found.model.vector();
    (0..truth.len())
        .map(|index| {
            let error = if index == 7 { wrap(found_values[7] - truth[7]) } else { found_values[index] - truth[index] };
            if found.deviations[index] > 0.0 { error / found.deviations[index] } else { error }
        })
        .collect()
}

/// No parameter is further from the truth than its stated deviation allows.
pub fn assert_honest(found: &Found, truth: &TrueVehicle) {
    let errors = errors(found, truth);
    assert!(errors.iter().all(|error| error.abs() < 5.0), "{errors:?} deviations off, {:?}", found.deviations);
}
