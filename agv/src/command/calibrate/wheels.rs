//! `agv calibrate` of a vehicle with several wheels.

use agv_host_sim::calibrate::log_input::LogInput;
use agv_host_sim::calibrate::wheeled::clock::Clock;
use agv_host_sim::calibrate::wheeled::fit::{self, Fitted};
use agv_host_sim::calibrate::wheeled::log_drive::LogDrive;
use agv_host_sim::calibrate::wheeled::unknowns::Unknown;
use serde::Serialize;

#[derive(Serialize)]
struct Summary {
    method: &'static str,
    fitted: Vec<Fitted>,
    clock: Clock,
    residual_m: f64,
}

/// Fits the vehicle of the log and prints what was found.
pub fn run(input: &LogInput, is_json: bool) -> anyhow::Result<()> {
    let LogDrive { kind, nominal, drive } = LogDrive::new(input)?;
    let unknowns = Unknown::of(kind, &nominal.wheels, true);
    let found = fit::fit(&[drive], &nominal, &unknowns, true)?;
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
    Ok(())
}
