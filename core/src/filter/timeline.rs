//! The recent past of the filter, so that a late measurement is fused at the time at which it was true.
//!
//! A ring of entries in order of time. Each holds the motion since the entry before, the correction that was made at
//! its end, if any, and the state after both. A correction in the past is inserted at its own time, and everything
//! behind it is computed again; so the result does not depend on the order in which measurements arrive. States are
//! computed when they are asked for, so that the corrections of one scan, made in order of time, cost one pass.
//!
//! Motions of an odometry that reports more often than 143 times a second become one as long as no correction lies between
//! them, so that the ring spans about as much time at every rate. A correction that comes late may then meet a motion that a
//! timely one would have met in parts, as if the vehicle had kept its velocity for those 14 ms: at an acceleration of
//! 1 m/s^2 that is less than 0.03 mm, by which the order of measurements counts at such rates.

use heapless::Deque;
use serde::{Deserialize, Serialize};

use super::{Ekf, Landmark, Observation, PoseObservation};
use crate::geometry::{Point, Pose};
use crate::measurement::{LaserId, Time};
use crate::odometry::{Coasting, MeanMotion, Motion, UnknownAcceleration};

/// Motions become one up to this time, us; one that takes more than half of it stays as it is.
const LONGEST_JOINED: u64 = 14_000;

/// An observation that was taken for one landmark.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Correction {
    /// What was seen.
    pub observation: Observation,
    /// Pose of the sensor in R.
    pub mount: Pose,
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

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Entry {
    motion: Motion,
    fusion: Fusion,
    state: Ekf,
}

/// What happened at the end of a motion.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
enum Fusion {
    Nothing,
    Correction(Correction),
    /// The pose was told.
    Pose(PoseObservation),
    /// The state was given by a filter that knows more.
    Given,
}

impl Entry {
    fn time(&self) -> Time {
        self.motion.end
    }

    /// Goes on from the state at its start, `running`, to that behind its end.
    fn recompute(&mut self, running: &mut Ekf) {
        match &self.fusion {
            Fusion::Given => {
                *running = self.state;
                return;
            }
            Fusion::Nothing => running.predict(&self.motion),
            Fusion::Correction(correction) => {
                running.predict(&self.motion);
                correction.apply(running);
            }
            Fusion::Pose(seen) => {
                running.predict(&self.motion);
                seen.apply(running);
            }
        }
        self.state = *running;
    }
}

impl Correction {
    /// Corrects a state. False, and nothing changed, if the filter refuses it as singular.
    pub fn apply(&self, state: &mut Ekf) -> bool {
        let landmark = Landmark::Known { position: self.landmark, variance: self.landmark_variance };
        match state.observe(&state.viewpoint(LaserId::FIRST, &self.mount), &self.observation, &landmark) {
            Some(linearisation) => state.correct(&linearisation),
            None => false,
        }
    }
}

/// The last `ENTRIES` motions and corrections.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Timeline<const ENTRIES: usize> {
    entries: Deque<Entry, ENTRIES>,
    /// How many entries, from the oldest, have a state that is up to date; at least one.
    settled: usize,
    /// Motion that was assumed behind the last sample of the odometry, and until when.
    ahead: Option<(Pose, Time)>,
    /// When the last motion ended that the odometry reported.
    last_report: Time,
    /// The mean of those of late.
    recent: MeanMotion,
    odometry_pose: Pose,
    start: Time,
    longest_extrapolation: f64,
    unknown: UnknownAcceleration,
}

impl<const ENTRIES: usize> Timeline<ENTRIES> {
    /// A timeline that has not begun. Behind the last motion it goes on at the mean velocity of late, at most for so long, s.
    #[must_use]
    pub fn new(longest_extrapolation: f64, unknown: UnknownAcceleration) -> Self {
        let time = Time::default();
        Self {
            entries: Deque::new(),
            settled: 1,
            ahead: None,
            last_report: time,
            recent: MeanMotion::NONE,
            odometry_pose: Pose::default(),
            start: time,
            longest_extrapolation,
            unknown,
        }
    }

    /// Begins, or begins anew, with a state that is true at `time`. If that is within what is remembered, the motions since
    /// are kept, and lead on to the newest entry; corrections are not, as they were chosen for another state. In place: a
    /// timeline is too large for the stack of a controller.
    pub fn begin(&mut self, time: Time, state: Ekf) {
        let past = self.position(time).filter(|_| time < self.now());
        if let Some(position) = past {
            self.begin_in_past(position, time, state);
            return;
        }
        self.entries.clear();
        // A ring without room would be useless but not unsound.
        let _ = self.entries.push_back(Entry { motion: Motion::none(time), fusion: Fusion::Nothing, state });
        self.settled = 1;
        self.ahead = None;
        (self.last_report, self.recent) = (time, MeanMotion::from(time));
        self.odometry_pose = state.pose;
        self.start = time;
    }

    /// Begins anew behind the entry at `position`, which is not the newest.
    fn begin_in_past(&mut self, position: usize, time: Time, state: Ekf) {
        for _ in 0..position {
            self.entries.pop_front();
        }
        self.odometry_pose = state.pose;
        let mut entries = self.entries.iter_mut();
        if let Some(first) = entries.next() {
            *first = Entry { motion: Motion::none(time), fusion: Fusion::Nothing, state };
        }
        for entry in entries {
            if entry.motion.start < time {
                entry.motion = entry.motion.split(time).1;
            }
            entry.fusion = Fusion::Nothing;
            self.odometry_pose = self.odometry_pose.compose(&entry.motion.displacement);
        }
        // Of what was assumed only the rest is made up for by the odometry, which counts from the new start on.
        if time > self.last_report
            && let Some((assumed, _)) = &mut self.ahead
        {
            *assumed = state.pose.between(&self.odometry_pose);
        }
        self.settled = 1;
        self.start = time;
    }

    /// Forgets everything: its times were of a clock that is wrong.
    pub fn forget(&mut self) {
        self.entries.clear();
    }

    /// The timeline, if it has begun.
    #[must_use]
    pub fn begun(&self) -> Option<&Self> {
        (!self.entries.is_empty()).then_some(self)
    }

    /// The timeline, if it has begun.
    pub fn begun_mut(&mut self) -> Option<&mut Self> {
        (!self.entries.is_empty()).then_some(self)
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

    /// The time of the oldest entry that is left if one more comes; none if there is room.
    #[must_use]
    pub fn oldest_after_next(&self) -> Option<Time> {
        self.entries.is_full().then(|| self.entries.get(1).map(Entry::time)).flatten()
    }

    /// The state at the newest entry.
    #[must_use]
    pub fn state(&mut self) -> Ekf {
        self.repropagate(self.entries.len());
        self.entries.back().map_or(Ekf::new(Pose::default(), 0.0, 0.0), |entry| entry.state)
    }

    /// Goes on by a motion that the odometry reported. Its start may lie before the newest entry, if measurements have
    /// been extrapolated; what was assumed is then replaced so that the total is what the odometry says.
    pub fn advance(&mut self, motion: &Motion) {
        match self.ahead.take() {
            Some((assumed, until)) if until < motion.end => self.append(&motion.remainder(&assumed, until)),
            // The extrapolation went past the sample; the next one sets it right.
            Some((assumed, until)) => self.ahead = Some((motion.displacement.between(&assumed), until)),
            None if motion.start >= self.now() => self.append(motion),
            // A motion that was not assumed, but told, counts.
            None if motion.end > self.now() => self.append(&motion.split(self.now()).1),
            None => {}
        }
        self.last_report = motion.end;
        self.recent.add(motion);
    }

    /// Goes on from the newest entry by a motion that is assumed until the odometry reports what it was.
    pub fn assume(&mut self, motion: &Motion) {
        let (assumed, _) = self.ahead.unwrap_or((Pose::default(), motion.end));
        self.ahead = Some((assumed.compose(&motion.displacement), motion.end));
        self.append(motion);
    }

    /// Takes what was assumed as what it was: the odometry will not report it.
    pub fn accept_assumed(&mut self) {
        self.ahead = None;
    }

    /// Whether the state at `time` can be told.
    ///
    /// # Errors
    /// See [`TimelineError`].
    pub fn reaches(&self, time: Time) -> Result<(), TimelineError> {
        if self.position(time).is_none() {
            return Err(TimelineError::TooLate);
        }
        if time > self.now() && time.since(self.last_report) > self.longest_extrapolation {
            return Err(TimelineError::TooEarly);
        }
        Ok(())
    }

    /// When the last motion ended that the odometry reported.
    #[must_use]
    pub fn last_report(&self) -> Time {
        self.last_report
    }

    /// The mean of the motions that the odometry has reported of late.
    #[must_use]
    pub fn recent_motion(&self) -> Motion {
        self.recent.motion()
    }

    /// The pose that only the odometry has moved since the beginning, at the time of the newest entry. What lies between it
    /// and the pose of the state is the correction by landmarks, so a controller that steers by it feels no step.
    #[must_use]
    pub fn odometry_pose(&self) -> &Pose {
        &self.odometry_pose
    }

    /// The state at `time`, from the entry before it and the odometry.
    ///
    /// # Errors
    /// See [`TimelineError`].
    pub fn state_at(&mut self, time: Time) -> Result<Ekf, TimelineError> {
        let position = self.position(time).ok_or(TimelineError::TooLate)?;
        self.repropagate(position + 1);
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

    /// Fuses what was true at `time`: `correct` is given the state of that time, and answers the correction that it has made
    /// of it, if any. True if one was made.
    ///
    /// # Errors
    /// See [`TimelineError`]; `correct` has then not been called.
    pub fn fuse(
        &mut self,
        time: Time,
        correct: impl FnOnce(&mut Ekf) -> Option<Correction>,
    ) -> Result<bool, TimelineError> {
        self.fuse_as(time, |state| correct(state).map(Fusion::Correction))
    }

    /// Fuses a pose that was true at `time`. False, and nothing changed, if the filter refuses it as singular.
    ///
    /// # Errors
    /// See [`TimelineError`].
    pub fn fuse_pose(&mut self, time: Time, seen: &PoseObservation) -> Result<bool, TimelineError> {
        self.fuse_as(time, |state| seen.apply(state).then_some(Fusion::Pose(*seen)))
    }

    fn fuse_as(&mut self, time: Time, correct: impl FnOnce(&mut Ekf) -> Option<Fusion>) -> Result<bool, TimelineError> {
        let position = self.position(time).ok_or(TimelineError::TooLate)?;
        self.repropagate(position + 1);
        let mut state = self.entries.get(position).ok_or(TimelineError::TooLate)?.state;
        let parts = self.motion_to(position, time)?;
        state.predict(&parts.0);
        let Some(fusion) = correct(&mut state) else {
            return Ok(false);
        };
        self.divide(position, &parts, fusion, &state);
        Ok(true)
    }

    /// Sets the state at `time` to what another filter has found; what followed is computed again.
    ///
    /// # Errors
    /// See [`TimelineError`].
    pub fn set_state(&mut self, time: Time, state: Ekf) -> Result<(), TimelineError> {
        let position = self.position(time).ok_or(TimelineError::TooLate)?;
        let parts = self.motion_to(position, time)?;
        self.repropagate(position + 1);
        self.divide(position, &parts, Fusion::Given, &state);
        Ok(())
    }

    /// The motion from the entry at `position` to `time`, and what remains of it to the entry that follows, if one does.
    fn motion_to(&self, position: usize, time: Time) -> Result<(Motion, Option<Motion>), TimelineError> {
        match self.entries.get(position + 1) {
            Some(next) => {
                let (first, second) = next.motion.split(time);
                Ok((first, Some(second)))
            }
            None => Ok((self.extrapolation(time)?, None)),
        }
    }

    /// Puts an entry with that state behind the one at `position`, at the end of the first part of the motion.
    fn divide(&mut self, position: usize, parts: &(Motion, Option<Motion>), fusion: Fusion, state: &Ekf) {
        let (motion, rest) = parts;
        if rest.is_none() {
            let (assumed, _) = self.ahead.unwrap_or((Pose::default(), motion.end));
            self.ahead = Some((assumed.compose(&motion.displacement), motion.end));
            self.odometry_pose = self.odometry_pose.compose(&motion.displacement);
        }
        let position = self.insert(position + 1, &Entry { motion: *motion, fusion, state: *state });
        if let (Some(rest), Some(next)) = (rest, self.entries.get_mut(position + 1)) {
            next.motion = *rest;
        }
        self.settled = position + 1;
    }

    /// The displacement of R from `from` to each of the entries up to `to`, as pairs of time and pose in R at `from`,
    /// beginning with `from` itself. The odometry alone decides: corrections leave no step in it.
    pub fn relative_path<'a>(&'a self, from: Time, to: Time) -> impl Iterator<Item = (Time, Pose)> + 'a {
        let mut pose = Pose::default();
        core::iter::once((from, pose)).chain(self.motions(from, to).map(move |motion| {
            pose = pose.compose(&motion.displacement);
            (motion.end, pose)
        }))
    }

    /// The motions between two times, as far as they are remembered.
    pub fn motions(&self, from: Time, to: Time) -> impl Iterator<Item = Motion> + '_ {
        let position = self.position(from).unwrap_or(0);
        let mut is_first = true;
        let within = self.entries.iter().skip(position + 1).map(|entry| entry.motion);
        let beyond = (to > self.now()).then(|| self.assumed_until(to));
        let mut reached = false;
        within.chain(beyond).map_while(move |motion| {
            if reached {
                return None;
            }
            let motion =
                if core::mem::take(&mut is_first) && motion.start < from { motion.split(from).1 } else { motion };
            reached = motion.end >= to;
            Some(if motion.end > to { motion.split(to).0 } else { motion })
        })
    }

    /// The displacement of R between two times, in R at `from`.
    #[must_use]
    pub fn displacement(&self, from: Time, to: Time) -> Pose {
        self.motions(from, to).fold(Pose::default(), |sum, motion| sum.compose(&motion.displacement))
    }

    /// What is assumed from the newest entry on.
    fn assumed_until(&self, time: Time) -> Motion {
        let now = self.now();
        let mut coasting = Coasting::new(self.recent.motion());
        // So far it was assumed before.
        let _ = coasting.to(now, &self.unknown);
        coasting.to(time, &self.unknown).map_or_else(|| Motion::none(now), |motion| Motion { start: now, ..motion })
    }

    fn extrapolation(&self, time: Time) -> Result<Motion, TimelineError> {
        if time.since(self.last_report) > self.longest_extrapolation {
            return Err(TimelineError::TooEarly);
        }
        Ok(self.assumed_until(time))
    }

    /// The newest entry that is not later than `time`.
    fn position(&self, time: Time) -> Option<usize> {
        self.entries.iter().rposition(|entry| entry.time() <= time)
    }

    fn append(&mut self, motion: &Motion) {
        self.repropagate(self.entries.len());
        self.odometry_pose = self.odometry_pose.compose(&motion.displacement);
        if let Some(last) = self.joinable(motion) {
            last.motion = last.motion.then(motion);
            last.state.predict(motion);
            return;
        }
        let Some(mut state) = self.entries.back().map(|entry| entry.state) else { return };
        state.predict(motion);
        self.make_room();
        let _ = self.entries.push_back(Entry { motion: *motion, fusion: Fusion::Nothing, state });
        self.settled = self.entries.len();
    }

    /// The newest entry, if a short motion that follows can become one with its motion.
    fn joinable(&mut self, motion: &Motion) -> Option<&mut Entry> {
        let is_first = self.entries.len() < 2;
        let last = self.entries.back_mut()?;
        let duration = |start: Time| motion.end.micros().saturating_sub(start.micros());
        let is_short = duration(motion.start) <= LONGEST_JOINED / 2
            && duration(last.motion.start) <= LONGEST_JOINED
            && motion.start == last.motion.end;
        (is_short && !is_first && matches!(last.fusion, Fusion::Nothing)).then_some(last)
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
    fn insert(&mut self, position: usize, entry: &Entry) -> usize {
        let position = if self.make_room() { position.saturating_sub(1) } else { position };
        // It makes room at the end, where it stays if it belongs there.
        let _ = self.entries.push_back(*entry);
        if position + 1 >= self.entries.len() {
            return position;
        }
        let (front, back) = self.entries.as_mut_slices();
        match position.checked_sub(front.len()) {
            Some(position) => make_way(back, position),
            None => {
                make_way(back, 0);
                if let (Some(first), Some(last)) = (back.first_mut(), front.last()) {
                    *first = *last;
                }
                make_way(front, position);
            }
        }
        if let Some(place) = self.entries.get_mut(position) {
            *place = *entry;
        }
        position
    }

    /// Brings the states of the first `count` entries up to date.
    fn repropagate(&mut self, count: usize) {
        let first = self.settled.max(1);
        if count <= first {
            return;
        }
        let Some(mut running) = self.entries.get(first - 1).map(|entry| entry.state) else {
            return;
        };
        for entry in self.entries.iter_mut().skip(first).take(count - first) {
            entry.recompute(&mut running);
        }
        self.settled = count;
    }
}

/// Moves the entries from `position` on one further; the last one is overwritten.
fn make_way(entries: &mut [Entry], position: usize) {
    let Some(entries) = entries.get_mut(position..) else { return };
    let Some((_, others)) = entries.split_last() else { return };
    let moved = others.len();
    entries.copy_within(..moved, 1);
}
