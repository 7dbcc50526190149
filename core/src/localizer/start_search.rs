//! The search for the pose of a vehicle that does not know where it is, in slices between events.

use super::{Event, Mode, Parameters, PoseFix, StartFinder, StartRule, StartState};
use crate::maps::MapView;
use crate::relocalization::{ReflectorIndex, RelocalizationParameters};
use crate::state::Relocalization;

/// Words of the rough picture of where reflectors are: 4 kB, cells of about half a metre in a hall of 100 m x 60 m.
const WORDS: usize = 1024;

/// Effort of a slice: about 0.1 ms at 480 MHz, so that events do not wait.
const SLICE: u32 = 2_000;

/// Effort that is spent in the time of one revolution at most: about 40 million instructions, 80 ms at 480 MHz. A search
/// that needs more goes on in the next revolution.
pub const EFFORT_A_REVOLUTION: u32 = 1_600_000;

/// Searches among the reflectors of the map while the localiser has no pose.
#[derive(Clone, Debug)]
pub struct StartSearch {
    finder: StartFinder,
    index: ReflectorIndex<WORDS>,
    is_wanted: bool,
    /// What is left of the effort of this revolution.
    left: u32,
    state: Relocalization,
}

impl StartSearch {
    /// A search that has seen nothing.
    #[must_use]
    #[inline(always)]
    pub fn new(parameters: &Parameters, is_wanted: bool) -> Self {
        Self {
            finder: StartFinder::new(*parameters, RelocalizationParameters::default(), StartRule::default()),
            index: ReflectorIndex::new(),
            is_wanted,
            left: 0,
            state: Relocalization::Idle,
        }
    }

    /// Makes ready for the reflectors that the localiser has.
    pub fn index(&mut self, reflectors: MapView) {
        self.index.build(reflectors);
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
            let reflectors = self.index.of(reflectors);
            self.finder.handle(event, &reflectors);
            if matches!(event, Event::Reflectors(_) | Event::Scan(_)) {
                self.left = EFFORT_A_REVOLUTION;
            }
        } else if self.state != Relocalization::Idle {
            self.finder.forget();
            self.state = Relocalization::Idle;
        }
    }

    /// Searches for a while. Whether there is more to do, and the pose if it is found.
    pub fn advance(&mut self, reflectors: MapView) -> (bool, Option<PoseFix>) {
        if self.left == 0 {
            return (false, None);
        }
        self.left = self.left.saturating_sub(SLICE);
        let reflectors = self.index.of(reflectors);
        let state = self.finder.search(&reflectors, SLICE);
        // While it searches anew, the last answer stands.
        self.state = match (&state, self.state) {
            (StartState::Searching, Relocalization::Idle) => Relocalization::Searching,
            (StartState::Searching | StartState::Waiting, before) => before,
            (StartState::Found(_) | StartState::Unconfirmed(_), _) => Relocalization::Searching,
            (StartState::Ambiguous(..), _) => Relocalization::Ambiguous,
            (StartState::TooFew, _) => Relocalization::TooFew,
            (StartState::Unknown, _) => Relocalization::Unknown,
        };
        match state {
            StartState::Found(fix) => (true, Some(fix)),
            state => (state == StartState::Searching, None),
        }
    }
}
