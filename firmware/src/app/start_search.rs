//! The search for the pose of a vehicle that does not know where it is, in slices between events.

use agv_core::localizer::{Event, Parameters, PoseFix, StartFinder, StartState};
use agv_core::places::{IndexedReflectors, ReflectorIndex, RelocalizationParameters};
use agv_core::state::Mode;
use agv_core::wire::can::controller;

use super::room::Localizer;

/// Words of the rough picture of where reflectors are: 4 kB, cells of about half a metre in a hall of 100 m x 60 m.
const WORDS: usize = 1024;

/// Effort of a slice: about 0.1 ms at 480 MHz, so that events do not wait.
const SLICE: u32 = 2_000;

/// Effort that is spent in the time of one revolution at most: about 40 million instructions, 80 ms at 480 MHz. A search
/// that needs more goes on in the next revolution.
pub const EFFORT_A_REVOLUTION: u32 = 1_600_000;

/// Searches among the reflectors of the map while the localiser has no pose.
pub struct StartSearch {
    finder: StartFinder,
    index: ReflectorIndex<WORDS>,
    is_wanted: bool,
    /// What is left of the effort of this revolution.
    left: u32,
    state: controller::StartSearch,
}

impl StartSearch {
    /// A search that has seen nothing.
    #[must_use]
    #[inline(always)]
    pub fn new(parameters: &Parameters, is_wanted: bool) -> Self {
        Self {
            finder: StartFinder::new(*parameters, RelocalizationParameters::default()),
            index: ReflectorIndex::new(),
            is_wanted,
            left: 0,
            state: controller::StartSearch::Idle,
        }
    }

    /// Makes ready for the reflectors that the localiser has.
    pub fn index(&mut self, localizer: &Localizer) {
        self.index.build(localizer.reflectors());
    }

    /// How far it has come.
    #[must_use]
    pub fn state(&self) -> controller::StartSearch {
        self.state
    }

    /// Takes an event that the localiser has taken.
    pub fn handle(&mut self, localizer: &Localizer, event: &Event) {
        let is_lost = matches!(localizer.outputs().pose.mode, Mode::NotLocalised | Mode::Lost);
        if self.is_wanted && is_lost {
            let reflectors = IndexedReflectors { map: localizer.reflectors(), index: &self.index };
            self.finder.handle(event, &reflectors);
            if matches!(event, Event::Reflectors(_) | Event::Scan(_)) {
                self.left = EFFORT_A_REVOLUTION;
            }
        } else if self.state != controller::StartSearch::Idle {
            self.finder.forget();
            self.state = controller::StartSearch::Idle;
        }
    }

    /// Searches for a while. Whether there is more to do, and the pose if it is found.
    pub fn advance(&mut self, localizer: &Localizer) -> (bool, Option<PoseFix>) {
        if self.left == 0 {
            return (false, None);
        }
        self.left = self.left.saturating_sub(SLICE);
        let reflectors = IndexedReflectors { map: localizer.reflectors(), index: &self.index };
        let state = self.finder.search(&reflectors, SLICE);
        // While it searches anew, the last answer stands.
        self.state = match (&state, self.state) {
            (StartState::Searching, controller::StartSearch::Idle) => controller::StartSearch::Searching,
            (StartState::Searching | StartState::Waiting, before) => before,
            (StartState::Found(_), _) => controller::StartSearch::Searching,
            (StartState::Ambiguous(..), _) => controller::StartSearch::Ambiguous,
            (StartState::TooFew, _) => controller::StartSearch::TooFew,
            (StartState::Unknown, _) => controller::StartSearch::Unknown,
        };
        match state {
            StartState::Found(fix) => (true, Some(fix)),
            state => (state == StartState::Searching, None),
        }
    }
}
