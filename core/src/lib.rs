//! Localisation of automated guided vehicles.
//!
//! Everything that the vehicle computes and nothing that it touches: events go in, outputs come out. The crate has no
//! allocator, no clock and no input or output, and every loop in it is bounded, so the same code gives the same bits on
//! a desktop and on a controller.
//!
//! # What to call
//!
//! 1. [`Parameters::new`](localizer::Parameters::new) with the vehicle and the pose of its laser; then
//!    [`check`](localizer::Parameters::check), which names what is out of its bounds.
//! 2. [`Localizer::new`](localizer::Localizer::new), in memory that stays where it is: it is some hundred kilobytes large.
//! 3. [`add_landmarks`](localizer::Localizer::add_landmarks) with the map.
//! 4. [`handle`](localizer::Localizer::handle) with every event, in the order in which they are known, first
//!    [`SetPose`](localizer::Event::SetPose). Each has the time at which it was true, on one clock.
//!
//! | event | rate | how late |
//! |---|---|---|
//! | odometry: counters, speeds, or increments | 20 to 1000 Hz | in order of time |
//! | reflectors and scans | as the sensor turns | up to 0.4 s; by no more than 0.1 s ahead of the odometry |
//! | encoder faults | when they change, and every 10 ms while there is one | in order of time |
//!
//! After each event [`Outputs::pose`](localizer::Outputs) says the pose for the newest time, its covariance, and how far it is
//! to be trusted: [`Mode`](state::Mode) and [`Reason`](state::Reason). The pose holds until the next event. It is no pose to
//! drive by in the modes `NotLocalised`, `Lost` and `WithoutOdometry`, in `DeadReckoning` only as far as the odometry is
//! trusted; `Degraded` asks to stop or creep. [`Outputs::misuse`](localizer::Outputs) says what was wrong with the event
//! itself. Where a pose is needed while the localiser still works on a scan, there is the
//! [`OutputPredictor`](localizer::OutputPredictor); a vehicle that does not know where it is has the
//! [`StartSearch`](localizer::StartSearch). The crate `agv-controller` joins all of them with the protocols.
//!
//! ```
//! use agv_core::geometry::{Point, Pose};
//! use agv_core::localizer::{Event, Localizer, Mode, Parameters, PoseFix};
//! use agv_core::maps::Landmark;
//! use agv_core::measurement::{PoseIncrement, ReflectorObservation, Reflectors, Time};
//! use agv_core::odometry::Vehicle;
//!
//! let parameters = Parameters::new(Vehicle::Increments, Pose::new(0.5, 0.0, 0.0));
//! assert_eq!(parameters.check(), Ok(()));
//! let mut localizer: Box<Localizer> = Box::new(Localizer::new(parameters));
//! localizer.add_landmarks(&[Landmark::reflector(7, Point::new(4.0, 0.0), 0.002)]).unwrap();
//!
//! let time = Time::from_seconds(1.0);
//! let (position_deviation, heading_deviation) = (0.05, 0.01);
//! localizer.handle(&Event::SetPose(PoseFix { time, pose: Pose::default(), position_deviation, heading_deviation }));
//! let time = Time::from_seconds(1.01);
//! localizer.handle(&Event::Increment(PoseIncrement { time, displacement: Pose::default() }));
//! // The reflector is 3.52 m before the laser: the vehicle stands 2 cm further back.
//! let observations = [ReflectorObservation { time, range: 3.52, bearing: 0.0 }];
//! let output = localizer.handle(&Event::Reflectors(Reflectors::of_first(&observations))).pose;
//! assert_eq!(output.mode, Mode::Reflectors);
//! assert!((output.pose.x + 0.02).abs() < 0.002);
//! ```
//!
//! `examples/` has more: a tricycle with its encoders (`localise`), keypoints of a scan (`falko`).
//!
//! # The house
//!
//! Rooms, floor by floor; a room imports only from floors below its own:
//!
//! | floor | rooms |
//! |---|---|
//! | 7 | [`record`] |
//! | 6 | [`localizer`] |
//! | 5 | [`integrity`] |
//! | 4 | [`calibration`], [`contours`], [`filter`], [`relocalization`], [`state`] |
//! | 3 | [`maps`], [`odometry`], [`sensing`] |
//! | 2 | [`measurement`] |
//! | 1 | [`arrays`], [`geometry`], [`order`] |
//!
//! Frames: W world, R robot (logical point: the projection of the driving wheel's centre on the rear axle), S sensor.
//! Units: SI and radians. Poses and covariances are f64, scans and features f32.
//!
//! Equation numbers with `K` are those of F. Kallasi, "FALKO features and AGV localisation" (thesis, Parma, 2016).
#![no_std]
#![forbid(unsafe_code)]

pub mod arrays;
pub mod calibration;
pub mod contours;
pub mod filter;
pub mod geometry;
pub mod integrity;
pub mod localizer;
pub mod maps;
pub mod measurement;
pub mod odometry;
pub mod order;
pub mod record;
pub mod relocalization;
pub mod sensing;
pub mod sources;
pub mod state;
