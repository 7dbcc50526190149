//! How far the poses on the bus were from the truth.

use std::time::Instant;

use agv_core::geometry::{Pose, wrap};
use serde::Serialize;

use super::Driven;
use crate::recording::{Recording, truth_at};

/// How far the poses on the bus were from the truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Errors {
    /// Poses that rest on what is seen, while driving.
    pub poses: usize,
    /// Share of all poses while driving that do.
    pub localised_share: f64,
    /// Position: 95 % mark, m.
    pub position_p95_m: f64,
    /// Position: largest, m.
    pub position_max_m: f64,
    /// Heading: 95 % mark, deg.
    pub heading_p95_deg: f64,
    /// Heading: largest, deg.
    pub heading_max_deg: f64,
    /// Longest time between poses, s.
    pub longest_gap_s: f64,
}

/// Compares the poses of a drive with its truth, each at the time that it states. The controller's clock is read from
/// the pose that came fastest.
#[must_use]
pub fn errors(driven: &Driven, recording: &Recording) -> Option<Errors> {
    let origin = driven.poses.first()?.heard;
    let seconds = |time: Instant| time.saturating_duration_since(origin).as_secs_f64();
    let mut stated = Vec::with_capacity(driven.poses.len());
    let mut last: Option<f64> = None;
    for heard in &driven.poses {
        let low = f64::from(heard.pose.time) * 1e-3;
        // Sixteen bits of milliseconds: the turn that is nearest to when it was heard, counted from the first pose.
        let first = f64::from(driven.poses[0].pose.time) * 1e-3;
        let expected = first + seconds(heard.heard);
        let time = low + 65.536 * ((expected - low) / 65.536).round();
        let gap = last.map_or(0.0, |last| time - last);
        last = Some(time);
        stated.push((time, gap, heard));
    }
    let offset = stated.iter().map(|(time, _, heard)| seconds(heard.heard) - time).fold(f64::INFINITY, f64::min);
    let begin = seconds(driven.begin);
    let (mut positions, mut headings, mut all, mut longest_gap) = (Vec::new(), Vec::new(), 0, 0.0_f64);
    for (time, gap, heard) in stated {
        let since = time + offset - begin;
        if since < 0.0 {
            continue;
        }
        let Some(truth) = truth_at(&recording.truth, driven.first.offset(since)) else { continue };
        all += 1;
        longest_gap = longest_gap.max(gap);
        if !heard.pose.mode.is_localised() {
            continue;
        }
        let Pose { x, y, theta } = heard.pose.pose;
        positions.push((x - truth.x).hypot(y - truth.y));
        headings.push(wrap(theta - truth.theta).abs().to_degrees());
    }
    positions.sort_by(f64::total_cmp);
    headings.sort_by(f64::total_cmp);
    let mark = |sorted: &[f64]| sorted.get(sorted.len() * 95 / 100).copied();
    Some(Errors {
        poses: positions.len(),
        localised_share: positions.len() as f64 / f64::from(all.max(1)),
        position_p95_m: mark(&positions)?,
        position_max_m: *positions.last()?,
        heading_p95_deg: mark(&headings)?,
        heading_max_deg: *headings.last()?,
        longest_gap_s: longest_gap,
    })
}
