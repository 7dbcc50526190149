//! Tables of wheels and of poses of a reference, with columns that are named and have units.

use std::collections::HashMap;
use std::path::Path;

use agv_core::geometry::{Pose, wrap};
use agv_core::odometry::WheelMotion;
use serde::Deserialize;

use super::table::shorten;
use super::units::{self, Measure};
use crate::account::Account;
use crate::calibrate::wheeled::drive::{WheelDrive, WheelStep};
use crate::delimited;
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
    /// Whether a comma stands before the fraction.
    has_decimal_commas: bool,
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
        match delimited::number(word, self.has_decimal_commas) {
            Some(number) => Ok(Some(number * self.factor)),
            None => Err(format!("column {} is no number: {:?}", self.name, shorten(word))),
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

/// Reads a table. A row without a value for all columns of the wheels, or of the reference, says nothing of them; neither does one of the
/// time of the row before.
///
/// # Errors
/// If the file is missing, empty, not text, lacks a column, has a bad cell, or its time runs backward.
pub fn read(path: &Path, columns: &TableColumns) -> Result<WheelDrive, TextFileError> {
    read_all(path, columns).map(|(drive, _)| drive)
}

/// The same, with what became of the rows.
///
/// # Errors
/// As [`read`].
pub fn read_all(path: &Path, columns: &TableColumns) -> Result<(WheelDrive, Account), TextFileError> {
    let text = text_file::read(path, "a table")?;
    let problem = |line: usize, problem: String| TextFileError::Line { path: path.to_owned(), line, problem };
    let table = delimited::of_text(&text);
    let mut layout = None;
    let mut reader = Rows::default();
    for (index, (line, record)) in table.rows.iter().enumerate() {
        if layout.is_none() {
            layout =
                Some(Layout::find(columns, record, table.has_decimal_commas).map_err(|text| problem(*line, text))?);
            if columns.has_heading {
                continue;
            }
        }
        let Some(layout) = &layout else { continue };
        // A last line that does not end may lack its last cells.
        let is_last = index + 1 == table.rows.len() && !text.ends_with('\n');
        let cells = table.rows.first().map_or(0, |(_, first)| first.len());
        if is_last && record.len() < cells {
            reader.account.warn(format!("the file ends in the middle of line {line}: it was read up to there"));
            continue;
        }
        match reader.take(layout, record, *line) {
            Err(_) if is_last && !reader.steps.is_empty() => {
                reader.account.warn(format!("the file ends in the middle of line {line}: it was read up to there"));
            }
            outcome => outcome.map_err(|text| problem(*line, text))?,
        }
    }
    if reader.steps.is_empty() {
        return Err(TextFileError::Empty { path: path.to_owned() });
    }
    Ok(reader.finish())
}

impl Layout {
    fn find(columns: &TableColumns, first: &csv::StringRecord, has_decimal_commas: bool) -> Result<Self, String> {
        let names: HashMap<String, usize> = if columns.has_heading {
            first.iter().enumerate().map(|(index, name)| (name.trim().to_owned(), index)).collect()
        } else {
            (0..first.len()).map(|index| ((index + 1).to_string(), index)).collect()
        };
        let find = |column: &Column, wanted: &[Measure]| {
            find(&names, column, wanted).map(|found| Found { has_decimal_commas, ..found })
        };
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
    let index = *names.get(&name).ok_or_else(|| {
        let mut known: Vec<(&usize, &str)> = names.iter().map(|(name, index)| (index, name.as_str())).collect();
        known.sort_unstable();
        let known: Vec<&str> = known.into_iter().map(|(_, name)| name).collect();
        format!("there is no column {name:?} among {}", shorten_to(&known.join(", "), LISTED))
    })?;
    let (measure, factor) = units::find(&column.unit, column.ticks)
        .ok_or_else(|| format!("column {name:?} has no known unit: {:?}; there are {}", column.unit, units::names()))?;
    if !wanted.contains(&measure) {
        return Err(format!("column {name:?} cannot be in {}", column.unit));
    }
    Ok(Found { index, name, factor, measure, is_change: column.is_change, has_decimal_commas: false })
}

/// Letters of the names that a message lists.
const LISTED: usize = 120;

fn shorten_to(text: &str, letters: usize) -> String {
    text.chars().take(letters).collect()
}

/// What was read so far.
#[derive(Default)]
struct Rows {
    account: Account,
    first: Option<f64>,
    last: Option<(f64, Vec<WheelState>)>,
    steps: Vec<WheelStep>,
    poses: Vec<(f64, Pose)>,
}

impl Rows {
    fn take(&mut self, layout: &Layout, record: &csv::StringRecord, line: usize) -> Result<(), String> {
        let time = layout.time.value(record)?;
        if let Some(time) = time {
            self.take_wheels(layout, record, time, line)?;
        }
        if let Some((own, pose)) = &layout.reference {
            let time = own.as_ref().map_or(Ok(time), |own| own.value(record))?;
            let [x, y, heading] = pose;
            if let (Some(time), Some(x), Some(y), Some(heading)) =
                (time, x.value(record)?, y.value(record)?, heading.value(record)?)
            {
                match self.poses.last() {
                    Some((last, _)) if time < *last => {
                        return Err("the time of the reference runs backward".to_owned());
                    }
                    Some((last, _)) if time == *last => {
                        self.account.leave_out("poses of the time of the pose before", format!("at line {line}"));
                    }
                    _ => self.poses.push((time, Pose { x, y, theta: wrap(heading) })),
                }
            }
        }
        Ok(())
    }

    fn take_wheels(
        &mut self,
        layout: &Layout,
        record: &csv::StringRecord,
        time: f64,
        line: usize,
    ) -> Result<(), String> {
        let duration = self.last.as_ref().map_or(0.0, |(last, _)| time - last);
        if duration < 0.0 {
            let before = time - duration;
            return Err(format!(
                "time runs backward, from {before} s to {time} s: where a second run begins, begin a second file"
            ));
        }
        if self.last.is_some() && duration == 0.0 {
            self.account.leave_out("rows of the time of the row before", format!("at line {line}"));
            return Ok(());
        }
        let mut states = Vec::new();
        for (number, wheel) in layout.wheels.iter().enumerate() {
            let before = self.last.as_ref().map_or_else(WheelState::default, |(_, states)| states[number]);
            let Some(state) = wheel.state(record, &before, duration)? else { return Ok(()) };
            states.push(state);
        }
        self.account.take(1);
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
    fn finish(self) -> (WheelDrive, Account) {
        let first = self.first.unwrap_or(0.0);
        (WheelDrive::new(self.steps, self.poses.into_iter().map(|(time, pose)| (time - first, pose))), self.account)
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
