//! Whether the times of what a log holds can be: for every source the same questions.

use super::Finding;
use super::stream::{Source, Stream, median};
use crate::recording::Recording;

/// Share of a source that is said twice before it is told.
const REPEATED: f64 = 0.02;
/// A source that is so far from the odometry as it arrives has another clock, s: the localiser remembers no longer than 1.3 s.
pub(super) const OTHER_CLOCK: f64 = 1.0;
/// Share of the shorter of two sources that lies within the other one.
const OVERLAP: f64 = 0.5;

/// Gaps, times that go back, times that come twice, and times of another clock.
pub(super) fn findings(recording: &Recording, streams: &[Stream], log: &str) -> Vec<Finding> {
    let odometry = streams.iter().find(|stream| stream.source == Source::of_vehicle(&recording.parameters.vehicle));
    let of_stream = |stream: &Stream| {
        let clock = odometry.filter(|odometry| odometry.source != stream.source);
        let clock = clock.and_then(|odometry| other_clock(stream, odometry, log));
        [order(stream, log), clock]
    };
    streams.iter().flat_map(of_stream).flatten().collect()
}

fn order(stream: &Stream, log: &str) -> Option<Finding> {
    let limit = stream.gap();
    let count = |is: &dyn Fn(f64) -> bool| stream.steps().filter(|step| is(*step)).count();
    let (long, back, twice) = (count(&|step| step > limit), count(&|step| step < 0.0), count(&|step| step == 0.0));
    let longest = stream.steps().fold(0.0, f64::max);
    let furthest = -stream.steps().fold(0.0, f64::min);
    let times = |count: usize| if count == 1 { "once".to_owned() } else { format!("{count} times") };
    let mut words = Vec::new();
    match long {
        0 => {}
        1 => words.push(format!("leave a gap of {longest:.2} s")),
        _ => words.push(format!("leave {long} gaps, the longest of {longest:.2} s")),
    }
    if back > 0 {
        words.push(format!("go back in time {}, by {furthest:.3} s at the most", times(back)));
    }
    if twice as f64 > REPEATED * stream.times.len() as f64 {
        words.push(format!("come twice with the same time, {}", times(twice)));
    }
    let what = format!("{} {}", stream.source.name(), words.join(", and "));
    (!words.is_empty()).then(|| Finding::new(what, stream.source.remedy(log)))
}

/// By how much a source is later than the odometry as it arrives, s; none if nothing says it.
pub(super) fn late_at_arrival(stream: &Stream) -> Option<f64> {
    let heard = stream.odometry.iter().filter(|odometry| odometry.is_some()).count();
    if 2 * heard < stream.times.len() || !is_interleaved(stream) {
        return None;
    }
    median(
        stream
            .times
            .iter()
            .zip(&stream.odometry)
            .filter_map(|(time, odometry)| Some(time.as_ref()?.since((*odometry)?))),
    )
}

/// Whether the odometry went on while the source measured: otherwise the log is in the order of times rather than of arrival.
fn is_interleaved(stream: &Stream) -> bool {
    let heard = || stream.odometry.iter().flatten();
    let (Some(first), Some(last)) = (heard().min(), heard().max()) else { return false };
    stream.span().is_some_and(|(begin, end)| last.since(*first) > OVERLAP * end.since(begin))
}

fn other_clock(stream: &Stream, odometry: &Stream, log: &str) -> Option<Finding> {
    let (begin, end) = stream.span()?;
    let (first, last) = odometry.span()?;
    let (duration, shortest) = (end.since(begin), last.since(first).min(end.since(begin)));
    let common = end.min(last).since(begin.max(first));
    let is_apart = common < OVERLAP * shortest || (shortest == 0.0 && common < 0.0);
    let late = late_at_arrival(stream);
    let apart = late.filter(|late| late.abs() > OTHER_CLOCK).or_else(|| is_apart.then(|| begin.since(first)))?;
    let side = if apart > 0.0 { "after" } else { "before" };
    let what = format!(
        "{} carry times {:.4} s {side} those of the odometry, over {duration:.1} s: they are of another clock",
        stream.source.name(),
        apart.abs()
    );
    let next = if late.is_some() && stream.source.laser().is_some() {
        format!("agv check {log} --put-right mended.agvlog")
    } else {
        "give both one clock (NTP, or the times of receipt), and record or import it again".to_owned()
    };
    Some(Finding::new(what, next))
}
