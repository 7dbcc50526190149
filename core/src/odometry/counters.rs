//! Which counters a vehicle reports.

use heapless::Vec;

use super::{AngleEncoder, CounterRange, Tricycle, Vehicle, WheelBased};
use crate::measurement::{WheelReading, WheelSample};

/// No vehicle reports more counters.
pub const MOST_COUNTERS: usize = 4;

/// What a counter counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Counted {
    /// How far a wheel has turned.
    Turn,
    /// The steering angle of a wheel.
    Steering,
}

/// One of the counters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counter {
    /// Its wheel: the place in [`WheelSample::wheels`]; 0 of a tricycle.
    pub wheel: usize,
    /// What it counts.
    pub counted: Counted,
    /// Its range.
    pub range: CounterRange,
    /// Way of the wheel for one tick, m, or steering angle for one tick, rad.
    pub scale: f64,
}

impl Vehicle {
    /// The counters that the vehicle reports, wheel by wheel in the order of its kinematics, the turn of a wheel before its
    /// steering angle. None of a vehicle that reports something else.
    // One copy: it is asked for in several places, at the start and for each sample.
    #[inline(never)]
    #[must_use]
    pub fn counters(&self) -> Vec<Counter, MOST_COUNTERS> {
        let mut counters = Vec::new();
        // None of the vehicles has more than there is room for.
        let mut add = |counter| _ = counters.push(counter);
        match self {
            Self::Tricycle(tricycle) => {
                let Tricycle { drive_scale, drive_range, steering_scale, steering_range, .. } = *tricycle;
                add(Counter { wheel: 0, counted: Counted::Turn, range: drive_range, scale: drive_scale });
                add(Counter { wheel: 0, counted: Counted::Steering, range: steering_range, scale: steering_scale });
            }
            Self::Wheels(vehicle) => {
                for (number, wheel) in vehicle.wheels().as_ref().iter().enumerate() {
                    let counter = |counted, encoder: AngleEncoder, factor| Counter {
                        wheel: number,
                        counted,
                        range: encoder.range,
                        scale: encoder.scale * factor,
                    };
                    let turn = wheel.turn.map(|encoder| counter(Counted::Turn, encoder, wheel.radius));
                    let steering = wheel.steering.map(|encoder| counter(Counted::Steering, encoder, 1.0));
                    turn.into_iter().chain(steering).for_each(&mut add);
                }
            }
            Self::Ackermann(_) | Self::Increments | Self::TricycleSpeed(_) => {}
        }
        counters
    }
}

impl WheelSample {
    /// What a counter shows; nothing moves of one that the vehicle does not have.
    #[must_use]
    pub fn count(&self, counter: &Counter) -> u32 {
        let wheel = self.wheels.get(counter.wheel).copied().unwrap_or_default();
        match counter.counted {
            Counted::Turn => wheel.count,
            Counted::Steering => wheel.steering,
        }
    }

    /// Puts in what a counter shows.
    pub fn set_count(&mut self, counter: &Counter, count: u32) {
        let Some(WheelReading { count: turn, steering }) = self.wheels.get_mut(counter.wheel) else { return };
        match counter.counted {
            Counted::Turn => *turn = count,
            Counted::Steering => *steering = count,
        }
    }
}
