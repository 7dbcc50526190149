//! The methods of the sensor.

use agv_wire::cola::{Dialect, Fault, Sequence};
use agv_wire::nav350::{
    Answer, ErrorCode, IdentifiedLandmark, LayoutLandmark, Method, MethodName, MethodResult, OperatingMode,
    SpeedReport, UserLevel,
};

use super::encoding::{encode, refuse};
use super::pending::Pending;
use super::promise::PromisedMethod;
use super::sensor::Sensor;

/// Whether a method is for authorised clients only.
fn needs_level(name: MethodName) -> bool {
    !matches!(
        name,
        MethodName::SetAccessMode
            | MethodName::ChangeState
            | MethodName::DoMapping
            | MethodName::GetTimestamp
            | MethodName::GetData
            | MethodName::GetPose
            | MethodName::GetLandmarkData
            | MethodName::GetLandmarks
            | MethodName::GetLayer
            | MethodName::GetLayout
            | MethodName::SetSpeed
    )
}

/// The methods that are answered at the end of a turn, and whether one that begins now is waited for.
fn slow(method: &Method) -> Option<(PromisedMethod, bool)> {
    Some(match method {
        Method::GetData { wait, mask } => (PromisedMethod::Data { wait: *wait, mask: *mask as u8 }, *wait),
        Method::GetPose { wait } => (PromisedMethod::Pose { wait: *wait }, *wait),
        Method::GetLandmarkData { wait, dataset } => {
            (PromisedMethod::Landmarks { wait: *wait, dataset: *dataset }, *wait)
        }
        Method::DoMapping => (PromisedMethod::Mapping, true),
        _ => return None,
    })
}

impl Sensor {
    pub(super) fn call(&mut self, dialect: Dialect, method: &Method, now: f64, pending: &mut Pending) -> Vec<u8> {
        let name = method.name();
        if needs_level(name) && self.level < UserLevel::AuthorisedClient.number() {
            return refuse(dialect, Fault::ACCESS_DENIED);
        }
        if let Some((method, wait)) = slow(method) {
            return self.promise(dialect, name, method, wait, now, pending);
        }
        let ids = |error, ids: &[u16]| {
            encode(dialect, &Answer::Result(MethodResult::LandmarkIds(name, error, Sequence::Values(ids))))
        };
        let result = match method {
            Method::SetAccessMode { level, password } => MethodResult::AccessMode(self.log_in(*level, *password)),
            Method::ChangeState(mode) => {
                self.mode = *mode;
                MethodResult::State(ErrorCode::OK, Some(*mode))
            }
            Method::GetTimestamp => MethodResult::Timestamp(ErrorCode::OK, self.device_time(now)),
            Method::SetSpeed(speed) => MethodResult::Plain(name, Some(self.set_speed(*speed))),
            Method::EraseLayout(_) => MethodResult::Plain(name, Some(self.edit(Vec::clear))),
            Method::AddLandmarks(landmarks) => {
                let mut added = Vec::new();
                let error = self.edit(|layout| added = add(layout, landmarks.iter()));
                return ids(error, &added);
            }
            Method::SetLandmarks(landmarks) => {
                let error = self.edit(|layout| landmarks.iter().for_each(|landmark| set(layout, landmark)));
                MethodResult::Plain(name, Some(error))
            }
            Method::DeleteLandmarks(ids) => {
                let error = self.edit(|layout| layout.retain(|known| !ids.iter().any(|id| id == known.id)));
                MethodResult::Plain(name, Some(error))
            }
            Method::GetLandmarks(ids) => {
                let wanted: Vec<_> =
                    ids.iter().filter_map(|id| self.layout.iter().find(|known| known.id == id).cloned()).collect();
                let error = if wanted.len() == ids.len() { ErrorCode::OK } else { ErrorCode::INVALID_DATA };
                return encode(dialect, &Answer::Result(MethodResult::Landmarks(error, Sequence::Values(&wanted))));
            }
            Method::GetLayer(layer) => {
                let in_layer = self.layout.iter().filter(|known| known.landmark.layers.contains(layer));
                return ids(ErrorCode::OK, &in_layer.map(|known| known.id).collect::<Vec<u16>>());
            }
            Method::GetLayout => {
                return ids(ErrorCode::OK, &self.layout.iter().map(|known| known.id).collect::<Vec<u16>>());
            }
            _ => MethodResult::Plain(name, Some(ErrorCode::OK)),
        };
        let result = encode(dialect, &Answer::Result(result));
        if name.is_slow() { self.accept(dialect, name, result, now, pending) } else { result }
    }

    /// Accepts a method that is answered at the end of a turn, or says why not.
    fn promise(
        &mut self,
        dialect: Dialect,
        name: MethodName,
        method: PromisedMethod,
        wait: bool,
        now: f64,
        pending: &mut Pending,
    ) -> Vec<u8> {
        let problem = if pending.promise.is_some() {
            Some(ErrorCode::ALREADY_ACTIVE)
        } else {
            (self.mode != method.needed_mode()).then_some(ErrorCode::WRONG_MODE)
        };
        if let Some(error) = problem {
            return self.accept(dialect, name, method.failure(dialect, error), now, pending);
        }
        pending.promise = Some(self.promised(dialect, method, wait, now));
        encode(dialect, &Answer::Accepted(name))
    }

    /// An acknowledgement, and the result now or after the gap.
    fn accept(&self, dialect: Dialect, name: MethodName, result: Vec<u8>, now: f64, pending: &mut Pending) -> Vec<u8> {
        let mut bytes = encode(dialect, &Answer::Accepted(name));
        if self.gap > 0.0 {
            pending.delay(now + self.gap, result);
        } else {
            bytes.extend(result);
        }
        bytes
    }

    /// Whether that user has that password.
    fn log_in(&mut self, level: u8, password: u32) -> bool {
        let levels = [UserLevel::Maintenance, UserLevel::AuthorisedClient, UserLevel::Service];
        let is_granted = levels.iter().any(|known| (known.number(), known.default_password()) == (level, password));
        if is_granted {
            self.level = level;
        }
        is_granted
    }

    fn set_speed(&mut self, speed: SpeedReport) -> ErrorCode {
        if self.mode != OperatingMode::Navigation {
            return ErrorCode::WRONG_MODE;
        }
        self.speed = Some(speed);
        ErrorCode::OK
    }

    /// Changes the layout, in the modes that allow it.
    fn edit(&mut self, change: impl FnOnce(&mut Vec<IdentifiedLandmark>)) -> ErrorCode {
        if !matches!(self.mode, OperatingMode::Standby | OperatingMode::Mapping) {
            return ErrorCode::WRONG_MODE;
        }
        change(&mut self.layout);
        ErrorCode::OK
    }
}

/// Adds landmarks; the names that they are given.
fn add(layout: &mut Vec<IdentifiedLandmark>, landmarks: impl Iterator<Item = LayoutLandmark>) -> Vec<u16> {
    let mut ids = Vec::new();
    for landmark in landmarks {
        let id = layout.iter().map(|known| known.id + 1).max().unwrap_or(0);
        layout.push(IdentifiedLandmark { id, landmark });
        ids.push(id);
    }
    ids
}

fn set(layout: &mut Vec<IdentifiedLandmark>, landmark: IdentifiedLandmark) {
    match layout.iter_mut().find(|known| known.id == landmark.id) {
        Some(known) => *known = landmark,
        None => layout.push(landmark),
    }
}
