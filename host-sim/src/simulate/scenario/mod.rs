//! A drive to simulate, as a file states it.
//!
//! Lengths are in metres, times in seconds, angles in degrees where the key ends in `_deg`. Whatever a file leaves out has
//! the value of the project's standard block storage, which is also what `Scenario::default` is.

mod believed;
mod check;
mod floor;
mod gyro;
pub mod keys;
mod line;
mod sensors;
mod start;
mod systematic;
mod vehicle;
mod way;
mod world;

pub use believed::{believed_parameters, believed_tricycle, believed_wheels};
pub use floor::FloorOptions;
pub use gyro::{GyroFault, GyroOptions};
pub use sensors::{DataAge, DirtySector, Knock, LaserOptions, ReflectorOptions};
pub use start::{PersonOptions, StartOptions};
pub use systematic::SystematicErrors;
pub use vehicle::{
    BelievedVehicle, Carry, DriveOptions, MotionReport, OdometryOptions, Slip, VehicleErrors, VehicleOptions,
};
pub use way::{PathKind, PathOptions, PoseOptions};
pub use world::{CircleOptions, RectangleOptions, ReflectorShape, Shapes, WorldOptions};

use std::path::{Path as FilePath, PathBuf};

use agv_core::geometry::Point;
use agv_core::localizer::ParameterError;
use serde::{Deserialize, Serialize};

use super::block_storage::{BlockStorage, BlockStoragePath, ReflectorPlacement};
use super::path::Path;
use super::people::Person;
use super::random::{Random, Stream};
use super::standard;
use super::warehouse_hall;
use super::world::World;

/// Why a scenario cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ScenarioError {
    /// The file cannot be read.
    #[error("{}: the scenario cannot be read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// The file is empty.
    #[error("{}: the scenario is empty", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The text is not a scenario: not TOML, an unknown key, or a value of the wrong type.
    #[error("this is not a scenario, line {line}: {problem}")]
    Parse {
        /// Line, from 1.
        line: usize,
        /// What is wrong with it.
        problem: String,
    },
    /// A value is outside of what makes sense.
    #[error("the scenario's {key} must be {demand}")]
    Value {
        /// Where it stands.
        key: String,
        /// What it is, if it is a number.
        value: Option<f64>,
        /// What it must be.
        demand: String,
    },
    /// What the localiser would have to believe cannot be.
    #[error("the scenario's vehicle cannot be: {0}")]
    Parameters(ParameterError),
    /// A line of a file cannot be used.
    #[error("{}:{line}: {problem}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What is wrong with it.
        problem: String,
    },
}

impl ScenarioError {
    /// The same with the file and the line that it comes from.
    fn of_file(self, path: &FilePath, text: &str) -> Self {
        let (line, problem) = match &self {
            Self::Parse { line, problem } => (Some(*line), format!("this is not a scenario: {problem}")),
            Self::Value { key, value, .. } => (line::of_key(text, key, *value), self.to_string()),
            Self::Parameters(error) => (line::of_leaf(text, error.leaf), self.to_string()),
            _ => return self,
        };
        Self::Line { path: path.to_owned(), line: line.unwrap_or(1), problem }
    }
}

/// A drive to simulate.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Scenario {
    /// Seed of all random numbers.
    pub seed: u64,
    /// What stands where.
    pub world: WorldOptions,
    /// The way.
    pub path: PathOptions,
    /// How the way is driven.
    pub drive: DriveOptions,
    /// The vehicle, true and believed.
    pub vehicle: VehicleOptions,
    /// Disturbances of the motion and noise of the encoders.
    pub odometry: OdometryOptions,
    /// The gyro.
    pub gyro: GyroOptions,
    /// The laser.
    pub laser: LaserOptions,
    /// Detection and survey of reflectors.
    pub reflectors: ReflectorOptions,
    /// The floor.
    pub floor: FloorOptions,
    /// The start pose that the localiser is given.
    pub start: StartOptions,
    /// Who walks about.
    pub people: Vec<PersonOptions>,
}

impl Scenario {
    /// The standard block storage without reflectors, on one of its paths.
    #[must_use]
    pub fn block_storage(path: BlockStoragePath, seed: u64) -> Self {
        let kind = match path {
            BlockStoragePath::P1 => PathKind::P1,
            BlockStoragePath::P2 => PathKind::P2,
            BlockStoragePath::P3 => PathKind::P3,
            BlockStoragePath::P4 => PathKind::P4,
            BlockStoragePath::Mapping => PathKind::Mapping,
        };
        Self { seed, path: PathOptions { kind, ..PathOptions::default() }, ..Self::default() }
    }

    /// The same with reflectors.
    #[must_use]
    pub fn block_storage_with_reflectors(path: BlockStoragePath, placement: ReflectorPlacement, seed: u64) -> Self {
        let world = WorldOptions::BlockStorage(BlockStorage { reflectors: placement, ..BlockStorage::default() });
        Self { world, ..Self::block_storage(path, seed) }
    }

    /// Reads a scenario file.
    ///
    /// # Errors
    /// The file cannot be read or is not a scenario.
    pub fn read(path: &FilePath) -> Result<Self, ScenarioError> {
        let text = standard::read_to_string(path)
            .map_err(|source| ScenarioError::Read { path: path.to_path_buf(), source })?;
        // An empty text states a drive with nothing but defaults, but nobody keeps that in a file.
        if text.trim().is_empty() {
            return Err(ScenarioError::Empty { path: path.to_path_buf() });
        }
        Self::parse(&text).map_err(|error| error.of_file(path, &text))
    }

    /// Reads a scenario from the text of a file.
    ///
    /// # Errors
    /// The text is not a scenario.
    pub fn parse(text: &str) -> Result<Self, ScenarioError> {
        let scenario: Self = toml::from_str(text).map_err(|error| {
            let (line, problem) = toml_complaint(text, &error);
            let is_wrong = |text: &str| toml::from_str::<Self>(text).err().map(|error| error.message().to_owned());
            ScenarioError::Parse { line: line::of_error(text, line, is_wrong), problem: line::in_plain_words(&problem) }
        })?;
        scenario.check()?;
        Ok(scenario)
    }

    /// The world with its people.
    #[must_use]
    pub fn build_world(&self) -> World {
        let mut world = match &self.world {
            WorldOptions::BlockStorage(storage) => storage.world(self.seed),
            WorldOptions::WarehouseHall(hall) => hall.world(self.seed),
            WorldOptions::Shapes(shapes) => shapes.world(),
        };
        let mut random = Random::new(self.seed, Stream::People);
        for person in &self.people {
            let drawn = random.uniform();
            let way = person.way.iter().map(|&[x, y]| Point::new(x, y)).collect();
            world.people.push(Person::new(way, person.speed, person.phase.unwrap_or(drawn), person.shape));
        }
        world
    }

    /// The way.
    #[must_use]
    pub fn build_path(&self) -> Path {
        match self.path.kind {
            PathKind::P1 => BlockStoragePath::P1.path(),
            PathKind::P2 => BlockStoragePath::P2.path(),
            PathKind::P3 => BlockStoragePath::P3.path(),
            PathKind::P4 => BlockStoragePath::P4.path(),
            PathKind::Mapping => BlockStoragePath::Mapping.path(),
            PathKind::HallLoop => warehouse_hall::loop_path(),
            PathKind::Legs => Path { start: self.path.start.pose(), legs: self.path.legs.clone() },
        }
    }
}

/// Line, from 1, and what is wrong there, in one line.
#[must_use]
pub fn toml_complaint(text: &str, error: &toml::de::Error) -> (usize, String) {
    let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
    (before.matches('\n').count() + 1, error.message().replace('\n', ", "))
}
