//! Poses that somebody gives.

use agv_core::localizer::AnyEvent;
use agv_core::measurement::{PoseFix, Time};

use super::Finding;
use super::stream::{Source, Stream};
use super::times::OTHER_CLOCK;
use crate::recording::Recording;

/// Poses that cannot be taken, that are of another time, or that are less sure than the vehicle may be.
pub(super) fn findings(recording: &Recording, streams: &[Stream], log: &str) -> Vec<Finding> {
    let fixes: Vec<&PoseFix> = recording
        .events
        .iter()
        .filter_map(|event| if let AnyEvent::SetPose(fix) = event { Some(fix) } else { None })
        .collect();
    let start = format!("agv replay {log} --start X,Y,HEADING, with the pose as it was measured");
    let mut findings = Vec::new();
    let unsound = fixes.iter().filter(|fix| !fix.is_sound()).count();
    if unsound > 0 {
        let what =
            format!("{unsound} of the poses that are given cannot be: they are no numbers, or negative deviations");
        findings.push(Finding::new(what, start.clone()));
    }
    let sound = || fixes.iter().filter(|fix| fix.is_sound());
    if let Some((first, last)) = odometry_span(recording, streams) {
        let apart = |fix: &&&PoseFix| (first.since(fix.time)).max(fix.time.since(last));
        let is_apart = |fix: &&&PoseFix| apart(fix) > OTHER_CLOCK;
        if let Some(furthest) = sound().filter(is_apart).map(|fix| apart(&fix)).max_by(f64::total_cmp) {
            let count = sound().filter(is_apart).count();
            findings.push(Finding::new(
                format!("{count} of the poses that are given are of another time, by {furthest:.4} s: they are of another clock"),
                start.clone(),
            ));
        }
    }
    let limits = &recording.parameters.limits;
    let is_rough = |fix: &&&PoseFix| {
        fix.position_deviation > limits.largest_position_deviation
            || fix.heading_deviation > limits.largest_heading_deviation
    };
    if let Some(rough) = sound().find(is_rough) {
        let degrees = f64::to_degrees;
        findings.push(Finding::new(
            format!(
                "a pose is given that is good to {:.2} m and {:.1} deg; above {:.2} m and {:.1} deg the vehicle is too uncertain \
                 until landmarks correct it (RViz gives 0.5 m and 15 deg to every pose)",
                rough.position_deviation,
                degrees(rough.heading_deviation),
                limits.largest_position_deviation,
                degrees(limits.largest_heading_deviation)
            ),
            format!(
                "agv replay {log} --start {:.3},{:.3},{:.2}, if the vehicle stands there to 0.3 m and 5 deg",
                rough.pose.x,
                rough.pose.y,
                degrees(rough.pose.theta)
            ),
        ));
    }
    findings
}

fn odometry_span(recording: &Recording, streams: &[Stream]) -> Option<(Time, Time)> {
    let source = Source::of_vehicle(&recording.parameters.vehicle);
    streams.iter().find(|stream| stream.source == source)?.span()
}
