//! Pictures of a replayed drive.

use agv_core::geometry::Point;
use agv_core::integrity::Alarm;
use agv_core::localizer::{LandmarkSource, LandmarkUse, Mode};
use agv_core::maps::{LandmarkKind, Verdict};
use agv_core::measurement::Time;

use super::figures::{Figures, KINDS, MODES};
use super::names::kind_name;
use super::track::Track;
use crate::accuracy::{HEADING_REQUIREMENT, POSITION_REQUIREMENT, Spread, pose_at};
use crate::recording::{RecordedEvent, RecordedScan, Recording};
use crate::replay::Replay;
use crate::report::{
    Bounds, FIT_TO_DOCK, FIT_TO_TRAVEL, Figure, FigureError, LandmarkMark, Map, NO_POSE, NOT_FIT, Page, PointSet,
    Series, StateSpan, landmark_timeline, line_chart, scatter_chart, state_timeline, trajectory_plot,
};

/// Scans that the outlines of the surroundings are drawn from, and pieces of outline of each, at the most.
const OUTLINE_SCANS: usize = 8;
const OUTLINE_PIECES: usize = 500;

/// Neighbouring returns further apart than this are not joined, m.
const OUTLINE_GAP: f64 = 0.3;

/// Normalised squares above so many gates are drawn there.
const HIGHEST_TEST_RATIO: f64 = 3.0;

/// Errors of the position, mm, and of the heading, deg, over the way; with what the filter believed.
struct ErrorLines {
    position: Vec<(f64, f64)>,
    position_bound: Vec<(f64, f64)>,
    heading: Vec<(f64, f64)>,
    heading_bound: Vec<(f64, f64)>,
}

/// Position errors over the way, m and mm: for a chart of several drives.
#[must_use]
pub fn position_error_line(track: &Track) -> Vec<(f64, f64)> {
    track.errors.iter().map(|error| (error.way, 1e3 * error.position)).collect()
}

/// Heading errors without their sign over the way, m and deg.
#[must_use]
pub fn heading_error_line(track: &Track) -> Vec<(f64, f64)> {
    let headings = track.errors.iter().filter_map(|error| Some((error.way, error.heading?.abs().to_degrees())));
    headings.collect()
}

/// Lines over the way with the largest position error that can still be worked with.
///
/// # Errors
/// If the picture cannot be drawn.
pub fn position_error_chart(series: &[Series]) -> Result<Figure, FigureError> {
    let limit = Bounds { name: "2 cm", heights: &[1e3 * POSITION_REQUIREMENT] };
    line_chart(["way, m", "position error, mm"], series, Some(limit))
}

/// Lines over the way with the largest heading error that can still be worked with.
///
/// # Errors
/// If the picture cannot be drawn.
pub fn heading_error_chart(series: &[Series]) -> Result<Figure, FigureError> {
    let limit = Bounds { name: "0.1 deg", heights: &[HEADING_REQUIREMENT.to_degrees()] };
    line_chart(["way, m", "heading error, deg"], series, Some(limit))
}

/// Adds all pictures of a drive to a page.
///
/// # Errors
/// If a picture cannot be drawn.
pub fn add_pictures(
    page: &mut Page,
    recording: &Recording,
    replay: &Replay,
    track: &Track,
    figures: &Figures,
) -> Result<(), FigureError> {
    page.section("Where the pose was good for what");
    page.figure(
        &level_map(recording, replay, track)?,
        "The way in the colour of what the protection level allowed there. The limits are the settings alert_limits; a circle marks the start, \
         and grey is what the laser saw.",
    );
    page.section("Way");
    page.figure(
        &trajectories(recording, replay, track)?,
        "Way of the logical point over the landmarks of the map. Circles mark the start; grey is what the laser saw.",
    );
    if !track.errors.is_empty() {
        add_errors(page, track)?;
    }
    add_modes(page, figures, recording, replay)?;
    add_innovations(page, recording, replay)?;
    add_landmark_use(page, replay)
}

fn line(points: impl Iterator<Item = Point>) -> Vec<(f64, f64)> {
    points.map(|point| (point.x, point.y)).collect()
}

/// The way, one path for each thing that the level allows; a piece of another kind interrupts it.
fn level_map(recording: &Recording, replay: &Replay, track: &Track) -> Result<Figure, FigureError> {
    let limits = &recording.parameters.alert_limits;
    let classes = [
        (Alarm::None, FIT_TO_DOCK),
        (Alarm::Docking, FIT_TO_TRAVEL),
        (Alarm::Travel, NOT_FIT),
        (Alarm::NoPose, NO_POSE),
    ];
    let nowhere = (f64::NAN, f64::NAN);
    let mut ways: [Vec<(f64, f64)>; 4] = Default::default();
    let mut last: Option<(f64, f64)> = None;
    for point in &track.points {
        let output = &point.output;
        let alarm = limits.alarm(output.mode, &output.level);
        let place = (output.pose.x, output.pose.y);
        for ((class, _), way) in classes.iter().zip(&mut ways) {
            if *class == alarm {
                // A piece begins where the one before it ends.
                if way.last().is_none_or(|(x, _)| x.is_nan()) {
                    way.extend(last);
                }
                way.push(place);
            } else if way.last().is_some_and(|(x, _)| x.is_finite()) {
                way.push(nowhere);
            }
        }
        last = Some(place);
    }
    let mut paths: Vec<Series> = classes.iter().zip(&ways).map(|((_, name), points)| Series { name, points }).collect();
    paths.retain(|path| !path.points.is_empty());
    on_map(recording, replay, track, &paths)
}

fn trajectories(recording: &Recording, replay: &Replay, track: &Track) -> Result<Figure, FigureError> {
    let estimated = line(track.points.iter().map(|point| point.output.pose.position()));
    let truth = line(recording.truth.iter().map(|truth| truth.pose.position()));
    let references = line(recording.references.iter().map(|reference| reference.position()));
    let mut paths = vec![Series { name: "estimated", points: &estimated }];
    if !truth.is_empty() {
        paths.push(Series { name: "true", points: &truth });
    }
    if !references.is_empty() {
        paths.push(Series { name: "references, of the laser", points: &references });
    }
    on_map(recording, replay, track, &paths)
}

/// Paths over the landmarks, and what the laser saw.
fn on_map(recording: &Recording, replay: &Replay, track: &Track, paths: &[Series]) -> Result<Figure, FigureError> {
    let of_kind = |kind: LandmarkKind| {
        let landmarks = recording.landmarks.iter().filter(|landmark| landmark.kind == kind);
        landmarks.map(|landmark| (landmark.x, landmark.y)).collect::<Vec<_>>()
    };
    let fixed = KINDS.map(of_kind);
    let dynamic: Vec<(f64, f64)> = replay.dynamic_landmarks.iter().map(|[x, y]| (*x, *y)).collect();
    let mut landmarks: Vec<PointSet> =
        KINDS.iter().zip(&fixed).map(|(kind, points)| PointSet { name: kind_name(*kind), points }).collect();
    landmarks.push(PointSet { name: "found while driving", points: &dynamic });
    landmarks.retain(|set| !set.points.is_empty());
    let outlines = outlines(recording, track);
    trajectory_plot(&Map { outlines: &outlines, landmarks: &landmarks }, paths)
}

/// What a few scans along the way saw, from where the localiser believed to be: short lines in W.
fn outlines(recording: &Recording, track: &Track) -> Vec<[(f64, f64); 2]> {
    let poses: Vec<_> = track.points.iter().map(|point| point.output).collect();
    let scans: Vec<&RecordedScan> = recording
        .events
        .iter()
        .filter_map(|event| match event {
            RecordedEvent::Scan(scan) => Some(scan),
            _ => None,
        })
        .collect();
    let farthest = recording.parameters.features.farthest;
    let step = scans.len().div_ceil(OUTLINE_SCANS).max(1);
    let mut outlines = Vec::new();
    for scan in scans.iter().step_by(step) {
        let view = scan.view();
        let locate = |beam: usize| {
            let range = *scan.ranges.get(beam)?;
            let is_return = range.is_finite() && range > recording.parameters.features.nearest && range < farthest;
            let pose = pose_at(&poses, view.beam_time(beam)).filter(|_| is_return)?;
            let (sine, cosine) = (scan.first_bearing + beam as f64 * scan.bearing_step).sin_cos();
            let seen = Point::new(f64::from(range) * cosine, f64::from(range) * sine);
            Some(pose.compose(recording.parameters.lasers.first()).transform(&seen))
        };
        let stride = scan.ranges.len().div_ceil(OUTLINE_PIECES).max(1);
        let points: Vec<Option<Point>> = (0..scan.ranges.len()).step_by(stride).map(locate).collect();
        for pair in points.windows(2) {
            if let [Some(from), Some(to)] = pair
                && (to - from).norm() < OUTLINE_GAP
            {
                outlines.push([(from.x, from.y), (to.x, to.y)]);
            }
        }
    }
    outlines
}

fn add_errors(page: &mut Page, track: &Track) -> Result<(), FigureError> {
    let degrees = |radians: f64| radians.to_degrees();
    let lines = ErrorLines {
        position: position_error_line(track),
        position_bound: track.points.iter().map(|point| (point.way, 3e3 * point.position_deviation())).collect(),
        heading: heading_error_line(track),
        heading_bound: track.points.iter().map(|point| (point.way, degrees(3.0 * point.heading_deviation()))).collect(),
    };
    page.section("Errors over the way");
    let bound = "three standard deviations";
    let position = [
        Series { name: "distance from the true position", points: &lines.position },
        Series { name: bound, points: &lines.position_bound },
    ];
    page.figure(
        &position_error_chart(&position)?,
        "Error of the position, what the filter believed of it along its worst axis, and what can still be worked with.",
    );
    if !lines.heading.is_empty() {
        let heading = [
            Series { name: "difference from the true heading", points: &lines.heading },
            Series { name: bound, points: &lines.heading_bound },
        ];
        page.figure(
            &heading_error_chart(&heading)?,
            "Error of the heading, what the filter believed of it, and what can still be worked with.",
        );
    }
    Ok(())
}

fn add_modes(page: &mut Page, figures: &Figures, recording: &Recording, replay: &Replay) -> Result<(), FigureError> {
    let mut spans: Vec<StateSpan> = Vec::new();
    for (event, pose) in recording.events.iter().zip(&replay.poses) {
        let now = if pose.mode == Mode::NotLocalised { event.time() } else { Some(pose.time) };
        let Some(now) = now.map(Time::seconds) else {
            continue;
        };
        let state = MODES.iter().position(|mode| *mode == pose.mode).unwrap_or_default();
        if let Some(last) = spans.last_mut() {
            last.to = now.max(last.to);
        }
        if spans.last().is_none_or(|last| last.state != state) {
            spans.push(StateSpan { from: now, to: now, state });
        }
    }
    page.section("Mode over time");
    let names = MODES.map(|mode| figures.mode_name(mode));
    page.figure(&state_timeline("time, s", &names, &spans)?, "What the pose rested on.");
    Ok(())
}

fn add_innovations(page: &mut Page, recording: &Recording, replay: &Replay) -> Result<(), FigureError> {
    let compared: Vec<&LandmarkUse> =
        replay.uses.iter().filter(|used| used.landmark.is_some() && used.verdict != Verdict::OutOfTime).collect();
    if compared.is_empty() {
        return Ok(());
    }
    page.section("Innovations");
    let gate = recording.parameters.association.gate;
    let ratios = |is_wanted: fn(Verdict) -> bool| -> Vec<(f64, f64)> {
        let wanted = compared.iter().filter(|used| is_wanted(used.verdict));
        wanted.map(|used| (used.time.seconds(), gate * used.test_ratio.min(HIGHEST_TEST_RATIO))).collect()
    };
    let accepted = ratios(|verdict| verdict == Verdict::Accepted);
    let rejected = ratios(|verdict| verdict != Verdict::Accepted);
    let sets = [PointSet { name: "accepted", points: &accepted }, PointSet { name: "rejected", points: &rejected }];
    page.figure(
        &scatter_chart(["time, s", "normalised square"], &sets, Some(Bounds { name: "gate", heights: &[gate] }))?,
        "Squared Mahalanobis distance from the nearest landmark; far larger ones are drawn at the top.",
    );
    let residuals = |is_wanted: &dyn Fn(LandmarkKind) -> bool, value: &dyn Fn(&LandmarkUse) -> f64| {
        let wanted = compared.iter().filter(|used| used.verdict == Verdict::Accepted && is_wanted(used.kind));
        wanted.map(|used| (used.time.seconds(), value(used))).collect::<Vec<(f64, f64)>>()
    };
    let is_reflector = |kind: LandmarkKind| kind == LandmarkKind::Reflector;
    let is_feature = |kind: LandmarkKind| kind != LandmarkKind::Reflector;
    let millimetres = |axis: usize| move |used: &LandmarkUse| 1e3 * used.residual[axis];
    let ranges = residuals(&is_reflector, &millimetres(0));
    let bearings = residuals(&is_reflector, &|used| used.residual[1].to_degrees());
    let first = residuals(&is_feature, &millimetres(0));
    let second = residuals(&is_feature, &millimetres(1));
    let expected = |wanted: &dyn Fn(LandmarkKind) -> bool, axis: usize| {
        let accepted = replay.uses.iter().filter(|used| used.verdict == Verdict::Accepted && wanted(used.kind));
        3.0 * Spread::of(accepted.map(|used| used.residual_deviation[axis])).median
    };
    add_residuals(
        page,
        "range, mm",
        &[("reflectors", &ranges)],
        1e3 * expected(&is_reflector, 0),
        "Range of the reflectors minus its expectation.",
    )?;
    add_residuals(
        page,
        "bearing, deg",
        &[("reflectors", &bearings)],
        expected(&is_reflector, 1).to_degrees(),
        "Bearing of the reflectors minus its expectation.",
    )?;
    add_residuals(
        page,
        "position, mm",
        &[("along the first axis of the sensor", &first), ("along the second", &second)],
        1e3 * expected(&is_feature, 0),
        "Position of the features in the sensor's frame minus its expectation.",
    )
}

/// Residuals with what the filter expects of them.
fn add_residuals(
    page: &mut Page,
    label: &str,
    sets: &[(&str, &Vec<(f64, f64)>)],
    bound: f64,
    caption: &str,
) -> Result<(), FigureError> {
    if sets.iter().all(|(_, points)| points.is_empty()) {
        return Ok(());
    }
    let sets: Vec<PointSet> = sets.iter().map(|(name, points)| PointSet { name, points }).collect();
    let bounds = Bounds { name: "three expected standard deviations, median", heights: &[-bound, bound] };
    page.figure(&scatter_chart(["time, s", label], &sets, Some(bounds))?, caption);
    Ok(())
}

fn add_landmark_use(page: &mut Page, replay: &Replay) -> Result<(), FigureError> {
    let groups: [(&str, LandmarkSource, bool); 3] = [
        ("Reflectors: when each was used.", LandmarkSource::Fixed, true),
        ("Mapped features: when each was used.", LandmarkSource::Fixed, false),
        ("Features found while driving: when each was used.", LandmarkSource::Dynamic, false),
    ];
    let mut is_first = true;
    for (caption, source, is_reflector) in groups {
        let marks: Vec<LandmarkMark> = replay
            .uses
            .iter()
            .filter(|used| (used.kind == LandmarkKind::Reflector) == is_reflector)
            .filter_map(|used| {
                let (_, id) = used.landmark.filter(|(of, _)| *of == source)?;
                let is_accepted = used.verdict == Verdict::Accepted;
                Some(LandmarkMark { x: used.time.seconds(), landmark: id.into(), is_accepted })
            })
            .collect();
        if marks.is_empty() {
            continue;
        }
        if std::mem::take(&mut is_first) {
            page.section("Use of landmarks");
        }
        page.figure(&landmark_timeline("time, s", &marks)?, caption);
    }
    Ok(())
}
