//! The robots of R. Sousa, M. Petry, P. Costa, A. Moreira, "OptiOdom: a generic approach for odometry calibration of wheeled mobile
//! robots", Journal of Intelligent and Robotic Systems 105 (2022): a folder a session, in it a table a run (time, pose of a
//! motion capture, ticks of this cycle of every wheel) and one of nominal values.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};
use std::path::{Path, PathBuf};

use agv_core::geometry::Pose;
use agv_core::odometry::{
    AngleEncoder, Contact, CounterRange, Differential, DrivenWheel, Mecanum, Omnidirectional, Tricycle, Vehicle, Wheel,
    WheelVehicle,
};

use super::wheel_recording;
use super::wheel_table::{self, Column, ReferenceColumns, TableColumns, WheelColumns};
use crate::calibrate::wheeled::drive::WheelDrive;
use crate::calibrate::wheeled::unknowns::{Kind, WheeledModel};
use crate::recording::Recording;
use crate::text_file::{self, TextFileError};

/// A session: runs of one robot on one day.
#[derive(Clone, Debug, PartialEq)]
pub struct Session {
    /// What the robot is.
    pub kind: Kind,
    /// Nominal vehicle; the capture is believed to stand on its middle.
    pub nominal: WheeledModel,
    /// Name and drive of each run, in order.
    pub runs: Vec<(String, WheelDrive)>,
}

/// What the table of nominal values states.
struct Metadata {
    kind: String,
    /// Ticks for one turn of a wheel.
    ticks: f64,
    /// Distances, m.
    distances: Vec<f64>,
    /// Diameters of the wheels, m.
    diameters: Vec<f64>,
}

/// Reads a session's folder.
///
/// # Errors
/// If there is no such folder, a table in it is bad, or a robot is of no known kind.
pub fn read(folder: &Path) -> Result<Session, TextFileError> {
    let (files, metadata) = session_of(folder)?;
    let (kind, wheels) = metadata.wheels(folder)?;
    let columns = metadata.columns();
    let run = |path: &PathBuf| {
        let name = path.file_stem().and_then(|name| name.to_str()).unwrap_or_default().to_owned();
        Ok((name, wheel_table::read(path, &columns)?))
    };
    let runs: Vec<_> =
        files.iter().filter(|path| is_named(path, "_run-")).map(run).collect::<Result<_, TextFileError>>()?;
    if runs.is_empty() {
        return Err(TextFileError::Empty { path: folder.to_owned() });
    }
    Ok(Session { kind, nominal: WheeledModel { wheels, sensor: Pose::default() }, runs })
}

/// Reads one run as a drive with its nominal vehicle; what is nominal lies beside it. References are the poses of the capture.
///
/// # Errors
/// As [`read`].
pub fn read_run(path: &Path) -> Result<Recording, TextFileError> {
    let (_, metadata) = session_of(path.parent().unwrap_or(Path::new(".")))?;
    let (_, wheels) = metadata.wheels(path)?;
    let mut drive = wheel_table::read(path, &metadata.columns())?;
    for step in &mut drive.steps {
        match metadata.kind.as_str() {
            // The right wheel comes first in the table, the left one in events.
            "diff" => step.motions.reverse(),
            // Wheels of the vehicle roll to the left about the middle, those of the table to the right.
            "omni3" => step.motions.iter_mut().for_each(|motion| motion.turn = -motion.turn),
            "omni4" => step.motions.iter_mut().skip(1).step_by(2).for_each(|motion| motion.turn = -motion.turn),
            _ => {}
        }
    }
    let vehicle = metadata.vehicle(&wheels).ok_or_else(|| metadata.no_such_robot(path))?;
    wheel_recording::of(&drive, vehicle, Some(metadata.radius()), Pose::default())
        .map_err(|error| TextFileError::of_line(path, 1, error.to_string()))
}

fn is_named(path: &Path, part: &str) -> bool {
    path.file_name().and_then(|name| name.to_str()).is_some_and(|name| name.contains(part) && name.ends_with(".csv"))
}

/// The files of a session, in order, and what is nominal.
fn session_of(folder: &Path) -> Result<(Vec<PathBuf>, Metadata), TextFileError> {
    let entries = std::fs::read_dir(folder).map_err(|error| TextFileError::of_system(folder, error))?;
    let mut files: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.sort();
    let table = files.iter().find(|path| is_named(path, "_metadata")).ok_or_else(|| TextFileError::Foreign {
        path: folder.to_owned(),
        expected: "a session of the OptiOdom robots",
        looks_like: "a folder without a table of nominal values",
    })?;
    let metadata = Metadata::read(table)?;
    Ok((files, metadata))
}

impl Metadata {
    fn read(path: &Path) -> Result<Self, TextFileError> {
        let text = text_file::read(path, "a table of nominal values")?;
        let row = |name: &str| -> Option<Vec<&str>> {
            let line = text.lines().find(|line| line.split(',').next() == Some(name))?;
            Some(line.split(',').skip(1).map(str::trim).filter(|word| !word.is_empty()).collect())
        };
        let numbers = |name: &str| -> Option<Vec<f64>> { row(name)?.iter().map(|word| word.parse().ok()).collect() };
        let found = || {
            let (gear, resolution) = (numbers("ngear")?, numbers("encRes")?);
            Some(Self {
                kind: (*row("type")?.first()?).to_owned(),
                ticks: gear.first()? * resolution.first()?,
                distances: numbers("Li")?,
                diameters: numbers("Di")?,
            })
        };
        found()
            .ok_or_else(|| TextFileError::of_line(path, 1, "a row of type, ngear, encRes, Li or Di is missing or bad"))
    }

    fn no_such_robot(&self, path: &Path) -> TextFileError {
        let problem = format!("there is no such robot, or its measures are missing: {:?}", self.kind);
        TextFileError::of_line(path, 1, problem)
    }

    /// Radius of the first wheel, m.
    fn radius(&self) -> f64 {
        0.5 * self.diameters.first().copied().unwrap_or_default()
    }

    fn wheels(&self, path: &Path) -> Result<(Kind, Vec<Wheel>), TextFileError> {
        self.nominal_wheels().ok_or_else(|| self.no_such_robot(path))
    }

    /// The vehicle as logs have it: counters of a millionth of a radian.
    fn vehicle(&self, wheels: &[Wheel]) -> Option<Vehicle> {
        const TICK: AngleEncoder = AngleEncoder { scale: 1e-6, range: CounterRange::BITS_32 };
        let driven = |number: usize| Some(DrivenWheel { radius: wheels.get(number)?.radius.abs(), turn: TICK });
        let first = wheels.first()?;
        Some(match self.kind.as_str() {
            "tricyc" => Vehicle::Tricycle(Tricycle {
                wheelbase: first.x,
                drive_scale: first.radius * TICK.scale,
                drive_range: TICK.range,
                steering_scale: TICK.scale,
                steering_range: TICK.range,
                steering_offset_forward: 0.0,
                steering_offset_backward: 0.0,
            }),
            "diff" => Vehicle::Wheels(WheelVehicle::Differential(Differential {
                track: 2.0 * first.y.abs(),
                left: driven(1)?,
                right: driven(0)?,
            })),
            "omni3" => Vehicle::Wheels(WheelVehicle::ThreeOmnidirectional(Omnidirectional {
                arm: first.x.hypot(first.y),
                first: first.y.atan2(first.x),
                driven: [driven(0)?, driven(1)?, driven(2)?],
            })),
            _ => Vehicle::Wheels(WheelVehicle::Mecanum(Mecanum {
                wheelbase: 2.0 * first.x,
                track: 2.0 * first.y,
                driven: [driven(0)?, driven(1)?, driven(2)?, driven(3)?],
            })),
        })
    }

    /// A steered wheel's reading is an angle already; the nominal ratio to it is one.
    fn nominal_wheels(&self) -> Option<(Kind, Vec<Wheel>)> {
        let encoder = AngleEncoder { scale: 1.0, range: CounterRange::BITS_32 };
        let length = *self.distances.first()?;
        let wheel = |number: usize, place: [f64; 2], heading: f64, contact: Contact| {
            let diameter = self.diameters.get(number).or(self.diameters.first())?;
            let [x, y] = place;
            let (radius, turn) = (0.5 * diameter, Some(encoder));
            Some(Wheel { x, y, heading, radius, contact, turn, steering: None })
        };
        Some(match self.kind.as_str() {
            "tricyc" => {
                let front = Wheel { steering: Some(encoder), ..wheel(0, [length, 0.0], 0.0, Contact::Tyre)? };
                let rear = Wheel { turn: None, steering: None, x: 0.0, ..front };
                (Kind::Tricycle, vec![front, rear])
            }
            "diff" => {
                let side = |number, y| wheel(number, [0.0, y], 0.0, Contact::Tyre);
                (Kind::Differential, vec![side(0, -0.5 * length)?, side(1, 0.5 * length)?])
            }
            // Each rolls clockwise about the middle while it counts up; the third one stands behind.
            "omni3" => {
                let around = |number: usize, place: f64| {
                    wheel(
                        number,
                        [length * place.cos(), length * place.sin()],
                        place - FRAC_PI_2,
                        Contact::Rollers(0.0),
                    )
                };
                let sixth = TAU / 6.0;
                (Kind::Omnidirectional, vec![around(0, -sixth)?, around(1, sixth)?, around(2, 3.0 * sixth)?])
            }
            // Front left, front right, rear left, rear right; those on the right count backward.
            "omni4" => {
                let across = *self.distances.get(1)?;
                let corner = |number: usize, forward: f64, left: f64| {
                    let rollers = Contact::Rollers(-forward * left * FRAC_PI_4);
                    let found = wheel(number, [0.5 * forward * length, 0.5 * left * across], 0.0, rollers)?;
                    Some(Wheel { radius: found.radius * left, ..found })
                };
                let front = [corner(0, 1.0, 1.0)?, corner(1, 1.0, -1.0)?];
                (Kind::Omnidirectional, [front, [corner(2, -1.0, 1.0)?, corner(3, -1.0, -1.0)?]].concat())
            }
            _ => return None,
        })
    }

    fn columns(&self) -> TableColumns {
        let column = |number: usize, unit: &str| Column {
            column: number.to_string(),
            unit: unit.to_owned(),
            ticks: None,
            is_change: false,
        };
        let turn = |number: usize| {
            let ticks = Column { ticks: Some(self.ticks), is_change: true, ..column(number, "ticks") };
            WheelColumns { turn: Some(ticks), ..WheelColumns::default() }
        };
        let wheel = match self.kind.as_str() {
            "tricyc" => vec![WheelColumns { steering: Some(column(6, "rad")), ..turn(5) }, WheelColumns::default()],
            "diff" => vec![turn(5), turn(6)],
            "omni3" => (5..8).map(turn).collect(),
            _ => (5..9).map(turn).collect(),
        };
        let reference =
            Some(ReferenceColumns { time: None, x: column(2, "m"), y: column(3, "m"), heading: column(4, "rad") });
        TableColumns { time: column(1, "s"), wheel, reference, has_heading: false }
    }
}
