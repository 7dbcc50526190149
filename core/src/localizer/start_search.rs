//! The search for the pose of a vehicle that does not know where it is, in slices between events.

use super::{ContourStartFinder, Event, Mode, Parameters, PoseFix, StartFinder, StartRule, StartState};
use crate::maps::MapView;
use crate::relocalization::{ReflectorIndex, RelocalizationParameters};
use crate::sources::{FindPlaces, NoPlaces};
use crate::state::Relocalization;

/// Words of the rough picture of where reflectors are: 4 kB, cells of about half a metre in a hall of 100 m x 60 m.
const WORDS: usize = 1024;

/// Effort of a slice: about 0.1 ms at 480 MHz, so that events do not wait.
const SLICE: u32 = 2_000;

/// Effort that is spent in the time of one revolution at most: about 40 million instructions, 80 ms at 480 MHz. A search
/// that needs more goes on in the next revolution.
pub const EFFORT_A_REVOLUTION: u32 = 1_600_000;

/// Effort of a slice among contours: as long as one among reflectors. The last step may take 0.15 ms more.
pub const CONTOUR_SLICE: u32 = 1_500;

/// The same at most in the time of one revolution: see [`EFFORT_A_REVOLUTION`].
pub const CONTOUR_EFFORT_A_REVOLUTION: u32 = 2_400_000;

/// Searches among the reflectors of the map, and in a map of contours, while the localiser has no pose.
#[derive(Clone, Debug)]
pub struct StartSearch<P: FindPlaces = NoPlaces> {
    finder: StartFinder,
    index: ReflectorIndex<WORDS>,
    has_index: bool,
    is_wanted: bool,
    /// What is left of the effort of this revolution.
    left: u32,
    contours: ContourStartFinder<P>,
    /// The same among contours.
    contours_left: u32,
    state: Relocalization,
}

impl<P: FindPlaces> StartSearch<P> {
    /// A search that has seen nothing.
    #[must_use]
    #[inline(always)]
    pub fn new(parameters: &Parameters, is_wanted: bool) -> Self {
        Self {
            finder: StartFinder::new(*parameters, RelocalizationParameters::default(), StartRule::default()),
            index: ReflectorIndex::new(),
            has_index: false,
            is_wanted,
            left: 0,
            contours: ContourStartFinder::new(*parameters),
            contours_left: 0,
            state: Relocalization::Idle,
        }
    }

    /// The localiser has other maps.
    pub fn forget_maps(&mut self) {
        self.has_index = false;
        self.contours.forget_map();
    }

    /// How far it has come.
    #[must_use]
    pub fn state(&self) -> Relocalization {
        self.state
    }

    /// Takes an event that the localiser has taken; `mode` is what it has said, `reflectors` is its map.
    pub fn handle(&mut self, event: &Event, mode: Mode, reflectors: MapView) {
        let is_lost = matches!(mode, Mode::NotLocalised | Mode::Lost);
        if self.is_wanted && is_lost {
            if !self.has_index {
                self.index.build(reflectors);
                self.has_index = true;
            }
            let reflectors = self.index.of(reflectors);
            self.finder.handle(event, &reflectors);
            if matches!(event, Event::Reflectors(_) | Event::Scan(_)) {
                self.left = EFFORT_A_REVOLUTION;
            }
            if P::IS_THERE {
                self.contours.handle(event);
                if matches!(event, Event::Scan(_)) {
                    self.contours_left = CONTOUR_EFFORT_A_REVOLUTION;
                }
            }
        } else {
            (self.left, self.contours_left) = (0, 0);
            if self.state != Relocalization::Idle {
                self.finder.forget();
                self.contours.forget();
                self.state = Relocalization::Idle;
            }
        }
    }

    /// Whether effort is left for the present revolution.
    #[must_use]
    pub const fn has_time(&self) -> bool {
        self.left > 0 || self.contours_left > 0
    }

    /// Searches for a while. Whether there is more to do, and the pose if it is found. The map of contours, if there is one, is looked at
    /// where the reflectors have not told it, with the room that is lent for it.
    pub fn advance(
        &mut self,
        reflectors: MapView,
        contours: Option<(P::Map, &mut P::Room)>,
    ) -> (bool, Option<PoseFix>) {
        let has_reflectors = !reflectors.landmarks().is_empty();
        if has_reflectors || contours.is_none() {
            let (is_busy, found) = self.advance_among_reflectors(reflectors);
            if found.is_some() || is_busy {
                return (is_busy, found);
            }
        }
        match contours {
            Some((map, room)) => self.advance_among_contours(&map, room, !has_reflectors),
            None => (false, None),
        }
    }

    fn advance_among_reflectors(&mut self, reflectors: MapView) -> (bool, Option<PoseFix>) {
        if self.left == 0 {
            return (false, None);
        }
        self.left = self.left.saturating_sub(SLICE);
        let reflectors = self.index.of(reflectors);
        let state = self.finder.search(&reflectors, SLICE);
        self.state = told(&state, self.state);
        match state {
            StartState::Found(fix) => (true, Some(fix)),
            state => (state == StartState::Searching, None),
        }
    }

    /// What contours say is told unless reflectors are there to tell it.
    fn advance_among_contours(&mut self, map: &P::Map, room: &mut P::Room, is_told: bool) -> (bool, Option<PoseFix>) {
        if self.contours_left == 0 {
            return (false, None);
        }
        self.contours_left = self.contours_left.saturating_sub(CONTOUR_SLICE);
        let state = self.contours.search(map, room, CONTOUR_SLICE);
        if is_told {
            self.state = told(&state, self.state);
        }
        match state {
            StartState::Found(fix) => (true, Some(fix)),
            state => (state == StartState::Searching, None),
        }
    }
}

/// What is said of a search. While it searches anew, the last answer stands.
fn told(state: &StartState, before: Relocalization) -> Relocalization {
    match (state, before) {
        (StartState::Searching, Relocalization::Idle) => Relocalization::Searching,
        (StartState::Searching | StartState::Waiting, before) => before,
        (StartState::Found(_) | StartState::Unconfirmed(_), _) => Relocalization::Searching,
        (StartState::Ambiguous(..), _) => Relocalization::Ambiguous,
        (StartState::TooFew, _) => Relocalization::TooFew,
        (StartState::Unknown, _) => Relocalization::Unknown,
    }
}
