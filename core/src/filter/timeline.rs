//! The recent past of the filter, so that a late measurement is fused at the time at which it was true.
//!
//! A ring of entries in order of time. Each holds the motion since the entry before, the correction that was made at
//! its end, if any, and the state after both. A correction in the past is inserted at its own time, and everything
//! behind it is computed again; so the result does not depend on the order in which measurements arrive. States are
//! computed when they are asked for, so that the corrections of one scan, made in order of time, cost one pass.

use heapless::Deque;

use super::{Ekf, Observation};
use crate::geometry::{Point, Pose};
use crate::measurement::Time;
use crate::odometry::Motion;

/// An observation that was taken for one landmark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correction {
    /// What was seen.
    pub observation: Observation,
    /// Where the landmark is, m, in W.
    pub landmark: Point,
    /// Variance of the landmark's position an axis, m^2.
    pub landmark_variance: f64,
}

/// Why a measurement finds no place in the past.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimelineError {
    /// It is older than all that is remembered.
    TooLate,
    /// It is further ahead of the last motion than may be extrapolated.
    TooEarly,
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    motion: Motion,
    correction: Option<Correction>,
    state: Ekf,
}

impl Entry {
    fn time(&self) -> Time {
        self.motion.end
    }

    fn recompute(&mut self, before: &Ekf, laser: &Pose) {
        self.state = *before;
        self.state.predict(&self.motion);
        if let Some(correction) = &self.correction {
            correction.apply(&mut self.state, laser);
        }
    }
}

impl Correction {
    fn apply(&self, state: &mut Ekf, laser: &Pose) -> bool {
        match self.observation.linearise(&state.pose, laser, &self.landmark, self.landmark_variance) {
            Some(linearisation) => state.correct(&linearisation),
            None => false,
        }
    }
}

/// The last `ENTRIES` motions and corrections.
#[derive(Clone, Debug)]
pub struct Timeline<const ENTRIES: usize> {
    entries: Deque<Entry, ENTRIES>,
    /// How many entries, from the oldest, have a state that is up to date; at least one.
    settled: usize,
    /// Motion that was assumed behind the last sample of the odometry, and until when.
    ahead: Option<(Pose, Time)>,
    /// The last motion that the odometry reported.
    last_motion: Motion,
    start: Time,
    laser: Pose,
    longest_extrapolation: f64,
}

impl<const ENTRIES: usize> Timeline<ENTRIES> {
    /// A past that begins at `time` with `state`, for a sensor at `laser` in R. Measurements may be up to
    /// `longest_extrapolation` seconds ahead of the odometry.
    #[must_use]
    pub fn new(time: Time, state: Ekf, laser: Pose, longest_extrapolation: f64) -> Self {
        let mut entries = Deque::new();
        let start = Entry { motion: Motion::none(time), correction: None, state };
        // A ring without room would be useless but not unsound.
        let _ = entries.push_back(start);
        Self {
            entries,
            settled: 1,
            ahead: None,
            last_motion: Motion::none(time),
            start: time,
            laser,
            longest_extrapolation,
        }
    }

    /// The time at which the past began.
    #[must_use]
    pub fn start(&self) -> Time {
        self.start
    }

    /// The time of the newest entry.
    #[must_use]
    pub fn now(&self) -> Time {
        self.entries.back().map_or(Time::default(), Entry::time)
    }

    /// The state at the newest entry.
    #[must_use]
    pub fn state(&mut self) -> Ekf {
        self.settle(self.entries.len());
        self.entries.back().map_or(Ekf::new(Pose::default(), 0.0, 0.0), |entry| entry.state)
    }

    /// Goes on by a motion that the odometry reported. Its start may lie before the newest entry, if measurements have
    /// been extrapolated; what was assumed is then replaced so that the total is what the odometry says.
    pub fn advance(&mut self, motion: &Motion) {
        let rest = match self.ahead.take() {
            Some((assumed, until)) if until < motion.end => motion.remainder(&assumed, until),
            // The extrapolation went past the sample; the next one sets it right.
            Some((assumed, until)) => {
                self.ahead = Some((motion.displacement.between(&assumed), until));
                self.last_motion = *motion;
                return;
            }
            None => *motion,
        };
        self.last_motion = *motion;
        self.append(rest);
    }

    /// The last motion that the odometry reported.
    #[must_use]
    pub fn last_motion(&self) -> &Motion {
        &self.last_motion
    }

    /// The state at `time`, from the entry before it and the odometry.
    ///
    /// # Errors
    /// See [`TimelineError`].
    pub fn state_at(&mut self, time: Time) -> Result<Ekf, TimelineError> {
        let position = self.position(time).ok_or(TimelineError::TooLate)?;
        self.settle(position + 1);
        let before = self.entries.get(position).ok_or(TimelineError::TooLate)?;
        if before.time() == time {
            return Ok(before.state);
        }
        let mut state = before.state;
        match self.entries.get(position + 1) {
            Some(next) => state.predict(&next.motion.split(time).0),
            None => state.predict(&self.extrapolation(time)?),
        }
        Ok(state)
    }

    /// Makes a correction at the time at which it was true: `choose` is given the state of that time and answers which
    /// correction it is, if any. True if one was made; false if none was chosen or the filter refused it as singular.
    ///
    /// # Errors
    /// See [`TimelineError`]; `choose` has then not been called.
    pub fn correct(
        &mut self,
        time: Time,
        choose: impl FnOnce(&Ekf) -> Option<Correction>,
    ) -> Result<bool, TimelineError> {
        let position = self.position(time).ok_or(TimelineError::TooLate)?;
        self.settle(position + 1);
        let mut state = self.entries.get(position).ok_or(TimelineError::TooLate)?.state;
        let (motion, rest) = match self.entries.get(position + 1) {
            Some(next) => {
                let (first, second) = next.motion.split(time);
                (first, Some(second))
            }
            None => (self.extrapolation(time)?, None),
        };
        state.predict(&motion);
        let Some(correction) = choose(&state) else {
            return Ok(false);
        };
        if !correction.apply(&mut state, &self.laser) {
            return Ok(false);
        }
        if rest.is_none() {
            let (assumed, _) = self.ahead.unwrap_or((Pose::default(), time));
            self.ahead = Some((assumed.compose(&motion.displacement), time));
        }
        let position = self.insert(position + 1, Entry { motion, correction: Some(correction), state });
        if let (Some(rest), Some(next)) = (rest, self.entries.get_mut(position + 1)) {
            next.motion = rest;
        }
        self.settled = position + 1;
        Ok(true)
    }

    /// The displacement of R from `from` to each of the entries up to `to`, as pairs of time and pose in R at `from`,
    /// beginning with `from` itself. The odometry alone decides: corrections leave no step in it.
    pub fn relative_path<'a>(&'a self, from: Time, to: Time) -> impl Iterator<Item = (Time, Pose)> + 'a {
        let position = self.position(from).unwrap_or(0);
        let mut pose = Pose::default();
        let mut is_first = true;
        let within = self.entries.iter().skip(position + 1).map(|entry| entry.motion);
        let beyond = (to > self.now()).then(|| self.last_motion_until(to));
        let mut reached = false;
        core::iter::once((from, pose)).chain(within.chain(beyond).map_while(move |motion| {
            if reached {
                return None;
            }
            let motion =
                if core::mem::take(&mut is_first) && motion.start < from { motion.split(from).1 } else { motion };
            reached = motion.end >= to;
            let motion = if motion.end > to { motion.split(to).0 } else { motion };
            pose = pose.compose(&motion.displacement);
            Some((motion.end, pose))
        }))
    }

    fn last_motion_until(&self, time: Time) -> Motion {
        let now = self.now();
        let (_, done) = self.last_motion.extrapolate(time).split(now);
        Motion { start: now, ..done }
    }

    fn extrapolation(&self, time: Time) -> Result<Motion, TimelineError> {
        if time.since(self.last_motion.end) > self.longest_extrapolation {
            return Err(TimelineError::TooEarly);
        }
        Ok(self.last_motion_until(time))
    }

    /// The newest entry that is not later than `time`.
    fn position(&self, time: Time) -> Option<usize> {
        self.entries.iter().rposition(|entry| entry.time() <= time)
    }

    fn append(&mut self, motion: Motion) {
        let state = self.state();
        self.make_room();
        let mut entry = Entry { motion, correction: None, state };
        entry.recompute(&state, &self.laser);
        let _ = self.entries.push_back(entry);
        self.settled = self.entries.len();
    }

    /// Drops the oldest entry if the ring is full; true if it did.
    fn make_room(&mut self) -> bool {
        let is_full = self.entries.is_full();
        if is_full {
            self.entries.pop_front();
            self.settled = self.settled.saturating_sub(1);
        }
        is_full
    }

    /// Puts an entry at `position` and returns where it ended, one lower if the oldest entry had to go.
    fn insert(&mut self, position: usize, entry: Entry) -> usize {
        let position = if self.make_room() { position.saturating_sub(1) } else { position };
        let mut carried = entry;
        for place in self.entries.iter_mut().skip(position) {
            core::mem::swap(place, &mut carried);
        }
        let _ = self.entries.push_back(carried);
        position
    }

    /// Brings the states of the first `count` entries up to date.
    fn settle(&mut self, count: usize) {
        let first = self.settled.max(1);
        if count <= first {
            return;
        }
        let Some(mut before) = self.entries.get(first - 1).map(|entry| entry.state) else {
            return;
        };
        for entry in self.entries.iter_mut().skip(first).take(count - first) {
            entry.recompute(&before, &self.laser);
            before = entry.state;
        }
        self.settled = count;
    }
}
