//! Curves over time, as many points as a screen has room for.

use agv_core::localizer::Mode;
use agv_core::measurement::Time;
use serde::Serialize;

use super::timeline::Timeline;
use crate::drive::MODES;

/// Intervals of one answer at the most.
const MOST: usize = 4000;

/// Curves over equal intervals of time. An interval without poses has None.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Overview {
    /// Where the first interval begins, s.
    pub from_s: f64,
    /// Where the last one ends, s.
    pub to_s: f64,
    /// Names of the modes.
    pub mode_names: Vec<&'static str>,
    /// The gravest mode in each interval, as its place in `mode_names`.
    pub modes: Vec<Option<u8>>,
    /// Largest standard deviation of the position, m.
    pub deviation_m: Vec<Option<f32>>,
    /// Largest normalised squared innovation of the lately accepted observations.
    pub normalised_square: Vec<Option<f32>>,
    /// Smallest share of accepted observations.
    pub acceptance: Vec<Option<f32>>,
    /// Largest correction by landmarks, m.
    pub correction_m: Vec<Option<f32>>,
}

/// How grave a mode is.
fn gravity(mode: Mode) -> u8 {
    match mode {
        Mode::Mixed => 0,
        Mode::Reflectors => 1,
        Mode::Features => 2,
        Mode::NotLocalised => 3,
        Mode::DeadReckoning => 4,
        Mode::Degraded => 5,
        Mode::WithoutOdometry => 6,
        Mode::Lost => 7,
    }
}

impl Timeline {
    /// Curves between two instants in so many intervals.
    #[must_use]
    pub fn overview(&self, from: Time, to: Time, intervals: usize) -> Overview {
        let intervals = intervals.clamp(1, MOST);
        let empty = || vec![None; intervals];
        let mut overview = Overview {
            from_s: from.seconds(),
            to_s: to.seconds(),
            mode_names: MODES.map(|mode| self.mode_name(mode)).to_vec(),
            modes: vec![None; intervals],
            deviation_m: empty(),
            normalised_square: empty(),
            acceptance: empty(),
            correction_m: empty(),
        };
        let span = to.since(from);
        let mut gravest = vec![None; intervals];
        let first = self.poses.partition_point(|pose| pose.time < from);
        for (pose, correction) in self.poses.iter().zip(&self.corrections).skip(first) {
            if pose.time > to {
                break;
            }
            let share = if span > 0.0 { pose.time.since(from) / span } else { 0.0 };
            let interval = ((share * intervals as f64) as usize).min(intervals - 1);
            let raise = |known: &mut Option<f32>, value: f64| {
                *known = Some(known.map_or(value as f32, |known| known.max(value as f32)));
            };
            let [xx, _, yy, ..] = pose.covariance;
            raise(&mut overview.deviation_m[interval], xx.max(yy).max(0.0).sqrt());
            raise(&mut overview.normalised_square[interval], pose.normalised_square);
            raise(&mut overview.correction_m[interval], f64::from(*correction));
            let acceptance = &mut overview.acceptance[interval];
            *acceptance =
                Some(acceptance.map_or(pose.acceptance as f32, |known: f32| known.min(pose.acceptance as f32)));
            if gravest[interval].is_none_or(|known| gravity(known) < gravity(pose.mode)) {
                gravest[interval] = Some(pose.mode);
            }
        }
        let place = |mode: Mode| MODES.iter().position(|known| *known == mode).unwrap_or_default() as u8;
        overview.modes = gravest.into_iter().map(|mode| mode.map(place)).collect();
        overview
    }
}
