//! The localiser: what bus and laser say in, estimates and the log out.

use std::time::Duration;

use agv_controller::{Localization, SentPose};
use agv_core::geometry::Pose;
use agv_core::localizer::{Event, Localize};
use agv_core::maps::Landmark;
use agv_core::state::Relocalization;

use super::exchange::{Exchange, LocalizerQueues, Task};
use super::incident::Incident;
use super::kept_pose::verified;
use super::log_queue::LogWriter;

/// How long it sleeps if nobody wakes it: then it looks whether it is to end.
const NAP: Duration = Duration::from_millis(10);

/// What the loop works with.
pub(super) struct LocalizerLoop<'a, L: Localize> {
    pub localization: Localization<L>,
    pub exchange: &'a Exchange,
    pub queues: LocalizerQueues,
    pub log: LogWriter<'a>,
    /// A pose that was published behind events which the localiser has not heard yet.
    pub waiting: Option<SentPose>,
    /// Where the vehicle may be, and where its first laser is on it, until it knows better.
    pub kept: Option<(Pose, Pose)>,
    pub landmarks: &'a [Landmark],
    pub note: &'a (dyn Fn(&str) + Sync),
}

impl<L: Localize> LocalizerLoop<'_, L> {
    /// Handles what comes until everything ends.
    pub fn run(mut self) {
        self.exchange.be_localizer();
        self.tell();
        while !self.exchange.is_over() {
            if !self.step() {
                std::thread::park_timeout(NAP);
            }
        }
    }

    /// Handles what has come, and returns whether there was anything. Samples that wait go first: they are what a revolution is seen
    /// from. A search takes what time is left.
    pub fn step(&mut self) -> bool {
        self.exchange.check_in(Task::Localizer);
        self.log_published(self.localization.told());
        if self.exchange.has_failed() {
            self.log.tell(Incident::Fault);
        }
        self.take_bus_event() || self.take_revolution() || self.search()
    }

    fn take_bus_event(&mut self) -> bool {
        let Some(told) = self.queues.events.receive() else { return false };
        if let Some(progress) = told.progress {
            self.log_published(progress.told.wrapping_sub(1));
        }
        let Self { localization, log, .. } = self;
        localization.hear(&told, |record| log.write(record));
        self.tell();
        self.log.begin_again(self.localization.localizer());
        true
    }

    /// Tells the bus what the localiser says.
    pub fn tell(&mut self) {
        let estimate = self.localization.estimate();
        self.log.answer(&estimate);
        self.exchange.publish(estimate);
    }

    fn take_revolution(&mut self) -> bool {
        let Some(revolution) = self.queues.revolutions.receive() else { return false };
        let Self { localization, log, .. } = self;
        localization.revolution(&revolution, |record| log.write(record));
        // Where places look alike, the search alone does not end.
        let is_ambiguous = localization.relocalization() == Relocalization::Ambiguous;
        if let Some((kept, mount)) = self.kept.filter(|_| is_ambiguous)
            && let Some(seen) = revolution.reflectors()
            && let Some(fix) = verified(&kept, &mount, seen.observations, self.landmarks)
        {
            localization.handle(&Event::SetPose(fix), |record| log.write(record));
            (self.note)("start: two places look alike; what is seen fits where the vehicle was last");
            self.kept = None;
        }
        self.tell();
        let _ = self.queues.free_revolutions.send(revolution);
        true
    }

    fn search(&mut self) -> bool {
        let Self { localization, log, .. } = self;
        let before = localization.relocalization();
        let mut has_spoken = false;
        let is_busy = localization.search(|record| {
            has_spoken = true;
            log.write(record);
        });
        if has_spoken || localization.relocalization() != before {
            self.tell();
        }
        is_busy
    }

    /// Logs what was published before the bus told more than so many events. The count wraps: what is ahead by less than half of its
    /// range is later.
    fn log_published(&mut self, told: u32) {
        let Self { localization, queues, log, waiting, .. } = self;
        while let Some(next) = waiting.take().or_else(|| queues.published.receive()) {
            if next.progress.told.wrapping_sub(told) as i32 > 0 {
                *waiting = Some(next);
                return;
            }
            localization.published(&next, |record| log.write(record));
        }
    }
}
