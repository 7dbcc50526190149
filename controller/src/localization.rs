//! The localiser, and the search for a pose that it does not have.

use agv_core::localizer::{Event, Localize, PredictionState, StartSearch};
use agv_core::record::{Output, Published, Record};
use agv_core::sources::FindContours;
use agv_core::state::{PoseOutput, Relocalization};
use agv_settings::Settings;
use agv_wire::nav350::Revolution;

use super::progress::{SentPose, Told};

/// What the localiser has said last, for whoever publishes it.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    /// Events that it has answered, wrapping.
    pub answered: u32,
    /// Its pose.
    pub pose: PoseOutput,
    /// What it has learnt of the motion.
    pub prediction: PredictionState,
    /// How far the search for a pose has come.
    pub relocalization: Relocalization,
}

/// One event in, outputs out, and a search in the time between events. What is told and answered, and what was published
/// meanwhile, is handed to `log` as records of a log.
#[derive(Clone, Debug)]
pub struct Localization<L: Localize> {
    localizer: L,
    search: StartSearch<<L::Contours as FindContours>::Places>,
    answered: u32,
    told: u32,
}

impl<L: Localize> Localization<L> {
    /// A localiser that has its maps, and a search among their reflectors, if the settings want one.
    #[must_use]
    #[inline(always)]
    pub fn new(localizer: L, settings: &Settings) -> Self {
        let search = StartSearch::new(&settings.parameters, settings.start_search);
        Self { localizer, search, answered: 0, told: 0 }
    }

    /// The localiser.
    #[must_use]
    pub fn localizer(&self) -> &L {
        &self.localizer
    }

    /// The localiser, to replace its maps: what was found of those before is forgotten.
    pub fn localizer_mut(&mut self) -> &mut L {
        self.search.forget_maps();
        &mut self.localizer
    }

    /// Takes an event that the bus has told, or somebody else.
    pub fn hear(&mut self, told: &Told, mut log: impl FnMut(&Record)) {
        if let Some(progress) = told.progress {
            self.told = progress.told;
            let behind = self.answered.wrapping_sub(progress.answered);
            if behind != 0 {
                log(&Record::Behind(behind));
            }
        }
        self.handle(&told.event.event(), log);
    }

    /// Takes an event.
    pub fn handle(&mut self, event: &Event, mut log: impl FnMut(&Record)) {
        let outputs = self.localizer.handle(event);
        self.answered = self.answered.wrapping_add(1);
        log(&Record::Event(*event));
        log(&Record::Output(Output::from(outputs)));
        let mode = outputs.pose.mode;
        self.search.handle(event, mode, self.localizer.reflectors());
    }

    /// Takes what a revolution has shown: its reflectors, and its scan.
    pub fn revolution<const BEAMS: usize, const REFLECTORS: usize>(
        &mut self,
        revolution: &Revolution<BEAMS, REFLECTORS>,
        mut log: impl FnMut(&Record),
    ) {
        if let Some(reflectors) = revolution.reflectors() {
            self.handle(&Event::Reflectors(reflectors), &mut log);
        }
        if let Some(scan) = revolution.scan() {
            self.handle(&Event::Scan(scan), &mut log);
        }
    }

    /// Takes what was published. Where it stands in the log matters: behind all events that the bus had told
    /// ([`Localization::told`]), and before the next of them.
    pub fn published(&self, published: &SentPose, mut log: impl FnMut(&Record)) {
        let behind = self.answered.wrapping_sub(published.progress.answered);
        log(&Record::Published(Published { pose: published.pose, behind }));
    }

    /// Number of the last event that the bus has told.
    #[must_use]
    pub fn told(&self) -> u32 {
        self.told
    }

    /// Goes on with the search for a pose for a slice of time, and returns whether there is more to do. A pose that is found
    /// is an event like any other, so that a replay of the log needs no search.
    pub fn search(&mut self, log: impl FnMut(&Record)) -> bool {
        if !self.search.has_time() {
            return false;
        }
        let (reflectors, contours) = self.localizer.for_search();
        let (is_busy, found) = self.search.advance(reflectors, contours);
        if let Some(fix) = found {
            self.handle(&Event::SetPose(fix), log);
        }
        is_busy
    }

    /// How far the search for a pose has come.
    #[must_use]
    pub fn relocalization(&self) -> Relocalization {
        self.search.state()
    }

    /// What it says now.
    #[must_use]
    pub fn estimate(&self) -> Estimate {
        Estimate {
            answered: self.answered,
            pose: self.localizer.outputs().pose,
            prediction: self.localizer.prediction_state(),
            relocalization: self.relocalization(),
        }
    }
}
