//! Whether the values of what a log holds can be: one question for each way in which a sensor of that kind fails.

mod counters;
mod laser;
mod motion;

use agv_core::localizer::AnyEvent;
use agv_core::measurement::{EncoderSample, MOST_WHEELS, WheelReading, WheelSample};
use agv_core::odometry::Counter;

use super::Finding;
use super::stream::{Source, Stream};
use crate::recording::{RecordedEvent, RecordedReflectors, RecordedScan, Recording};

/// Share of what a source says from which on a fault is told.
const SHARE: f64 = 0.02;
/// Share of one value again and again that no source has that works.
const STUCK: f64 = 0.98;
/// Readings below which nothing is said of what stands still.
const FEWEST: usize = 50;

/// Values that cannot be, and values that never change.
pub(super) fn findings(recording: &Recording, streams: &[Stream], log: &str) -> Vec<Finding> {
    let is_moving = Moving::of(recording);
    streams.iter().flat_map(|stream| of_stream(recording, stream, &is_moving, log)).collect()
}

/// A way in which values are wrong, and of how many readings.
type Wrong = (usize, String, String);

fn of_stream(recording: &Recording, stream: &Stream, moving: &Moving, log: &str) -> Vec<Finding> {
    let events: Vec<&RecordedEvent> =
        recording.events.iter().filter(|event| Source::of(event) == Some(stream.source)).collect();
    let parameters = &recording.parameters;
    let wrong = match stream.source {
        Source::Encoders | Source::Wheels => counters::wrong(parameters, &events, moving),
        Source::Speed => motion::speeds(parameters, &events, moving),
        Source::Increments => motion::increments(parameters, &events, stream, moving),
        Source::Gyro => motion::gyro(parameters, &events, moving),
        Source::Reflectors(_) => laser::reflectors(&events, moving),
        Source::Scans(_) => laser::scans(&events, moving),
    };
    let all = events.len();
    let told = wrong.into_iter().filter(|(count, ..)| *count > 0 && *count as f64 >= SHARE * all as f64);
    let mut found: Vec<Finding> = told
        .map(|(count, what, next)| {
            let share = 100.0 * count as f64 / all as f64;
            let next = if next.is_empty() { stream.source.remedy(log) } else { next };
            Finding::new(format!("{} {what} ({count} of {all}, {share:.0} %)", stream.source.name()), next)
        })
        .collect();
    if let Some(laser) = stream.source.laser()
        && parameters.lasers.mount(laser).is_none()
    {
        found.push(Finding::new(
            format!(
                "{} are not used: the settings have no place for laser {}",
                stream.source.name(),
                laser.index() + 1
            ),
            "state where it is mounted: agv settings laser",
        ));
    }
    found
}

/// Whether the vehicle moves, by any of its sensors but one.
struct Moving {
    odometry: bool,
    laser: bool,
}

impl Moving {
    fn of(recording: &Recording) -> Self {
        let moves = |event: &RecordedEvent| match event {
            AnyEvent::Speed(sample) => sample.speed.abs() > STILL,
            AnyEvent::Increment(increment) => increment.displacement.position().norm() > 1e-4,
            _ => false,
        };
        let counters = recording.parameters.vehicle.counters();
        let samples: Vec<WheelSample> = recording.events.iter().filter_map(wheel_sample).collect();
        let goes = |counter: &Counter| counters::goes(&samples, counter, WAY);
        let revolutions: Vec<&RecordedReflectors> = recording
            .events
            .iter()
            .filter_map(|event| if let AnyEvent::Reflectors(seen) = event { Some(seen) } else { None })
            .filter(|seen| !seen.observations.is_empty())
            .collect();
        let ends = revolutions.first().zip(revolutions.get(revolutions.len() / 2));
        let scans: Vec<&RecordedScan> = recording
            .events
            .iter()
            .filter_map(|event| if let AnyEvent::Scan(scan) = event { Some(scan) } else { None })
            .collect();
        let views = scans.first().zip(scans.get(scans.len() / 2));
        Self {
            odometry: counters.iter().any(goes)
                || recording.events.iter().filter(|event| moves(event)).count() > FEWEST,
            laser: ends.is_some_and(|(first, last)| is_another_place(first, last))
                || views.is_some_and(|(first, last)| is_another_view(first, last)),
        }
    }
}

/// Time that a wheel may catch up in one sample, s.
const CATCH_UP: f64 = 0.02;
/// A vehicle that is slower stands, m/s; one that has gone less far has stood, m.
const STILL: f64 = 0.05;
const WAY: f64 = 0.5;
/// Ranges that differ by more are seen from elsewhere, m.
const ELSEWHERE: f32 = 0.3;

fn is_another_place(first: &RecordedReflectors, last: &RecordedReflectors) -> bool {
    let is_near = |range: f32| first.observations.iter().any(|one| (one.range - range).abs() < ELSEWHERE);
    last.observations.iter().filter(|one| !is_near(one.range)).count() * 2 > last.observations.len()
}

fn is_another_view(first: &RecordedScan, last: &RecordedScan) -> bool {
    let pairs = || first.ranges.iter().zip(&last.ranges).filter(|(a, b)| a.is_finite() && b.is_finite());
    pairs().filter(|(a, b)| (**a - **b).abs() > ELSEWHERE).count() * 2 > pairs().count()
}

fn wheel_sample(event: &RecordedEvent) -> Option<WheelSample> {
    match event {
        AnyEvent::Wheels(sample) => Some(*sample),
        AnyEvent::Encoders(EncoderSample { time, drive, steering }) => {
            let mut wheels = [WheelReading::default(); MOST_WHEELS];
            wheels[0] = WheelReading { count: *drive, steering: *steering };
            Some(WheelSample { time: *time, wheels })
        }
        _ => None,
    }
}

/// Most neighbours in a row that are the same.
fn longest_run<T>(values: &[T], is_same: impl Fn(&T, &T) -> bool) -> usize {
    let (mut run, mut longest) = (1, usize::from(!values.is_empty()));
    for pair in values.windows(2) {
        run = if is_same(&pair[0], &pair[1]) { run + 1 } else { 1 };
        longest = longest.max(run);
    }
    longest
}
