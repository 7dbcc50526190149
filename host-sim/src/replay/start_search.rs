//! Where a drive begins, found as the controller finds it: by the reflectors that are seen.

use agv_core::contours::{KeptMap, Submap};
use agv_core::localizer::{ContourStartFinder, PoseFix, StartFinder, StartRule, StartState};
use agv_core::maps::{FixedMap, Landmark, LandmarkKind, MapError};
use agv_core::relocalization::{ReflectorIndex, RelocalizationParameters};
use agv_core::sources::Places;

use crate::recording::Recording;

/// Most reflectors of a map.
const REFLECTORS: usize = 1000;

/// Why a vehicle does not find itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StartSearchError {
    /// The map does not fit.
    #[error("the map has more than {REFLECTORS} reflectors, or one that is not finite")]
    Map,
    /// The map is empty.
    #[error("the map has no reflectors")]
    NoReflectors,
    /// Two poses fit equally, all along.
    #[error("two poses fit what is seen equally")]
    Ambiguous,
    /// There is nothing to tell it by.
    #[error("too little is seen that the map has")]
    TooFew,
    /// The map does not explain what is seen.
    #[error("no place of the map looks like what is seen")]
    Unknown,
}

impl From<MapError> for StartSearchError {
    fn from(_: MapError) -> Self {
        Self::Map
    }
}

/// The first pose that the vehicle finds by itself, and the number of the event after which it has it. Poses that it is
/// told are not looked at.
///
/// # Errors
/// See [`StartSearchError`].
pub fn find_start(recording: &Recording) -> Result<(usize, PoseFix), StartSearchError> {
    let is_reflector = |landmark: &&Landmark| landmark.kind == LandmarkKind::Reflector;
    let reflectors: Vec<Landmark> = recording.landmarks.iter().filter(is_reflector).copied().collect();
    if reflectors.is_empty() {
        return Err(StartSearchError::NoReflectors);
    }
    let (mut map, mut index) = (Box::new(FixedMap::<REFLECTORS>::new()), Box::new(ReflectorIndex::<4096>::new()));
    map.extend(&reflectors)?;
    index.build(map.view());
    let reflectors = index.of(map.view());
    let mut finder = Box::new(StartFinder::<64>::new(
        recording.parameters,
        RelocalizationParameters::default(),
        StartRule::default(),
    ));
    let mut reason = StartSearchError::TooFew;
    for (number, event) in recording.events.iter().enumerate().filter(|(_, event)| !event.is_told()) {
        finder.handle(&event.view(), &reflectors);
        match finder.search(&reflectors, u32::MAX) {
            StartState::Found(fix) => return Ok((number, fix)),
            StartState::Ambiguous(..) => reason = StartSearchError::Ambiguous,
            StartState::Unknown => reason = StartSearchError::Unknown,
            StartState::TooFew => reason = StartSearchError::TooFew,
            StartState::Waiting | StartState::Searching | StartState::Unconfirmed(_) => {}
        }
    }
    Err(reason)
}

/// What finds a start in a map of contours, of the capacities of the vehicle.
pub type ContourFinder<'m> = ContourStartFinder<Places<'m, 400, CONTOUR_POINTS>>;

/// The room that it needs.
pub type ContourRoom = Submap<CONTOUR_POINTS>;

/// Points around a place at the most.
const CONTOUR_POINTS: usize = 6144;

/// The same by a map of contours.
///
/// # Errors
/// See [`StartSearchError`].
pub fn find_start_by_contours(recording: &Recording, map: &KeptMap<'_>) -> Result<(usize, PoseFix), StartSearchError> {
    let mut finder = Box::new(ContourFinder::new(recording.parameters));
    let mut room: Box<ContourRoom> = Box::default();
    let mut reason = StartSearchError::TooFew;
    for (number, event) in recording.events.iter().enumerate().filter(|(_, event)| !event.is_told()) {
        finder.handle(&event.view());
        match finder.search(map, &mut room, u32::MAX) {
            StartState::Found(fix) => return Ok((number, fix)),
            StartState::Ambiguous(..) => reason = StartSearchError::Ambiguous,
            StartState::Unknown => reason = StartSearchError::Unknown,
            StartState::TooFew => reason = StartSearchError::TooFew,
            StartState::Waiting | StartState::Searching | StartState::Unconfirmed(_) => {}
        }
    }
    Err(reason)
}
