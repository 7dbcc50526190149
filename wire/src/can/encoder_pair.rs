//! The encoders of driving wheel and steering as one measurement.

use super::encoder::{Encoder, EncoderEvent, EncoderReading, EncoderSettings, EncoderState, Reporting};
use super::frame::Frame;
use super::plausibility::{PlausibilityLimits, PlausibilityMonitor};
use super::sync::SyncProducer;
use agv_core::measurement::{EncoderFault, EncoderFaults, EncoderSample, Time};
use agv_core::odometry::CounterRange;

/// One of the two encoders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelSettings {
    /// How it is set up.
    pub encoder: EncoderSettings,
    /// What it does on a sound vehicle.
    pub limits: PlausibilityLimits,
}

#[derive(Clone, Debug)]
struct Channel {
    encoder: Encoder,
    monitor: PlausibilityMonitor,
    range: CounterRange,
    has_error: bool,
    before: Option<EncoderReading>,
    latest: Option<EncoderReading>,
}

impl Channel {
    fn new(settings: &ChannelSettings, start: Time) -> Self {
        let range = settings.encoder.range.unwrap_or(CounterRange::BITS_32);
        Self {
            encoder: Encoder::new(settings.encoder, start),
            monitor: PlausibilityMonitor::new(settings.limits, range, start),
            range,
            has_error: false,
            before: None,
            latest: None,
        }
    }

    /// Whether there is a new reading that can be used.
    fn handle(&mut self, frame: &Frame, time: Time) -> Option<Result<EncoderReading, (EncoderFault, EncoderReading)>> {
        match self.encoder.handle(frame, time)? {
            EncoderEvent::Reading(reading) => Some(match self.monitor.reading(reading.time, reading.position) {
                None => {
                    self.before = self.latest.replace(reading);
                    Ok(reading)
                }
                Some(fault) => {
                    self.before = None;
                    self.latest = None;
                    Err((fault, reading))
                }
            }),
            EncoderEvent::Started => {
                if let Some(identity) = self.encoder.identity() {
                    self.range = identity.range;
                    self.monitor.set_range(identity.range);
                }
                None
            }
            EncoderEvent::BootedUp => {
                self.has_error = false;
                self.before = None;
                None
            }
            EncoderEvent::Emergency(emergency) => {
                self.has_error = !emergency.is_reset();
                None
            }
            EncoderEvent::SetupFailed(_) => None,
        }
    }

    fn check(&mut self, now: Time) -> Option<EncoderFault> {
        if self.encoder.identity().is_some_and(|identity| identity.tells_other_range) {
            self.monitor.raise(EncoderFault::WrongRange, now);
        } else if self.has_error {
            self.monitor.raise(EncoderFault::Reported, now);
        } else if self.encoder.is_heartbeat_lost(now) {
            self.monitor.raise(EncoderFault::HeartbeatLost, now);
        }
        self.monitor.check(now)
    }

    /// The counter at `time`, if it lies between the last two readings or at one of them.
    fn at(&self, time: Time) -> Option<u32> {
        let latest = self.latest?;
        if latest.time == time {
            return Some(latest.position);
        }
        let before = self.before?;
        if time < before.time || time > latest.time {
            return None;
        }
        let share = time.since(before.time) / latest.time.since(before.time);
        let step = self.range.step(before.position, latest.position) as f64;
        let moved = libm::round(step * share) as i64;
        Some(self.range.wrap(i64::from(before.position).saturating_add(moved)))
    }
}

/// Sets up two encoders, watches them, and puts their positions together.
///
/// A sample is true when the driving wheel's counter was read; the steering angle is that of the same moment, between
/// two readings if it must be. So no way is ever invented: the counters of the driving wheel are the real ones. A fault
/// of either encoder gives no samples while it lasts. After a jump of the driving wheel's counter the samples go on from
/// the last good value: the way that was driven meanwhile is lost, but no false way is reported.
#[derive(Clone, Debug)]
pub struct EncoderPair {
    drive: Channel,
    steering: Channel,
    sync: Option<SyncProducer>,
    /// What is taken from the driving wheel's counter, ticks.
    drive_offset: u32,
    /// The counter of the last sample, to go on from after a jump.
    last_drive: Option<u32>,
    /// A reading of the driving wheel that waits for the steering.
    waiting: Option<EncoderReading>,
    /// What was said of faults last.
    told_faults: EncoderFaults,
}

/// Time between two reports of a fault that lasts, s.
pub const FAULT_PERIOD: f64 = 0.010;

impl EncoderPair {
    /// Two encoders that have not been heard. If one reports at SYNC, and no other master sees to it, the
    /// pair sends SYNC every `sync_period` seconds.
    #[must_use]
    pub fn new(drive: &ChannelSettings, steering: &ChannelSettings, sync_period: f64, start: Time) -> Self {
        let is_synchronous = [drive, steering]
            .iter()
            .any(|channel| channel.encoder.has_master() && channel.encoder.reporting == Reporting::Synchronous);
        Self {
            drive: Channel::new(drive, start),
            steering: Channel::new(steering, start),
            sync: is_synchronous.then(|| SyncProducer::new(sync_period, start)),
            drive_offset: 0,
            last_drive: None,
            waiting: None,
            told_faults: EncoderFaults::default(),
        }
    }

    /// Takes a frame that was received at `time`; gives a sample if it completes one.
    pub fn handle(&mut self, frame: &Frame, time: Time) -> Option<EncoderSample> {
        match self.drive.handle(frame, time) {
            Some(Ok(reading)) => self.waiting = Some(reading),
            Some(Err((EncoderFault::Jumped, reading))) => {
                self.waiting = None;
                if let Some(last) = self.last_drive {
                    self.drive_offset = self.less(reading.position, last);
                }
            }
            Some(Err(_)) => self.waiting = None,
            None => {}
        }
        self.steering.handle(frame, time);
        self.sample(time)
    }

    /// The difference of two counters of the driving wheel, modulo its range.
    fn less(&self, position: u32, amount: u32) -> u32 {
        self.drive.range.wrap(i64::from(position) - i64::from(amount))
    }

    fn sample(&mut self, now: Time) -> Option<EncoderSample> {
        let reading = self.waiting?;
        let steering = self.steering.at(reading.time)?;
        self.waiting = None;
        if self.faults(now).any() {
            return None;
        }
        let drive = self.less(reading.position, self.drive_offset);
        self.last_drive = Some(drive);
        Some(EncoderSample { time: reading.time, drive, steering })
    }

    /// The next frame to send. Call until there is none.
    pub fn poll(&mut self, now: Time) -> Option<Frame> {
        if let Some(frame) = self.sync.as_mut().and_then(|sync| sync.poll(now)) {
            self.drive.encoder.note_sync(now);
            self.steering.encoder.note_sync(now);
            return Some(frame);
        }
        let (frame, _) = self.drive.encoder.poll(now);
        frame.or_else(|| self.steering.encoder.poll(now).0)
    }

    /// The faults that the encoders have now.
    pub fn faults(&mut self, now: Time) -> EncoderFaults {
        EncoderFaults { time: now, drive: self.drive.check(now), steering: self.steering.check(now) }
    }

    /// What there is to say of faults: when they change, and every [`FAULT_PERIOD`] seconds while there are any.
    pub fn poll_faults(&mut self, now: Time) -> Option<EncoderFaults> {
        let faults = self.faults(now);
        let told = self.told_faults;
        let has_changed = (faults.drive, faults.steering) != (told.drive, told.steering);
        let is_due = faults.any() && now.since(told.time) >= FAULT_PERIOD;
        (has_changed || is_due).then(|| {
            self.told_faults = faults;
            faults
        })
    }

    /// Where the master is with the encoders: driving wheel, steering.
    #[must_use]
    pub const fn states(&self) -> [EncoderState; 2] {
        [self.drive.encoder.state(), self.steering.encoder.state()]
    }

    /// The encoders: driving wheel, steering.
    #[must_use]
    pub const fn encoders(&self) -> [&Encoder; 2] {
        [&self.drive.encoder, &self.steering.encoder]
    }

    /// Others know that the vehicle stands still.
    pub fn expect_standstill(&mut self) {
        self.drive.monitor.expect_standstill();
        self.steering.monitor.expect_standstill();
    }

    /// Others know that the driving wheel turns at least so fast, ticks/s of either sign; 0 if nobody knows.
    pub fn expect_motion(&mut self, drive_speed: f64, now: Time) {
        self.drive.monitor.expect_motion(drive_speed, now);
    }
}
