//! Layouts as tables with a line of names: columns in any order, separated by commas, semicolons or tabs, with points or commas in
//! numbers, in the unit that the names state.

use agv_wire::nav350::{IdentifiedLandmark, Size};
use csv::StringRecord;

use super::reading::{Reading, Unit};
use crate::account::Account;
use crate::delimited::{self, Table};

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Column {
    Name,
    X,
    Y,
    Type,
    Subtype,
    Size,
    Layers,
    Kind,
}

/// Names of the columns, in small letters and without a unit.
const NAMES: [(&str, Column); 21] = [
    ("globid", Column::Name),
    ("id", Column::Name),
    ("name", Column::Name),
    ("nr", Column::Name),
    ("no", Column::Name),
    ("number", Column::Name),
    ("nummer", Column::Name),
    ("reflector", Column::Name),
    ("point", Column::Name),
    ("x", Column::X),
    ("easting", Column::X),
    ("east", Column::X),
    ("y", Column::Y),
    ("northing", Column::Y),
    ("north", Column::Y),
    ("type", Column::Type),
    ("subtype", Column::Subtype),
    ("size", Column::Size),
    ("layers", Column::Layers),
    ("layer", Column::Layers),
    ("kind", Column::Kind),
];

/// What a name of a column says: `x_mm`, `X [mm]`, `X (m)`, `Easting`.
fn meaning(name: &str) -> Option<(Column, Option<Unit>)> {
    let name = name.trim().to_lowercase();
    let name = name.trim_start_matches('#').trim();
    let mut words = name.split(|one: char| !one.is_alphanumeric()).filter(|word| !word.is_empty());
    let first = words.next()?;
    let column = NAMES.iter().find(|(known, _)| *known == first)?.1;
    Some((column, words.next().and_then(|word| word.parse().ok())))
}

/// Where each column is, and the units of x and y.
struct Columns {
    places: Vec<(Column, usize)>,
    units: [Option<Unit>; 2],
}

impl Columns {
    /// None if the record holds numbers: the layout has no line of names.
    fn of(record: &StringRecord) -> Option<Self> {
        let found: Vec<(Column, Option<Unit>, usize)> = record
            .iter()
            .enumerate()
            .filter_map(|(index, name)| meaning(name).map(|(column, unit)| (column, unit, index)))
            .collect();
        let unit = |wanted| found.iter().find(|(column, ..)| *column == wanted).and_then(|(_, unit, _)| *unit);
        let is_name = |word: &str| word.trim().chars().any(char::is_alphabetic);
        let columns = Self {
            places: found.iter().map(|(column, _, index)| (*column, *index)).collect(),
            units: [unit(Column::X), unit(Column::Y)],
        };
        record.iter().next().is_some_and(is_name).then_some(columns)
    }

    fn place(&self, wanted: Column) -> Option<usize> {
        self.places.iter().find(|(column, _)| *column == wanted).map(|(_, place)| *place)
    }
}

/// Whether a text begins with a line of names.
pub(super) fn has_names(text: &str) -> bool {
    let first = delimited::of_text(text).rows.into_iter().next();
    first.is_some_and(|(_, record)| Columns::of(&record).is_some())
}

/// The landmarks of a table with names.
pub(super) fn parse(
    text: &str,
    reading: &Reading,
    account: &mut Account,
) -> Result<Vec<IdentifiedLandmark>, (usize, String)> {
    let Table { rows, separator, has_decimal_commas } = delimited::of_text(text);
    let mut rows = rows.into_iter();
    let (line, names) = rows.next().ok_or((1, "there is no line of names".to_owned()))?;
    let columns = Columns::of(&names).ok_or((line, "there is no line of names".to_owned()))?;
    let seen = names.iter().map(str::trim).collect::<Vec<_>>().join(", ");
    let needed = |column, name: &str| {
        columns
            .place(column)
            .ok_or((line, format!("there is no column {name} among {seen}; expected are globID, x_mm, y_mm")))
    };
    let (x, y) = (needed(Column::X, "x")?, needed(Column::Y, "y")?);
    if separator != b',' {
        account.note(format!("columns are separated by {:?}", char::from(separator)));
    }
    let unit = |index: usize| reading.unit.or(columns.units[index]).unwrap_or(Unit::Millimetre).metres();
    if reading.unit.is_none() && columns.units.iter().any(Option::is_none) {
        account.note("the names of the columns state no unit: millimetres were taken");
    }
    let mut landmarks: Vec<IdentifiedLandmark> = Vec::new();
    for (line, record) in rows {
        let word = |place: usize| record.get(place).unwrap_or_default().trim().to_owned();
        let number = |place: usize, name: &str| {
            let found = delimited::number(&word(place), has_decimal_commas);
            found.ok_or_else(|| (line, format!("{name} is no number: {:?}", word(place))))
        };
        let whole = |column: Column, name: &str, usual: u16| {
            let Some(place) = columns.place(column) else { return Ok(usual) };
            word(place)
                .parse()
                .map_err(|_| (line, format!("{name} is no whole number from 0 to 65535: {:?}", word(place))))
        };
        if columns.place(Column::Kind).is_some_and(|kind| word(kind) != "reflector") {
            account.set_aside("landmarks that are no reflectors", 1);
            continue;
        }
        let id = whole(Column::Name, "the name", u16::try_from(landmarks.len() + 1).unwrap_or(u16::MAX))?;
        let place = reading.placed([number(x, "x")? * unit(0), number(y, "y")? * unit(1)]);
        let mut found = super::reflector(id, place[0], place[1]);
        found.landmark.kind = whole(Column::Type, "the type", u16::from(found.landmark.kind))?
            .try_into()
            .map_err(|_| (line, "the type is no number from 0 to 255".to_owned()))?;
        found.landmark.subtype = whole(Column::Subtype, "the subtype", u16::from(found.landmark.subtype))?
            .try_into()
            .map_err(|_| (line, "the subtype is no number from 0 to 255".to_owned()))?;
        found.landmark.size = Size(whole(Column::Size, "the size", found.landmark.size.0)?);
        if let Some(layers) = columns.place(Column::Layers) {
            found.landmark.layers.clear();
            for layer in word(layers).split_whitespace() {
                let layer = layer.parse().map_err(|_| (line, format!("a layer is no number: {layer:?}")))?;
                found.landmark.layers.push(layer).map_err(|_| (line, "there are too many layers".to_owned()))?;
            }
        }
        super::check_range(place).map_err(|problem| (line, problem))?;
        if landmarks.iter().any(|known| known.id == id) {
            return Err((line, "the name was used before".to_owned()));
        }
        landmarks.push(found);
    }
    if columns.place(Column::Name).is_none() {
        account.note("no column names the reflectors: they were numbered from 1");
    }
    account.take(landmarks.len());
    Ok(landmarks)
}
