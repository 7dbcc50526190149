//! Whether the gyro turns as the odometry does.

use agv_core::localizer::AnyEvent;
use agv_core::measurement::{GyroSample, Time};

use super::Finding;
use crate::odometry_steps::odometry_steps;
use crate::recording::Recording;

/// Time over which turns are compared, s.
const SPAN: f64 = 1.0;
/// Turns below which nothing is said, rad, all together.
const LEAST: f64 = 3.0;
/// Of a gyro in order the turn is that of the wheels to this share: wheels slip and are of another size by less.
const SAME: f64 = 0.2;
/// Share of the turns' squares that a factor must explain.
const EXPLAINED: f64 = 0.9;

/// A factor between what the gyro and the odometry say of the turns. `is_odometry_sound` says whether the laser agrees with the odometry.
pub(super) fn finding(recording: &Recording, is_odometry_sound: bool, log: &str) -> Option<Finding> {
    let gyro = &recording.parameters.gyro;
    let factor = factor(recording).filter(|factor| gyro.is_fitted && (factor - 1.0).abs() > SAME)?;
    let right = gyro.factor * factor;
    let what = if (factor + 1.0).abs() < SAME {
        "the gyro turns the other way than the wheels: it hangs upside down, or another axis is read".to_owned()
    } else if (factor.abs().to_degrees() - 1.0).abs() < SAME {
        "the gyro's rates are in degrees for each second: radians are wanted".to_owned()
    } else {
        format!("the wheels turn by {factor:.3} of what the gyro says")
    };
    let right = if (right.abs() - 1.0).abs() < SAME { right.signum() } else { right };
    let mend = format!("agv replay {log} --set gyro.factor={right:.5}");
    let next = if is_odometry_sound { mend } else { format!("{mend}, unless it is the wheels that are wrong") };
    Some(Finding::new(what, next))
}

/// By how much the gyro's turns must be multiplied to be those of the odometry, with the bias that it has while it stands taken off; none
/// if no factor explains them.
fn factor(recording: &Recording) -> Option<f64> {
    let samples: Vec<GyroSample> = recording
        .events
        .iter()
        .filter_map(|event| if let AnyEvent::Gyro(sample) = event { Some(*sample) } else { None })
        .filter(|sample| sample.rate.is_finite())
        .collect();
    let turns: Vec<(Time, f64)> = recording
        .events
        .iter()
        .zip(odometry_steps(recording))
        .filter_map(|(event, step)| Some((event.time()?, step?.theta)))
        .collect();
    let first = turns.first()?.0.max(samples.first()?.time);
    let last = turns.last()?.0.min(samples.last()?.time);
    let count = (last.since(first) / SPAN).floor().clamp(0.0, 1e6) as usize;
    let mut pairs = vec![(0.0, 0.0); count];
    let place = |time: Time| (time >= first).then(|| (time.since(first) / SPAN) as usize);
    for (time, turn) in &turns {
        if let Some(pair) = place(*time).and_then(|index| pairs.get_mut(index)) {
            pair.0 += turn;
        }
    }
    let factor = recording.parameters.gyro.factor;
    for pair in samples.windows(2) {
        let step = pair[1].time.since(pair[0].time);
        let is_step = step > 0.0 && step < SPAN;
        if let Some(turn) = place(pair[1].time).filter(|_| is_step).and_then(|index| pairs.get_mut(index)) {
            turn.1 += factor * pair[1].rate * step;
        }
    }
    let all: f64 = pairs.iter().map(|(wheels, _)| wheels.abs()).sum();
    if all < LEAST {
        return None;
    }
    // A line through both: its slope is the factor, and what is left at no turn is the bias.
    let mean = |of: fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>() / count as f64;
    let (wheels, gyro) = (mean(|pair| pair.0), mean(|pair| pair.1));
    let sum = |of: &dyn Fn(f64, f64) -> f64| pairs.iter().map(|pair| of(pair.0 - wheels, pair.1 - gyro)).sum::<f64>();
    let (ww, gg, wg) = (sum(&|w, _| w * w), sum(&|_, g| g * g), sum(&|w, g| w * g));
    (wg * wg > EXPLAINED * ww * gg).then(|| wg / gg)
}
