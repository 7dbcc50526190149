//! Drives that never happened: a world, a vehicle in it, and what its sensors would have said.
//!
//! A scenario and its seed fix every bit of a simulation, on every machine: random numbers have a specified sequence and
//! elementary functions are those of `libm`.

pub mod block_storage;
pub mod floor;
pub mod gyro;
pub mod laser;
pub mod multi_beam;
pub mod odometer;
pub mod path;
pub mod people;
pub mod random;
pub mod random_field;
pub mod raycast;
pub mod reflector_detector;
pub mod scenario;
pub mod shape;
pub mod speed_profile;
pub mod standard;
pub mod storeys;
pub mod vehicle;
pub mod warehouse_hall;
pub mod wheels;
pub mod world;

use agv_core::geometry::Pose;
use agv_core::localizer::PoseFix;
use agv_core::maps::{Landmark, LandmarkKind};
use agv_core::measurement::Time;
use agv_core::odometry::{Ackermann, Tricycle, Wheel, WheelBased};

use crate::recording::{RecordedEvent, Recording, Truth};
use floor::Floor;
use laser::{LaserTrack, Revolution, Scene};
use odometer::SpeedWheel;
use path::Path;
use random::{Random, Stream};
use random_field::RandomField;
use raycast::RayCaster;
use scenario::{MotionReport, Scenario, ScenarioError, believed_parameters, believed_tricycle, believed_wheels};
use vehicle::Motion;
use world::World;

/// Why a drive cannot be simulated.
#[derive(Debug, thiserror::Error)]
pub enum SimulateError {
    /// The scenario makes no sense.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
}

/// A simulated drive and the truth behind it.
#[derive(Clone, Debug, PartialEq)]
pub struct Simulation {
    /// What the localiser is told, and where the vehicle was.
    pub recording: Recording,
    /// What stood where.
    pub world: World,
    /// The way that the vehicle was meant to drive.
    pub path: Path,
    /// The true tricycle.
    pub true_tricycle: Tricycle,
    /// True mounting of the laser, S in R.
    pub true_laser: Pose,
}

/// Time of a drive's first event. Not zero, so that instants a little earlier exist.
pub const START: Time = Time::from_micros(1_000_000);

/// Simulates the drive of `scenario`.
///
/// # Errors
/// The scenario makes no sense.
pub fn simulate(scenario: &Scenario) -> Result<Simulation, SimulateError> {
    scenario.check()?;
    let world = scenario.build_world();
    let path = scenario.build_path();
    let true_tricycle = true_tricycle(scenario);
    let true_laser = true_laser(scenario);
    let mut odometry_random = Random::new(scenario.seed, Stream::Odometry);
    let motion = vehicle::drive(
        &path,
        true_tricycle.wheelbase,
        &scenario.drive,
        &scenario.odometry,
        1.0 / scenario.odometry.rate,
        &mut odometry_random,
    );

    let mut arrivals = Arrivals::default();
    if scenario.start.given {
        arrivals.add(START, RecordedEvent::SetPose(start_fix(scenario, &path.start)));
    }
    report_motion(&mut arrivals, scenario, &motion, &true_tricycle, &mut odometry_random);
    if scenario.gyro.fitted {
        let mut random = Random::new(scenario.seed, Stream::Gyro);
        for sample in gyro::samples(&motion, &scenario.gyro, START, &mut random) {
            arrivals.add(sample.time, RecordedEvent::Gyro(sample));
        }
    }
    let floor = Floor::new(&scenario.floor, &mut Random::new(scenario.seed, Stream::Floor));
    report_laser(
        &mut arrivals,
        scenario,
        &world,
        &LaserTrack::new(&motion, |pose, time| floor.tilted(pose, &scenario.laser.moved(&true_laser, time))),
    );

    let truth = motion
        .states
        .iter()
        .enumerate()
        .map(|(index, state)| Truth { time: START.offset(index as f64 * motion.interval), pose: state.pose })
        .collect();
    let recording = Recording {
        parameters: believed_parameters(scenario),
        landmarks: survey(scenario, &world),
        events: arrivals.in_order(),
        truth,
        references: Vec::new(),
        state: None,
    };
    Ok(Simulation { recording, world, path, true_tricycle, true_laser })
}

fn true_tricycle(scenario: &Scenario) -> Tricycle {
    let errors = &scenario.vehicle.truth;
    let mut random = Random::new(scenario.seed, Stream::Vehicle);
    let signs = if errors.random_signs { [random.sign(), random.sign()] } else { [1.0, 1.0] };
    let offset_error = signs[1] * errors.steering_offset_error_deg.to_radians();
    let backward_error = errors.steering_offset_backward_error_deg.to_radians();
    let believed = believed_tricycle(scenario);
    Tricycle {
        wheelbase: believed.wheelbase + errors.wheelbase_error,
        drive_scale: believed.drive_scale * (1.0 + signs[0] * errors.drive_scale_error),
        steering_offset_forward: believed.steering_offset_forward + offset_error,
        steering_offset_backward: believed.steering_offset_backward + offset_error + backward_error,
        ..believed
    }
}

/// The wheels as they are: one side is larger than the other, and the first steered wheel is mounted a little askew.
fn true_wheels(scenario: &Scenario) -> Vec<Wheel> {
    let errors = &scenario.vehicle.truth;
    let mut random = Random::new(scenario.seed, Stream::Vehicle);
    let signs = if errors.random_signs { [random.sign(), random.sign()] } else { [1.0, 1.0] };
    let Some(vehicle) = believed_wheels(scenario) else { return Vec::new() };
    let mut wheels = vehicle.wheels().as_ref().to_vec();
    let mut askew = signs[1] * errors.steering_offset_error_deg.to_radians();
    for (number, wheel) in wheels.iter_mut().enumerate() {
        let side = if number % 2 == 0 { 0.5 } else { -0.5 };
        let larger = signs[0] * errors.drive_scale_error + side * signs[1] * errors.wheel_difference;
        wheel.radius *= 1.0 + larger;
        if wheel.steering.is_some() {
            wheel.heading += std::mem::take(&mut askew);
        }
    }
    wheels
}

fn true_laser(scenario: &Scenario) -> Pose {
    let (believed, error) = (scenario.laser.mounting, scenario.vehicle.truth.laser_error);
    Pose::new(believed.x + error.x, believed.y + error.y, (believed.heading_deg + error.heading_deg).to_radians())
}

fn start_fix(scenario: &Scenario, truth: &Pose) -> PoseFix {
    let position_deviation = scenario.start.position_deviation;
    let heading_deviation = scenario.start.heading_deviation_deg.to_radians();
    let mut random = Random::new(scenario.seed, Stream::Start);
    let pose = Pose::new(
        truth.x + position_deviation * random.normal(),
        truth.y + position_deviation * random.normal(),
        truth.theta + heading_deviation * random.normal(),
    );
    PoseFix { time: START, pose, position_deviation, heading_deviation }
}

fn survey(scenario: &Scenario, world: &World) -> Vec<Landmark> {
    let deviation = scenario.reflectors.survey_deviation;
    let mut random = Random::new(scenario.seed, Stream::Survey);
    let mut shared = Random::new(scenario.seed, Stream::SurveyField);
    let mut field =
        || RandomField::new(scenario.reflectors.correlated_survey, scenario.reflectors.survey_length, &mut shared);
    let fields = [field(), field()];
    world
        .reflectors
        .iter()
        .zip(0_u16..)
        .map(|(reflector, id)| Landmark {
            id,
            kind: LandmarkKind::Reflector,
            x: reflector.body.centre.x + fields[0].at(&reflector.body.centre) + deviation * random.normal(),
            y: reflector.body.centre.y + fields[1].at(&reflector.body.centre) + deviation * random.normal(),
            deviation: deviation as f32,
        })
        .collect()
}

fn report_motion(
    arrivals: &mut Arrivals,
    scenario: &Scenario,
    motion: &Motion,
    tricycle: &Tricycle,
    random: &mut Random,
) {
    let options = &scenario.odometry;
    let scale = tricycle.drive_scale / scenario.vehicle.believed.drive_scale;
    let believed_offset = scenario.vehicle.believed.steering_offset_forward_deg.to_radians();
    let offset_error = tricycle.steering_offset_forward - believed_offset;
    match scenario.vehicle.reports {
        MotionReport::Encoders => {
            for sample in odometer::encoders(motion, tricycle, options, START, random) {
                let told = odometer::with_mistakes(sample, tricycle, &scenario.vehicle.truth);
                arrivals.add(sample.time, RecordedEvent::Encoders(told));
            }
        }
        MotionReport::Speed | MotionReport::TricycleSpeed => {
            let encoder_offset = scenario.vehicle.believed.encoder_offset;
            let wheel = match scenario.vehicle.reports {
                MotionReport::Speed => SpeedWheel::Rear(Ackermann { wheelbase: tricycle.wheelbase, encoder_offset }),
                _ => SpeedWheel::Steered,
            };
            for sample in odometer::speeds(motion, &wheel, scale, offset_error, options, START, random) {
                arrivals.add(sample.time, RecordedEvent::Speed(sample));
            }
        }
        MotionReport::Differential
        | MotionReport::BiSteerable
        | MotionReport::Ackermann
        | MotionReport::ThreeOmnidirectional
        | MotionReport::Omnidirectional
        | MotionReport::Mecanum => {
            let wheels = true_wheels(scenario);
            for sample in wheels::samples(motion, &wheels, tricycle.wheelbase, options, START, random) {
                arrivals.add(sample.time, RecordedEvent::Wheels(sample));
            }
        }
        MotionReport::Increments => {
            let turn = libm::tan(offset_error) / tricycle.wheelbase;
            for sample in odometer::increments(motion, scale, turn, options, START, random) {
                arrivals.add(sample.time, RecordedEvent::Increment(sample));
            }
        }
    }
}

fn report_laser(arrivals: &mut Arrivals, scenario: &Scenario, world: &World, track: &LaserTrack) {
    let caster = RayCaster::new(world);
    let scene = Scene { fixed: &caster, people: &world.people };
    let mut noise = Random::new(scenario.seed, Stream::Laser);
    let mut faults = Random::new(scenario.seed, Stream::LaserFaults);
    let mut reflector_random = Random::new(scenario.seed, Stream::Reflectors);
    for index in 0..laser::revolutions(&scenario.laser, track) {
        let revolution = Revolution { index, scene, track, options: &scenario.laser, drive_start: START };
        let end = START.offset((index + 1) as f64 / scenario.laser.frequency);
        if !world.reflectors.is_empty() {
            let observations =
                reflector_detector::detect(&revolution, &world.reflectors, &scenario.reflectors, &mut reflector_random);
            arrivals.add(end.offset(scenario.reflectors.latency), RecordedEvent::Reflectors(observations.into()));
        }
        if scenario.laser.scans {
            let scan = laser::scan(&revolution, &mut noise, &mut faults);
            arrivals.add(end.offset(scenario.laser.latency), RecordedEvent::Scan(scan));
        }
    }
}

/// Events with the time at which they reach the localiser.
#[derive(Default)]
struct Arrivals(Vec<(Time, RecordedEvent)>);

impl Arrivals {
    fn add(&mut self, arrival: Time, event: RecordedEvent) {
        self.0.push((arrival, event));
    }

    /// Events that arrive at once keep the order in which they were added.
    fn in_order(mut self) -> Vec<RecordedEvent> {
        self.0.sort_by_key(|(arrival, _)| *arrival);
        self.0.into_iter().map(|(_, event)| event).collect()
    }
}
