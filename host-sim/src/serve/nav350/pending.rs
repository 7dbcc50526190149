//! What a connection still has to be told.

use std::collections::VecDeque;

use super::promise::Promise;
use super::sensor::Sensor;

/// What a connection still has to be told.
#[derive(Default)]
pub(super) struct Pending {
    /// The one slow method that is under way.
    pub(super) promise: Option<Promise>,
    /// Results that wait for the gap behind their acknowledgement.
    delayed: VecDeque<(f64, Vec<u8>)>,
}

impl Pending {
    /// Leaves a result for later.
    pub(super) fn delay(&mut self, due: f64, bytes: Vec<u8>) {
        self.delayed.push_back((due, bytes));
    }

    /// When there is something to say.
    pub(super) fn due(&self) -> Option<f64> {
        let delayed = self.delayed.front().map(|(due, _)| *due);
        let promised = self.promise.map(|promise| promise.due);
        delayed.into_iter().chain(promised).min_by(f64::total_cmp)
    }

    /// What there is to say now.
    pub(super) fn poll(&mut self, sensor: &Sensor, now: f64) -> Option<Vec<u8>> {
        if let Some((_, bytes)) = self.delayed.pop_front_if(|(due, _)| *due <= now) {
            return Some(bytes);
        }
        let promise = self.promise.take_if(|promise| promise.due <= now && sensor.has_seen(promise))?;
        Some(sensor.keep(&promise))
    }
}
