//! The core against a recording.

mod comparison;
mod logged_predictor;
mod publishing;
mod start_search;

pub use comparison::{Comparison, Comparisons, compare};
pub use logged_predictor::{Answer, LoggedPredictor};
pub use publishing::compare_published;
pub use start_search::{ContourFinder, ContourRoom, StartSearchError, find_start, find_start_by_contours};

use std::time::{Duration, Instant};

use agv_core::contours::KeptMap;
use agv_core::localizer::{ContourCapacities, LandmarkUse, Localizer, PoseOutput, PredictionState, StateError};
use agv_core::maps::MapError;
use agv_core::measurement::Time;
use agv_core::record::Output;
use serde::Serialize;
use thiserror::Error;

use crate::recording::Recording;

/// What the localiser said of a whole recording.
#[derive(Clone, Debug, Default)]
pub struct Replay {
    /// The pose, and what was known of the motion, before the first event.
    pub start: Option<(PoseOutput, PredictionState)>,
    /// The pose after each event.
    pub poses: Vec<PoseOutput>,
    /// What had been learnt of the motion after each event.
    pub predictions: Vec<PredictionState>,
    /// What became of each observation, event by event.
    pub uses: Vec<LandmarkUse>,
    /// For each event, how many observations there were up to and including it.
    pub use_ends: Vec<usize>,
    /// Landmarks that were found while driving, as they are at the end.
    pub dynamic_landmarks: Vec<[f64; 2]>,
    /// Scans that were laid onto contours.
    pub contours: ContourCounts,
    /// Processor time that the core took.
    pub elapsed: Duration,
}

/// What became of the scans that were laid onto contours: those of a kept map, or of the distance behind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ContourCounts {
    /// Scans.
    pub scans: usize,
    /// Those that corrected the pose.
    pub matched: usize,
}

impl Replay {
    /// What the localiser answered to the event of that index.
    #[must_use]
    pub fn output(&self, event: usize) -> Option<Output<'_>> {
        let end = *self.use_ends.get(event)?;
        let start = event.checked_sub(1).map_or(0, |before| self.use_ends[before]);
        Some(Output { pose: *self.poses.get(event)?, uses: &self.uses[start..end] })
    }
}

/// Why a recording cannot be replayed.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum ReplayError {
    /// The map is larger than the localiser's memory.
    #[error("the map of the recording has more landmarks than the localiser has room for")]
    MapTooLarge,
    /// A landmark is not finite.
    #[error("the map of the recording holds a position that is not a number")]
    MapNotFinite,
    /// It begins in the middle of a drive, and what was before is not understood.
    #[error("the log begins in the middle of a drive, and {0}; --start replays it without that state")]
    State(StateError),
}

/// Feeds all events of a recording to a new localiser. `progress` is called with the number of events done.
///
/// # Errors
/// [`ReplayError`] if the recording's map cannot be used.
pub fn replay(recording: &Recording, progress: impl FnMut(usize)) -> Result<Replay, ReplayError> {
    replay_in(recording, None, progress)
}

/// The same with a map of contours beside the landmarks, if there is one.
///
/// # Errors
/// [`ReplayError`] if a map cannot be used.
pub fn replay_in(
    recording: &Recording,
    contours: Option<KeptMap<'_>>,
    mut progress: impl FnMut(usize),
) -> Result<Replay, ReplayError> {
    let mut localizer: Box<Localizer<ContourCapacities>> = Box::new(Localizer::new(recording.parameters));
    localizer.set_contours(contours);
    localizer.add_landmarks(&recording.landmarks).map_err(|error| match error {
        MapError::Full => ReplayError::MapTooLarge,
        MapError::NotFinite => ReplayError::MapNotFinite,
    })?;
    if let Some(state) = &recording.state {
        localizer.restore_state(&state.localizer).map_err(ReplayError::State)?;
    }
    let start = Some((localizer.outputs().pose, localizer.prediction_state()));
    let mut replay = Replay { start, poses: Vec::with_capacity(recording.events.len()), ..Replay::default() };
    let mut told: Option<Time> = None;
    let start = Instant::now();
    for (index, event) in recording.events.iter().enumerate() {
        let outputs = localizer.handle(&event.view());
        let status = &outputs.sources.contours;
        if status.told != told {
            told = status.told;
            replay.contours.scans += 1;
            replay.contours.matched += usize::from(status.accepted > 0);
        }
        replay.uses.extend_from_slice(&outputs.uses);
        replay.use_ends.push(replay.uses.len());
        replay.poses.push(outputs.pose);
        replay.predictions.push(localizer.prediction_state());
        if index % 1024 == 0 {
            progress(index);
        }
    }
    replay.elapsed = start.elapsed();
    replay.dynamic_landmarks = localizer
        .dynamic_landmarks()
        .iter()
        .map(|landmark| landmark.position)
        .chain(localizer.state_landmarks().map(|(_, position)| position))
        .map(Into::into)
        .collect();
    progress(recording.events.len());
    Ok(replay)
}
