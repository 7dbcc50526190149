//! The sensor's clock in the vehicle's time.

use heapless::Vec;

use super::DeviceTime;
use agv_core::measurement::Time;

/// How many exchanges are remembered.
const EXCHANGES: usize = 32;
/// Exchanges over less time than this, s, say nothing about drift.
const DRIFT_SPAN: f64 = 10.0;
/// Nor do fewer than these.
const DRIFT_EXCHANGES: usize = 8;
/// How wrong the drift may be before it was measured, and after.
const UNKNOWN_DRIFT: f64 = 200e-6;
const FITTED_DRIFT: f64 = 30e-6;
/// Exchanges whose uncertainties differ by less, s, count alike.
const SIMILAR: f64 = 0.5e-3;
/// No crystal drifts by more.
const GREATEST_DRIFT: f64 = 500e-6;
/// An exchange that disagrees by more than this, s, and what it and the line are uncertain by, is of a clock that was
/// started again or set.
const RESTART: f64 = 0.005;
/// Exchanges that took longer, s, are of no use.
const SLOWEST: f64 = 1.0;

/// Why an exchange was not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClockError {
    /// The answer took too long, or came before the question.
    RoundTrip,
    /// The sensor's clock does not go on where it was; all earlier exchanges are forgotten, this one is used.
    Restarted,
}

/// Question and answer about the time.
#[derive(Clone, Copy, Debug)]
struct Exchange {
    /// The sensor's clock without wraps, ms.
    device: i64,
    /// The middle between question and answer, us.
    local: i64,
    /// Time between question and answer, us.
    round_trip: i64,
}

impl Exchange {
    /// By how much it may be wrong when the sensor's clock shows `newest`, ms, s.
    fn uncertainty(&self, newest: i64, unknown_drift: f64) -> f64 {
        let age = (newest - self.device) as f64 * 1e-3;
        0.5e-6 * self.round_trip as f64 + libm::fabs(age) * unknown_drift
    }
}

/// Local time as a line over the sensor's time.
#[derive(Clone, Copy, Debug)]
struct Line {
    device: f64,
    local: f64,
    drift: f64,
    /// How wrong it may be at the newest exchange, s, and how much more with each second.
    uncertainty: f64,
    unknown_drift: f64,
}

/// Keeps the offset between the sensor's clock and the vehicle's.
///
/// The sensor is taken to read its clock in the middle of the round trip, so an exchange is wrong by half of its round
/// trip at the most, and by what the clocks have drifted apart since. The offset is the mean of the exchanges for which
/// this is smallest; the drift is the slope of those with small round trips. The sensor's resolution, a millisecond,
/// comes on top.
#[derive(Clone, Debug, Default)]
pub struct SensorClock {
    exchanges: Vec<Exchange, EXCHANGES>,
    newest: Option<(DeviceTime, i64)>,
    line: Option<Line>,
}

impl SensorClock {
    /// A clock of which nothing is known.
    #[must_use]
    pub const fn new() -> Self {
        Self { exchanges: Vec::new(), newest: None, line: None }
    }

    /// How much faster the vehicle's clock is than the sensor's, as a share.
    #[must_use]
    pub fn drift(&self) -> f64 {
        self.line.map_or(0.0, |line| line.drift)
    }

    /// Whether times can be converted.
    #[must_use]
    pub const fn is_known(&self) -> bool {
        self.line.is_some()
    }

    /// Takes an exchange: the question left at `sent`, the answer came at `received` and said `device`.
    ///
    /// # Errors
    /// If the exchange cannot be used, or says that the sensor's clock was started again.
    pub fn record(&mut self, sent: Time, received: Time, device: DeviceTime) -> Result<(), ClockError> {
        let round_trip = received.since(sent);
        if !(0.0..=SLOWEST).contains(&round_trip) {
            return Err(ClockError::RoundTrip);
        }
        let middle = sent.offset(0.5 * round_trip);
        let is_restarted = self.line.zip(self.to_local(device)).is_some_and(|(line, expected)| {
            let age = self.newest.map_or(0.0, |(newest, _)| 1e-3 * libm::fabs(f64::from(device.since(newest))));
            let uncertainty = line.uncertainty + line.unknown_drift * age + 0.5 * round_trip;
            libm::fabs(expected.since(middle)) > RESTART + uncertainty
        });
        if is_restarted {
            *self = Self::new();
        }
        let extended = self.extend(device);
        self.newest = Some((device, extended));
        let exchange = Exchange {
            device: extended,
            local: middle.micros().cast_signed(),
            round_trip: received.micros().abs_diff(sent.micros()).cast_signed(),
        };
        self.remember(exchange);
        self.line = self.fit();
        if is_restarted { Err(ClockError::Restarted) } else { Ok(()) }
    }

    /// When the sensor's clock showed `device`. Right within 24 days of the last exchange. None before the first one.
    #[must_use]
    pub fn to_local(&self, device: DeviceTime) -> Option<Time> {
        let line = self.line?;
        let elapsed = (self.extend(device) as f64 - line.device) * 1e-3;
        let micros = line.local + elapsed * (1.0 + line.drift) * 1e6;
        Some(Time::from_micros(libm::round(micros) as u64))
    }

    /// What the sensor's clock shows at `time`. None before the first exchange.
    #[must_use]
    pub fn to_device(&self, time: Time) -> Option<DeviceTime> {
        let line = self.line?;
        let elapsed = (time.micros() as f64 - line.local) * 1e-3 / (1.0 + line.drift);
        let extended = libm::round(line.device + elapsed) as i64;
        // The sensor's counter is what is left of the number without wraps.
        Some(DeviceTime(extended as u32))
    }

    /// Keeps an exchange. If there is no room, the one goes that is the most uncertain by now: usually the oldest, but where the network has
    /// become slow, what it told before is better for minutes.
    fn remember(&mut self, exchange: Exchange) {
        let Err(exchange) = self.exchanges.push(exchange) else { return };
        let unknown_drift = self.line.map_or(UNKNOWN_DRIFT, |line| line.unknown_drift);
        let uncertainty = |one: &Exchange| one.uncertainty(exchange.device, unknown_drift);
        let worst = self.exchanges.iter_mut().max_by(|a, b| uncertainty(a).total_cmp(&uncertainty(b)));
        if let Some(worst) = worst.filter(|worst| uncertainty(worst) >= uncertainty(&exchange)) {
            *worst = exchange;
        }
    }

    fn extend(&self, device: DeviceTime) -> i64 {
        match self.newest {
            Some((newest, extended)) => extended + i64::from(device.since(newest)),
            None => i64::from(device.0),
        }
    }

    /// The line through the exchanges.
    fn fit(&self) -> Option<Line> {
        let (_, newest) = self.newest?;
        let origin = *self.exchanges.first()?;
        // Differences to one of them are small, so they are exact.
        let lead = |exchange: &Exchange| {
            let device = (exchange.device - origin.device) as f64 * 1e-3;
            (device, (exchange.local - origin.local) as f64 * 1e-6 - device)
        };
        let measured = self.measure_drift(lead);
        let drift = measured.or(self.line.map(|line| line.drift)).unwrap_or(0.0);
        let unknown_drift = if measured.is_some() { FITTED_DRIFT } else { UNKNOWN_DRIFT };
        let uncertainty = |exchange: &Exchange| exchange.uncertainty(newest, unknown_drift);
        let least = self.exchanges.iter().map(uncertainty).fold(f64::INFINITY, libm::fmin);
        let good = self.exchanges.iter().filter(|exchange| uncertainty(exchange) <= least + SIMILAR);
        let (count, sum) = good.fold((0.0, 0.0), |(count, sum), exchange| {
            let (device, lead) = lead(exchange);
            (count + 1.0, sum + lead - drift * device)
        });
        let local = origin.local as f64 + sum / count * 1e6;
        Some(Line { device: origin.device as f64, local, drift, uncertainty: least + SIMILAR, unknown_drift })
    }

    /// Slope of the leads of the exchanges with small round trips; None if they are too few or too near, or their round
    /// trips too long for the time between them.
    fn measure_drift(&self, lead: impl Fn(&Exchange) -> (f64, f64)) -> Option<f64> {
        let smallest = self.exchanges.iter().map(|exchange| exchange.round_trip).min()?;
        let good = || self.exchanges.iter().filter(|exchange| exchange.round_trip <= 2 * smallest + 1000).map(&lead);
        let count = good().count();
        let (first, last) = good().fold((f64::INFINITY, f64::NEG_INFINITY), |(first, last), (device, _)| {
            (libm::fmin(first, device), libm::fmax(last, device))
        });
        // Round trips that are not small against the span make a slope by themselves.
        let is_told = 1e-6 * smallest as f64 <= UNKNOWN_DRIFT * (last - first);
        if count < DRIFT_EXCHANGES || last - first < DRIFT_SPAN || !is_told {
            return None;
        }
        let (device_sum, lead_sum) = good().fold((0.0, 0.0), |sum, (device, lead)| (sum.0 + device, sum.1 + lead));
        let (device_mean, lead_mean) = (device_sum / count as f64, lead_sum / count as f64);
        let (square, product) = good().fold((0.0, 0.0), |(square, product), (device, lead)| {
            let device = device - device_mean;
            (square + device * device, product + device * (lead - lead_mean))
        });
        Some((product / square).clamp(-GREATEST_DRIFT, GREATEST_DRIFT))
    }
}
