//! Questions that a sensor answers at the end of a turn.

use agv_core::measurement::Time;
use agv_wire::cola::{Dialect, Sequence};
use agv_wire::nav350::{
    Answer, Channel, ErrorCode, LandmarkData, MethodResult, NavigationData, OperatingMode, PoseAnswer, PoseReport,
    ReflectorList,
};

use super::drive::Turn;
use super::encoding::encode;
use super::seen::SeenScan;
use super::sensor::Sensor;

/// A question that is answered later.
#[derive(Clone, Copy)]
pub(super) struct Promise {
    pub(super) due: f64,
    turn: usize,
    /// When the turn began, in the sensor's time, s.
    start: f64,
    method: PromisedMethod,
    dialect: Dialect,
}

#[derive(Clone, Copy)]
pub(super) enum PromisedMethod {
    Data { wait: bool, mask: u8 },
    Pose { wait: bool },
    Landmarks { wait: bool, dataset: u8 },
    Mapping,
}

impl PromisedMethod {
    /// The mode in which it is answered.
    pub(super) const fn needed_mode(self) -> OperatingMode {
        match self {
            Self::Data { .. } | Self::Pose { .. } => OperatingMode::Navigation,
            Self::Landmarks { .. } => OperatingMode::LandmarkDetection,
            Self::Mapping => OperatingMode::Mapping,
        }
    }

    /// The result that says why there is none.
    pub(super) fn failure(self, dialect: Dialect, error: ErrorCode) -> Vec<u8> {
        encode_result(dialect, self, error, None, None, heapless::Vec::new(), None)
    }
}

impl Sensor {
    /// A question that is answered at the end of a turn.
    pub(super) fn promised(&mut self, dialect: Dialect, method: PromisedMethod, wait: bool, now: f64) -> Promise {
        let (due, turn, start) = match method {
            PromisedMethod::Mapping => self.mapping_turn(now),
            _ => self.turn(wait, now),
        };
        Promise { due: due.max(now + self.gap), turn, start, method, dialect }
    }

    /// When a question is answered, which turn answers it, and when that turn began.
    fn turn(&mut self, wait: bool, now: f64) -> (f64, usize, f64) {
        if self.drive.is_live {
            let next = self.drive.first + self.drive.turns.len();
            // Before the first turn there is none to tell of at once.
            let number = if wait || self.drive.turns.is_empty() { next } else { next - 1 };
            return (now, number, 0.0);
        }
        if self.stands && self.drive_start.is_none_or(|start| now < start) {
            return self.standing_turn(wait, now);
        }
        let drive_start = *self.drive_start.get_or_insert(now);
        let period = self.drive.frame.period;
        let start = |turn: &Turn| drive_start + turn.start.since(self.drive.begin);
        let end = |turn: &Turn| start(turn) + period;
        let mut turn = self.drive.turns.partition_point(|turn| end(turn) <= now);
        if !wait {
            turn = turn.saturating_sub(1);
        }
        let last = self.drive.turns.len() - 1;
        let (turn, shift) = if turn <= last {
            (turn, 0.0)
        } else {
            let periods = ((now - end(&self.drive.turns[last])) / period).floor() + 1.0;
            (last, periods * period)
        };
        let due = if wait { end(&self.drive.turns[turn]) + shift } else { now };
        (due, turn, start(&self.drive.turns[turn]) + shift)
    }

    /// The same while the vehicle stands: the first turn is repeated.
    fn standing_turn(&self, wait: bool, now: f64) -> (f64, usize, f64) {
        let period = self.drive.frame.period;
        let periods = (now / period).floor() + if wait { 1.0 } else { 0.0 };
        let due = if wait { periods * period } else { now };
        (due, 0, (periods - 1.0) * period)
    }

    /// The same for mapping, which takes as many turns as it is to average. A vehicle that has not driven off stands
    /// meanwhile.
    fn mapping_turn(&mut self, now: f64) -> (f64, usize, f64) {
        if self.drive.is_live {
            return self.turn(true, now);
        }
        let is_driving = self.drive_start.is_some_and(|start| now >= start);
        let (due, turn, start) = if is_driving { self.turn(true, now) } else { self.standing_turn(true, now) };
        let more = f64::from(self.map_configuration().mean.saturating_sub(1));
        (due + more * self.drive.frame.period, turn, start)
    }

    /// Whether the turn that answers a question has ended.
    pub(super) fn has_seen(&self, promise: &Promise) -> bool {
        promise.turn < self.drive.first + self.drive.turns.len()
    }

    /// The answer that was promised.
    pub(super) fn keep(&self, promise: &Promise) -> Vec<u8> {
        let Promise { dialect, method, .. } = *promise;
        let turn = self.drive.place(promise.turn);
        let start =
            if self.drive.is_live { self.drive.turns[turn].start.since(Time::default()) } else { promise.start };
        if matches!(method, PromisedMethod::Mapping) {
            let reflectors = self.mapped(turn, start);
            let list = ReflectorList { filter: 0, reflectors: Sequence::Values(&reflectors) };
            return encode(dialect, &Answer::Result(MethodResult::Mapping(ErrorCode::OK, Some(list))));
        }
        let seen = self.seen(turn, start);
        let (wants_reflectors, wants_scan) = match method {
            PromisedMethod::Data { mask, .. } => (mask != 1, mask != 0),
            PromisedMethod::Landmarks { dataset, .. } => (dataset != 1, dataset != 0),
            PromisedMethod::Pose { .. } | PromisedMethod::Mapping => (false, false),
        };
        let pose = seen.pose();
        let reflectors = seen.reflectors();
        let filter = seen.landmark_format().filter;
        let list = ReflectorList { filter, reflectors: Sequence::Values(&reflectors) };
        let scan = if wants_scan { seen.scan() } else { SeenScan::default() };
        let has_position = pose.is_some() || matches!(method, PromisedMethod::Landmarks { .. });
        let error = if has_position { ErrorCode::OK } else { ErrorCode::NO_POSITION };
        let list = wants_reflectors.then_some(list);
        encode_result(dialect, method, error, pose, list, scan.channels(&seen), scan.remission(&seen))
    }
}

fn encode_result(
    dialect: Dialect,
    method: PromisedMethod,
    error: ErrorCode,
    pose: Option<PoseReport>,
    reflectors: Option<ReflectorList>,
    channels: heapless::Vec<Channel<u32>, 2>,
    remission: Option<Channel<u16>>,
) -> Vec<u8> {
    let version = 1;
    let result = match method {
        PromisedMethod::Data { wait, mask } => MethodResult::Data(NavigationData {
            version,
            error,
            wait: wait.into(),
            mask,
            pose,
            reflectors,
            channels,
            remission,
        }),
        PromisedMethod::Landmarks { wait, dataset } => MethodResult::LandmarkData(LandmarkData {
            version,
            error,
            wait: wait.into(),
            dataset,
            reflectors,
            channels,
            remission,
        }),
        PromisedMethod::Pose { wait } => MethodResult::Pose(PoseAnswer { version, error, wait: wait.into(), pose }),
        PromisedMethod::Mapping => MethodResult::Mapping(error, reflectors),
    };
    encode(dialect, &Answer::Result(result))
}
