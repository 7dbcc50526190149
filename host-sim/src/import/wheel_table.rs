//! Tables of wheels and of poses of a reference, with columns that are named and have units.

use std::collections::HashMap;
use std::path::Path;

use agv_core::geometry::{Pose, wrap};
use agv_core::odometry::WheelMotion;
use serde::Deserialize;

use super::table::shorten;
use super::units::{self, Measure};
use crate::calibrate::wheeled::drive::{WheelDrive, WheelStep};
use crate::text_file::{self, TextFileError};

/// A column of a table.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Column {
    /// Its name in the table's heading; its number, from 1, in a table without one.
    pub column: String,
    /// Its unit.
    pub unit: String,
    /// How many ticks make a turn, if the unit is ticks: of the wheel, or of its steering. Negative if they count the other way.
    #[serde(default)]
    pub ticks: Option<f64>,
    /// Whether each row tells the change since the row before, instead of a total.
    #[serde(default)]
    pub is_change: bool,
}

/// Columns of a wheel.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WheelColumns {
    /// How far it has turned (an angle), or how fast it turns (a rate) or goes (a speed, with the wheel's radius).
    #[serde(default)]
    pub turn: Option<Column>,
    /// Radius, m, if a speed is given.
    #[serde(default)]
    pub radius: Option<f64>,
    /// Its steering angle.
    #[serde(default)]
    pub steering: Option<Column>,
}

/// Columns of a reference.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReferenceColumns {
    /// Its time, if it is not that of the wheels.
    #[serde(default)]
    pub time: Option<Column>,
    /// Position.
    pub x: Column,
    /// Position.
    pub y: Column,
    /// Heading.
    pub heading: Column,
}

/// What the columns of a table are.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableColumns {
    /// When the wheels were read.
    pub time: Column,
    /// In the order of the vehicle's wheels.
    pub wheel: Vec<WheelColumns>,
    /// Poses that were measured beside them.
    #[serde(default)]
    pub reference: Option<ReferenceColumns>,
    /// Whether the first row names the columns.
    #[serde(default = "yes")]
    pub has_heading: bool,
}

const fn yes() -> bool {
    true
}

/// A column that was found.
struct Found {
    index: usize,
    name: String,
    factor: f64,
    measure: Measure,
    is_change: bool,
}

impl Found {
    /// Its cell in SI; none if the cell is empty.
    fn value(&self, record: &csv::StringRecord) -> Result<Option<f64>, String> {
        let Some(word) = record.get(self.index) else {
            return Err(format!("there are {} columns, and {} is the {}th", record.len(), self.name, self.index + 1));
        };
        let word = word.trim();
        if word.is_empty() {
            return Ok(None);
        }
        match word.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(Some(number * self.factor)),
            _ => Err(format!("column {} is no number: {:?}", self.name, shorten(word))),
        }
    }
}

/// The wheels' turns and steering angles as a sum.
#[derive(Clone, Copy, Default)]
struct WheelState {
    turn: f64,
    steering: f64,
}

struct FoundWheel {
    turn: Option<Found>,
    radius: Option<f64>,
    steering: Option<Found>,
}

struct Layout {
    time: Found,
    wheels: Vec<FoundWheel>,
    reference: Option<(Option<Found>, [Found; 3])>,
}

/// Reads a table. A row without a value for all columns of the wheels, or of the reference, says nothing of them.
///
/// # Errors
/// If the file is missing, empty, not text, lacks a column, has a bad cell, or its time runs backward.
pub fn read(path: &Path, columns: &TableColumns) -> Result<WheelDrive, TextFileError> {
    let text = text_file::read(path, "a table")?;
    let problem = |line: usize, problem: String| TextFileError::Line { path: path.to_owned(), line, problem };
    let mut table = csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(text.as_bytes());
    let mut layout = None;
    let mut reader = Rows::default();
    for (index, record) in table.records().enumerate() {
        let record = record.map_err(|error| problem(index + 1, error.to_string()))?;
        let line = record.position().map_or(index + 1, |position| position.line() as usize);
        if layout.is_none() {
            layout = Some(Layout::find(columns, &record).map_err(|text| problem(line, text))?);
            if columns.has_heading {
                continue;
            }
        }
        let Some(layout) = &layout else { continue };
        reader.take(layout, &record).map_err(|text| problem(line, text))?;
    }
    if reader.steps.is_empty() {
        return Err(TextFileError::Empty { path: path.to_owned() });
    }
    Ok(reader.finish())
}

impl Layout {
    fn find(columns: &TableColumns, first: &csv::StringRecord) -> Result<Self, String> {
        let names: HashMap<String, usize> = if columns.has_heading {
            first.iter().enumerate().map(|(index, name)| (name.trim().to_owned(), index)).collect()
        } else {
            (0..first.len()).map(|index| ((index + 1).to_string(), index)).collect()
        };
        let find = |column: &Column, wanted: &[Measure]| find(&names, column, wanted);
        let wheel = |wheel: &WheelColumns| {
            let turning = [Measure::Angle, Measure::Rate, Measure::Speed];
            let turn = wheel.turn.as_ref().map(|column| find(column, &turning)).transpose()?;
            if let Some(found) = turn.as_ref().filter(|found| found.measure == Measure::Speed)
                && wheel.radius.is_none_or(|radius| radius == 0.0)
            {
                return Err(format!("column {} is a speed: the radius of its wheel is needed", found.name));
            }
            let steering = wheel.steering.as_ref().map(|column| find(column, &[Measure::Angle])).transpose()?;
            Ok(FoundWheel { turn, radius: wheel.radius, steering })
        };
        let reference = |reference: &ReferenceColumns| {
            let time = reference.time.as_ref().map(|column| find(column, &[Measure::Time])).transpose()?;
            let place = |column| find(column, &[Measure::Length]);
            let pose = [place(&reference.x)?, place(&reference.y)?, find(&reference.heading, &[Measure::Angle])?];
            Ok::<_, String>((time, pose))
        };
        Ok(Self {
            time: find(&columns.time, &[Measure::Time])?,
            wheels: columns.wheel.iter().map(wheel).collect::<Result<_, String>>()?,
            reference: columns.reference.as_ref().map(reference).transpose()?,
        })
    }
}

fn find(names: &HashMap<String, usize>, column: &Column, wanted: &[Measure]) -> Result<Found, String> {
    let name = column.column.clone();
    let index = *names.get(&name).ok_or_else(|| format!("there is no column {name:?}"))?;
    let (measure, factor) = units::find(&column.unit, column.ticks)
        .ok_or_else(|| format!("column {name:?} has no known unit: {:?}; there are {}", column.unit, units::names()))?;
    if !wanted.contains(&measure) {
        return Err(format!("column {name:?} cannot be in {}", column.unit));
    }
    Ok(Found { index, name, factor, measure, is_change: column.is_change })
}

/// What was read so far.
#[derive(Default)]
struct Rows {
    first: Option<f64>,
    last: Option<(f64, Vec<WheelState>)>,
    steps: Vec<WheelStep>,
    poses: Vec<(f64, Pose)>,
}

impl Rows {
    fn take(&mut self, layout: &Layout, record: &csv::StringRecord) -> Result<(), String> {
        let time = layout.time.value(record)?;
        if let Some(time) = time {
            self.take_wheels(layout, record, time)?;
        }
        if let Some((own, pose)) = &layout.reference {
            let time = own.as_ref().map_or(Ok(time), |own| own.value(record))?;
            let [x, y, heading] = pose;
            if let (Some(time), Some(x), Some(y), Some(heading)) =
                (time, x.value(record)?, y.value(record)?, heading.value(record)?)
            {
                if self.poses.last().is_some_and(|(last, _)| time <= *last) {
                    return Err("the time of the reference runs backward".to_owned());
                }
                self.poses.push((time, Pose { x, y, theta: wrap(heading) }));
            }
        }
        Ok(())
    }

    fn take_wheels(&mut self, layout: &Layout, record: &csv::StringRecord, time: f64) -> Result<(), String> {
        let duration = self.last.as_ref().map_or(0.0, |(last, _)| time - last);
        if self.last.is_some() && duration <= 0.0 {
            return Err("time runs backward".to_owned());
        }
        let mut states = Vec::new();
        for (number, wheel) in layout.wheels.iter().enumerate() {
            let before = self.last.as_ref().map_or_else(WheelState::default, |(_, states)| states[number]);
            let Some(state) = wheel.state(record, &before, duration)? else { return Ok(()) };
            states.push(state);
        }
        let first = *self.first.get_or_insert(time);
        if let Some((_, before)) = &self.last {
            let motion = |(before, after): (&WheelState, &WheelState)| WheelMotion {
                turn: after.turn - before.turn,
                steering_start: before.steering,
                steering_end: after.steering,
            };
            let motions = before.iter().zip(&states).map(motion).collect();
            self.steps.push(WheelStep { end: time - first, motions });
        }
        self.last = Some((time, states));
        Ok(())
    }

    /// Both clocks begin with the first row of the wheels.
    fn finish(self) -> WheelDrive {
        let first = self.first.unwrap_or(0.0);
        WheelDrive::new(self.steps, self.poses.into_iter().map(|(time, pose)| (time - first, pose)))
    }
}

impl FoundWheel {
    fn state(
        &self,
        record: &csv::StringRecord,
        before: &WheelState,
        duration: f64,
    ) -> Result<Option<WheelState>, String> {
        let mut state = *before;
        if let Some(turn) = &self.turn {
            let Some(value) = turn.value(record)? else { return Ok(None) };
            state.turn = match turn.measure {
                Measure::Rate => before.turn + value * duration,
                Measure::Speed => before.turn + value / self.radius.unwrap_or(1.0) * duration,
                _ if turn.is_change => before.turn + value,
                _ => value,
            };
        }
        if let Some(steering) = &self.steering {
            let Some(value) = steering.value(record)? else { return Ok(None) };
            state.steering = if steering.is_change { before.steering + value } else { value };
        }
        Ok(Some(state))
    }
}
