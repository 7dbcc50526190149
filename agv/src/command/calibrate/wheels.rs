//! `agv calibrate` of a vehicle with several wheels.

use std::path::Path;

use agv_core::localizer::Parameters;
use agv_host_sim::calibrate::log_input::LogInput;
use agv_host_sim::calibrate::vehicle_file::VehicleFile;
use agv_host_sim::calibrate::wheeled::clock::Clock;
use agv_host_sim::calibrate::wheeled::fit::{self, Fitted};
use agv_host_sim::calibrate::wheeled::fitted_vehicle::{fitted_vehicle, has_setting};
use agv_host_sim::calibrate::wheeled::log_drive::LogDrive;
use agv_host_sim::calibrate::wheeled::mistakes::{WheelExplanation, explain_wheels};
use agv_host_sim::calibrate::wheeled::unknowns::Unknown;
use anyhow::Context as _;
use serde::Serialize;

use crate::command::output::note;
use crate::command::progress;

#[derive(Serialize)]
struct Summary {
    method: &'static str,
    fitted: Vec<Fitted>,
    clock: Clock,
    residual_m: f64,
}

/// What is asked for.
pub struct Fit<'a> {
    /// Whether mistakes are undone first.
    pub mend: bool,
    /// Where the settings go.
    pub apply: Option<&'a Path>,
    /// Whether the summary is JSON.
    pub is_json: bool,
}

/// What makes sense of the drive; nothing where none is there, or one by which nothing is wrong.
fn explanation(input: &LogInput) -> anyhow::Result<Option<WheelExplanation>> {
    let bar = progress::spinner().with_message("looking for mistakes");
    let found = explain_wheels(input, |_, _| bar.tick());
    bar.finish_and_clear();
    if found.is_empty() || found.iter().any(|one| one.mistakes.is_empty()) {
        return Ok(None);
    }
    let words: Vec<String> = found.iter().map(ToString::to_string).collect();
    let mendable = found.into_iter().find(WheelExplanation::is_mendable);
    let none = || format!("{}: no setting mends that; agv check says what to do", words.join(", or "));
    mendable.with_context(none).map(Some)
}

/// Fits the vehicle of the log, prints what was found, and writes it to a file if one is given. Of a vehicle with mistakes that are to be
/// mended, only what they name is fitted.
pub fn run(input: LogInput, asked: &Fit) -> anyhow::Result<()> {
    let explanation = if asked.mend { explanation(&input)? } else { None };
    match explanation {
        Some(explanation) => mend(explanation, asked),
        None => fit_to(input, None, asked),
    }
}

/// The same of a vehicle whose mistakes are known.
pub fn mend(explanation: WheelExplanation, asked: &Fit) -> anyhow::Result<()> {
    note(&format!("agv: {explanation}: mended; the rest of the vehicle is held"));
    fit_to(explanation.mended, Some(explanation.unknowns), asked)
}

fn fit_to(input: LogInput, named: Option<Vec<Unknown>>, asked: &Fit) -> anyhow::Result<()> {
    let (apply, is_json) = (asked.apply, asked.is_json);
    let LogDrive { kind, nominal, drive } = LogDrive::new(&input)?;
    let mut unknowns = named.unwrap_or_else(|| Unknown::of(kind, &nominal.wheels, true));
    if apply.is_some() {
        // What has no setting stays as it is, and the rest is fitted to go with it.
        let (kept, held): (Vec<_>, Vec<_>) = unknowns.into_iter().partition(has_setting);
        unknowns = kept;
        held.iter().for_each(|held| note(&format!("agv: {} has no setting, and is held", held.name)));
    }
    let found = fit::fit(&[drive], &nominal, &unknowns, true)?;
    if let Some(path) = apply {
        let vehicle = fitted_vehicle(&input.parameters.vehicle, &found.model).context("the vehicle has no settings")?;
        for open in found.fitted.iter().filter(|fitted| fitted.is_open) {
            note(&format!("agv: the drive does not tell the {}: it stays about as it was", open.name));
        }
        let mut parameters = Parameters { vehicle, ..input.parameters };
        *parameters.lasers.first_mut() = found.model.sensor;
        VehicleFile::of_vehicle(&parameters).write(path)?;
    }
    let clock = found.clocks.first().copied().unwrap_or_default();
    if is_json {
        let summary = Summary { method: "joint", fitted: found.fitted, clock, residual_m: found.residual };
        println!("{}", serde_json::to_string_pretty(&summary)?);
        return Ok(());
    }
    println!("{:<36} {:>12} {:>11}", "", "change", "std");
    for Fitted { name, change, deviation, is_open } in &found.fitted {
        let open = if *is_open { "  open: the drive does not tell it" } else { "" };
        println!("{name:<36} {change:>+12.6} {deviation:>11.6}{open}");
    }
    println!("clock of the odometry: {:+.3} s, {:+.3} %", clock.offset_s, 100.0 * clock.rate);
    println!("residual of a window: {:.2} mm", 1e3 * found.residual);
    if let Some(path) = apply {
        println!("written: {}", path.display());
    }
    Ok(())
}
