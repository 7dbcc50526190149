//! Layouts of a NAV350 as files.
//!
//! An imk file has one landmark a line: `globID x_mm y_mm type subtype size_mm layer1 [layer2 ...]`; lines that begin
//! with `#` or `globID` are skipped. A csv file has the same columns behind a line of their names, with the layers
//! separated by spaces; a map of this program is read, too. A dxf drawing has a point for each landmark and a text with its
//! name at the same place.

#[cfg(feature = "drawings")]
mod blocks;
#[cfg(feature = "drawings")]
mod drawing;
mod reading;
mod table;

pub use reading::{Reading, Unit};

use std::path::Path;
use std::str::FromStr;

use agv_core::maps::{Landmark, LandmarkKind};
use agv_wire::nav350::{Coordinate, IdentifiedLandmark, LayoutLandmark, Size};

use crate::account::Account;
use crate::mapping::map_file;
use crate::output_file;
use crate::text_file::{self, TextFileError};

/// How a layout is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// As the maker's programs do.
    Imk,
    /// Comma-separated.
    Csv,
    /// A drawing.
    #[cfg(feature = "drawings")]
    Dxf,
}

impl Format {
    /// The format that the ending of the name says.
    ///
    /// # Errors
    /// If it is neither `imk`, `csv` nor `dxf`.
    pub fn of(path: &Path) -> Result<Self, TextFileError> {
        match path.extension().and_then(|ending| ending.to_str()) {
            Some(ending) if ending.eq_ignore_ascii_case("imk") => Ok(Self::Imk),
            Some(ending) if ending.eq_ignore_ascii_case("csv") => Ok(Self::Csv),
            #[cfg(feature = "drawings")]
            Some(ending) if ending.eq_ignore_ascii_case("dxf") => Ok(Self::Dxf),
            #[cfg(not(feature = "drawings"))]
            Some(ending) if ending.eq_ignore_ascii_case("dxf") => {
                Err(TextFileError::LeftOut { path: path.to_owned(), source: crate::left_out::DRAWINGS })
            }
            _ => Err(TextFileError::Foreign {
                path: path.to_owned(),
                expected: "a layout, whose name ends in .imk, .csv or .dxf,",
                looks_like: "a file of another name",
            }),
        }
    }
}

/// The layout in a text.
///
/// # Errors
/// The number of the first line that is no landmark, from 1, and what is wrong with it.
pub fn parse(text: &str) -> Result<Vec<IdentifiedLandmark>, (usize, &'static str)> {
    let mut landmarks: Vec<IdentifiedLandmark> = Vec::new();
    for (line, number) in text.lines().zip(1..) {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') || line.starts_with("globID") {
            continue;
        }
        let landmark = parse_line(line).map_err(|problem| (number, problem))?;
        if landmarks.iter().any(|known| known.id == landmark.id) {
            return Err((number, "the name was used before"));
        }
        landmarks.push(landmark);
    }
    Ok(landmarks)
}

fn parse_line(line: &str) -> Result<IdentifiedLandmark, &'static str> {
    fn next<'a, T: FromStr>(words: &mut impl Iterator<Item = &'a str>) -> Result<T, &'static str> {
        let word = words.next().ok_or("a landmark has a name, two coordinates, type, subtype, size and layers")?;
        word.parse().map_err(|_| "a number is not whole or too large")
    }
    let mut words = line.split(|letter: char| letter == ',' || letter.is_whitespace()).filter(|word| !word.is_empty());
    let words = &mut words;
    let id = next(words)?;
    let mut landmark = LayoutLandmark {
        x: Coordinate(next(words)?),
        y: Coordinate(next(words)?),
        kind: next(words)?,
        subtype: next(words)?,
        size: Size(next(words)?),
        layers: heapless::Vec::new(),
    };
    for word in words {
        let layer = word.parse().map_err(|_| "a number is not whole or too large")?;
        landmark.layers.push(layer).map_err(|_| "there are too many layers")?;
    }
    Ok(IdentifiedLandmark { id, landmark })
}

/// A layout as a text.
#[must_use]
pub fn write(landmarks: &[IdentifiedLandmark], format: Format) -> String {
    let (separator, mut text) = match format {
        Format::Imk => (' ', "# globID x_mm y_mm type subtype size_mm layer1 layer2 layer3\n".to_owned()),
        Format::Csv => (',', "globID,x_mm,y_mm,type,subtype,size_mm,layers\n".to_owned()),
        #[cfg(feature = "drawings")]
        Format::Dxf => return drawing::write(landmarks),
    };
    for IdentifiedLandmark { id, landmark } in landmarks {
        let LayoutLandmark { x, y, kind, subtype, size, layers } = landmark;
        let numbers = [
            id.to_string(),
            x.0.to_string(),
            y.0.to_string(),
            kind.to_string(),
            subtype.to_string(),
            size.0.to_string(),
            layers.iter().map(ToString::to_string).collect::<Vec<_>>().join(" "),
        ];
        text.push_str(numbers.join(&separator.to_string()).trim_end());
        text.push('\n');
    }
    text
}

/// A layout that was read, and what became of the rest of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadedLayout {
    /// Its landmarks.
    pub landmarks: Vec<IdentifiedLandmark>,
    /// Both ends of each line that is drawn beside them, as of walls and racks, m.
    pub lines: Vec<[[f64; 2]; 2]>,
    /// What was left out, assumed and doubtful.
    pub account: Account,
}

/// Reads a layout from a file.
///
/// # Errors
/// If the file cannot be read, or a line is no landmark.
pub fn load(path: &Path) -> Result<Vec<IdentifiedLandmark>, TextFileError> {
    load_as(path, &Reading::default()).map(|loaded| loaded.landmarks)
}

/// Reads a layout from a file of which somebody knows more than it says.
///
/// # Errors
/// As [`load`].
pub fn load_as(path: &Path, reading: &Reading) -> Result<LoadedLayout, TextFileError> {
    let format = Format::of(path)?;
    let mut account = Account::default();
    let refused = |(line, problem): (usize, String)| TextFileError::of_line(path, line, problem);
    #[cfg(feature = "drawings")]
    if format == Format::Dxf {
        let bytes = std::fs::read(path).map_err(|source| TextFileError::of_system(path, source))?;
        let text;
        let drawn = if drawing::is_binary(&bytes) {
            &bytes
        } else {
            text = text_file::read(path, "a drawing (DXF)")?;
            text.as_bytes()
        };
        return drawing::parse(drawn, reading).map_err(refused);
    }
    let text = text_file::read(path, "a layout")?;
    if text.lines().next().is_some_and(|first| first.trim() == map_file::HEADER) && *reading == Reading::default() {
        let map = map_file::read(path)?;
        let landmarks = layout(&map);
        if landmarks.is_empty() {
            return Err(TextFileError::of_line(
                path,
                1,
                "the map holds no reflectors, of which a layout is".to_owned(),
            ));
        }
        account.take(landmarks.len());
        account.set_aside("landmarks that are no reflectors", map.len() - landmarks.len());
        return Ok(LoadedLayout { landmarks, lines: Vec::new(), account });
    }
    let landmarks = if format == Format::Csv && table::has_names(&text) {
        table::parse(&text, reading, &mut account).map_err(refused)?
    } else {
        let found = parse(&text).map_err(|(line, problem)| TextFileError::of_line(path, line, problem))?;
        account.take(found.len());
        moved(found, reading).map_err(|problem| TextFileError::of_line(path, 1, problem))?
    };
    if landmarks.is_empty() {
        return Err(TextFileError::Empty { path: path.to_owned() });
    }
    Ok(LoadedLayout { landmarks, lines: Vec::new(), account })
}

/// The landmarks of a file in millimetres as somebody says that they are to be understood.
fn moved(mut landmarks: Vec<IdentifiedLandmark>, reading: &Reading) -> Result<Vec<IdentifiedLandmark>, String> {
    if *reading == Reading::default() {
        return Ok(landmarks);
    }
    let unit = reading.unit.unwrap_or(Unit::Millimetre).metres();
    for entry in &mut landmarks {
        let place = reading.placed([f64::from(entry.landmark.x.0) * unit, f64::from(entry.landmark.y.0) * unit]);
        check_range(place)?;
        [entry.landmark.x, entry.landmark.y] = place.map(Coordinate::from_metres);
    }
    Ok(landmarks)
}

/// Coordinates of a layout are whole millimetres of 32 bits, m.
const FARTHEST: f64 = i32::MAX as f64 * 1e-3;

/// Refuses a place that a layout cannot hold.
fn check_range(place: [f64; 2]) -> Result<(), String> {
    if place.iter().all(|value| value.abs() < FARTHEST) {
        return Ok(());
    }
    let [x, y] = place;
    Err(format!(
        "({x:.1}, {y:.1}) m is too far away, as coordinates of a whole country are: layouts reach {FARTHEST:.0} m. State which point becomes \
         the origin with --origin {:.0},{:.0}, or the unit with --unit",
        x.floor(),
        y.floor()
    ))
}

/// Writes a layout to a file.
///
/// # Errors
/// If the file cannot be written, or the ending of its name is of no known format.
pub fn save(path: &Path, landmarks: &[IdentifiedLandmark]) -> Result<(), TextFileError> {
    let text = write(landmarks, Format::of(path)?);
    output_file::write(path, text).map_err(|source| TextFileError::of_system(path, source))
}

/// Standard deviation of a surveyed reflector's place along each axis, m.
const SURVEY_DEVIATION: f32 = 0.005;

/// The reflectors of a layout as the localiser's map has them.
#[must_use]
pub fn landmarks(layout: &[IdentifiedLandmark]) -> Vec<Landmark> {
    let landmark = |entry: &IdentifiedLandmark| Landmark {
        id: entry.id,
        kind: LandmarkKind::Reflector,
        x: entry.landmark.x.metres(),
        y: entry.landmark.y.metres(),
        deviation: SURVEY_DEVIATION,
    };
    layout.iter().map(landmark).collect()
}

/// The reflectors of a map as a layout has them: in whole millimetres, all of one size.
#[must_use]
pub fn layout(landmarks: &[Landmark]) -> Vec<IdentifiedLandmark> {
    let reflectors = landmarks.iter().filter(|landmark| landmark.kind == LandmarkKind::Reflector);
    reflectors.map(|landmark| reflector(landmark.id, landmark.x, landmark.y)).collect()
}

/// A reflector of the usual kind at a place in m.
fn reflector(id: u16, x: f64, y: f64) -> IdentifiedLandmark {
    let landmark = LayoutLandmark {
        x: Coordinate::from_metres(x),
        y: Coordinate::from_metres(y),
        kind: 1,
        subtype: 2,
        size: Size(80),
        layers: [0].into_iter().collect(),
    };
    IdentifiedLandmark { id, landmark }
}
