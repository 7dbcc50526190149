//! The way of the vehicle, as fine as a screen shows it.

use agv_core::localizer::Mode;
use serde::{Deserialize, Serialize};

use super::timeline::Timeline;
use crate::drive::MODES;

/// Points of one answer at the most.
const MOST: usize = 20_000;

/// A part of the map and how finely it is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct Window {
    /// Points nearer to each other than this are one, m.
    pub tolerance_m: f64,
    /// Smallest and largest coordinates of the part, m.
    pub x0: f64,
    /// See `x0`.
    pub y0: f64,
    /// See `x0`.
    pub x1: f64,
    /// See `x0`.
    pub y1: f64,
}

/// The way within a window.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Outline {
    /// Pieces of the way, each with one mode: its place in the list of modes, then x and y in turn, mm.
    pub pieces: Vec<(u8, Vec<i32>)>,
    /// Smallest x and y, and largest, of the whole way and the map, m; None if there is neither.
    pub extent_m: Option<[f64; 4]>,
}

impl Timeline {
    /// The way as it looks through a window.
    #[must_use]
    pub fn outline(&self, window: &Window) -> Outline {
        let is_inside = |x: f64, y: f64| (window.x0..=window.x1).contains(&x) && (window.y0..=window.y1).contains(&y);
        let mut pieces: Vec<(u8, Vec<i32>)> = Vec::new();
        let mut count = 0;
        let mut last: Option<(f64, f64, Mode)> = None;
        let mut is_pen_down = false;
        let placed = self.poses.iter().map(|pose| (pose.pose.x, pose.pose.y, pose.mode));
        // Before poses come, the way is shown where somebody knows it.
        let known = self.truth.iter().filter(|_| self.poses.is_empty());
        for (x, y, mode) in placed.chain(known.map(|truth| (truth.pose.x, truth.pose.y, Mode::NotLocalised))) {
            if let Some((before_x, before_y, before)) = last
                && before == mode
                && (x - before_x).hypot(y - before_y) < window.tolerance_m
            {
                continue;
            }
            let previous = last.replace((x, y, mode));
            if !is_inside(x, y) || count >= MOST {
                is_pen_down = false;
                continue;
            }
            let place = MODES.iter().position(|known| *known == mode).unwrap_or_default() as u8;
            let millimetres = |metres: f64| (1000.0 * metres).round() as i32;
            if !is_pen_down || pieces.last().is_none_or(|(mode, _)| *mode != place) {
                let start = previous.filter(|_| is_pen_down).map(|(x, y, _)| vec![millimetres(x), millimetres(y)]);
                pieces.push((place, start.unwrap_or_default()));
            }
            if let Some((_, points)) = pieces.last_mut() {
                points.extend([millimetres(x), millimetres(y)]);
            }
            is_pen_down = true;
            count += 1;
        }
        Outline { pieces, extent_m: self.extent() }
    }

    fn extent(&self) -> Option<[f64; 4]> {
        let landmarks = self.landmarks.iter().map(|landmark| (landmark.x, landmark.y));
        let poses = self.poses.iter().map(|pose| (pose.pose.x, pose.pose.y));
        let truth = self.truth.iter().map(|truth| (truth.pose.x, truth.pose.y));
        landmarks.chain(poses).chain(truth).fold(None, |extent, (x, y)| {
            let [x0, y0, x1, y1] = extent.unwrap_or([x, y, x, y]);
            Some([x0.min(x), y0.min(y), x1.max(x), y1.max(y)])
        })
    }
}
