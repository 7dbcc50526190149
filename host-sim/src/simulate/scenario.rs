//! A drive to simulate, as a file states it.
//!
//! Lengths are in metres, times in seconds, angles in degrees where the key ends in `_deg`. Whatever a file leaves out has
//! the value of the project's standard block storage, which is also what `Scenario::default` is.

use std::path::{Path as FilePath, PathBuf};

use agv_core::geometry::{Point, Pose};
use serde::{Deserialize, Serialize};

use super::block_storage::{BlockStorage, BlockStoragePath, ReflectorPlacement};
use super::path::{Leg, Path};
use super::people::{Person, PersonShape};
use super::random::{Random, Stream};
use super::warehouse_hall::{self, WarehouseHall};
use super::world::{Circle, Rectangle, Reflector, Sector, World};

/// Why a scenario cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ScenarioError {
    /// The file cannot be read.
    #[error("the scenario {path} cannot be read")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// The file is empty.
    #[error("the scenario {path} is empty")]
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
        key: &'static str,
        /// What it must be.
        demand: &'static str,
    },
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
    /// The laser.
    pub laser: LaserOptions,
    /// Detection and survey of reflectors.
    pub reflectors: ReflectorOptions,
    /// The start pose that the localiser is given.
    pub start: StartOptions,
    /// Who walks about.
    pub people: Vec<PersonOptions>,
}

/// What stands where.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum WorldOptions {
    /// The standard block storage.
    BlockStorage(BlockStorage),
    /// A hall with racks.
    WarehouseHall(WarehouseHall),
    /// Shapes one by one.
    Shapes(Shapes),
}

impl Default for WorldOptions {
    fn default() -> Self {
        Self::BlockStorage(BlockStorage::default())
    }
}

/// A world of given shapes, in W.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Shapes {
    /// Walls: x and y of one end, x and y of the other, m.
    pub walls: Vec<[f64; 4]>,
    /// Boxes.
    pub rectangles: Vec<RectangleOptions>,
    /// Round columns.
    pub circles: Vec<CircleOptions>,
    /// Reflectors.
    pub reflectors: Vec<ReflectorShape>,
}

/// A box.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RectangleOptions {
    /// Centre in W, m.
    pub x: f64,
    /// Centre in W, m.
    pub y: f64,
    /// Direction of the length in W.
    #[serde(default)]
    pub heading_deg: f64,
    /// Length, m.
    pub length: f64,
    /// Width, m.
    pub width: f64,
}

/// A round column.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CircleOptions {
    /// Centre in W, m.
    pub x: f64,
    /// Centre in W, m.
    pub y: f64,
    /// Radius, m.
    pub radius: f64,
}

/// A reflector.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReflectorShape {
    /// Axis in W, m.
    pub x: f64,
    /// Axis in W, m.
    pub y: f64,
    /// Radius, m.
    #[serde(default = "ReflectorShape::standard_radius")]
    pub radius: f64,
    /// Detected up to this distance, m.
    #[serde(default = "ReflectorShape::standard_farthest")]
    pub farthest: f64,
    /// Middle of the directions from which it is seen; all directions if absent.
    pub facing_deg: Option<f64>,
    /// Half of the width of these directions.
    #[serde(default = "ReflectorShape::standard_half_width")]
    pub half_width_deg: f64,
}

impl ReflectorShape {
    fn standard_radius() -> f64 {
        0.04
    }
    fn standard_farthest() -> f64 {
        30.0
    }
    fn standard_half_width() -> f64 {
        60.0
    }
}

/// The way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PathOptions {
    /// Which way.
    pub kind: PathKind,
    /// Where it starts, for a way of legs.
    pub start: PoseOptions,
    /// The legs, for a way of legs.
    pub legs: Vec<Leg>,
}

/// Which way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PathKind {
    /// The block storage's first path.
    P1,
    /// The block storage's second path.
    P2,
    /// The block storage's third path.
    P3,
    /// The block storage's fourth path.
    P4,
    /// The block storage's drive for mapping.
    Mapping,
    /// The warehouse hall's loop.
    HallLoop,
    /// The legs that the scenario states.
    Legs,
}

impl Default for PathOptions {
    fn default() -> Self {
        Self { kind: PathKind::P1, start: PoseOptions::default(), legs: Vec::new() }
    }
}

/// A pose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PoseOptions {
    /// Position, m.
    pub x: f64,
    /// Position, m.
    pub y: f64,
    /// Heading.
    pub heading_deg: f64,
}

impl PoseOptions {
    /// The pose.
    #[must_use]
    pub fn pose(&self) -> Pose {
        Pose::new(self.x, self.y, self.heading_deg.to_radians())
    }
}

/// How the way is driven.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DriveOptions {
    /// Speed of the logical point, m/s.
    pub speed: f64,
    /// Acceleration, m/s2.
    pub acceleration: f64,
    /// Braking, m/s2.
    pub braking: f64,
    /// Standstill at the start, s.
    pub start_standstill: f64,
    /// Standstill at the end, s.
    pub end_standstill: f64,
    /// Fastest turn of the driving wheel, degrees a second.
    pub steering_rate_deg: f64,
}

impl Default for DriveOptions {
    fn default() -> Self {
        Self {
            speed: 0.8,
            acceleration: 0.3,
            braking: 0.3,
            start_standstill: 1.0,
            end_standstill: 0.5,
            steering_rate_deg: 60.0,
        }
    }
}

/// The vehicle.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct VehicleOptions {
    /// What it reports of its motion.
    pub reports: MotionReport,
    /// What the localiser believes.
    pub believed: BelievedVehicle,
    /// In what the truth differs.
    #[serde(rename = "true")]
    pub truth: VehicleErrors,
}

/// What the vehicle reports of its motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MotionReport {
    /// Counters of a tricycle's wheel.
    #[default]
    Encoders,
    /// Speed and steering angle of a car.
    Speed,
    /// Displacements.
    Increments,
}

/// What the localiser believes of the vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BelievedVehicle {
    /// Distance from the rear axle to the steering axis, m.
    pub wheelbase: f64,
    /// Way of the driving wheel for one tick, m. The standard one is that of K table 5.1.
    pub drive_scale: f64,
    /// Values of the driving wheel's counter. The standard one has 16 bits, as the incremental encoders of drives have.
    pub drive_counter: u64,
    /// Values of the steering counter, which makes one turn with the wheel. The standard one is an absolute encoder of
    /// 16 bits a turn, 0.0055 degrees a tick.
    pub steering_counter: u64,
    /// Steering offset while driving forward.
    pub steering_offset_forward_deg: f64,
    /// Steering offset while driving backward.
    pub steering_offset_backward_deg: f64,
    /// Distance of the wheel with the speed sensor to the left of the axis, m; for a car.
    pub encoder_offset: f64,
}

impl Default for BelievedVehicle {
    fn default() -> Self {
        Self {
            wheelbase: 1.5,
            drive_scale: 0.249_75e-3,
            drive_counter: 1 << 16,
            steering_counter: 1 << 16,
            steering_offset_forward_deg: 0.0,
            steering_offset_backward_deg: 0.0,
            encoder_offset: 0.0,
        }
    }
}

/// In what the true vehicle differs from the believed one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct VehicleErrors {
    /// True way for a tick over the believed one, minus one.
    pub drive_scale_error: f64,
    /// True steering offset minus the believed one, in both senses of travel.
    pub steering_offset_error_deg: f64,
    /// Whether the seed chooses the signs of the two errors above.
    pub random_signs: bool,
    /// True wheelbase minus the believed one, m.
    pub wheelbase_error: f64,
    /// True mounting of the laser (S in R) minus the believed one, component by component.
    pub laser_error: PoseOptions,
}

impl Default for VehicleErrors {
    fn default() -> Self {
        Self {
            drive_scale_error: 0.002,
            steering_offset_error_deg: 0.05,
            random_signs: true,
            wheelbase_error: 0.0,
            laser_error: PoseOptions::default(),
        }
    }
}

/// Disturbances of the motion and noise of the encoders.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OdometryOptions {
    /// Samples a second.
    pub rate: f64,
    /// Standard deviation of what the driving wheel turns too much or too little, m for the root of a metre.
    pub slip: f64,
    /// Standard deviation of a reading of the steering angle.
    pub steering_noise_deg: f64,
    /// Standard deviation of the heading's walk, degrees for the root of a metre.
    pub yaw_walk_deg: f64,
    /// Standard deviation of the shift to the side, m for the root of a metre.
    pub side_slip: f64,
}

impl Default for OdometryOptions {
    fn default() -> Self {
        Self { rate: 100.0, slip: 3e-3, steering_noise_deg: 0.01, yaw_walk_deg: 0.02, side_slip: 0.5e-3 }
    }
}

impl OdometryOptions {
    /// Perfect wheels on a perfect floor.
    #[must_use]
    pub fn perfect() -> Self {
        Self { slip: 0.0, steering_noise_deg: 0.0, yaw_walk_deg: 0.0, side_slip: 0.0, ..Self::default() }
    }
}

/// The laser.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LaserOptions {
    /// Whether the localiser is given scans.
    pub scans: bool,
    /// Believed mounting, S in R.
    pub mounting: PoseOptions,
    /// Beams a revolution.
    pub beams: u32,
    /// Revolutions a second.
    pub frequency: f64,
    /// Standard deviation of a range up to 30 m, m.
    pub range_noise: f64,
    /// Standard deviation of a range beyond 30 m, m.
    pub far_range_noise: f64,
    /// Standard deviation of a beam's direction.
    pub bearing_noise_deg: f64,
    /// Nearest return, m.
    pub nearest: f64,
    /// Farthest return, m.
    pub farthest: f64,
    /// From the last beam to the arrival of the scan, s.
    pub latency: f64,
    /// Whether strengths are reported; returns of foil are bright.
    pub intensities: bool,
    /// Share of the beams on an edge that report a distance between its two sides, 0 to 1.
    pub mixed_share: f64,
    /// Width of a beam, for mixing.
    pub divergence_deg: f64,
    /// Share of the beams that are lost, 0 to 1.
    pub lost_share: f64,
    /// Where the window is dirty.
    pub dirty_sectors: Vec<DirtySector>,
}

impl Default for LaserOptions {
    fn default() -> Self {
        Self {
            scans: true,
            mounting: PoseOptions { x: 0.9, y: 0.0, heading_deg: 0.0 },
            beams: 1440,
            frequency: 8.0,
            range_noise: 0.010,
            far_range_noise: 0.025,
            bearing_noise_deg: 0.02,
            nearest: 0.5,
            farthest: 70.0,
            latency: 0.010,
            intensities: false,
            mixed_share: 0.0,
            divergence_deg: 0.25,
            lost_share: 0.0,
            dirty_sectors: Vec::new(),
        }
    }
}

/// A part of the laser's window that lets some beams through.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DirtySector {
    /// Where it starts, in S, counter-clockwise.
    pub from_deg: f64,
    /// Where it ends, in S.
    pub to_deg: f64,
    /// Share of its beams that are lost, 0 to 1.
    pub lost_share: f64,
}

/// Detection and survey of reflectors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReflectorOptions {
    /// Standard deviation of a range, m.
    pub range_noise: f64,
    /// Standard deviation of a bearing.
    pub bearing_noise_deg: f64,
    /// None is detected beyond this distance, m.
    pub farthest: f64,
    /// Probability that a visible reflector is missed in a revolution.
    pub missing_share: f64,
    /// False reflectors for each detected one; each stands on a surface in a random direction.
    pub false_share: f64,
    /// Standard deviation of a surveyed position along each axis, m.
    pub survey_deviation: f64,
    /// From the end of the revolution to the arrival of its reflectors, s.
    pub latency: f64,
}

impl Default for ReflectorOptions {
    fn default() -> Self {
        Self {
            range_noise: 0.008,
            bearing_noise_deg: 0.05,
            farthest: 30.0,
            missing_share: 0.0,
            false_share: 0.01,
            survey_deviation: 0.002,
            latency: 0.010,
        }
    }
}

/// The start pose that the localiser is given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StartOptions {
    /// Whether there is one.
    pub given: bool,
    /// Standard deviation along each axis, m, true and stated.
    pub position_deviation: f64,
    /// Standard deviation of the heading, true and stated.
    pub heading_deviation_deg: f64,
}

impl Default for StartOptions {
    fn default() -> Self {
        Self { given: true, position_deviation: 0.005, heading_deviation_deg: 0.03 }
    }
}

/// Somebody who walks about.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PersonOptions {
    /// Corners of the closed way, x and y in W, m.
    pub way: Vec<[f64; 2]>,
    /// Speed, m/s.
    #[serde(default = "PersonOptions::standard_speed")]
    pub speed: f64,
    /// Share of the way that is behind at the start, 0 to 1; the seed chooses if absent.
    pub phase: Option<f64>,
    /// What the laser sees.
    #[serde(default)]
    pub shape: PersonShape,
}

impl PersonOptions {
    fn standard_speed() -> f64 {
        1.2
    }
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
        let text =
            std::fs::read_to_string(path).map_err(|source| ScenarioError::Read { path: path.to_path_buf(), source })?;
        // An empty text states a drive with nothing but defaults, but nobody keeps that in a file.
        if text.trim().is_empty() {
            return Err(ScenarioError::Empty { path: path.to_path_buf() });
        }
        Self::parse(&text)
    }

    /// Reads a scenario from the text of a file.
    ///
    /// # Errors
    /// The text is not a scenario.
    pub fn parse(text: &str) -> Result<Self, ScenarioError> {
        let scenario: Self = toml::from_str(text).map_err(|error| {
            let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
            let problem = error.message().replace('\n', ", ");
            ScenarioError::Parse { line: before.matches('\n').count() + 1, problem }
        })?;
        scenario.check()?;
        Ok(scenario)
    }

    /// Whether every value makes sense.
    ///
    /// # Errors
    /// The first value that does not.
    pub fn check(&self) -> Result<(), ScenarioError> {
        let (drive, vehicle, laser) = (&self.drive, &self.vehicle.believed, &self.laser);
        let positive = [
            ("drive.speed", drive.speed),
            ("drive.acceleration", drive.acceleration),
            ("drive.braking", drive.braking),
            ("drive.steering_rate_deg", drive.steering_rate_deg),
            ("vehicle.believed.wheelbase", vehicle.wheelbase),
            ("vehicle.believed.wheelbase with its error", vehicle.wheelbase + self.vehicle.truth.wheelbase_error),
            ("vehicle.believed.drive_scale", vehicle.drive_scale),
            ("odometry.rate", self.odometry.rate),
            ("laser.frequency", laser.frequency),
            ("laser.farthest", laser.farthest),
        ];
        for (key, value) in positive {
            demand(key, value.is_finite() && value > 0.0, "a positive number")?;
        }
        let not_negative = [
            ("drive.start_standstill", drive.start_standstill),
            ("drive.end_standstill", drive.end_standstill),
            ("odometry.slip", self.odometry.slip),
            ("odometry.steering_noise_deg", self.odometry.steering_noise_deg),
            ("odometry.yaw_walk_deg", self.odometry.yaw_walk_deg),
            ("odometry.side_slip", self.odometry.side_slip),
            ("laser.range_noise", laser.range_noise),
            ("laser.far_range_noise", laser.far_range_noise),
            ("laser.bearing_noise_deg", laser.bearing_noise_deg),
            ("laser.nearest", laser.nearest),
            ("laser.latency", laser.latency),
            ("laser.divergence_deg", laser.divergence_deg),
            ("reflectors.range_noise", self.reflectors.range_noise),
            ("reflectors.bearing_noise_deg", self.reflectors.bearing_noise_deg),
            ("reflectors.farthest", self.reflectors.farthest),
            ("reflectors.survey_deviation", self.reflectors.survey_deviation),
            ("reflectors.latency", self.reflectors.latency),
            ("start.position_deviation", self.start.position_deviation),
            ("start.heading_deviation_deg", self.start.heading_deviation_deg),
        ];
        for (key, value) in not_negative {
            demand(key, value.is_finite() && value >= 0.0, "zero or a positive number")?;
        }
        let shares = [
            ("laser.mixed_share", laser.mixed_share),
            ("laser.lost_share", laser.lost_share),
            ("reflectors.missing_share", self.reflectors.missing_share),
            ("reflectors.false_share", self.reflectors.false_share),
        ];
        let dirty = laser.dirty_sectors.iter().map(|sector| ("laser.dirty_sectors.lost_share", sector.lost_share));
        let phases = self.people.iter().filter_map(|person| person.phase).map(|phase| ("people.phase", phase));
        for (key, value) in shares.into_iter().chain(dirty).chain(phases) {
            demand(key, (0.0..=1.0).contains(&value), "between 0 and 1")?;
        }
        demand("laser.beams", (1..=100_000).contains(&laser.beams), "from 1 to 100000")?;
        for (key, values) in [
            ("vehicle.believed.drive_counter", vehicle.drive_counter),
            ("vehicle.believed.steering_counter", vehicle.steering_counter),
        ] {
            demand(key, (2..=1 << 32).contains(&values), "from 2 to 2^32")?;
        }
        demand("vehicle.true.drive_scale_error", self.vehicle.truth.drive_scale_error.abs() < 1.0, "less than 1")?;
        demand("people.way", self.people.iter().all(|person| !person.way.is_empty()), "a list of at least one point")?;
        self.check_path()?;
        self.check_world()
    }

    fn check_path(&self) -> Result<(), ScenarioError> {
        let has_legs = !self.path.legs.is_empty();
        if self.path.kind != PathKind::Legs {
            return demand("path.legs", !has_legs, "left out unless path.kind is \"legs\"");
        }
        demand("path.legs", has_legs, "a list of at least one leg")?;
        let segments = || self.path.legs.iter().flat_map(|leg| &leg.segments);
        let lengths = segments().all(|segment| segment.length.is_finite() && segment.length > 0.0);
        demand("path.legs.segments.length", lengths, "a positive number")?;
        let curvatures = segments().all(|segment| segment.curvature.is_finite());
        demand("path.legs.segments.curvature", curvatures, "finite")?;
        demand("path.legs.segments", self.path.legs.iter().all(|leg| !leg.segments.is_empty()), "at least one segment")
    }

    fn check_world(&self) -> Result<(), ScenarioError> {
        match &self.world {
            WorldOptions::BlockStorage(storage) => {
                demand("world.moved_share", (0.0..=1.0).contains(&storage.moved_share), "between 0 and 1")?;
                demand("world.moved_by", storage.moved_by.is_finite(), "finite")
            }
            WorldOptions::WarehouseHall(hall) => {
                demand("world.filled_share", (0.0..=1.0).contains(&hall.filled_share), "between 0 and 1")
            }
            WorldOptions::Shapes(shapes) => {
                let numbers = shapes.walls.iter().flatten().copied();
                let rectangles = shapes
                    .rectangles
                    .iter()
                    .flat_map(|shape| [shape.x, shape.y, shape.heading_deg, shape.length, shape.width]);
                let circles = shapes.circles.iter().flat_map(|shape| [shape.x, shape.y, shape.radius]);
                let reflectors = shapes.reflectors.iter().flat_map(|shape| [shape.x, shape.y, shape.radius]);
                let near = numbers.chain(rectangles).chain(circles).chain(reflectors).all(|value| value.abs() < 1000.0);
                demand("world", near, "made of numbers within 1000 m of the origin")?;
                demand("world.reflectors", shapes.reflectors.len() <= usize::from(u16::MAX), "65535 reflectors at most")
            }
        }
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

impl Shapes {
    /// The world of these shapes.
    #[must_use]
    pub fn world(&self) -> World {
        let mut world = World::default();
        for &[x, y, other_x, other_y] in &self.walls {
            world.add_wall(Point::new(x, y), Point::new(other_x, other_y));
        }
        for shape in &self.rectangles {
            let pose = Pose::new(shape.x, shape.y, shape.heading_deg.to_radians());
            world.add_rectangle(&Rectangle { pose, length: shape.length, width: shape.width });
        }
        for shape in &self.circles {
            world.circles.push(Circle { centre: Point::new(shape.x, shape.y), radius: shape.radius });
        }
        for shape in &self.reflectors {
            world.reflectors.push(Reflector {
                body: Circle { centre: Point::new(shape.x, shape.y), radius: shape.radius },
                farthest: shape.farthest,
                sector: shape.facing_deg.map(|middle| Sector {
                    middle: middle.to_radians(),
                    half_width: shape.half_width_deg.to_radians(),
                }),
            });
        }
        world
    }
}

fn demand(key: &'static str, is_met: bool, demand: &'static str) -> Result<(), ScenarioError> {
    if is_met { Ok(()) } else { Err(ScenarioError::Value { key, demand }) }
}
