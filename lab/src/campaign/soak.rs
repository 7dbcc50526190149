//! A drive for many hours in one run: whether memory, time or accuracy drift, and clocks and counters wrap unnoticed.

use std::time::Instant;

use serde::Serialize;

use super::CampaignError;
use super::fault::{Fault, FaultKind};
use super::rig::{self, Heard, RigOptions};
use super::verdict::{AlertLimits, Judge};
use agv_host_sim::accuracy::Spread;
use agv_host_sim::simulate::scenario::{PathKind, PathOptions, PoseOptions, Scenario};
use agv_host_sim::simulate::simulate;

/// One hour of a soak.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Hour {
    /// Which, from 1.
    pub hour: u64,
    /// Error of the position, mm.
    pub position_mm: Spread,
    /// Largest error of the heading, deg.
    pub heading_deg: f64,
    /// Times in which the error was larger than the protection level.
    pub violations: u32,
    /// How long the controller said that something is wrong, s.
    pub degraded_s: f64,
    /// Processor time of one core, s: of the rig, its sensors included.
    pub seconds: f64,
    /// Memory of the whole process at its end, MB; none where the system does not tell.
    pub memory_mb: Option<f64>,
}

/// Time of a lap, s, at least; there are as many laps as fill the hours.
const SHORTEST_LAP: f64 = 70.0;
const HOUR: f64 = 3600.0;

/// Drives `hours` hours, lap after lap of the scenario's way with a stop after each. The laser's counter of milliseconds
/// wraps in the middle. `done` is called after each hour.
///
/// # Errors
/// See [`CampaignError`].
pub fn soak(scenario: &Scenario, hours: u64, mut done: impl FnMut()) -> Result<Vec<Hour>, CampaignError> {
    let seconds = hours as f64 * HOUR;
    let lap = scenario.build_path();
    let legs = lap.legs.iter().cycle().take(lap.legs.len() * (seconds / SHORTEST_LAP).ceil() as usize).cloned();
    let start = PoseOptions { x: lap.start.x, y: lap.start.y, heading_deg: lap.start.theta.to_degrees() };
    let mut scenario =
        Scenario { path: PathOptions { kind: PathKind::Legs, start, legs: legs.collect() }, ..scenario.clone() };
    scenario.laser.scans = false;
    let recording = simulate(&scenario)?.recording;
    let wrap = Fault {
        name: "wrap".to_owned(),
        from: 0.5 * seconds,
        until: None,
        what: FaultKind::LaserClockWraps,
        can_recover: true,
    };
    let limits = AlertLimits::default();
    let mut all = Vec::new();
    let (mut judge, mut errors, mut begun) = (Judge::new(limits, 0.0), Vec::new(), Instant::now());
    let options = RigOptions::told(seconds, scenario.seed, None);
    rig::drive(&recording, &[&wrap], &options, |&Heard { now, time, output, truth, .. }| {
        // The vehicle is told where it is when it drives off.
        if time < 0.0 {
            return;
        }
        judge.hear(now, time, output, truth);
        if let Some((output, truth)) = output.and_then(|output| Some((output, truth(output.time)?))) {
            errors.push(1e3 * (output.pose.position() - truth.position()).norm());
        }
        if time >= HOUR * (all.len() + 1) as f64 - 0.005 {
            let verdict = std::mem::replace(&mut judge, Judge::new(limits, 0.0)).verdict(&[&wrap]);
            all.push(Hour {
                hour: all.len() as u64 + 1,
                position_mm: Spread::of(errors.drain(..)),
                heading_deg: verdict.worst_heading_deg,
                violations: verdict.violations,
                degraded_s: verdict.degraded_s,
                seconds: begun.elapsed().as_secs_f64(),
                memory_mb: resident_memory(),
            });
            begun = Instant::now();
            done();
        }
    })?;
    Ok(all)
}

/// What the process occupies, MB.
fn resident_memory() -> Option<f64> {
    let pages: f64 = std::fs::read_to_string("/proc/self/statm").ok()?.split(' ').nth(1)?.parse().ok()?;
    Some(pages * 4096.0 * 1e-6)
}
