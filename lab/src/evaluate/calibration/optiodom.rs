//! The robots of the OptiOdom data: each kind fitted on one or two sessions, and dead reckoned on all others.

use std::path::{Path, PathBuf};

use agv_core::calibration::Offsets;
use agv_core::geometry::Pose;
use agv_core::measurement::Time;
use agv_core::odometry::{CounterRange, Tricycle};
use anyhow::Context;
use serde::Serialize;

use agv_host_sim::calibrate::closed_form::{self, ClosedForm};
use agv_host_sim::calibrate::counted::Counted;
use agv_host_sim::calibrate::wheeled::clock::Clock;
use agv_host_sim::calibrate::wheeled::drive::WheelDrive;
use agv_host_sim::calibrate::wheeled::fit::{self, Fitted, WheeledFit};
use agv_host_sim::calibrate::wheeled::trajectory_error::TrajectoryError;
use agv_host_sim::calibrate::wheeled::unknowns::{Unknown, WheeledModel};
use agv_host_sim::calibrate::windows::{LaserPose, windows};
use agv_host_sim::import::optiodom::{self, Session};

/// Kind, its folder, and the sessions on which it is fitted.
const FITTED: [(&str, &str, &[&str]); 4] = [
    ("tricycle", "tricyc", &["square/140120211430", "circular/140120211415"]),
    ("differential", "diff", &["square/231220200029"]),
    ("omni3", "omni3", &["square/221220201934"]),
    ("omni4", "omni4", &["square/080920201205"]),
];

/// A cell of the table: a method on all drives of a path that were not fitted. Errors are means over the drives; each drive is
/// started in its first true pose, and nothing is aligned.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cell {
    /// Kind of the robot.
    pub kind: &'static str,
    /// Path.
    pub path: String,
    /// Drives.
    pub drives: usize,
    /// "nominal", "closed_form", "joint", or "hindsight": the joint fit on these very drives, which no calibration can know before. It
    /// tells what the model of the wheels leaves.
    pub method: &'static str,
    /// Position at the end, m.
    pub end_m: f64,
    /// Root of the mean square of the position, m: in `joint` with both clocks brought together.
    pub ate_m: f64,
    /// Heading at the end, degrees.
    pub end_heading_deg: f64,
    /// The same as `ate_m` with the times as they were recorded, m.
    pub ate_as_recorded_m: f64,
    /// Worst of `ate_m`, m, and its drive.
    pub worst_ate_m: f64,
    /// Of that drive.
    pub worst_drive: String,
    /// Least and greatest offset of the odometry's clock in these drives, s; `joint` only.
    pub clock_offset_s: Option<[f64; 2]>,
    /// The same of its rate.
    pub clock_rate: Option<[f64; 2]>,
    /// What the fit left open: hardly better known than before.
    pub open: Vec<String>,
}

/// What was found for a kind.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibrated {
    /// Kind of the robot.
    pub kind: &'static str,
    /// On which drives.
    pub fitted_on: Vec<String>,
    /// What the fit found.
    pub fit: WheeledFit,
}

/// All that the data hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The fits.
    pub fits: Vec<Calibrated>,
    /// The table.
    pub cells: Vec<Cell>,
}

struct Check {
    name: String,
    drive: WheelDrive,
}

/// Fits and checks all kinds; `with_hindsight` says whether each path is fitted on its own checks as well.
///
/// # Errors
/// If the data are not there, or a fit gives nothing.
pub fn run(folder: &Path, with_hindsight: bool) -> anyhow::Result<Outcome> {
    let mut outcome = Outcome { fits: Vec::new(), cells: Vec::new() };
    for (kind, name, fitted_on) in FITTED {
        let (fits, cells) =
            of_kind(kind, &folder.join(name), fitted_on, with_hindsight).with_context(|| kind.to_owned())?;
        outcome.fits.push(fits);
        outcome.cells.extend(cells);
    }
    Ok(outcome)
}

fn of_kind(
    kind: &'static str,
    folder: &Path,
    fitted_on: &[&str],
    with_hindsight: bool,
) -> anyhow::Result<(Calibrated, Vec<Cell>)> {
    let sessions =
        fitted_on.iter().map(|name| Ok(optiodom::read(&folder.join(name))?)).collect::<anyhow::Result<Vec<_>>>()?;
    let first = sessions.first().context("no session to fit")?;
    let drives: Vec<WheelDrive> =
        sessions.iter().flat_map(|session| session.runs.iter().map(|(_, drive)| drive.clone())).collect();
    let fit = calibrate(first, &drives)?;
    let mut methods = vec![("nominal", first.nominal.clone())];
    if kind == "tricycle" {
        methods.push(("closed_form", closed_form_of(&first.nominal, &drives)?));
    }
    methods.push(("joint", fit.model.clone()));
    let mut cells = Vec::new();
    for path in paths(folder)? {
        let checks = checks(folder, &path, fitted_on)?;
        for (method, model) in methods.iter().filter(|_| !checks.is_empty()) {
            let open = if *method == "joint" { fit.fitted.as_slice() } else { &[] };
            cells.push(cell(kind, &path, method, model, open, &checks)?);
        }
        if with_hindsight && !checks.is_empty() {
            let drives: Vec<WheelDrive> = checks.iter().map(|check| check.drive.clone()).collect();
            let fit = calibrate(first, &drives)?;
            cells.push(cell(kind, &path, "hindsight", &fit.model, &fit.fitted, &checks)?);
        }
    }
    let fitted_on = sessions.iter().flat_map(|session| session.runs.iter().map(|(name, _)| name.clone())).collect();
    Ok((Calibrated { kind, fitted_on, fit }, cells))
}

/// The joint fit, with the same options for every kind.
///
/// # Errors
/// If the drives do not tell enough.
pub fn calibrate(session: &Session, drives: &[WheelDrive]) -> anyhow::Result<WheeledFit> {
    let unknowns = Unknown::of(session.kind, &session.nominal.wheels, true);
    Ok(fit::fit(drives, &session.nominal, &unknowns, true)?)
}

fn folders(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let mut folders: Vec<PathBuf> =
        entries.filter_map(|entry| Some(entry.ok()?.path())).filter(|path| path.is_dir()).collect();
    folders.sort();
    Ok(folders)
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn paths(folder: &Path) -> anyhow::Result<Vec<String>> {
    Ok(folders(folder)?.iter().map(|path| name_of(path)).collect())
}

/// All drives of a path that were not fitted.
fn checks(folder: &Path, path: &str, fitted_on: &[&str]) -> anyhow::Result<Vec<Check>> {
    let mut checks = Vec::new();
    for session in folders(&folder.join(path))? {
        if !fitted_on.contains(&format!("{path}/{}", name_of(&session)).as_str()) {
            let read = optiodom::read(&session)?;
            checks.extend(read.runs.into_iter().map(|(name, drive)| Check { name, drive }));
        }
    }
    Ok(checks)
}

fn cell(
    kind: &'static str,
    path: &str,
    method: &'static str,
    model: &WheeledModel,
    fitted: &[Fitted],
    checks: &[Check],
) -> anyhow::Result<Cell> {
    let is_joint = ["joint", "hindsight"].contains(&method);
    let error = |check: &Check, clock: &Clock| {
        TrajectoryError::of(&check.drive, model, clock).with_context(|| format!("{}: no motion", check.name))
    };
    let (mut errors, mut recorded, mut clocks) = (Vec::new(), Vec::new(), Vec::new());
    for check in checks {
        let clock = if is_joint { fit::clock_of(&check.drive, model)? } else { Clock::default() };
        errors.push(error(check, &clock)?);
        recorded.push(error(check, &Clock::default())?);
        clocks.push(clock);
    }
    let mean = |values: &[TrajectoryError], of: fn(&TrajectoryError) -> f64| {
        values.iter().map(of).sum::<f64>() / values.len() as f64
    };
    let range = |of: fn(&Clock) -> f64| {
        let values = clocks.iter().map(of);
        is_joint.then(|| values.fold([f64::MAX, f64::MIN], |[least, most], value| [least.min(value), most.max(value)]))
    };
    let worst = errors.iter().zip(checks).max_by(|one, other| one.0.ate_m.total_cmp(&other.0.ate_m));
    let (worst, check) = worst.context("no drive to check")?;
    Ok(Cell {
        kind,
        path: path.to_owned(),
        drives: checks.len(),
        method,
        end_m: mean(&errors, |error| error.end_m),
        ate_m: mean(&errors, |error| error.ate_m),
        end_heading_deg: mean(&errors, |error| error.end_heading_deg),
        ate_as_recorded_m: mean(&recorded, |error| error.ate_m),
        worst_ate_m: worst.ate_m,
        worst_drive: check.name.clone(),
        clock_offset_s: range(|clock| clock.offset_s),
        clock_rate: range(|clock| clock.rate),
        open: fitted.iter().filter(|fitted| fitted.is_open).map(|fitted| fitted.name.clone()).collect(),
    })
}

/// Way of the driving wheel below which a window does not count, m.
const SHORTEST_WAY: f64 = 0.02;

/// The closed form of the thesis with one steering offset, on all drives together.
fn closed_form_of(nominal: &WheeledModel, drives: &[WheelDrive]) -> anyhow::Result<WheeledModel> {
    let front = nominal.wheels.first().context("no wheel")?;
    let tricycle = Tricycle {
        wheelbase: front.x,
        drive_scale: front.radius,
        drive_range: CounterRange::BITS_32,
        steering_scale: 1.0,
        steering_range: CounterRange::BITS_32,
        steering_offset_forward: 0.0,
        steering_offset_backward: 0.0,
    };
    let mut all = Vec::new();
    for drive in drives {
        let mut ticks = 0.0;
        // The wheel's turn in rad stands for its ticks.
        let counted: Vec<Counted> = drive
            .steps
            .iter()
            .filter_map(|step| {
                let motion = step.motions.first()?;
                ticks += motion.turn;
                Some(Counted { time: Time::from_seconds(step.end), ticks, steering: motion.steering_end })
            })
            .collect();
        let pose = |pose: &agv_host_sim::calibrate::wheeled::drive::TimedPose| LaserPose {
            time: Time::from_seconds(pose.time),
            pose: Pose::new(pose.x, pose.y, pose.heading),
        };
        let poses: Vec<LaserPose> = drive.poses.iter().map(pose).collect();
        all.extend(windows(&counted, &poses, SHORTEST_WAY / tricycle.drive_scale));
    }
    let form = ClosedForm { offsets: Offsets::Common, is_wheelbase_free: true, side: None };
    let found = closed_form::solve(&all, &tricycle, &form, 1.0)
        .map_err(agv_host_sim::calibrate::refusal::Refusal::from)
        .context("closed form")?;
    let found = closed_form::model(&found, 1.0);
    let mut model = nominal.clone();
    if let Some(front) = model.wheels.first_mut() {
        (front.x, front.radius, front.heading) = (found.wheelbase, found.drive_scale, found.offset_forward);
    }
    model.sensor = found.laser;
    Ok(model)
}
