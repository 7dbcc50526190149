//! `agv calibrate`.

mod noise;
mod plan;
mod wheels;

use std::path::{Path, PathBuf};

use agv_core::calibration::{MountingSide, Offsets};
use agv_core::maps::{Landmark, LandmarkKind};
use agv_core::odometry::Vehicle;
use agv_host_sim::calibrate::causes::{Cause, Explanation, FEWEST_REFLECTORS, QUESTIONS, TRIES, differences, explain};
use agv_host_sim::calibrate::drive::{Drive, Preparation};
use agv_host_sim::calibrate::found::{Found, Grade, Method, Question, find, find_any};
use agv_host_sim::calibrate::log_input::LogInput;
use agv_host_sim::calibrate::mending::mended;
use agv_host_sim::calibrate::model::PARAMETERS;
use agv_host_sim::calibrate::refusal::Refusal;
use agv_host_sim::calibrate::report::{add_calibration, parameter_rows, remark_rows};
use agv_host_sim::calibrate::vehicle_file::VehicleFile;
use agv_host_sim::calibrate::wheeled::mistakes::{WheelExplanation, explain_wheels};
use agv_host_sim::drive_check::with_laser_motion;
use agv_host_sim::mapping::map_file;
use agv_host_sim::recording::Recording;
use agv_host_sim::report::Page;
use anyhow::{Context, ensure};
use clap::ValueEnum;
use serde::Serialize;

use super::vehicle_argument::VehicleArgument;
use super::{output, progress};

const HELP: &str = "\
Examples:
  agv calibrate drive.agvlog
  agv calibrate drive.agvlog --method atc --report calibration
  agv calibrate drive.agvlog --wheelbase --apply vehicle.toml
  agv replay other.agvlog --vehicle vehicle.toml
  agv calibrate noise hall.agvlog
  agv calibrate plan --area 14x11 --steering 18..50 --time 900 --scenario plan.toml

The vehicle drives arcs from standstill to standstill, forward and backward, to the left and to the right, with different
steering angles, among at least four reflectors. Without stops, or with poses instead of reflectors, the drive is cut by time.
A vehicle of several wheels is fitted to poses, with the clocks of both; what the drive does not tell is said to be open.
Keys of --json:
  method, source, segments, grade, parameters, std, wheelbase_seen_m, wheelbase_seen_std_m,
  conditioning {equations, normal_equations}, noise {slip_m_per_root_m, steering_rad, laser},
  outliers [start_s, end_s, x_m, y_m, theta_rad], faults [text], remarks [text].";

/// Find the vehicle's parameters from the log of a drive, or plan such a drive.
#[derive(clap::Args)]
#[command(after_help = HELP, args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct Calibrate {
    #[command(subcommand)]
    command: Option<Subcommand>,
    /// The log.
    #[arg(required = true)]
    log: Option<PathBuf>,
    #[command(flatten)]
    vehicle: VehicleArgument,
    /// How the parameters are found.
    #[arg(long, value_enum, default_value = "joint")]
    method: MethodName,
    /// Find the wheelbase too, instead of holding it.
    #[arg(long)]
    wheelbase: bool,
    /// Find the steering encoder's scale too.
    #[arg(long)]
    steering_ratio: bool,
    /// Where the laser is known to be.
    #[arg(long, value_enum)]
    side: Option<Side>,
    /// Map of the reflectors, to place each stop in it.
    #[arg(long, value_name = "MAP")]
    map: Option<PathBuf>,
    /// Mend what is wrong in what is believed of the vehicle: signs of the encoders, offsets of the steering, the wheelbase, the
    /// laser; and faults of the counting.
    #[arg(long)]
    mend: bool,
    /// Write the parameters to a file that `agv replay --vehicle` takes.
    #[arg(long, value_name = "FILE")]
    apply: Option<PathBuf>,
    /// Write a page with pictures to DIR/index.html.
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Print one JSON object instead of a table.
    #[arg(long)]
    json: bool,
}

#[derive(clap::Subcommand)]
enum Subcommand {
    Noise(noise::Noise),
    Plan(plan::Plan),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum MethodName {
    /// Closed form with one steering offset.
    Stc,
    /// Closed form with a steering offset for each sense of travel.
    Atc,
    /// Nonlinear fit of everything at once, with two offsets.
    Joint,
    /// Fit to poses with one offset and with the clocks of both sides, as for any vehicle of wheels; also of a drive that only goes
    /// forward.
    Clocks,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Side {
    Front,
    Rear,
    Left,
    Right,
}

/// Every parameter by the name that it has in a vehicle file; null where it was held.
#[derive(Serialize)]
struct Named {
    steer_offset_forward_rad: Option<f64>,
    steer_offset_backward_rad: Option<f64>,
    drive_scale_m_per_tick: Option<f64>,
    wheelbase_m: Option<f64>,
    steering_ratio: Option<f64>,
    laser_x_m: Option<f64>,
    laser_y_m: Option<f64>,
    laser_theta_rad: Option<f64>,
}

impl Named {
    fn of(values: [Option<f64>; PARAMETERS]) -> Self {
        let [forward, backward, scale, wheelbase, ratio, x, y, heading] = values;
        Self {
            steer_offset_forward_rad: forward,
            steer_offset_backward_rad: backward,
            drive_scale_m_per_tick: scale,
            wheelbase_m: wheelbase,
            steering_ratio: ratio,
            laser_x_m: x,
            laser_y_m: y,
            laser_theta_rad: heading,
        }
    }
}

#[derive(Serialize)]
struct Summary {
    method: &'static str,
    source: &'static str,
    segments: usize,
    grade: &'static str,
    parameters: Named,
    std: Named,
    wheelbase_seen_m: f64,
    wheelbase_seen_std_m: f64,
    conditioning: Conditioning,
    noise: Noise,
    outliers: Vec<Outlier>,
    faults: Vec<String>,
    remarks: Vec<String>,
}

#[derive(Serialize)]
struct Conditioning {
    equations: f64,
    normal_equations: f64,
}

#[derive(Serialize)]
struct Noise {
    slip_m_per_root_m: f64,
    steering_rad: f64,
    laser: f64,
}

#[derive(Serialize)]
struct Outlier {
    start_s: f64,
    end_s: f64,
    x_m: f64,
    y_m: f64,
    theta_rad: f64,
}

/// Poses that are given at a few places tell no motion.
const FEW_POSES: usize = 20;

/// Differences of the wheelbase that are told: in standard deviations, and as a share of it.
const CLEAR: f64 = 4.0;
const NOTABLE: f64 = 0.003;

/// Share of the wheelbase below which its deviation must be for the drive to tell it.
const TOLD: f64 = 0.01;

/// The parameters with a wheelbase that is another than the believed one, if the drive tells it.
fn with_wheelbase(input: &LogInput, preparation: &Preparation) -> Option<(Found, Drive)> {
    let drive = Drive::new(input, preparation).ok()?;
    let (found, drive) = find_any(drive, &QUESTIONS).ok()?;
    let [.., deviation, _, _, _, _] = found.deviations;
    let causes = differences(&found, &drive.nominal, drive.is_from_stops());
    let is_other = causes.iter().any(|cause| matches!(cause, Cause::Wheelbase(_)));
    (is_other && deviation > 0.0 && deviation < TOLD * drive.nominal.wheelbase).then_some((found, drive))
}

/// Every explanation of a drive that cannot be calibrated.
fn explanations(input: &LogInput) -> Vec<Explanation> {
    let bar = progress::bar("looking for the reason", TRIES as u64);
    let found = explain(input, |done| bar.set_position(done as u64));
    bar.finish_and_clear();
    found
}

/// Why there is no result, with the mistakes that would explain the drive.
fn explained(refusal: &Refusal, explanations: &[Explanation]) -> anyhow::Error {
    let wrong = || explanations.iter().filter(|found| !found.causes.is_empty());
    let causes: Vec<String> = wrong().map(ToString::to_string).collect();
    if causes.is_empty() {
        return anyhow::anyhow!("{refusal}");
    }
    let causes = causes.join(", or if ");
    let mend = if wrong().any(Explanation::is_mendable) { "; --mend --apply FILE mends that" } else { "" };
    // Of what counts the wrong way the causes say it better.
    let begin = if matches!(refusal, Refusal::WrongDirection(_)) {
        "encoders and laser contradict each other".to_owned()
    } else {
        refusal.to_string()
    };
    anyhow::anyhow!("{begin}; the drive makes sense if {causes}{mend}; agv check says what to do")
}

/// What calibrates a tricycle.
enum Calibrated {
    /// Arcs between stops, or along reflectors.
    ByArcs(Box<(Found, Drive)>),
    /// Mistakes that wheels and laser show, of a drive that tells no more.
    ByWheels(Box<WheelExplanation>),
}

impl Calibrate {
    /// Whether nothing is asked for that the joint fit of several wheels does not have.
    fn is_plain(&self) -> bool {
        let is_switched = self.wheelbase || self.steering_ratio;
        let is_given = self.side.is_some() || self.map.is_some() || self.report.is_some();
        matches!(self.method, MethodName::Joint | MethodName::Clocks) && !is_switched && !is_given
    }

    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        match self.command {
            Some(Subcommand::Noise(noise)) => return noise.run(),
            Some(Subcommand::Plan(plan)) => return plan.run(),
            None => {}
        }
        let log = self.log.as_ref().context("a log is needed")?;
        let size = std::fs::metadata(log).map_or(0, |metadata| metadata.len());
        let reading = progress::bar("reading", size);
        let (mut input, damages) = LogInput::read(log, |bytes| reading.set_position(bytes))?;
        reading.finish_and_clear();
        self.vehicle.apply(&mut input.parameters, log)?;
        let input = self.with_laser_motion(input, log)?;
        let tell_damages =
            || damages.iter().for_each(|damage| output::note(&format!("agv: the log is damaged: {damage}")));
        if matches!(input.parameters.vehicle, Vehicle::Wheels(_)) || self.method == MethodName::Clocks {
            ensure!(
                self.is_plain(),
                "{}: the fit of any wheels takes no option but --mend, --apply and --json",
                log.display()
            );
            tell_damages();
            let fit = wheels::Fit { mend: self.mend, apply: self.apply.as_deref(), is_json: self.json };
            return wheels::run(input, &fit).with_context(|| log.display().to_string());
        }
        let map: Option<Vec<Landmark>> = match &self.map {
            Some(path) => {
                let mut map = map_file::read(path)?;
                map.retain(|landmark| landmark.kind == LandmarkKind::Reflector);
                ensure!(!map.is_empty(), "{}: the map holds no reflectors", path.display());
                Some(map)
            }
            None => None,
        };
        let name = || log.display().to_string();
        let preparation = Preparation { map: map.as_deref(), mend: self.mend };
        let (found, mut drive) = match self.calibrated(&input, &preparation).with_context(name)? {
            Calibrated::ByArcs(calibrated) => *calibrated,
            Calibrated::ByWheels(explanation) => {
                tell_damages();
                let fit = wheels::Fit { mend: true, apply: self.apply.as_deref(), is_json: self.json };
                return wheels::mend(*explanation, &fit).with_context(name);
            }
        };
        drive.remarks.extend(damages.iter().map(|damage| format!("the log is damaged: {damage}")));
        drive.remarks.extend(self.differences(&drive, &found));
        if let Some(path) = &self.apply {
            VehicleFile::of(&drive.vehicle(&found.model), &found.model.laser).write(path)?;
        }
        if let Some(folder) = &self.report {
            let mut page =
                Page::new(&format!("Calibration from {}", log.file_name().unwrap_or_default().to_string_lossy()));
            add_calibration(&mut page, &drive, &found)?;
            let path = folder.join("index.html");
            page.write(&path).with_context(|| path.display().to_string())?;
        }
        if self.json {
            println!("{}", serde_json::to_string_pretty(&self.summary(&drive, &found))?);
            return Ok(());
        }
        println!("{:<26} {:>12} {:>12} {:>12}", "", "before", "after", "std");
        for [name, before, after, deviation, unit] in parameter_rows(&drive, &found) {
            println!("{name:<26} {before:>12} {after:>12} {deviation:>12} {unit}");
        }
        let mut rows = remark_rows(&drive, &found);
        rows.extend(self.apply.iter().map(|path| ["written".to_owned(), path.display().to_string()]));
        if let Some(folder) = &self.report {
            rows.push(["report".to_owned(), folder.join("index.html").display().to_string()]);
        }
        output::print_rows(&rows);
        Ok(())
    }

    /// Takes what the laser sees for its motion, where neither another instrument nor the odometry with reflectors tells it.
    fn with_laser_motion(&self, input: LogInput, log: &Path) -> anyhow::Result<LogInput> {
        let is_tricycle = matches!(input.parameters.vehicle, Vehicle::Tricycle(_)) && self.method != MethodName::Clocks;
        let reflectors = input.revolutions.iter().filter(|seen| seen.len() >= FEWEST_REFLECTORS).count();
        let is_told = input.laser_poses.len() > 1 || input.given_poses.len() > FEW_POSES;
        if is_told || (is_tricycle && 2 * reflectors > input.revolutions.len() && reflectors > 0) {
            return Ok(input);
        }
        let recording = self.recording(log)?;
        Ok(with_laser_motion(&input, &recording).unwrap_or(input))
    }

    /// The log, with the vehicle that is given.
    fn recording(&self, log: &Path) -> anyhow::Result<Recording> {
        let (mut recording, _) = agv_host_sim::log::read(log)?;
        self.vehicle.apply(&mut recording.parameters, log)?;
        Ok(recording)
    }

    /// The parameters; with what explains the drive mended, if that is wanted.
    fn calibrated(&self, input: &LogInput, preparation: &Preparation) -> anyhow::Result<Calibrated> {
        let attempt = |input: &LogInput, preparation: &Preparation| {
            let drive = Drive::new(input, preparation)?;
            Ok((find(&drive, &self.question())?, drive))
        };
        // What turns a counter must first have been held against everything else that does the same.
        let as_it_is = Drive::new(input, &Preparation { mend: false, ..*preparation });
        let first = match as_it_is {
            Err(refusal @ Refusal::WrongDirection(_)) => Err(refusal),
            _ => attempt(input, preparation),
        };
        let refusal: Refusal = match first {
            Ok(found) if !self.mend => return Ok(Calibrated::ByArcs(Box::new(found))),
            // A wheelbase that was held is to be mended, too.
            Ok(held) => {
                let found = with_wheelbase(input, preparation).unwrap_or(held);
                return Ok(Calibrated::ByArcs(Box::new(found)));
            }
            Err(refusal) => refusal,
        };
        let explanations = explanations(input);
        // What no setting mends is not mended by another that looks alike.
        let are_few = |cause: &Cause| matches!(cause, Cause::FewReflectors(_));
        let is_named = explanations.iter().any(|found| !found.causes.iter().all(are_few));
        let by_reflectors = explanations.iter().find_map(|found| Some((found.to_string(), mended(input, found)?)));
        if by_reflectors.is_none()
            && self.mend
            && !is_named
            && let Some(explanation) = self.explained_by_wheels(input)
        {
            ensure!(
                self.is_plain(),
                "{refusal}; the drive makes sense if {explanation}; --mend with no option but --apply and --json mends that"
            );
            return Ok(Calibrated::ByWheels(Box::new(explanation)));
        }
        let Some((explanation, right)) = by_reflectors.filter(|_| self.mend) else {
            return Err(explained(&refusal, &explanations));
        };
        // What explains the drive was found by one of these questions.
        let asked: Vec<Question> = std::iter::once(self.question()).chain(QUESTIONS).collect();
        let again = Drive::new(&right, preparation)
            .and_then(|drive| find_any(drive, &asked))
            .or_else(|_| Drive::among_few(&right).and_then(|drive| find_any(drive, &asked)));
        let (found, mut drive) = again.map_err(|again| explained(&again, &explanations))?;
        drive.remarks.push(format!("{explanation}: mended"));
        Ok(Calibrated::ByArcs(Box::new((found, drive))))
    }

    /// What the laser's motion, by whatever it sees, says of the wheels.
    fn explained_by_wheels(&self, input: &LogInput) -> Option<WheelExplanation> {
        let recording = self.recording(self.log.as_deref()?).ok()?;
        let input = with_laser_motion(input, &recording)?;
        explain_wheels(&input, |_, _| ()).into_iter().find(WheelExplanation::is_mendable)
    }

    /// What a result says that is no adjustment any more.
    fn differences(&self, drive: &Drive, found: &Found) -> Vec<String> {
        let causes = differences(found, &drive.nominal, drive.is_from_stops());
        let mut remarks: Vec<String> = causes.iter().map(ToString::to_string).collect();
        let [wheelbase, deviation] = found.suggested_wheelbase;
        let stretch = (wheelbase - found.model.wheelbase).abs();
        if !self.wheelbase && stretch > CLEAR * deviation && stretch > NOTABLE * found.model.wheelbase {
            remarks
                .push(format!("the wheelbase seems to be {wheelbase:.3} m; --wheelbase finds it with everything else"));
        }
        remarks
    }

    fn question(&self) -> Question {
        Question {
            method: if self.method == MethodName::Joint { Method::Joint } else { Method::ClosedForm },
            offsets: if self.method == MethodName::Stc { Offsets::Common } else { Offsets::ForEachSense },
            is_wheelbase_free: self.wheelbase,
            is_steering_ratio_free: self.steering_ratio,
            side: self.side.map(|side| match side {
                Side::Front => MountingSide::Front,
                Side::Rear => MountingSide::Rear,
                Side::Left => MountingSide::Left,
                Side::Right => MountingSide::Right,
            }),
        }
    }

    fn summary(&self, drive: &Drive, found: &Found) -> Summary {
        let outlier = |residual: &agv_host_sim::calibrate::found::Residual| Outlier {
            start_s: residual.start.seconds(),
            end_s: residual.end.seconds(),
            x_m: residual.motion.x,
            y_m: residual.motion.y,
            theta_rad: residual.motion.z,
        };
        Summary {
            method: match self.method {
                MethodName::Stc => "stc",
                MethodName::Atc => "atc",
                MethodName::Joint => "joint",
                MethodName::Clocks => "clocks",
            },
            source: drive.source.name(),
            segments: drive.windows.len(),
            grade: match found.grade() {
                Grade::Good => "good",
                Grade::Fair => "fair",
            },
            parameters: Named::of(found.model.vector().map(Some)),
            std: Named::of(found.deviations.map(|deviation| (deviation > 0.0).then_some(deviation))),
            wheelbase_seen_m: found.suggested_wheelbase[0],
            wheelbase_seen_std_m: found.suggested_wheelbase[1],
            conditioning: Conditioning {
                equations: found.conditioning.equations,
                normal_equations: found.conditioning.normal_equations,
            },
            noise: Noise {
                slip_m_per_root_m: found.noise.slip,
                steering_rad: found.noise.steering,
                laser: found.noise.laser,
            },
            outliers: found.outliers().map(outlier).collect(),
            faults: drive.faults.iter().map(ToString::to_string).collect(),
            remarks: drive.remarks.clone(),
        }
    }
}
