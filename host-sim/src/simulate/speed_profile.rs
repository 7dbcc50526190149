//! How far the vehicle has come after some time.

/// From standstill to standstill with constant acceleration, constant speed, and constant braking.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedProfile {
    length: f64,
    acceleration: f64,
    braking: f64,
    top_speed: f64,
    cruise_start: f64,
    cruise_end: f64,
    duration: f64,
}

impl SpeedProfile {
    /// The profile over `length` (m) that reaches at most `speed` (m/s) with `acceleration` and `braking` (m/s2). All
    /// four are positive.
    #[must_use]
    pub fn new(length: f64, speed: f64, acceleration: f64, braking: f64) -> Self {
        // Without a cruise, v^2 / 2a + v^2 / 2b is the whole length.
        let reachable = libm::sqrt(2.0 * length * acceleration * braking / (acceleration + braking));
        let top_speed = speed.min(reachable);
        let cruise_start = top_speed / acceleration;
        let ramps = 0.5 * top_speed * top_speed * (1.0 / acceleration + 1.0 / braking);
        let cruise_end = cruise_start + (length - ramps).max(0.0) / top_speed;
        let duration = cruise_end + top_speed / braking;
        Self { length, acceleration, braking, top_speed, cruise_start, cruise_end, duration }
    }

    /// From start to standstill, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// Way from the start, m, after `time` (s); 0 before the start and the whole length after the end.
    #[must_use]
    pub fn way(&self, time: f64) -> f64 {
        if time <= 0.0 {
            0.0
        } else if time < self.cruise_start {
            0.5 * self.acceleration * time * time
        } else if time < self.cruise_end {
            self.top_speed * (time - 0.5 * self.cruise_start)
        } else if time < self.duration {
            let rest = self.duration - time;
            self.length - 0.5 * self.braking * rest * rest
        } else {
            self.length
        }
    }
}
