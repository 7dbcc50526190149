//! What is wrong with a drive that is lost or poor, and what to do next: findings in the order in which they are to be looked at.

mod calibration;
mod encoder_faults;
mod given_poses;
mod readings;
mod start;
mod stream;
mod times;
mod timing;
mod turns;
mod vehicle;

use agv_core::localizer::Mode;
use agv_core::maps::{Landmark, LandmarkKind};
use serde::Serialize;

use crate::calibrate::innovation_noise::HONEST;
use crate::calibrate::log_input::LogInput;
use crate::drive::{Figures, kind_name};
use crate::recording::{RecordedEvent, Recording};
use crate::replay::{Replay, StartSearchError, find_start};

use stream::{Source, Stream};
use vehicle::VehicleCheck;

pub use timing::moved;
pub use vehicle::with_laser_motion;

/// Something that is wrong, or that could not be looked at.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// In plain words.
    pub what: String,
    /// The command to type, or what to do.
    pub next: String,
}

impl Finding {
    fn new(what: impl Into<String>, next: impl Into<String>) -> Self {
        Self { what: what.into(), next: next.into() }
    }
}

/// Share of a drive in modes that no good drive has, from which on it is poor.
pub const POOR: f64 = 0.02;
/// Share that must fit the map.
const ACCEPTED: f64 = 0.9;
/// Observations below which nothing is said of them.
const FEWEST: usize = 100;

/// Share of a drive's time that is lost, degraded, without odometry, or not localised at all.
#[must_use]
pub fn poor_share(figures: &Figures) -> f64 {
    let bad = [Mode::Lost, Mode::Degraded, Mode::WithoutOdometry, Mode::NotLocalised];
    let all: f64 = figures.modes.iter().map(|mode| mode.duration_s).sum();
    let poor: f64 = figures.modes.iter().filter(|mode| bad.contains(&mode.mode)).map(|mode| mode.duration_s).sum();
    // The sum of nothing is a negative zero.
    if all > 0.0 { poor / all + 0.0 } else { 1.0 }
}

/// Everything that there is to say of a drive. `log` is how the commands name it; `progress` is called as by [`explain`]. What a
/// wrong clock or a wrong vehicle spoils is not looked at before that is mended.
#[must_use]
pub fn check(
    recording: &Recording,
    replay: &Replay,
    figures: &Figures,
    log: &str,
    progress: impl FnMut(usize),
) -> Vec<Finding> {
    let mut findings = measurements(recording, log);
    let is_poor = poor_share(figures) > POOR;
    let mut input = LogInput::of(recording);
    let clock = timing::put_right(&mut input);
    let vehicle = VehicleCheck::new(recording, input, progress);
    let is_late = vehicle.by_wheels.iter().any(|one| one.late().is_some());
    // A clock shows itself only where the encoders tell the motion.
    let clock = clock.or_else(|| {
        let mut right = vehicle.mended().filter(|_| vehicle.by_wheels.is_empty())?;
        timing::put_right(&mut right)
    });
    findings.extend(clock.map(|offset| timing::finding(&offset, log)));
    let is_sound = vehicle.is_sound();
    let mistakes = vehicle.finding(log);
    if clock.is_some() || is_late || mistakes.is_some() {
        findings.extend(mistakes);
        return findings;
    }
    let by_reflectors = || start::finding_by_reflectors(recording, replay, log);
    if let Some(finding) = start::finding(recording, replay, log).or_else(|| by_reflectors().filter(|_| is_poor)) {
        findings.push(finding);
        return findings;
    }
    let is_too_sure = figures.innovations.iter().any(|seen| 0.5 * seen.mean_normalised_square > *HONEST.end());
    let calibration = calibration::finding(&vehicle.input, log).filter(|_| is_poor || is_too_sure);
    if let Some(finding) = calibration {
        findings.push(finding);
        return findings;
    }
    if is_poor {
        if vehicle.is_untold() {
            findings.push(untold());
        }
        findings.extend(place(recording, log));
    }
    findings.extend(turns::finding(recording, is_sound, log));
    findings.extend(map(recording, figures, is_sound, log));
    findings.extend(noise(figures, log));
    if is_poor && findings.is_empty() {
        findings.push(Finding::new(
            format!(
                "{:.0} % of the drive is poor, and nothing of what is looked at is the reason",
                100.0 * poor_share(figures)
            ),
            format!("agv view {log}"),
        ));
    }
    findings
}

/// What is wrong with what the sensors measured, each by itself: what is missing, its times and its values. No motion is compared.
#[must_use]
pub fn measurements(recording: &Recording, log: &str) -> Vec<Finding> {
    let streams = Stream::all(recording);
    let mut findings = what_is_missing(recording, &streams, log);
    findings.extend(encoder_faults::findings(recording));
    findings.extend(times::findings(recording, &streams, log));
    findings.extend(readings::findings(recording, &streams, log));
    findings.extend(given_poses::findings(recording, &streams, log));
    findings
}

fn what_is_missing(recording: &Recording, streams: &[Stream], log: &str) -> Vec<Finding> {
    let has = |is: fn(&RecordedEvent) -> bool| recording.events.iter().any(is);
    let mut findings = Vec::new();
    let wanted = Source::of_vehicle(&recording.parameters.vehicle);
    let others: Vec<String> =
        streams.iter().map(|stream| stream.source).filter(|source| source.is_odometry()).map(Source::name).collect();
    if !streams.iter().any(|stream| stream.source == wanted) {
        findings.push(if others.is_empty() {
            Finding::new(
                "the log has no odometry",
                "look at the encoders on the bus: agv can monitor can0; state their nodes with --drive and --steering",
            )
        } else {
            Finding::new(
                format!(
                    "the log holds {}, but of this kind of vehicle {} are wanted",
                    others.join(" and "),
                    wanted.name()
                ),
                "agv settings vehicle.kind; record or import it again with the right kind",
            )
        });
    }
    if recording.parameters.gyro.is_fitted && !streams.iter().any(|stream| stream.source == Source::Gyro) {
        findings.push(Finding::new(
            "by the settings the vehicle has a gyro, and it says nothing",
            "look at its frame on the bus: agv can monitor can0; agv settings can.gyro",
        ));
    }
    if !has(|event| matches!(event, RecordedEvent::Scan(_) | RecordedEvent::Reflectors(_))) {
        findings.push(Finding::new("the laser says nothing in this log", "agv nav350 probe HOST"));
    }
    if !has(|event| matches!(event, RecordedEvent::SetPose(_))) {
        findings.push(Finding::new("nobody has told the vehicle where it starts", start_remedy(recording, log)));
    }
    if recording.landmarks.is_empty() {
        let start =
            if recording.truth.is_empty() && recording.references.is_empty() { "" } else { " --start recorded" };
        findings.push(Finding::new(
            "the log has no map",
            format!("agv replay {log} --map MAP, or agv replay {log}{start} --landmarks dynamic"),
        ));
    }
    findings
}

/// How a replay learns where the vehicle starts: by the map's reflectors, by other poses of the log, or from whoever knows it.
fn start_remedy(recording: &Recording, log: &str) -> String {
    let is_reflector = |landmark: &Landmark| landmark.kind == LandmarkKind::Reflector;
    let sees_reflectors = recording.events.iter().any(|event| matches!(event, RecordedEvent::Reflectors(_)));
    let mut ways = Vec::new();
    if sees_reflectors && recording.landmarks.iter().any(is_reflector) {
        ways.push("--relocalise reflectors");
    }
    if !(recording.truth.is_empty() && recording.references.is_empty()) {
        ways.push("--start recorded");
    }
    ways.push("--start X,Y,HEADING");
    format!("agv replay {log} {}", ways.join(", or "))
}

/// What is to be said if neither the vehicle as it is believed to be nor any other one explains the drive.
fn untold() -> Finding {
    Finding::new(
        "the drive does not tell whether encoders and laser agree: it has too few arcs or reflectors for that",
        "agv calibrate plan --area 14x11, drive that, and check its log",
    )
}

/// Whether the vehicle would find itself in the map by its first revolutions.
fn place(recording: &Recording, log: &str) -> Option<Finding> {
    let is_reflectors = |event: &RecordedEvent| matches!(event, RecordedEvent::Reflectors(_));
    let places = recording.events.iter().enumerate().filter(|(_, event)| is_reflectors(event));
    let end = places.map(|(index, _)| index).nth(REVOLUTIONS - 1)?;
    let first = Recording { events: recording.events[..=end].to_vec(), ..recording.clone() };
    match find_start(&first) {
        Err(StartSearchError::Unknown) => Some(Finding::new(
            "no place of the map looks like what is seen: it is the map of another place, or the reflectors were moved",
            if recording.events.iter().any(|event| matches!(event, RecordedEvent::Scan(_))) {
                format!("agv map {log} --output new.csv --kind reflectors --slam, then agv replay {log} --map new.csv")
            } else {
                format!(
                    "agv replay {log} --map MAP; a map of this place is made from a drive that is recorded with scans"
                )
            },
        )),
        Err(StartSearchError::Ambiguous) => Some(Finding::new(
            "two places of the map look like what is seen",
            "agv layout check MAP says where a reflector more would tell them apart",
        )),
        _ => None,
    }
}

/// Revolutions by which a vehicle would have found itself.
const REVOLUTIONS: usize = 40;

fn map(recording: &Recording, figures: &Figures, is_sound: bool, log: &str) -> Vec<Finding> {
    let is_mapped = |kind| recording.landmarks.iter().any(|landmark| landmark.kind == kind);
    let counted = figures.observations.iter().filter(|counts| is_mapped(counts.kind)).filter_map(|counts| {
        let all = counts.accepted + counts.gated + counts.unknown + counts.ambiguous;
        let share = counts.accepted as f64 / all.max(1) as f64;
        (all >= FEWEST && share < ACCEPTED).then_some((counts.kind, share))
    });
    let words = counted.map(|(kind, share)| {
        let what = format!("{:.0} % of what is seen of {} is in the map", 100.0 * share, kind_name(kind));
        let next = if is_sound && share < 0.5 {
            format!("the map may be of another place, or the start is wrong: {}", start_remedy(recording, log))
        } else {
            format!("agv map {log} --output new.csv, and compare")
        };
        Finding::new(what, next)
    });
    words.collect()
}

fn noise(figures: &Figures, log: &str) -> Option<Finding> {
    let off = figures.innovations.iter().filter(|seen| !HONEST.contains(&(0.5 * seen.mean_normalised_square)));
    let words: Vec<String> =
        off.map(|seen| format!("{} {:.2}", kind_name(seen.kind), seen.mean_normalised_square)).collect();
    (!words.is_empty()).then(|| {
        Finding::new(
            format!(
                "innovations are not what the filter expects, mean normalised square where 2 is expected: {}",
                words.join(", ")
            ),
            format!("agv calibrate noise {log}"),
        )
    })
}
