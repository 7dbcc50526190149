//! Questions that a sensor answers at the end of a turn.

use agv_core::measurement::Time;
use agv_wire::cola::{Dialect, Sequence};
use agv_wire::nav350::{
    Angle, Answer, Channel, ChannelName, Coordinate, CoordinateFormat, Distance, ErrorCode, LandmarkData,
    LandmarkDataFormat, MethodName, MethodResult, NavigationData, OperatingMode, PoseAnswer, PoseDetails, PoseReport,
    PositionMode, Reflector, ReflectorDetails, ReflectorList, Setting, Size,
};

use super::drive::Turn;
use super::sensor::{Sensor, encode};

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

impl Sensor {
    /// Accepts a slow method, to be answered at the end of a turn.
    pub(super) fn promise(
        &mut self,
        dialect: Dialect,
        name: MethodName,
        method: PromisedMethod,
        wait: bool,
        now: f64,
        promise: &mut Option<Promise>,
    ) -> Vec<u8> {
        let mut bytes = encode(dialect, &Answer::Accepted(name));
        if promise.is_some() {
            bytes.extend(failure(dialect, method, ErrorCode::ALREADY_ACTIVE));
            return bytes;
        }
        let needed = match method {
            PromisedMethod::Data { .. } | PromisedMethod::Pose { .. } => OperatingMode::Navigation,
            PromisedMethod::Landmarks { .. } => OperatingMode::LandmarkDetection,
            PromisedMethod::Mapping => OperatingMode::Mapping,
        };
        if self.mode != needed {
            bytes.extend(failure(dialect, method, ErrorCode::WRONG_MODE));
            return bytes;
        }
        let period = self.drive.frame.period;
        if self.stands && self.drive_start.is_none_or(|start| now < start) {
            let periods = (now / period).floor() + if wait { 1.0 } else { 0.0 };
            let due = if wait { periods * period } else { now };
            *promise = Some(Promise { due, turn: 0, start: (periods - 1.0) * period, method, dialect });
            return bytes;
        }
        let drive_start = *self.drive_start.get_or_insert(now);
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
        let start = start(&self.drive.turns[turn]) + shift;
        *promise = Some(Promise { due, turn, start, method, dialect });
        bytes
    }

    /// The answer that was promised.
    pub(super) fn keep(&self, promise: &Promise) -> Vec<u8> {
        let turn = &self.drive.turns[promise.turn];
        let time = |time: Time| self.device_time(time.since(turn.start) + promise.start);
        let mut pose_details = false;
        let mut landmarks =
            LandmarkDataFormat { coordinates: CoordinateFormat::Cartesian, has_details: false, filter: 0 };
        let (mut has_remission, mut has_angles) = (false, false);
        for setting in &self.settings {
            match setting {
                Setting::PoseDataFormat(format) => pose_details = format.has_details,
                Setting::LandmarkDataFormat(format) => landmarks = *format,
                // One mode has distances only, another one directions too; its number is not documented.
                Setting::ScanDataFormat(format) => {
                    (has_remission, has_angles) = (format.has_remission, format.channels != 1);
                }
                _ => {}
            }
        }
        let frame = &self.drive.frame;
        let reflectors: Vec<Reflector> = turn
            .reflectors
            .iter()
            .zip(0_u16..)
            .map(|(observation, local_id)| {
                let angle = frame.angle(f64::from(observation.bearing));
                let range = f64::from(observation.range);
                let is_polar = landmarks.coordinates == CoordinateFormat::Polar;
                let cartesian = (
                    Coordinate::from_metres(range * libm::cos(angle)),
                    Coordinate::from_metres(range * libm::sin(angle)),
                );
                Reflector {
                    cartesian: (!is_polar).then_some(cartesian),
                    polar: is_polar.then(|| (Distance::from_metres(range), Angle::from_radians(angle))),
                    details: landmarks.has_details.then(|| ReflectorDetails {
                        local_id,
                        global_id: u16::MAX,
                        kind: 1,
                        subtype: 2,
                        quality: 100,
                        time: time(observation.time),
                        size: Size(80),
                        hit_count: 1,
                        mean_echo: 0,
                        start_index: 0,
                        end_index: 0,
                    }),
                }
            })
            .collect();
        let end = turn.start.offset(frame.period);
        let pose = turn.pose.map(|pose| PoseReport {
            x: Coordinate::from_metres(pose.x),
            y: Coordinate::from_metres(pose.y),
            heading: Angle::from_radians(pose.theta + frame.step(frame.zero)),
            details: pose_details.then(|| PoseDetails {
                output_mode: 0,
                time: time(end),
                mean_deviation: 0,
                mode: PositionMode::Continuous,
                info: 0,
                used_reflectors: u8::try_from(reflectors.len()).unwrap_or(u8::MAX),
            }),
        });
        let distances = Channel {
            name: ChannelName::DISTANCE,
            scale: 1.0,
            offset: 0.0,
            first: turn.first,
            resolution: turn.resolution,
            start: time(turn.start),
            samples: Sequence::Values(&turn.ranges),
        };
        let directions: Vec<u32> = (0..turn.ranges.len() as i64)
            .filter(|_| has_angles)
            .map(|beam| 10 * (i64::from(turn.first.0) + beam * i64::from(turn.resolution)).rem_euclid(360_000) as u32)
            .collect();
        let angles = Channel { name: ChannelName::ANGLE, samples: Sequence::Values(&directions), ..distances };
        let remission = Channel {
            name: ChannelName::REMISSION,
            scale: 1.0,
            offset: 0.0,
            first: turn.first,
            resolution: turn.resolution,
            start: time(turn.start),
            samples: Sequence::Values(&turn.remission),
        };
        let (wants_reflectors, wants_scan) = match promise.method {
            PromisedMethod::Data { mask, .. } => (mask != 1, mask != 0),
            PromisedMethod::Landmarks { dataset, .. } => (dataset != 1, dataset != 0),
            PromisedMethod::Pose { .. } | PromisedMethod::Mapping => (true, false),
        };
        let wants_scan = wants_scan && !turn.ranges.is_empty();
        let wants_remission = wants_scan && has_remission && !turn.remission.is_empty();
        let list = ReflectorList { filter: landmarks.filter, reflectors: Sequence::Values(&reflectors) };
        let error =
            if pose.is_some() || !matches!(promise.method, PromisedMethod::Data { .. } | PromisedMethod::Pose { .. }) {
                ErrorCode::OK
            } else {
                ErrorCode::NO_POSITION
            };
        encode_result(
            promise.dialect,
            promise.method,
            error,
            pose,
            wants_reflectors.then_some(list),
            [(wants_scan, distances), (wants_scan && has_angles, angles)]
                .into_iter()
                .filter_map(|(is_wanted, channel)| is_wanted.then_some(channel))
                .collect(),
            wants_remission.then_some(remission),
        )
    }
}

fn failure(dialect: Dialect, method: PromisedMethod, error: ErrorCode) -> Vec<u8> {
    encode_result(dialect, method, error, None, None, heapless::Vec::new(), None)
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
