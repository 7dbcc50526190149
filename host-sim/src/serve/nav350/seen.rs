//! What a sensor says of one turn: its pose, the reflectors and the scan, in the formats that were asked for.

use agv_core::geometry::{Point, Pose};
use agv_core::measurement::{ReflectorObservation, Time};
use agv_wire::cola::{Element, Sequence};
use agv_wire::nav350::{
    Angle, Channel, ChannelName, Coordinate, CoordinateFormat, DeviceTime, Distance, IdentifiedLandmark,
    LandmarkDataFormat, Milliangle, PoseDataFormat, PoseDetails, PoseReport, PositionMode, Reflector, ReflectorDetails,
    ScanDataFormat, Setting, Size,
};

use super::drive::Turn;
use super::sensor::Sensor;

/// Reflectors that a pose needs, by the maker's word.
const REFLECTORS_OF_A_POSE: usize = 3;

/// Farthest that a reflector is from its place in the layout, m.
const NEAR: f64 = 0.3;

/// One turn as a sensor has seen it.
#[derive(Clone, Copy)]
pub(super) struct Seen<'a> {
    sensor: &'a Sensor,
    turn: &'a Turn,
    /// True pose of S at its beginning.
    before: Option<Pose>,
    /// When the turn began, in the sensor's time, s.
    start: f64,
}

impl Sensor {
    /// The turn of that number, which began at `start`, s in the sensor's time.
    pub(super) fn seen(&self, number: usize, start: f64) -> Seen<'_> {
        let turns = &self.drive.turns;
        let before = number.checked_sub(1).and_then(|before| turns[before].pose);
        Seen { sensor: self, turn: &turns[number], before: before.or(turns[number].pose), start }
    }
}

/// The numbers of a scan that was asked for.
#[derive(Default)]
pub(super) struct SeenScan {
    ranges: Vec<u32>,
    directions: Vec<u32>,
    remission: Vec<u16>,
}

impl<'a> Seen<'a> {
    fn time(&self, time: Time) -> DeviceTime {
        self.sensor.device_time(time.since(self.turn.start) + self.start)
    }

    fn setting<T>(&self, wanted: impl Fn(&Setting<'static>) -> Option<T>) -> Option<T> {
        self.sensor.settings.iter().find_map(wanted)
    }

    fn pose_format(&self) -> PoseDataFormat {
        let format = self.setting(|setting| match setting {
            Setting::PoseDataFormat(format) => Some(*format),
            _ => None,
        });
        format.unwrap_or(PoseDataFormat { is_extrapolated: false, has_details: false })
    }

    /// What is to be said of reflectors.
    pub(super) fn landmark_format(&self) -> LandmarkDataFormat {
        let format = self.setting(|setting| match setting {
            Setting::LandmarkDataFormat(format) => Some(*format),
            _ => None,
        });
        format.unwrap_or(LandmarkDataFormat { coordinates: CoordinateFormat::Cartesian, has_details: false, filter: 0 })
    }

    fn scan_format(&self) -> ScanDataFormat {
        let format = self.setting(|setting| match setting {
            Setting::ScanDataFormat(format) => Some(*format),
            _ => None,
        });
        format.unwrap_or(ScanDataFormat { channels: 1, has_remission: false })
    }

    /// The names that the reflectors of the turn have in the layout.
    fn identities(&self) -> Vec<Option<u16>> {
        let period = self.sensor.drive.frame.period;
        let place = |observation: &ReflectorObservation| {
            let (before, after) = (self.before?, self.turn.pose?);
            let (way, share) = (before.between(&after), observation.time.since(self.turn.start) / period);
            let pose = before.compose(&Pose::new(share * way.x, share * way.y, share * way.theta));
            let (sine, cosine) = libm::sincos(f64::from(observation.bearing));
            let range = f64::from(observation.range);
            Some(pose.transform(&Point::new(range * cosine, range * sine)))
        };
        let named = |observation| {
            let place = place(observation)?;
            let beside = |known: &IdentifiedLandmark| {
                (known.landmark.x.metres() - place.x).powi(2) + (known.landmark.y.metres() - place.y).powi(2)
            };
            let known = self.sensor.layout().iter().map(|known| (beside(known), known.id));
            let (square, id) = known.min_by(|(one, _), (other, _)| one.total_cmp(other))?;
            (square <= NEAR * NEAR).then_some(id)
        };
        self.turn.reflectors.iter().map(named).collect()
    }

    /// The pose at the end of the turn, if it is known.
    pub(super) fn pose(&self) -> Option<PoseReport> {
        let frame = self.sensor.frame();
        let (pose, format) = (self.turn.pose?, self.pose_format());
        let details = format.has_details.then(|| {
            let used = self.identities().iter().flatten().count();
            PoseDetails {
                output_mode: format.is_extrapolated.into(),
                time: self.time(self.turn.start.offset(frame.period)),
                mean_deviation: 0,
                mode: match used {
                    0 => PositionMode::Invalid,
                    few if few < REFLECTORS_OF_A_POSE => PositionMode::Virtual,
                    _ => PositionMode::Continuous,
                },
                info: 0,
                used_reflectors: u8::try_from(used).unwrap_or(u8::MAX),
            }
        });
        Some(PoseReport {
            x: Coordinate::from_metres(pose.x),
            y: Coordinate::from_metres(pose.y),
            heading: Angle::from_radians(pose.theta + frame.step(frame.zero)),
            details,
        })
    }

    /// The reflectors, seen from the sensor.
    pub(super) fn reflectors(&self) -> Vec<Reflector> {
        let (frame, format) = (self.sensor.frame(), self.landmark_format());
        let identities = if format.has_details { self.identities() } else { vec![None; self.turn.reflectors.len()] };
        let reflectors = self.turn.reflectors.iter().zip(identities).zip(0_u16..);
        let reflectors = reflectors.map(|((observation, global_id), local_id)| {
            let angle = frame.angle(f64::from(observation.bearing));
            let range = f64::from(observation.range);
            let details = ReflectorDetails {
                global_id: global_id.unwrap_or(u16::MAX),
                ..details(local_id, self.time(observation.time))
            };
            reflector(&format, range, angle, details)
        });
        reflectors.collect()
    }

    /// The scan; nothing if there is none.
    pub(super) fn scan(&self) -> SeenScan {
        let (turn, format) = (self.turn, self.scan_format());
        // One mode has distances only, another one directions too; its number is not documented.
        let has_angles = format.channels != 1;
        let first = i64::from(self.first().0);
        let directions = (0..turn.ranges.len() as i64)
            .filter(|_| has_angles)
            .map(|beam| 10 * (first + beam * i64::from(turn.resolution)).rem_euclid(360_000) as u32);
        let mut ranges = turn.ranges.clone();
        let mut remission = if format.has_remission { turn.remission.clone() } else { Vec::new() };
        if self.sensor.is_turned() {
            ranges.reverse();
            remission.reverse();
        }
        SeenScan { ranges, directions: directions.collect(), remission }
    }

    /// Direction of the first beam. Beams are listed by growing angles: of a sensor whose angles grow the other way, from the last one on.
    fn first(&self) -> Milliangle {
        let Turn { first, resolution, ranges, .. } = self.turn;
        let beams = i32::try_from(ranges.len().saturating_sub(1)).unwrap_or(i32::MAX);
        if self.sensor.is_turned() { Milliangle(-(first.0 + beams * i32::from(*resolution))) } else { *first }
    }

    fn channel<'b, T: Element>(&self, name: ChannelName, samples: &'b [T]) -> Channel<'b, T> {
        Channel {
            name,
            scale: 1.0,
            offset: 0.0,
            first: self.first(),
            resolution: self.turn.resolution,
            start: self.time(self.turn.start),
            samples: Sequence::Values(samples),
        }
    }
}

impl SeenScan {
    /// Distances, and directions if they were asked for.
    pub(super) fn channels(&self, seen: &Seen) -> heapless::Vec<Channel<'_, u32>, 2> {
        let all = [(ChannelName::DISTANCE, &self.ranges), (ChannelName::ANGLE, &self.directions)];
        let all = all.into_iter().filter(|(_, samples)| !samples.is_empty());
        all.map(|(name, samples)| seen.channel(name, samples)).collect()
    }

    /// Strengths of echoes, if they were asked for and are known.
    pub(super) fn remission(&self, seen: &Seen) -> Option<Channel<'_, u16>> {
        (!self.remission.is_empty()).then(|| seen.channel(ChannelName::REMISSION, &self.remission))
    }
}

/// Time and identity of a reflector that was seen now.
pub(super) fn details(local_id: u16, time: DeviceTime) -> ReflectorDetails {
    ReflectorDetails {
        local_id,
        global_id: u16::MAX,
        kind: 1,
        subtype: 2,
        quality: 100,
        time,
        size: Size(80),
        hit_count: 1,
        mean_echo: 0,
        start_index: 0,
        end_index: 0,
    }
}

/// A reflector at a distance, m, in a direction, rad, as it was asked for.
pub(super) fn reflector(format: &LandmarkDataFormat, range: f64, angle: f64, details: ReflectorDetails) -> Reflector {
    let is_polar = format.coordinates == CoordinateFormat::Polar;
    let cartesian = || {
        let (sine, cosine) = libm::sincos(angle);
        (Coordinate::from_metres(range * cosine), Coordinate::from_metres(range * sine))
    };
    Reflector {
        cartesian: (!is_polar).then(cartesian),
        polar: is_polar.then(|| (Distance::from_metres(range), Angle::from_radians(angle))),
        details: format.has_details.then_some(details),
    }
}
