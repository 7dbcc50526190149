//! Whether an encoder is to be believed.
//!
//! A counter cannot say that it is wrong, but a vehicle cannot do everything: it is no faster than its drive, and can neither
//! stop nor go back at once. What contradicts that, and silence, is a fault. With readings every 10 ms every fault is known at most
//! 50 ms after it began, if [`PlausibilityMonitor::check`] is called at least every 5 ms.
//!
//! A counter that freezes is found by itself only while the vehicle is so fast that it could not have stopped within the
//! time: from about 0.25 m/s if it brakes with 2.5 m/s^2. Below that it takes another's word that the vehicle moves.

use agv_core::measurement::{EncoderFault, Time};
use agv_core::odometry::CounterRange;

/// What an encoder on a sound vehicle does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlausibilityLimits {
    /// Time between readings, s.
    pub period: f64,
    /// Silence after which a reading is late, s.
    pub late_after: f64,
    /// Silence after which the encoder is missing, s.
    pub missing_after: f64,
    /// Shortest standstill that is judged, s.
    pub frozen_after: f64,
    /// Fastest motion, ticks/s.
    pub fastest: f64,
    /// Hardest braking, ticks/s^2.
    pub hardest_braking: f64,
    /// How long readings must be sound before a fault is withdrawn, s.
    pub recovery: f64,
}

impl PlausibilityLimits {
    /// Limits for readings every `period` seconds, by default 10 ms: late after 2.5 periods, frozen after 3, missing after
    /// 4.5, sound again after 20. `fastest` in ticks/s, `hardest_braking` in ticks/s^2.
    #[must_use]
    pub const fn every(period: f64, fastest: f64, hardest_braking: f64) -> Self {
        Self {
            period,
            late_after: 2.5 * period,
            missing_after: 4.5 * period,
            frozen_after: 3.0 * period,
            fastest,
            hardest_braking,
            recovery: 20.0 * period,
        }
    }
}

/// A vehicle that moved so many ticks less than it must have is frozen; fewer can be rounding.
const FROZEN_MARGIN: f64 = 3.0;
/// Speed is measured over so many periods.
const SPEED_PERIODS: f64 = 2.0;
/// A frame may have waited for the bus so many periods.
const FRAME_DELAY_PERIODS: f64 = 2.0;
/// Ticks by which a step may exceed the fastest one: the rounding of its two ends.
const JUMP_MARGIN: f64 = 2.0;

/// A counter that should still go on as fast as brakes leave it, and goes back by more than this share of that, is reversed: a vehicle
/// that rolls back when it has braked hard is slower.
const REVERSED: f64 = 0.5;

#[derive(Clone, Copy, Debug)]
struct Reading {
    time: Time,
    position: u32,
}

/// Watches one encoder's readings.
#[derive(Clone, Copy, Debug)]
pub struct PlausibilityMonitor {
    limits: PlausibilityLimits,
    range: CounterRange,
    last: Option<Reading>,
    /// Silence counts from here.
    last_heard: Time,
    /// Where the speed is measured from.
    anchor: Option<Reading>,
    /// When the counter moved last.
    moved: Option<Time>,
    /// The counter was at least so fast at that time, ticks/s.
    speed: Option<(Time, f64)>,
    /// Whether it counted down then.
    was_down: bool,
    expected_speed: f64,
    fault: Option<(EncoderFault, Time)>,
}

impl PlausibilityMonitor {
    /// A monitor of an encoder with that range, which should be heard from `start` on. Steps of half the range and
    /// more cannot be told from steps the other way: `fastest` must be well below that for a few periods.
    #[must_use]
    pub const fn new(limits: PlausibilityLimits, range: CounterRange, start: Time) -> Self {
        Self {
            limits,
            range,
            last: None,
            last_heard: start,
            anchor: None,
            moved: None,
            speed: None,
            was_down: false,
            expected_speed: 0.0,
            fault: None,
        }
    }

    /// The encoder has said what its range is.
    pub fn set_range(&mut self, range: CounterRange) {
        self.range = range;
    }

    /// The encoder has started anew: earlier readings say nothing about later ones.
    pub fn restart(&mut self) {
        self.last = None;
        self.anchor = None;
        self.moved = None;
        self.speed = None;
    }

    /// What others know of the motion: the vehicle moves at least this fast now, ticks/s of either sign; 0 if nobody
    /// knows. An encoder that stands still from the beginning is found only by this.
    pub fn expect_motion(&mut self, speed: f64, now: Time) {
        let speed = if speed.is_finite() { libm::fabs(speed) } else { 0.0 };
        if self.expected_speed == 0.0 && speed > 0.0 {
            self.moved = Some(now);
        }
        self.expected_speed = speed;
    }

    /// Others know that the vehicle stands still, so a counter that stands still is right.
    pub fn expect_standstill(&mut self) {
        self.expected_speed = 0.0;
        self.moved = None;
        self.speed = None;
    }

    /// Takes a reading; gives the fault that it shows, in which case it must not be used.
    pub fn reading(&mut self, time: Time, position: u32) -> Option<EncoderFault> {
        self.last_heard = self.last_heard.max(time);
        if u64::from(position) >= self.range.values() {
            self.raise(EncoderFault::OutOfRange, time);
            return Some(EncoderFault::OutOfRange);
        }
        let reading = Reading { time, position };
        let Some(last) = self.last.replace(reading) else {
            self.anchor = Some(reading);
            return None;
        };
        let signed_step = self.range.step(last.position, position) as f64;
        let step = libm::fabs(signed_step);
        let longest = time.since(last.time).max(0.0) + FRAME_DELAY_PERIODS * self.limits.period;
        if self.is_reversed(signed_step, last.time, time) || step > self.limits.fastest * longest + JUMP_MARGIN {
            self.anchor = Some(reading);
            self.moved = None;
            self.speed = None;
            self.raise(EncoderFault::Jumped, time);
            return Some(EncoderFault::Jumped);
        }
        self.measure_speed(last, reading);
        if self.is_frozen(time) {
            self.raise(EncoderFault::Frozen, time);
            return Some(EncoderFault::Frozen);
        }
        None
    }

    /// Whether a step, in ticks, goes back from where the vehicle cannot but go on.
    fn is_reversed(&self, step: f64, from: Time, to: Time) -> bool {
        let going = self.speed_at(to);
        let back = if self.was_down { step } else { -step };
        let duration = to.since(from).max(self.limits.period);
        going > 0.0 && back > REVERSED * going * duration + JUMP_MARGIN
    }

    fn measure_speed(&mut self, last: Reading, reading: Reading) {
        if reading.position != last.position {
            self.moved = Some(reading.time);
        }
        let anchor = self.anchor.unwrap_or(last);
        let duration = reading.time.since(anchor.time);
        if duration >= SPEED_PERIODS * self.limits.period - 1e-6 {
            let ticks = libm::fabs(self.range.step(anchor.position, reading.position) as f64);
            // The earlier frame may have waited for the bus, both ends are rounded, and at the end the vehicle may be
            // slower than on average.
            let average = (ticks - 1.0).max(0.0) / (duration + FRAME_DELAY_PERIODS * self.limits.period);
            let least = average - self.limits.hardest_braking * duration;
            // What was known before still says how fast the vehicle was when the counter moved last.
            if least > self.speed_at(reading.time) {
                self.speed = Some((reading.time, least));
                self.was_down = self.range.step(anchor.position, reading.position) < 0;
            }
            self.anchor = Some(reading);
        }
    }

    /// The vehicle is at least so fast, ticks/s, having braked as hard as it can since its speed was measured.
    fn speed_at(&self, time: Time) -> f64 {
        self.speed
            .map_or(0.0, |(since, speed)| (speed - self.limits.hardest_braking * time.since(since).max(0.0)).max(0.0))
    }

    fn is_frozen(&self, now: Time) -> bool {
        let Some(since) = self.moved else { return false };
        let duration = now.since(since);
        if duration < self.limits.frozen_after - 1e-6 {
            return false;
        }
        // The way of a vehicle that brakes as hard as it can.
        let speed = self.speed_at(since);
        let braking = self.limits.hardest_braking.max(f64::MIN_POSITIVE);
        let rolling = duration.min(speed / braking);
        let way = speed * rolling - 0.5 * braking * rolling * rolling;
        way.max(self.expected_speed * duration) >= FROZEN_MARGIN
    }

    /// The encoder reported an error, or its heartbeat has ceased.
    pub fn raise(&mut self, fault: EncoderFault, now: Time) {
        self.fault = Some((fault, now));
    }

    /// The fault that the encoder has now. A fault stays until the readings have been sound for the recovery time.
    pub fn check(&mut self, now: Time) -> Option<EncoderFault> {
        let silence = now.since(self.last_heard);
        if silence > self.limits.missing_after {
            self.raise(EncoderFault::Missing, now);
        } else if silence > self.limits.late_after {
            self.raise(EncoderFault::Late, now);
        }
        self.fault = self.fault.filter(|(_, since)| now.since(*since) <= self.limits.recovery);
        self.fault.map(|(fault, _)| fault)
    }
}
