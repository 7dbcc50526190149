//! Kinds of faults, each with a size that is swept from nothing to its natural end.

use std::path::{Path, PathBuf};

use agv_core::odometry::Vehicle;
use agv_host_sim::simulate::random::Random;
use agv_host_sim::simulate::scenario::{Carry, DataAge, Knock, toml_complaint};
use agv_host_sim::simulate::standard;
use serde::{Deserialize, Serialize};

use super::blinding::Blinding;
use super::hall::STANDS;
use crate::campaign::fault::{Fault, FaultKind};

/// Why kinds of faults cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum KindsError {
    /// The file cannot be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// The text has no kinds.
    #[error("these are no kinds of faults, line {line}: {problem}")]
    Parse {
        /// Line, from 1.
        line: usize,
        /// What is wrong with it.
        problem: String,
    },
    /// A kind makes no fault.
    #[error("the kind {name:?}: {problem}")]
    Kind {
        /// The kind.
        name: String,
        /// What is wrong with it.
        problem: String,
    },
}

/// When a fault begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Begin {
    /// At any time of the drive, once the vehicle has stood.
    #[default]
    AnyTime,
    /// It is there from the beginning.
    Before,
    /// At any time at which the vehicle stands, and drives on later.
    Standing,
}

/// How long a fault lasts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Lasts {
    /// So many seconds.
    Seconds(f64),
    /// As many seconds as its size is.
    Size(TheSize),
}

/// What reveals a fault that was there before the vehicle was switched on: until then no sensor of the vehicle can tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Revealed {
    /// 90 degrees turned, with three reflectors in sight.
    Turn,
    /// 5 m driven, with three reflectors in sight.
    Drive,
}

/// The word for the size.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TheSize {
    /// "size".
    Size,
}

/// A kind of fault. In `what`, `knock`, `carry` or `age`, the text "size" stands for the size, and "-size" for the same with the other sign.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kind {
    /// What it is called in the table.
    pub name: String,
    /// What the size is in.
    pub unit: String,
    /// Sizes, from none on; empty for what has no size.
    #[serde(default)]
    pub sizes: Vec<f64>,
    /// When it begins.
    #[serde(default)]
    pub begins: Begin,
    /// How long it lasts, s, or "size"; to the end if absent.
    pub lasts: Option<Lasts>,
    /// What it does to sensors, lines or beliefs.
    pub what: Option<toml::Table>,
    /// How the laser moves on its mounting.
    pub knock: Option<toml::Table>,
    /// How the vehicle is lifted and set down.
    pub carry: Option<toml::Table>,
    /// How much older the laser's data are than the time that they state.
    pub age: Option<toml::Table>,
    /// What reveals it once it is all there: before the drive, or when a laser that creeps has come to its end. Until then the fault is
    /// of class C.
    #[serde(default)]
    pub revealed: Option<Revealed>,
    /// Whether the start is told, as it is what is tested.
    #[serde(default)]
    pub tells_start: bool,
}

/// A fault that no sensor of the vehicle can tell before something reveals it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hidden {
    /// When it begins, and from when on it is all there, s since the drive began.
    pub from: f64,
    /// See [`Self::from`].
    pub since: f64,
    /// What reveals it then.
    pub by: Revealed,
}

/// What goes wrong in one run.
#[derive(Clone, Debug, PartialEq)]
pub enum Drawn {
    /// Nothing.
    Nothing,
    /// A fault of sensors, lines or beliefs.
    Fault(Fault),
    /// The laser moves.
    Knock(Knock),
    /// The vehicle is carried.
    Carry(Carry),
    /// The laser's data are older than they state.
    Age(DataAge),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    kind: Vec<Kind>,
    #[serde(default)]
    blinding: Vec<Blinding>,
}

/// What is known of faults before a campaign.
#[derive(Clone, Debug, PartialEq)]
pub struct Catalogue {
    /// The kinds of faults.
    pub kinds: Vec<Kind>,
    /// Which take away what shows others.
    pub blinding: Vec<Blinding>,
}

/// The kind without a fault.
pub const NOTHING: &str = "nothing";

/// Fewest sizes of a kind.
pub const FEWEST_SIZES: usize = 9;

/// Reads kinds of faults.
///
/// # Errors
/// See [`KindsError`].
pub fn read(path: &Path) -> Result<Catalogue, KindsError> {
    let text = standard::read_to_string(path).map_err(|source| KindsError::Read { path: path.to_owned(), source })?;
    parse(&text)
}

/// Kinds of faults from the text of a file.
///
/// # Errors
/// See [`KindsError`].
pub fn parse(text: &str) -> Result<Catalogue, KindsError> {
    let file: File = toml::from_str(text).map_err(|error| {
        let (line, problem) = toml_complaint(text, &error);
        KindsError::Parse { line, problem }
    })?;
    for (index, kind) in file.kind.iter().enumerate() {
        kind.check().map_err(|problem| KindsError::Kind { name: kind.name.clone(), problem })?;
        if file.kind[..index].iter().any(|known| known.name == kind.name) {
            return Err(KindsError::Kind { name: kind.name.clone(), problem: "the name is there twice".to_owned() });
        }
    }
    let File { kind: kinds, blinding } = file;
    for name in blinding.iter().flat_map(Blinding::names) {
        if !kinds.iter().any(|kind| kind.name == *name) {
            return Err(KindsError::Kind {
                name: name.clone(),
                problem: "it is blinded or blinding, and is no kind".to_owned(),
            });
        }
    }
    Ok(Catalogue { kinds, blinding })
}

impl Kind {
    fn check(&self) -> Result<(), String> {
        if self.has_size() && self.sizes.len() < FEWEST_SIZES {
            return Err(format!("fewer than {FEWEST_SIZES} sizes"));
        }
        if !self.has_size() && !self.sizes.is_empty() {
            return Err("sizes, and nothing that they are of".to_owned());
        }
        if self.tables().count() != 1 {
            return Err("one of `what`, `knock`, `carry` and `age` is expected".to_owned());
        }
        self.every_size().iter().try_for_each(|&size| self.at(size, 0.0).map(|_| ()))
    }

    /// Whether anything of it has a size.
    fn has_size(&self) -> bool {
        let mut values = self.tables().flat_map(toml::Table::values).filter_map(toml::Value::as_str);
        matches!(self.lasts, Some(Lasts::Size(_))) || values.any(|text| text == "size" || text == "-size")
    }

    fn tables(&self) -> impl Iterator<Item = &toml::Table> {
        [&self.what, &self.knock, &self.carry, &self.age].into_iter().flatten()
    }

    /// Its sizes; 1 for what has none.
    #[must_use]
    pub fn every_size(&self) -> &[f64] {
        if self.sizes.is_empty() { &[1.0] } else { &self.sizes }
    }

    /// The fault of that size, beginning at `from`, s.
    ///
    /// # Errors
    /// What is wrong with the kind.
    pub fn at(&self, size: f64, from: f64) -> Result<Drawn, String> {
        let until = self.lasts.map(|lasts| match lasts {
            Lasts::Seconds(seconds) => from + seconds,
            Lasts::Size(_) => from + size,
        });
        let since = |table: &toml::Table| {
            let mut table = with_size(table, size);
            table.insert("from".to_owned(), toml::Value::Float(from));
            table
        };
        let complaint = |error: toml::de::Error| error.message().to_owned();
        if let Some(knock) = &self.knock {
            return since(knock).try_into().map(Drawn::Knock).map_err(complaint);
        }
        if let Some(carry) = &self.carry {
            return since(carry).try_into().map(Drawn::Carry).map_err(complaint);
        }
        if let Some(age) = &self.age {
            return since(age).try_into().map(Drawn::Age).map_err(complaint);
        }
        let what: FaultKind =
            with_size(self.what.as_ref().unwrap_or(&nothing()), size).try_into().map_err(complaint)?;
        if what == FaultKind::Nothing {
            return Ok(Drawn::Nothing);
        }
        Ok(Drawn::Fault(Fault { name: self.name.clone(), from, until, what, can_recover: until.is_some() }))
    }

    /// Until what it is hidden, if it was drawn to begin at `from`, s since the drive began; none of what any sensor can tell at once.
    #[must_use]
    pub fn hidden(&self, from: f64, drawn: &Drawn) -> Option<Hidden> {
        let lasts = if let Drawn::Knock(knock) = drawn { knock.lasts } else { 0.0 };
        let begins = if self.begins == Begin::Before { f64::NEG_INFINITY } else { from };
        self.revealed.map(|by| Hidden { from: begins, since: from + lasts, by })
    }

    /// Whether a vehicle can have it.
    #[must_use]
    pub fn is_possible(&self, vehicle: &Vehicle) -> bool {
        let fault = self.every_size().first().and_then(|size| self.at(*size, 0.0).ok());
        !matches!(fault, Some(Drawn::Fault(fault)) if !fault.what.is_possible(vehicle))
    }

    /// When the fault of a run begins, s, in a drive of that many seconds in which the vehicle stands at those times, and drives on later.
    pub fn draw_begin(&self, seconds: f64, standing: &[f64], random: &mut Random) -> f64 {
        let drawn = random.uniform();
        match self.begins {
            Begin::Before => 0.0,
            Begin::AnyTime => STANDS + drawn * (seconds - STANDS),
            Begin::Standing => standing.get((drawn * standing.len() as f64) as usize).copied().unwrap_or(0.0),
        }
    }
}

fn nothing() -> toml::Table {
    toml::Table::from_iter([("kind".to_owned(), toml::Value::String("nothing".to_owned()))])
}

/// The table with numbers in the places of "size".
fn with_size(table: &toml::Table, size: f64) -> toml::Table {
    let mut table = table.clone();
    for (_, value) in table.iter_mut() {
        let size = match value.as_str() {
            Some("size") => size,
            Some("-size") => -size,
            _ => continue,
        };
        *value = if size.fract() == 0.0 && size.abs() < 1e15 {
            // What counts takes whole numbers, and what measures takes them, too.
            toml::Value::Integer(size as i64)
        } else {
            toml::Value::Float(size)
        };
    }
    table
}
