//! When a start that was found is believed: one look may fit a place that only looks like the right one.

use super::seen_through::SeenThrough;
use crate::geometry::{Pose, difference};
use crate::maps::MapView;
use crate::measurement::Scan;
use crate::relocalization::{IndexedReflectors, ReflectorSnapshot};

/// What must have been seen before a pose that was found is told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StartRule {
    /// Revolutions that were looked at.
    pub revolutions: u16,
    /// Reflectors that the map explains,
    pub reflectors: usize,
    /// and so many more for each that it does not;
    pub for_unexplained: usize,
    /// or, if it explains all, the distance between two looks that find the same place, m.
    pub apart: f64,
    /// Reflectors count that were seen in so many revolutions.
    pub times: u8,
    /// Share of those that the map must explain.
    pub explained: f64,
}

impl StartRule {
    /// One look is believed.
    pub const ONE_LOOK: Self =
        Self { revolutions: 1, reflectors: 0, for_unexplained: 0, apart: 0.0, times: 1, explained: 0.0 };
}

impl Default for StartRule {
    /// Eight revolutions, and five reflectors, with four more for each that does not fit, or two looks 2 m apart at which all fit; three
    /// in four reflectors fit, and none is missing whose place the scans pass through.
    fn default() -> Self {
        Self { revolutions: 8, reflectors: 5, for_unexplained: 4, apart: 2.0, times: 2, explained: 0.75 }
    }
}

/// A look that has found a place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    /// Pose of R in W that it has found.
    pub pose: Pose,
    /// Where the odometry had R then.
    pub odometry: Pose,
    /// How many revolutions had been seen then.
    pub revolutions: u32,
}

impl Look {
    /// Where the vehicle is when the odometry has it there.
    fn moved_to(&self, odometry: &Pose) -> Pose {
        self.pose.compose(&self.odometry.between(odometry))
    }
}

/// What a look does to what is believed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Belief {
    /// The place is believed.
    Confirmed,
    /// It may be; more must be seen.
    Open,
    /// The map does not explain what is seen there.
    Contradicted,
}

/// Two looks find the same place within this distance, m, and turn, rad, by the odometry between them.
const SAME: (f64, f64) = (0.3, 0.05);
/// A look is forgotten this far behind, m, as what it saw is.
const REMEMBERED: f64 = super::start_finder::REMEMBERED as f64;
/// A reflector is explained if the map has one within so many standard deviations.
const GATE: f32 = 3.5;

/// So far around a place, m and rad, what did not fit there counts.
const AROUND: (f64, f64) = (5.0, 0.5);
/// Fewer that do not fit are false reflectors, which are gone elsewhere.
const DOUBTFUL: usize = 3;

/// Where reflectors did not fit, and how many.
#[derive(Clone, Copy, Debug)]
struct Doubt {
    /// Pose of R in W.
    place: Pose,
    unexplained: usize,
}

impl Doubt {
    fn is_around(&self, place: &Pose) -> bool {
        let off = self.place.between(place);
        libm::hypot(off.x, off.y) < AROUND.0 && libm::fabs(off.theta) < AROUND.1
    }
}

/// The first of the looks that agree, and what speaks against it.
#[derive(Clone, Debug)]
pub(super) struct StartConfirmation {
    rule: StartRule,
    first: Option<Look>,
    /// What did not fit in the last look, and what did not of reflectors that are forgotten since: what is seen later may fit a place that
    /// only looks alike.
    doubts: [Option<Doubt>; 2],
    seen_through: SeenThrough,
}

impl StartConfirmation {
    /// Nothing was found.
    pub(super) const fn new(rule: StartRule) -> Self {
        Self { rule, first: None, doubts: [None; 2], seen_through: SeenThrough::new() }
    }

    /// The reflectors that were seen are forgotten, and the looks, but not what did not fit.
    pub(super) fn begin_anew(&mut self) {
        self.forget();
        let [last, before] = self.doubts;
        let is_larger = |last: &Doubt| {
            let before = before.filter(|before| before.is_around(&last.place));
            last.unexplained >= DOUBTFUL && before.is_none_or(|before| last.unexplained >= before.unexplained)
        };
        self.doubts = [None, last.filter(is_larger).or(before)];
    }

    /// Forgets the looks.
    pub(super) fn forget(&mut self) {
        self.first = None;
        self.seen_through.forget();
    }

    /// Where the looks have the vehicle when the odometry has it at `odometry`.
    pub(super) fn pose(&self, odometry: &Pose) -> Option<Pose> {
        self.first.map(|first| first.moved_to(odometry))
    }

    /// Takes a scan whose laser the looks have at `sensor` in W.
    pub(super) fn look_through(&mut self, scan: &Scan, sensor: &Pose, reflectors: MapView) {
        self.seen_through.look(scan, sensor, reflectors);
    }

    /// Takes a look; `snapshot` is what is seen from where the odometry has R now.
    pub(super) fn take<const SEEN: usize>(
        &mut self,
        look: &Look,
        odometry: &Pose,
        snapshot: &ReflectorSnapshot<SEEN>,
        reflectors: &IndexedReflectors,
    ) -> Belief {
        let is_same = |first: &Look| {
            let since = first.odometry.between(&look.odometry);
            let off = first.pose.compose(&since).between(&look.pose);
            let is_there = libm::hypot(off.x, off.y) < SAME.0 && libm::fabs(difference(off.theta, 0.0)) < SAME.1;
            is_there && libm::hypot(since.x, since.y) <= REMEMBERED
        };
        let first = self.first.filter(is_same).unwrap_or_else(|| {
            self.seen_through.forget();
            *look
        });
        self.first = Some(first);
        let StartRule { revolutions, reflectors: enough, for_unexplained, apart, times, explained } = self.rule;
        let between = first.odometry.between(&look.odometry);
        let is_long = look.revolutions.saturating_sub(first.revolutions).saturating_add(1) >= u32::from(revolutions);
        let pose = look.moved_to(odometry);
        let (fitting, seen) = reflectors.explained(snapshot, &pose, times, GATE);
        let unexplained = seen.saturating_sub(fitting);
        let doubted = self.doubted(&pose, unexplained);
        let places = snapshot.reflectors().iter().map(|seen| pose.transform(&seen.position.cast()));
        if is_long && (fitting as f64) < explained * seen as f64
            || self.seen_through.is_any_missing(reflectors.map(), places)
        {
            return Belief::Contradicted;
        }
        let is_apart = unexplained == 0 && libm::hypot(between.x, between.y) >= apart;
        if is_long && (is_apart || fitting >= enough + for_unexplained * doubted) {
            Belief::Confirmed
        } else {
            Belief::Open
        }
    }

    /// How many reflectors have not fitted around a place, where so many do not now.
    fn doubted(&mut self, place: &Pose, unexplained: usize) -> usize {
        let [last, before] = &mut self.doubts;
        *last = Some(Doubt { place: *place, unexplained });
        before.filter(|before| before.is_around(place)).map_or(0, |before| before.unexplained).max(unexplained)
    }
}
