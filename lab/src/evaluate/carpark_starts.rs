//! The car park without a start pose: the vehicle is switched on at random moments of the drive and finds itself by its
//! reflectors.

use std::path::Path;

use agv_core::geometry::difference;
use agv_core::localizer::{Localizer, Mode, PoseOutput, StartFinder, StartRule, StartState};
use agv_core::maps::{FixedMap, Landmark, LandmarkKind};
use agv_core::relocalization::{IndexedReflectors, ReflectorIndex, RelocalizationParameters};
use serde::Serialize;

use super::carpark::{CarparkError, Noise, parameters};
use agv_host_sim::accuracy::truth_at;
use agv_host_sim::import::carpark;
use agv_host_sim::recording::{RecordedEvent, Recording, Truth};
use agv_host_sim::simulate::random::{Random, Stream};

/// One start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Start {
    /// When the vehicle was switched on, s of the recording.
    pub at_s: f64,
    /// Time in motion until it had a pose, s; none if it had none in time.
    pub found_after_s: Option<f64>,
    /// Distance of the laser from the batch solution when it had found itself, m.
    pub position_error_m: Option<f64>,
    /// Difference of the heading from that of the batch solution then, deg.
    pub heading_error_deg: Option<f64>,
}

/// What came of all starts.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Number of starts.
    pub starts: usize,
    /// Starts that were right within [`LONGEST`] of motion.
    pub right: usize,
    /// Starts after which the vehicle still said that it is not localised.
    pub not_localised: usize,
    /// Starts with a wrong pose.
    pub wrong: usize,
    /// Each start.
    pub each: Vec<Start>,
}

/// Time in motion after which a start is judged, s.
pub const LONGEST: f64 = 3.0;

/// A pose with larger errors of position (m) or heading (deg) is wrong.
const RIGHT: (f64, f64) = (0.5, 5.0);

/// Slower than this the vehicle stands, m/s.
const STANDING: f64 = 0.05;

/// No start is so near to the end of the recording, s.
const LAST_START: f64 = 15.0;

/// Switches the vehicle on at `starts` random moments.
///
/// # Errors
/// See [`CarparkError`].
pub fn run(folder: &Path, starts: usize, seed: u64) -> Result<Outcome, CarparkError> {
    let mut recording = carpark::read(folder, &carpark::WINDOW)?;
    recording.parameters = parameters(&recording.parameters, Noise::Nominal);
    let truth = carpark::read_batch_solution(folder)?;
    let is_reflector = |landmark: &&Landmark| landmark.kind == LandmarkKind::Reflector;
    let reflectors: Vec<Landmark> = recording.landmarks.iter().filter(is_reflector).copied().collect();
    let (mut map, mut index) = (FixedMap::<32>::new(), Box::new(ReflectorIndex::<4096>::new()));
    // The survey has fifteen reflectors, all finite: reading it has made sure.
    let _ = map.extend(&reflectors);
    index.build(map.view());
    let map = index.of(map.view());
    let mut random = Random::new(seed, Stream::Kidnapping);
    let window = (*carpark::WINDOW.start(), *carpark::WINDOW.end() - LAST_START);
    let mut times: Vec<f64> = (0..starts).map(|_| random.between(window.0, window.1)).collect();
    times.sort_by(f64::total_cmp);
    let each: Vec<Start> = times.into_iter().map(|time| start(&recording, &truth, &map, time)).collect();
    let is_right = |start: &&Start| {
        start.position_error_m.is_some_and(|error| error < RIGHT.0)
            && start.heading_error_deg.is_some_and(|error| error.abs() < RIGHT.1)
    };
    let right = each.iter().filter(is_right).count();
    let not_localised = each.iter().filter(|start| start.found_after_s.is_none()).count();
    Ok(Outcome { starts: each.len(), right, not_localised, wrong: each.len() - right - not_localised, each })
}

fn start(recording: &Recording, truth: &[Truth], map: &IndexedReflectors, at: f64) -> Start {
    let mut localizer: Box<Localizer> = Box::new(Localizer::new(recording.parameters));
    // The map of the recording fits the localiser, as the experiment beside this one shows.
    let _ = localizer.add_landmarks(&recording.landmarks);
    let mut finder = Box::new(StartFinder::<64>::new(
        recording.parameters,
        RelocalizationParameters::default(),
        StartRule::default(),
    ));
    let mut start = Start { at_s: at, found_after_s: None, position_error_m: None, heading_error_deg: None };
    let (mut moving, mut last) = (0.0, None);
    for event in recording.events.iter().filter(|event| event.time().is_some_and(|time| time.seconds() >= at)) {
        if let RecordedEvent::Speed(sample) = event {
            if let Some(before) = last
                && sample.speed.abs() > STANDING
            {
                moving += sample.time.since(before);
            }
            last = Some(sample.time);
        }
        if moving > LONGEST {
            break;
        }
        localizer.handle(&event.view());
        finder.handle(&event.view(), map);
        if let StartState::Found(fix) = finder.search(map, u32::MAX) {
            let pose = localizer.handle(&agv_core::localizer::Event::SetPose(fix)).pose;
            judge(&mut start, &pose, truth, recording);
            start.found_after_s = Some(moving);
            break;
        }
    }
    start
}

fn judge(start: &mut Start, pose: &PoseOutput, truth: &[Truth], recording: &Recording) {
    if pose.mode == Mode::NotLocalised {
        return;
    }
    let laser = recording.parameters.lasers.first();
    if let Some(expected) = truth_at(truth, pose.time) {
        let error = pose.pose.compose(laser).position() - expected.compose(laser).position();
        start.position_error_m = Some(error.norm());
        start.heading_error_deg = Some(difference(pose.pose.theta, expected.theta).to_degrees());
    }
}
