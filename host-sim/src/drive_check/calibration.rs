//! Whether the vehicle is calibrated.

use super::Finding;
use crate::calibrate::causes::QUESTIONS;
use crate::calibrate::drive::Drive;
use crate::calibrate::found::{PARAMETER_NAMES, find_any};
use crate::calibrate::log_input::LogInput;
use crate::calibrate::model::PARAMETERS;

/// Differences that are told, in standard deviations; and the least ones: offsets (rad), drive scale (share), wheelbase (m), steering
/// ratio, place (m) and heading (rad) of the laser.
const CLEAR: f64 = 5.0;
const LEAST: [f64; PARAMETERS] = [2e-3, 2e-3, 3e-3, 3e-3, 3e-3, 5e-3, 5e-3, 2e-3];

/// Places of parameters that a calibration holds unless it is told otherwise.
const WHEELBASE: usize = 3;
const STEERING_RATIO: usize = 4;

/// Parameters that a drive from stop to stop shows to be others than the log believes.
pub(super) fn finding(input: &LogInput, log: &str) -> Option<Finding> {
    let drive = Drive::among_few(input).ok().filter(Drive::is_from_stops)?;
    let (found, drive) = find_any(drive, &QUESTIONS).ok().filter(|(_, drive)| drive.is_from_stops())?;
    let (believed, right) = (drive.nominal.vector(), found.model.vector());
    let is_off = |index: &usize| {
        let unit = if *index == 2 { believed[2].abs() } else { 1.0 };
        let limit = (CLEAR * found.deviations[*index]).max(LEAST[*index] * unit);
        (right[*index] - believed[*index]).abs() > limit
    };
    let names: Vec<&str> = (0..PARAMETERS).filter(is_off).map(|index| PARAMETER_NAMES[index]).collect();
    // What is held goes into what is not.
    let is_off = |number: usize| names.contains(&PARAMETER_NAMES[number]);
    let options = [(WHEELBASE, " --wheelbase"), (STEERING_RATIO, " --steering-ratio")];
    let options: String = options.iter().filter(|(number, _)| is_off(*number)).map(|(_, option)| *option).collect();
    (!names.is_empty()).then(|| {
        Finding::new(
            format!("the vehicle is not calibrated; the drive says otherwise of: {}", names.join(", ")),
            format!("agv calibrate {log}{options} --apply vehicle.toml"),
        )
    })
}
