//! One revolution of the sensor as the localiser takes it.

use heapless::Vec;

use super::{
    Channel, ChannelName, ErrorCode, LandmarkData, NavigationData, PoseReport, PositionMode, Reflector, ReflectorList,
    SensorClock, SensorFrame,
};
use agv_core::geometry::{Pose, wrap};
use agv_core::localizer::OBSERVATIONS;
use agv_core::measurement::{LaserId, ReflectorObservation, Reflectors, Scan, ScanHead, Time};
use agv_core::order::{Evenly, insertion_sort_by};

/// Why an answer did not become a revolution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RevolutionError {
    /// The sensor's clock is not known yet.
    Clock,
    /// More beams than there is room for.
    Beams,
    /// The distances have no scale, or the beams no angle between them.
    Channel,
}

/// The pose that the sensor itself has found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorPose {
    /// When it is true, if the sensor says so.
    pub time: Option<Time>,
    /// Pose of S in the sensor's layout.
    pub pose: Pose,
    /// What it rests on, if the sensor says so.
    pub mode: Option<PositionMode>,
}

/// A scan whose beams are elsewhere.
#[derive(Clone, Copy, Debug)]
struct TakenScan {
    head: ScanHead,
    ranges: usize,
    intensities: usize,
}

/// Scan, reflectors and pose of one answer, in metres, radians, the frame S and the vehicle's clock, with room for
/// `BEAMS` beams and `REFLECTORS` reflectors. Of more reflectors as many are kept, from all around; by itself it has room for
/// one more than a localiser, which so knows of it and says so.
#[derive(Clone, Debug)]
pub struct Revolution<const BEAMS: usize = 1440, const REFLECTORS: usize = { OBSERVATIONS + 1 }> {
    laser: LaserId,
    ranges: [f32; BEAMS],
    intensities: [u16; BEAMS],
    scan: Option<TakenScan>,
    reflectors: Option<Vec<ReflectorObservation, REFLECTORS>>,
    pose: Option<SensorPose>,
    error: ErrorCode,
}

impl<const BEAMS: usize, const REFLECTORS: usize> Default for Revolution<BEAMS, REFLECTORS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const BEAMS: usize, const REFLECTORS: usize> Revolution<BEAMS, REFLECTORS> {
    /// Nothing yet, of the laser of a vehicle that has one.
    #[must_use]
    pub const fn new() -> Self {
        Self::of(LaserId::FIRST)
    }

    /// Nothing yet of one of the vehicle's lasers.
    #[must_use]
    pub const fn of(laser: LaserId) -> Self {
        Self {
            laser,
            ranges: [0.0; BEAMS],
            intensities: [0; BEAMS],
            scan: None,
            reflectors: None,
            pose: None,
            error: ErrorCode::OK,
        }
    }

    /// The ranges, if the answer had any.
    #[must_use]
    pub fn scan(&self) -> Option<Scan<'_>> {
        let TakenScan { head, ranges, intensities } = self.scan?;
        Some(head.scan(self.ranges.get(..ranges)?, self.intensities.get(..intensities)?))
    }

    /// The reflectors, if the answer had a list of them. It may be empty.
    #[must_use]
    pub fn reflectors(&self) -> Option<Reflectors<'_>> {
        self.reflectors.as_ref().map(|observations| Reflectors { laser: self.laser, observations })
    }

    /// The pose that the sensor itself has found, if any.
    #[must_use]
    pub const fn pose(&self) -> Option<SensorPose> {
        self.pose
    }

    /// How the method ended.
    #[must_use]
    pub const fn error(&self) -> ErrorCode {
        self.error
    }

    /// Takes the answer of [`GetData`](super::Method::GetData).
    ///
    /// # Errors
    /// If it cannot be converted; the revolution is then empty.
    pub fn take(
        &mut self,
        data: &NavigationData,
        clock: &SensorClock,
        frame: &SensorFrame,
    ) -> Result<(), RevolutionError> {
        self.take_parts(data.reflectors.as_ref(), &data.channels, data.remission.as_ref(), clock, frame)?;
        self.error = data.error;
        self.pose = data.pose.as_ref().map(|pose| sensor_pose(pose, clock, frame));
        Ok(())
    }

    /// Takes the answer of [`GetLandmarkData`](super::Method::GetLandmarkData).
    ///
    /// # Errors
    /// If it cannot be converted; the revolution is then empty.
    pub fn take_landmarks(
        &mut self,
        data: &LandmarkData,
        clock: &SensorClock,
        frame: &SensorFrame,
    ) -> Result<(), RevolutionError> {
        self.take_parts(data.reflectors.as_ref(), &data.channels, data.remission.as_ref(), clock, frame)?;
        self.error = data.error;
        Ok(())
    }

    fn take_parts(
        &mut self,
        reflectors: Option<&ReflectorList>,
        channels: &[Channel<u32>],
        remission: Option<&Channel<u16>>,
        clock: &SensorClock,
        frame: &SensorFrame,
    ) -> Result<(), RevolutionError> {
        (self.scan, self.reflectors, self.pose) = (None, None, None);
        let distances = channels.iter().find(|channel| channel.name == ChannelName::DISTANCE);
        let scan = match distances {
            Some(distances) => Some(self.take_scan(distances, remission, clock, frame)?),
            None => None,
        };
        if let Some(list) = reflectors {
            self.reflectors = Some(take_reflectors(list, scan.as_ref(), clock, frame)?);
        }
        self.scan = scan;
        Ok(())
    }

    fn take_scan(
        &mut self,
        distances: &Channel<u32>,
        remission: Option<&Channel<u16>>,
        clock: &SensorClock,
        frame: &SensorFrame,
    ) -> Result<TakenScan, RevolutionError> {
        let is_scaled = distances.scale.is_finite() && distances.scale > 0.0 && distances.offset.is_finite();
        if !is_scaled || distances.resolution == 0 {
            return Err(RevolutionError::Channel);
        }
        let step = f64::from(distances.resolution) * 1e-3 * (core::f64::consts::PI / 180.0);
        let intensities = match remission {
            // Strengths belong to beams only if there is one for each.
            Some(remission) if remission.samples.len() == distances.samples.len() => {
                remission.copy(&mut self.intensities).ok_or(RevolutionError::Beams)?
            }
            _ => 0,
        };
        let head = ScanHead {
            laser: self.laser,
            start: clock.to_local(distances.start).ok_or(RevolutionError::Clock)?,
            beam_interval: frame.interval(step),
            first_bearing: frame.bearing(distances.first.radians()),
            bearing_step: frame.step(step),
        };
        Ok(TakenScan {
            head,
            ranges: distances.copy_metres(&mut self.ranges).ok_or(RevolutionError::Beams)?,
            intensities,
        })
    }
}

fn sensor_pose(report: &PoseReport, clock: &SensorClock, frame: &SensorFrame) -> SensorPose {
    SensorPose {
        time: report.details.and_then(|details| clock.to_local(details.time)),
        pose: frame.pose(report),
        mode: report.details.map(|details| details.mode),
    }
}

/// Reflectors without a place, or without a time and a scan that tells it, are left out.
fn take_reflectors<const N: usize>(
    list: &ReflectorList,
    scan: Option<&TakenScan>,
    clock: &SensorClock,
    frame: &SensorFrame,
) -> Result<Vec<ReflectorObservation, N>, RevolutionError> {
    if !clock.is_known() {
        return Err(RevolutionError::Clock);
    }
    let usable = || list.reflectors.iter().filter_map(|reflector| observation(&reflector, scan, clock, frame));
    let mut choice = Evenly::new(N, usable().count());
    let mut observations = Vec::new();
    for observation in usable().filter(|_| choice.takes()) {
        // No more are taken than there is room for.
        let _ = observations.push(observation);
    }
    insertion_sort_by(&mut observations, |a: &ReflectorObservation, b| a.time.cmp(&b.time));
    Ok(observations)
}

fn observation(
    reflector: &Reflector,
    scan: Option<&TakenScan>,
    clock: &SensorClock,
    frame: &SensorFrame,
) -> Option<ReflectorObservation> {
    // Distance and direction are finer than the sensor's Cartesian coordinates for near reflectors.
    let (range, angle) = match (reflector.polar, reflector.cartesian) {
        (Some((distance, direction)), _) => (distance.metres(), direction.radians()),
        (None, Some((x, y))) => (libm::hypot(x.metres(), y.metres()), libm::atan2(y.metres(), x.metres())),
        (None, None) => return None,
    };
    let bearing = wrap(frame.bearing(angle));
    let time = match (reflector.details, scan) {
        (Some(details), _) => clock.to_local(details.time)?,
        (None, Some(TakenScan { head, ranges, .. })) => {
            let turn = libm::remainder((bearing - head.first_bearing) / head.bearing_step, *ranges as f64);
            let beam = if turn < 0.0 { turn + *ranges as f64 } else { turn };
            head.start.offset(beam * head.beam_interval)
        }
        (None, None) => return None,
    };
    Some(ReflectorObservation { time, range: range as f32, bearing: bearing as f32 })
}
