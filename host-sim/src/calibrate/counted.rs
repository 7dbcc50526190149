//! What the encoders counted, over all wraps, and what is wrong with the counting.

use std::fmt;

use agv_core::measurement::{EncoderSample, Time};
use agv_core::odometry::Tricycle;

/// State of both counters at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counted {
    /// When.
    pub time: Time,
    /// Ticks of the driving wheel since the first sample.
    pub ticks: f64,
    /// Steering angle that the nominal scale gives, without offset and without jumps, rad.
    pub steering: f64,
}

/// A fault of a counter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CounterFault {
    /// The counter lost a multiple of its lower half's range.
    Alias {
        /// When.
        time: Time,
        /// What is missing, ticks.
        missing: f64,
    },
    /// The counter stood still while the vehicle moved, and then caught up.
    Freeze {
        /// Last reading before.
        start: Time,
        /// First reading that has caught up.
        end: Time,
    },
    /// A counter counts the wrong way.
    WrongDirection {
        /// Whether it is the steering's; otherwise it is the driving wheel's.
        is_steering: bool,
    },
}

impl fmt::Display for CounterFault {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Alias { time, missing } => {
                write!(formatter, "the drive counter jumps by {:.0} ticks at {:.2} s", -missing, time.seconds())
            }
            Self::Freeze { start, end } => write!(
                formatter,
                "the drive counter stands still from {:.2} to {:.2} s and then catches up",
                start.seconds(),
                end.seconds()
            ),
            Self::WrongDirection { is_steering: true } => {
                formatter.write_str("the steering counter counts the wrong way")
            }
            Self::WrongDirection { is_steering: false } => {
                formatter.write_str("the drive counter counts the wrong way")
            }
        }
    }
}

/// What a counter loses when only its lower half is read.
const ALIAS: f64 = 65_536.0;
/// Steps on either side that say how fast the vehicle is.
const NEIGHBOURS: usize = 20;
/// So many steps of nothing in a row, between moving neighbours, are a freeze.
const SHORTEST_FREEZE: usize = 2;

/// Follows the counters over their wraps. Faults are found, and mended if `mend` says so: an alias by what is missing, a
/// freeze by sharing out what came after it.
#[must_use]
pub fn count(samples: &[EncoderSample], nominal: &Tricycle, mend: bool) -> (Vec<Counted>, Vec<CounterFault>) {
    let ordered: Vec<&EncoderSample> = {
        let mut last = None;
        samples.iter().filter(|sample| last.replace(sample.time).is_none_or(|last| sample.time > last)).collect()
    };
    let mut steps: Vec<f64> =
        ordered.windows(2).map(|pair| nominal.drive_range.step(pair[0].drive, pair[1].drive) as f64).collect();
    let mut faults = Vec::new();
    let usual: Vec<f64> = (0..steps.len()).map(|index| usual_step(&steps, index)).collect();
    let mut index = 0;
    while index < steps.len() {
        let run = steps[index..].iter().take_while(|step| **step == 0.0).count();
        let end = index + run;
        if end >= steps.len() {
            break;
        }
        // The step that ends the run, and what the neighbours let expect of it.
        let expected = usual[end] * (run + 1) as f64;
        let missing = if nominal.drive_range.values() as f64 > ALIAS {
            ((expected - steps[end]) / ALIAS).round() * ALIAS
        } else {
            0.0
        };
        if missing != 0.0 {
            faults.push(CounterFault::Alias { time: ordered[end + 1].time, missing });
            if mend {
                steps[end] += missing;
            }
        }
        let is_freeze = run >= SHORTEST_FREEZE && steps[end].abs() > 2.0 * usual[end].abs() && usual[end] != 0.0;
        if is_freeze {
            faults.push(CounterFault::Freeze { start: ordered[index].time, end: ordered[end + 1].time });
            if mend {
                let duration = ordered[end + 1].time.since(ordered[index].time);
                let total = steps[end];
                for (step, pair) in steps[index..=end].iter_mut().zip(ordered[index..].windows(2)) {
                    *step = total * pair[1].time.since(pair[0].time) / duration;
                }
            }
        }
        index = end + 1;
    }
    let range = nominal.steering_range;
    let mut ticks = 0.0;
    let mut steering = ordered.first().map_or(0, |first| range.signed(first.steering));
    let counted = ordered.iter().enumerate().map(|(index, sample)| {
        if let Some(before) = index.checked_sub(1) {
            ticks += steps[before];
            // Beyond half a turn too: a wheel that looks back goes to and fro there.
            steering += range.step(ordered[before].steering, sample.steering);
        }
        Counted { time: sample.time, ticks, steering: nominal.steering_scale * steering as f64 }
    });
    (counted.collect(), faults)
}

/// Median step around one of them.
fn usual_step(steps: &[f64], index: usize) -> f64 {
    let mut around: Vec<f64> =
        steps[index.saturating_sub(NEIGHBOURS)..(index + NEIGHBOURS + 1).min(steps.len())].to_vec();
    let middle = around.len() / 2;
    *around.select_nth_unstable_by(middle, f64::total_cmp).1
}
