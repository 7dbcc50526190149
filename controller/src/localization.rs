//! The localiser, and the search for a pose that it does not have.

use agv_core::localizer::{Event, Localize, Outputs, StartSearch};
use agv_core::odometry::OdometryBias;
use agv_core::state::{PoseOutput, Relocalization};
use agv_settings::Settings;
use agv_wire::nav350::Revolution;

/// What the localiser has said last, for whoever publishes it.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    /// Its pose.
    pub pose: PoseOutput,
    /// What it has learnt of the odometry.
    pub bias: OdometryBias,
    /// How far the search for a pose has come.
    pub relocalization: Relocalization,
}

/// One event in, outputs out, and a search in the time between events.
#[derive(Clone, Debug)]
pub struct Localization<L> {
    localizer: L,
    search: StartSearch,
}

impl<L: Localize> Localization<L> {
    /// A localiser that has its maps, and a search among their reflectors, if the settings want one.
    #[must_use]
    #[inline(always)]
    pub fn new(localizer: L, settings: &Settings) -> Self {
        let search = StartSearch::new(&settings.parameters, settings.start_search);
        let mut localization = Self { localizer, search };
        localization.index();
        localization
    }

    /// The localiser.
    #[must_use]
    pub fn localizer(&self) -> &L {
        &self.localizer
    }

    /// The localiser, to replace its maps; [`Localization::index`] is to be called then.
    pub fn localizer_mut(&mut self) -> &mut L {
        &mut self.localizer
    }

    /// Makes ready for the reflectors that the localiser has.
    pub fn index(&mut self) {
        self.search.index(self.localizer.reflectors());
    }

    /// Takes an event. `observe` is told what came of it.
    pub fn handle(&mut self, event: &Event, observe: impl FnOnce(&Event, &Outputs)) {
        let outputs = self.localizer.handle(event);
        observe(event, outputs);
        let mode = outputs.pose.mode;
        self.search.handle(event, mode, self.localizer.reflectors());
    }

    /// Takes what a revolution has shown: its reflectors, and its scan.
    pub fn revolution<const BEAMS: usize, const REFLECTORS: usize>(
        &mut self,
        revolution: &Revolution<BEAMS, REFLECTORS>,
        mut observe: impl FnMut(&Event, &Outputs),
    ) {
        if let Some(reflectors) = revolution.reflectors() {
            self.handle(&Event::Reflectors(reflectors), &mut observe);
        }
        if let Some(scan) = revolution.scan() {
            self.handle(&Event::Scan(scan), &mut observe);
        }
    }

    /// Goes on with the search for a pose for a slice of time, and returns whether there is more to do. A pose that is found
    /// is an event like any other, so that a replay of the log needs no search.
    pub fn search(&mut self, observe: impl FnOnce(&Event, &Outputs)) -> bool {
        let (is_busy, found) = self.search.advance(self.localizer.reflectors());
        if let Some(fix) = found {
            self.handle(&Event::SetPose(fix), observe);
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
            pose: self.localizer.outputs().pose,
            bias: self.localizer.odometry_bias(),
            relocalization: self.relocalization(),
        }
    }
}
