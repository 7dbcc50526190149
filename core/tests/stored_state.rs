//! The state of a localiser as bytes, with what scans tell: features, surfaces, a map in the state; and bytes that are none.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is how a test fails")]

use std::f64::consts::{PI, TAU};

use agv_core::contours::KeptMap;
use agv_core::geometry::{Pose, Twist};
use agv_core::localizer::{
    Capacities, CapacitiesOf, Event, Localizer, Mode, OutputPredictor, Parameters, PoseFix, STATE_VERSION, SlamSlots,
    StateError,
};
use agv_core::maps::{Landmark, LandmarkKind};
use agv_core::measurement::{LaserId, PoseIncrement, ReflectorObservation, Reflectors, Scan, Time};
use agv_core::odometry::Vehicle;
use agv_core::sources::Contours;
use proptest::prelude::*;

use super::support::kept_map::kept_map;
use super::support::replaced::{Replaced, state_of};
use super::support::walls::{Noise, Walls, corridor, range, room};

const BEAMS: usize = 720;
type Small = CapacitiesOf<BEAMS, 32, 32, 32, SlamSlots, Contours<'static, 400, 4096>>;

const LASER: Pose = Pose { x: 0.4, y: 0.05, theta: 0.2 };

/// Samples of the odometry in a revolution, and the time between them, us.
const SAMPLES: u64 = 12;
const INTERVAL: u64 = 10_000;
const REVOLUTION: f64 = (SAMPLES * INTERVAL) as f64 * 1e-6;

fn parameters() -> Parameters {
    Parameters::new(Vehicle::Increments, LASER)
}

/// Reflectors along the walls of the room.
fn reflectors() -> Vec<Landmark> {
    let places = [(-1.9, 0.3), (1.2, -2.9), (4.4, -2.9), (9.9, 0.7), (9.9, 4.6), (5.5, 5.9), (0.4, 4.9), (-1.9, 3.1)];
    (0..).zip(places).map(|(id, (x, y))| Landmark::reflector(id, agv_core::geometry::Point::new(x, y), 0.002)).collect()
}

/// The corners of the room, each as a corner.
fn features() -> Vec<Landmark> {
    let corner = |(id, wall): (u16, [f64; 4])| Landmark {
        kind: LandmarkKind::Corner,
        ..Landmark::reflector(id, agv_core::geometry::Point::new(wall[0], wall[1]), 0.005)
    };
    (0..).zip(room()).map(corner).collect()
}

/// Where a vehicle drives, and with what.
struct Scene {
    parameters: Parameters,
    walls: Walls,
    landmarks: Vec<Landmark>,
    map: Option<KeptMap<'static>>,
    /// Whether reflectors are in sight in a revolution.
    sees: fn(usize) -> bool,
    has_scans: bool,
}

impl Scene {
    fn new(parameters: Parameters) -> Self {
        Self { parameters, walls: room(), landmarks: reflectors(), map: None, sees: |_| true, has_scans: true }
    }

    fn localizer(&self) -> Box<Localizer<Small>> {
        let mut localizer: Box<Localizer<Small>> = Box::new(Localizer::new(self.parameters));
        localizer.set_contours(self.map);
        localizer.add_landmarks(&self.landmarks).unwrap();
        localizer
    }

    /// Lets `handle` take what happens in so many revolutions. The vehicle stands, is told where it is in the third revolution, and drives
    /// round.
    fn happen(&self, revolutions: usize, seed: u64, mut handle: impl FnMut(&Event)) {
        let mut noise = Noise(0x2545_f491_4f6c_dd1d ^ seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        let mut truth = Pose::new(0.5, 0.1, 0.05);
        let mut sample = 0;
        let time = |sample: u64| Time::from_micros(1_000_000 + sample * INTERVAL);
        for revolution in 0..revolutions {
            let (start, mut poses) = (time(sample), vec![truth]);
            let (speed, turn) = if revolution < 5 { (0.0, 0.0) } else { (0.8, 0.25) };
            let seconds = INTERVAL as f64 * 1e-6;
            for _ in 0..SAMPLES {
                sample += 1;
                let step = Pose::exp(&Twist { x: speed * seconds, y: 0.0, theta: turn * seconds });
                truth = truth.compose(&step);
                poses.push(truth);
                let root = step.x.abs().sqrt();
                let mut slip = |deviation: f64| deviation * root * noise.normal();
                let displacement = Pose::new(step.x + slip(0.002), step.y, step.theta + slip(5e-4));
                handle(&Event::Increment(PoseIncrement { time: time(sample), displacement }));
            }
            if revolution == 2 {
                let fix =
                    PoseFix { time: time(sample), pose: truth, position_deviation: 0.01, heading_deviation: 0.003 };
                handle(&Event::SetPose(fix));
            }
            let laser = |share: f64| {
                let place = share * SAMPLES as f64;
                let before = (place as usize).min(SAMPLES as usize - 1);
                let since = poses[before].between(&poses[before + 1]).fraction(place - before as f64);
                poses[before].compose(&since).compose(&LASER)
            };
            if (self.sees)(revolution) {
                let seen = |(index, landmark): (usize, Landmark)| {
                    let share = index as f64 / 8.0;
                    let seen = laser(share).inverse_transform(&landmark.position());
                    ReflectorObservation {
                        time: start.offset(share * REVOLUTION),
                        range: (seen.norm() + 0.004 * noise.normal()) as f32,
                        bearing: (seen.y.atan2(seen.x) + 5e-4 * noise.normal()) as f32,
                    }
                };
                let seen: Vec<_> = reflectors().into_iter().enumerate().map(seen).collect();
                handle(&Event::Reflectors(Reflectors::of_first(&seen)));
            }
            if self.has_scans {
                let beam = |beam: usize| {
                    let at = laser(beam as f64 / BEAMS as f64);
                    let bearing = beam as f64 * TAU / BEAMS as f64 - PI;
                    range(&self.walls, &Pose { theta: at.theta + bearing, ..at }, &mut noise)
                };
                let ranges: Vec<f32> = (0..BEAMS).map(beam).collect();
                handle(&Event::Scan(Scan {
                    laser: LaserId::FIRST,
                    start,
                    beam_interval: REVOLUTION / BEAMS as f64,
                    first_bearing: -PI,
                    bearing_step: TAU / BEAMS as f64,
                    ranges: &ranges,
                    intensities: &[],
                }));
            }
        }
    }

    /// Drives with replacements, and gives the localiser as it is at the end.
    fn go_on(&self, revolutions: usize, every: f64, seed: u64) -> Box<Localizer<Small>> {
        let mut both = Replaced::new(|| self.localizer(), every, seed);
        self.happen(revolutions, seed, |event| _ = both.handle(event));
        both.finish();
        let mut localizer = self.localizer();
        self.happen(revolutions, seed, |event| _ = localizer.handle(event));
        localizer
    }

    /// The state after so many revolutions.
    fn state(&self, revolutions: usize) -> Vec<u8> {
        let mut localizer = self.localizer();
        self.happen(revolutions, 1, |event| _ = localizer.handle(event));
        state_of(&localizer)
    }
}

/// What can be used by one vehicle.
fn scenes() -> [(&'static str, Scene); 7] {
    let mut featured = parameters();
    (featured.maps.features, featured.maps.dynamic) = (true, true);
    let mut mapping = parameters();
    mapping.maps.slam = true;
    let mut mapping_alone = mapping;
    mapping_alone.sources.contours = false;
    let none = Vec::new();
    [
        ("reflectors", Scene { has_scans: false, ..Scene::new(parameters()) }),
        ("surfaces where no landmark is", Scene { sees: |revolution| revolution < 12, ..Scene::new(parameters()) }),
        (
            "features",
            Scene {
                landmarks: [reflectors(), features()].concat(),
                sees: |revolution| revolution % 4 == 0,
                ..Scene::new(featured)
            },
        ),
        (
            "a kept map",
            Scene { map: Some(kept_map(&room(), &Pose::default())), sees: |_| false, ..Scene::new(parameters()) },
        ),
        (
            "a kept map that lacks a nook",
            Scene { map: Some(kept_map(&room()[..6].to_vec(), &Pose::default())), ..Scene::new(parameters()) },
        ),
        ("mapping", Scene { sees: |revolution| revolution % 2 == 0, landmarks: none.clone(), ..Scene::new(mapping) }),
        ("mapping by features", Scene { landmarks: none, sees: |_| false, ..Scene::new(mapping_alone) }),
    ]
}

#[test]
fn whatever_it_sees_by_it_goes_on_from_its_stored_state() {
    for (seed, (name, scene)) in (1..).zip(scenes()) {
        let localizer = scene.go_on(60, 12.0, seed);
        let mode = localizer.outputs().pose.mode;
        assert!(!matches!(mode, Mode::NotLocalised | Mode::Lost), "{name}: {mode:?}");
        let (mut room, start) = (vec![0; 1 << 20], std::time::Instant::now());
        let length = localizer.save_state(&mut room).unwrap();
        println!("{name}: {length} bytes in {} us, {mode:?}", start.elapsed().as_micros());
    }
    let corridor = Scene { walls: corridor(Some(7.0)), sees: |_| false, ..Scene::new(parameters()) };
    corridor.go_on(40, 6.0, 9);
}

#[test]
fn a_state_is_refused_by_who_cannot_go_on_with_it() {
    let scene = Scene::new(parameters());
    let state = scene.state(8);
    let mut localizer = scene.localizer();
    let mut other = state.clone();
    other[0] += 1;
    assert_eq!(localizer.restore_state(&other), Err(StateError::Version(u32::from(other[0]))));
    for length in [0, 1, state.len() / 2, state.len() - 1] {
        assert!(localizer.restore_state(&state[..length]).is_err(), "{length}");
    }
    let longer = [state.as_slice(), &[0]].concat();
    assert_eq!(localizer.restore_state(&longer), Err(StateError::Content));
    let mut less: Box<Localizer<CapacitiesOf<360, 32, 32, 32>>> = Box::new(Localizer::new(parameters()));
    assert!(matches!(less.restore_state(&state), Err(StateError::Capacities(_))));
    assert_eq!(localizer.save_state(&mut vec![0; state.len() - 1]), Err(StateError::Room));
    assert_eq!(localizer.restore_state(&state), Ok(()));
    assert_eq!(state_of(&localizer), state);
}

/// Bytes of the state of a localiser that has heard nothing. Where they change, the version of the state must as well.
#[test]
fn the_bytes_of_a_state_are_those_of_its_version() {
    let length = |parameters: Parameters| {
        let localizer: Box<Localizer> = Box::new(Localizer::new(parameters));
        state_of(&localizer).len()
    };
    let mut mapping = parameters();
    mapping.maps.slam = true;
    mapping.gyro.is_fitted = true;
    assert_eq!((STATE_VERSION, length(parameters()), length(mapping)), (1, 6956, 139_124));
}

#[test]
fn a_predictor_goes_on_from_its_stored_state() {
    let scene = Scene { has_scans: false, ..Scene::new(parameters()) };
    let mut localizer = scene.localizer();
    let mut alone: Box<OutputPredictor> = Box::new(OutputPredictor::new(&scene.parameters));
    let mut again = alone.clone();
    let (mut room, mut events) = (vec![0; 1 << 16], 0);
    scene.happen(12, 1, |event| {
        events += 1;
        if events % 5 == 0 {
            let length = again.save_state(&mut room).unwrap();
            *again = OutputPredictor::new(&scene.parameters);
            assert_eq!(again.restore_state(&room[..length]), Ok(()));
            assert!(again.restore_state(&room[..length - 1]).is_err());
        }
        localizer.handle(event);
        for predictor in [&mut alone, &mut again] {
            if let Event::Increment(increment) = event {
                predictor.increment(increment);
            }
            if events % 7 == 0 {
                predictor.update(&localizer.outputs().pose, &localizer.prediction_state());
            }
        }
        assert_eq!(format!("{alone:?}"), format!("{again:?}"), "{events}");
    });
}

fn hurt<C: Capacities>(localizer: &mut Localizer<C>, scene: &Scene, bytes: &[u8]) {
    if localizer.restore_state(bytes).is_ok() {
        scene.happen(4, 2, |event| _ = localizer.handle(event));
    }
}

proptest! {
    #[test]
    fn no_bytes_hurt(
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12),
        number in 0_usize..7,
    ) {
        let (_, scene) = scenes().into_iter().nth(number).unwrap();
        let mut state = scene.state(12);
        for (place, value) in &changes {
            let place = 16 + place.index(state.len() - 16);
            state[place] = *value;
        }
        hurt(&mut scene.localizer(), &scene, &state);
    }
}
