//! What the vehicle's own controller says of its motion, and whether it is silent.

use agv_core::measurement::{EncoderFault, EncoderFaults, Time};
use agv_core::odometry::Vehicle;
use agv_wire::can::encoder_group::FAULT_PERIOD;
use agv_wire::can::frame::{Frame, Id};
use agv_wire::can::motion_frames::{IncrementReports, MotionFrames, SpeedReports};
use heapless::Vec;

use super::{BusEvent, EncoderNodes, add};

/// Silences after which a report is late and missing, in periods: those of encoders
/// ([`agv_wire::can::plausibility::PlausibilityLimits::every`]).
const LATE: f64 = 2.5;
const MISSING: f64 = 4.5;

/// Increments further apart, in periods, are no neighbours: what those between them held is lost. Each may come late by half a period.
const LOST: f64 = 1.5;

/// Of so many periods the mean is taken.
const MEMORY: f64 = 16.0;

#[derive(Clone, Copy, Debug)]
enum Reports {
    Speed(SpeedReports),
    Increments(IncrementReports),
}

/// The reports of the vehicle's own controller.
#[derive(Clone, Copy, Debug)]
pub(super) struct OwnReports {
    reports: Reports,
    frames: MotionFrames,
    period: f64,
    /// The mean time between reports of late, s.
    interval: f64,
    heard: Time,
    told: EncoderFaults,
}

impl OwnReports {
    /// Those of a vehicle that was not heard before `start`; none if it tells counters, or nobody knows its frames.
    pub fn of(nodes: &EncoderNodes, vehicle: &Vehicle, start: Time) -> Option<Self> {
        let (frames, period) = (nodes.motion_frames?, nodes.period());
        let reports = match vehicle {
            Vehicle::Ackermann(_) | Vehicle::TricycleSpeed(_) => Reports::Speed(SpeedReports::new(&frames, period)),
            Vehicle::Increments => Reports::Increments(IncrementReports::new(&frames, period)),
            Vehicle::Tricycle(_) | Vehicle::Wheels(_) => return None,
        };
        Some(Self { reports, frames, period, interval: period, heard: start, told: EncoderFaults::default() })
    }

    /// Identifiers of their frames.
    pub fn ids(&self) -> Vec<Id, 2> {
        let mut ids = Vec::new();
        match &self.reports {
            Reports::Speed(_) => self.frames.speed_ids().into_iter().for_each(|id| add(&mut ids, Some(id))),
            Reports::Increments(_) => add(&mut ids, Some(self.frames.increment_id())),
        }
        ids
    }

    /// Takes a frame that came at `heard`; tells before an increment that others were lost.
    pub fn hear(&mut self, frame: &Frame, heard: Time, mut tell: impl FnMut(BusEvent)) {
        match &mut self.reports {
            Reports::Speed(reports) => {
                let Some(sample) = reports.handle(frame, heard) else { return };
                tell(BusEvent::Speed(sample));
            }
            Reports::Increments(reports) => {
                let Some(increment) = reports.handle(frame, heard) else { return };
                let apart = heard.since(self.heard);
                let are_lost = apart > LOST * self.interval.max(self.period);
                if are_lost && !self.told.any() {
                    self.told =
                        EncoderFaults { time: increment.time, drive: Some(EncoderFault::Missing), steering: None };
                    tell(BusEvent::EncoderFaults(self.told));
                }
                self.interval += (apart.min(MISSING * self.period) - self.interval) / MEMORY;
                tell(BusEvent::Increment(increment));
            }
        }
        self.heard = heard;
    }

    /// What there is to say of silence: when it begins, changes or ends, and every [`FAULT_PERIOD`] seconds while it lasts.
    pub fn poll_faults(&mut self, now: Time) -> Option<EncoderFaults> {
        let silence = now.since(self.heard);
        let drive = match () {
            () if silence > MISSING * self.period => Some(EncoderFault::Missing),
            () if silence > LATE * self.period => Some(EncoderFault::Late),
            () => None,
        };
        let is_due = drive.is_some() && now.since(self.told.time) >= FAULT_PERIOD;
        (drive != self.told.drive || is_due).then(|| {
            self.told = EncoderFaults { time: now, drive, steering: None };
            self.told
        })
    }
}
