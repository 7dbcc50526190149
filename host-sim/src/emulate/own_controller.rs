//! A vehicle's own controller, which says how the vehicle moves.

use agv_core::geometry::Pose;
use agv_core::localizer::Event;
use agv_core::measurement::{PoseIncrement, SpeedSample, Time};
use agv_wire::can::frame::Frame;
use agv_wire::can::motion_frames::MotionFrames;

use crate::recording::Recording;

#[derive(Clone, Copy, Debug)]
enum Report {
    Speed(SpeedSample),
    Increment(PoseIncrement),
}

impl Report {
    const fn time(&self) -> Time {
        match self {
            Self::Speed(sample) => sample.time,
            Self::Increment(increment) => increment.time,
        }
    }
}

/// A controller that says on a bus what a drive has recorded, and before and behind it that the vehicle stands.
#[derive(Clone, Debug)]
pub struct EmulatedController {
    frames: MotionFrames,
    reports: Vec<Report>,
    period: f64,
    next: usize,
    /// When it says the next time that the vehicle stands.
    due: Time,
    /// What increments were told too little, as frames have steps.
    rest: Pose,
}

impl EmulatedController {
    /// The controller of a drive, with a report every `period` seconds; none if the drive has no such reports.
    #[must_use]
    pub fn of(recording: &Recording, frames: &MotionFrames, period: f64) -> Option<Self> {
        let reports = recording.events.iter().filter_map(|event| match event.view() {
            Event::Speed(sample) => Some(Report::Speed(sample)),
            Event::Increment(increment) => Some(Report::Increment(increment)),
            _ => None,
        });
        let reports: Vec<Report> = reports.collect();
        let (due, rest) = (Time::default(), Pose::default());
        (!reports.is_empty()).then_some(Self { frames: *frames, reports, period, next: 0, due, rest })
    }

    /// Length of the drive, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        match (self.reports.first(), self.reports.last()) {
            (Some(first), Some(last)) => last.time().since(first.time()),
            _ => 0.0,
        }
    }

    /// What it sends at `now`, if the vehicle drives off, or has, at `start`.
    pub fn poll(&mut self, now: Time, start: Option<Time>) -> Vec<Frame> {
        let mut frames = Vec::new();
        let Some(first) = self.reports.first().map(Report::time) else { return frames };
        let elapsed = start.map_or(f64::NEG_INFINITY, |start| now.since(start));
        while let Some(report) = self.reports.get(self.next).copied().filter(|next| next.time().since(first) <= elapsed)
        {
            self.next += 1;
            self.due = now.offset(self.period);
            self.say(&report, &mut frames);
        }
        let is_driving = elapsed >= 0.0 && self.next < self.reports.len();
        if !is_driving && now >= self.due {
            let due = self.due.offset(self.period);
            self.due = if due <= now { now.offset(self.period) } else { due };
            // The steering stays where it is.
            let report = match self.reports[self.next.saturating_sub(1)] {
                Report::Speed(sample) => Report::Speed(SpeedSample { speed: 0.0, ..sample }),
                Report::Increment(increment) => {
                    Report::Increment(PoseIncrement { displacement: Pose::default(), ..increment })
                }
            };
            self.say(&report, &mut frames);
        }
        frames
    }

    fn say(&mut self, report: &Report, frames: &mut Vec<Frame>) {
        match report {
            Report::Speed(SpeedSample { speed, steering, .. }) => {
                frames.extend(self.frames.encode_speed(*speed, *steering).into_iter().flatten().flatten());
            }
            Report::Increment(PoseIncrement { displacement, .. }) => {
                let [rest, moved] = [self.rest, *displacement];
                let wanted = Pose { x: rest.x + moved.x, y: rest.y + moved.y, theta: rest.theta + moved.theta };
                let told = self.frames.rounded(&wanted);
                self.rest = Pose { x: wanted.x - told.x, y: wanted.y - told.y, theta: wanted.theta - told.theta };
                frames.extend(self.frames.encode_increment(&told));
            }
        }
    }
}
