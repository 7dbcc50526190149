//! The encoders of a vehicle as one measurement.

use heapless::Vec;

use super::encoder::{Encoder, EncoderEvent, EncoderReading, EncoderSettings, EncoderState, Reporting};
use super::frame::Frame;
use super::plausibility::{PlausibilityLimits, PlausibilityMonitor};
use super::sync::SyncProducer;
use agv_core::measurement::{EncoderFault, EncoderFaults, Time};
use agv_core::odometry::{Counted, CounterRange, MOST_COUNTERS};

/// One of the encoders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelSettings {
    /// How it is set up.
    pub encoder: EncoderSettings,
    /// What it does on a sound vehicle.
    pub limits: PlausibilityLimits,
    /// What it counts.
    pub counted: Counted,
}

/// The counters of all encoders at one time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counts {
    /// When they were read.
    pub time: Time,
    /// Ticks, in the order of the encoders; those that the vehicle does not have are zero.
    pub counts: [u32; MOST_COUNTERS],
}

#[derive(Clone, Debug)]
struct Channel {
    encoder: Encoder,
    monitor: PlausibilityMonitor,
    counted: Counted,
    range: CounterRange,
    has_error: bool,
    before: Option<EncoderReading>,
    latest: Option<EncoderReading>,
    /// What is taken from the counter, ticks.
    offset: u32,
    /// What was told of the counter last, to go on from after a jump.
    told: Option<u32>,
}

impl Channel {
    fn new(settings: &ChannelSettings, start: Time) -> Self {
        let range = settings.encoder.range.unwrap_or(CounterRange::BITS_32);
        Self {
            encoder: Encoder::new(settings.encoder, start),
            monitor: PlausibilityMonitor::new(settings.limits, range, start),
            counted: settings.counted,
            range,
            has_error: false,
            before: None,
            latest: None,
            offset: 0,
            told: None,
        }
    }

    /// Whether there is a new reading that can be used.
    fn handle(&mut self, frame: &Frame, time: Time) -> Option<Result<EncoderReading, EncoderFault>> {
        match self.encoder.handle(frame, time)? {
            EncoderEvent::Reading(reading) => Some(match self.monitor.reading(reading.time, reading.position) {
                None => {
                    self.before = self.latest.replace(reading);
                    Ok(reading)
                }
                Some(fault) => {
                    self.before = None;
                    self.latest = None;
                    // An angle is where it is; a way goes on from where it was.
                    if let (EncoderFault::Jumped, Counted::Turn, Some(told)) = (fault, self.counted, self.told) {
                        self.offset = self.less(reading.position, told);
                    }
                    Err(fault)
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
        } else if self.encoder.identity().is_some_and(|identity| identity.tells_other_direction) {
            self.monitor.raise(EncoderFault::WrongDirection, now);
        } else if self.has_error {
            self.monitor.raise(EncoderFault::Reported, now);
        } else if self.encoder.is_heartbeat_lost(now) {
            self.monitor.raise(EncoderFault::HeartbeatLost, now);
        }
        self.monitor.check(now)
    }

    /// The difference of two counters, modulo their range.
    fn less(&self, position: u32, amount: u32) -> u32 {
        self.range.wrap(i64::from(position) - i64::from(amount))
    }

    /// What is told of the counter at `time`, if it lies between the last two readings or at one of them.
    fn at(&self, time: Time) -> Option<u32> {
        Some(self.less(self.position_at(time)?, self.offset))
    }

    fn position_at(&self, time: Time) -> Option<u32> {
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

/// Sets up the encoders of a vehicle, watches them, and puts their positions together.
///
/// A sample is true when the first counter was read, which is that of a driven wheel; the others are those of the same
/// moment, between two readings if they must be. So no way is ever invented: the counters of a wheel are its real ones, or
/// between two real ones. A fault of any encoder gives no samples while it lasts. After a jump of a wheel's counter the
/// samples go on from the last good value: the way that was driven meanwhile is lost, but no false way is reported.
#[derive(Clone, Debug)]
pub struct EncoderGroup {
    channels: Vec<Channel, MOST_COUNTERS>,
    sync: Option<SyncProducer>,
    /// A reading of the first encoder that waits for the others.
    waiting: Option<EncoderReading>,
    /// What was said of faults last.
    told_faults: EncoderFaults,
    /// Which of the channels had a fault when they were looked at last: a bit for each.
    faulty: u8,
}

/// Time between two reports of a fault that lasts, s.
pub const FAULT_PERIOD: f64 = 0.010;

impl EncoderGroup {
    /// Encoders that have not been heard, at most [`MOST_COUNTERS`] of them; more are left out. If one reports at SYNC, and
    /// no other master sees to it, the group sends SYNC every `sync_period` seconds.
    #[must_use]
    pub fn new(channels: &[ChannelSettings], sync_period: f64, start: Time) -> Self {
        let channels = channels.get(..MOST_COUNTERS).unwrap_or(channels);
        let is_synchronous = channels
            .iter()
            .any(|channel| channel.encoder.has_master() && channel.encoder.reporting == Reporting::Synchronous);
        let mut group = Self {
            channels: Vec::new(),
            sync: is_synchronous.then(|| SyncProducer::new(sync_period, start)),
            waiting: None,
            told_faults: EncoderFaults::default(),
            faulty: 0,
        };
        for settings in channels {
            // There is room for all that are left.
            let _ = group.channels.push(Channel::new(settings, start));
        }
        group
    }

    /// Takes a frame that was received at `time`; gives a sample if it completes one.
    pub fn handle(&mut self, frame: &Frame, time: Time) -> Option<Counts> {
        for (number, channel) in self.channels.iter_mut().enumerate() {
            let heard = channel.handle(frame, time);
            if let (0, Some(heard)) = (number, heard) {
                self.waiting = heard.ok();
            }
        }
        self.sample(time)
    }

    fn sample(&mut self, now: Time) -> Option<Counts> {
        let EncoderReading { time, .. } = self.waiting?;
        let mut counts = [0; MOST_COUNTERS];
        for (count, channel) in counts.iter_mut().zip(&self.channels) {
            *count = channel.at(time)?;
        }
        self.waiting = None;
        if self.faults(now).any() {
            return None;
        }
        for (count, channel) in counts.iter().zip(&mut self.channels) {
            channel.told = Some(*count);
        }
        Some(Counts { time, counts })
    }

    /// The next frame to send. Call until there is none.
    pub fn poll(&mut self, now: Time) -> Option<Frame> {
        if let Some(frame) = self.sync.as_mut().and_then(|sync| sync.poll(now)) {
            self.channels.iter_mut().for_each(|channel| channel.encoder.note_sync(now));
            return Some(frame);
        }
        self.channels.iter_mut().find_map(|channel| channel.encoder.poll(now).0)
    }

    /// The faults that the encoders have now: the first one of those that count turns, and of those that count angles.
    pub fn faults(&mut self, now: Time) -> EncoderFaults {
        let mut faults = EncoderFaults { time: now, ..EncoderFaults::default() };
        self.faulty = 0;
        for (number, channel) in self.channels.iter_mut().enumerate() {
            let fault = channel.check(now);
            self.faulty |= u8::from(fault.is_some()) << number;
            let of = match channel.counted {
                Counted::Turn => &mut faults.drive,
                Counted::Steering => &mut faults.steering,
            };
            *of = of.or(fault);
        }
        faults
    }

    /// Which of the encoders that count turns, or of those that count angles, have a fault: bit 0 is the first encoder.
    #[must_use]
    pub fn faulty(&self, counted: Counted) -> u8 {
        let of_kind = |(number, channel): (usize, &Channel)| u8::from(channel.counted == counted) << number;
        self.faulty & self.channels.iter().enumerate().map(of_kind).fold(0, |all, one| all | one)
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

    /// Where the master is with each encoder.
    pub fn states(&self) -> impl Iterator<Item = EncoderState> + '_ {
        self.encoders().map(Encoder::state)
    }

    /// The encoders.
    pub fn encoders(&self) -> impl Iterator<Item = &Encoder> + '_ {
        self.channels.iter().map(|channel| &channel.encoder)
    }

    /// Others know that the vehicle stands still.
    pub fn expect_standstill(&mut self) {
        self.channels.iter_mut().for_each(|channel| channel.monitor.expect_standstill());
    }
}
