//! `agv replay`.

use std::path::{Path, PathBuf};

use agv_core::geometry::Pose;
use agv_core::localizer::{MapUse, PoseFix};
use agv_core::maps::{Landmark, LandmarkKind};
use agv_core::odometry::Vehicle;
use agv_core::record::Damage;
use agv_core::state::Mode;
use agv_host_sim::contour_map::ContourMap;
use agv_host_sim::drive::{Figures, Track, add_drive, figure_rows};
use agv_host_sim::drive_check::{POOR, poor_share};
use agv_host_sim::log::{self, Contents};
use agv_host_sim::mapping::odometry_noise::odometry_noise;
use agv_host_sim::mapping::{contour_file, map_file};
use agv_host_sim::recording::{RecordedEvent, RecordedOutput, Recording, Truth};
use agv_host_sim::replay::{Comparisons, Replay as Replayed, replay_in};
use agv_host_sim::report::Page;
use anyhow::{Context, ensure};
use clap::ValueEnum;

use super::drive_summary::DriveSummary;
use super::lidar3d::relocalise::Relocalisation;
use super::setting_arguments::SettingArguments;
use super::vehicle_argument::VehicleArgument;
use super::{like, output, pose_argument, progress};

const HELP: &str = "\
Examples:
  agv replay drive.agvlog
  agv replay drive.agvlog --report drive-report
  agv replay drive.agvlog --map features.csv --json
  agv replay drive.agvlog --vehicle vehicle.toml
  agv replay intel.agvlog --start recorded --landmarks dynamic
  agv replay drive.agvlog --landmarks none --output odometry.agvlog
  agv replay drive.agvlog --relocalise reflectors
  agv replay drive.agvlog --map contours.csv --relocalise contours
  agv replay tail.agvlog --like drive.agvlog --start recorded --output whole.agvlog
  agv replay drive.agvlog --relocalise lidar3d --places street.places3d --scans drive.pcap

Keys of --json:
  software, duration_s, way_m, events, poses, realtime_factor,
  fitness {travel_share, docking_share, pose_share, lost, lost_s, level_position_mm, level_heading_deg, corrections,
    largest_correction_mm, beyond_level [beyond, compared]}, grade (good, partly, poor),
  modes [mode, duration_s], mode_changes [time_s, since_start_s, mode, reason],
  observations [kind, accepted, gated, ambiguous, unknown, out_of_time], contours {scans, matched},
  innovations [kind, rms_first_mm, rms_second_mm, rms_bearing_deg, mean_normalised_square],
  accuracy {against, compared, position_mm, position_end_mm, heading_deg, heading_end_deg, nees, ok_share},
  outputs {compared, first_difference}, published {compared, first_difference}, damage [offset, skipped, reason].
Shares are of the recorded time; the level is null where the error has no bound. accuracy and beyond_level are null if nobody knows
where the vehicle was; outputs, and published for the poses that the vehicle was given, are null
if the log holds none that can be compared.";

/// Run the localiser on a log.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Replay {
    /// The log.
    log: PathBuf,
    /// Write a page with pictures to DIR/index.html.
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Write a log with the same events and the outputs of this replay.
    #[arg(long, value_name = "LOG2")]
    output: Option<PathBuf>,
    /// Map to use; its reflectors replace those of the log, its features the log's features. A map of contours is used
    /// beside them; the noise of an odometry that was imported is then found from its scans.
    #[arg(long, value_name = "MAP")]
    map: Vec<PathBuf>,
    /// Log whose vehicle and map are those of this one, if this one is a part that has lost its beginning.
    #[arg(long, value_name = "LOG")]
    like: Option<PathBuf>,
    #[command(flatten)]
    vehicle: VehicleArgument,
    /// Which landmarks correct the pose, instead of what the log states.
    #[arg(long, value_name = "KIND,...", value_delimiter = ',')]
    landmarks: Vec<Landmarks>,
    /// Where the vehicle is at the start, for logs that do not say it: X,Y,HEADING of the logical point in m, m and deg,
    /// good to 0.3 m and 5 deg, or `recorded` for the first true or reference pose, or the first answer of a localised
    /// vehicle if there is neither.
    #[arg(long, value_name = "POSE", value_parser = start, allow_hyphen_values = true)]
    start: Option<Start>,
    #[command(flatten)]
    settings: SettingArguments,
    #[command(flatten)]
    relocalisation: Relocalisation,
    /// Print one JSON object instead of a table.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Landmarks {
    /// Odometry alone.
    None,
    /// The map's reflectors.
    Reflectors,
    /// The map's natural features.
    Features,
    /// Natural features that are found while driving.
    Dynamic,
    /// Natural features that are found on the way, in the state of the filter.
    Slam,
}

/// Where the vehicle is at the start.
#[derive(Clone, Copy, Debug)]
enum Start {
    Recorded,
    Given(Pose),
}

fn start(text: &str) -> Result<Start, String> {
    if text == "recorded" {
        return Ok(Start::Recorded);
    }
    let problem = || "three numbers X,Y,HEADING, or 'recorded', are expected".to_owned();
    pose_argument::pose(text).map(Start::Given).map_err(|_| problem())
}

impl Replay {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        if let Some(output) = &self.output {
            let is_same = |a: &Path, b: &Path| a.canonicalize().is_ok_and(|a| b.canonicalize().is_ok_and(|b| a == b));
            ensure!(!is_same(output, &self.log), "{}: the output would replace the log", output.display());
        }
        let size = std::fs::metadata(&self.log).map_or(0, |metadata| metadata.len());
        let reading = progress::bar("reading", size);
        let contents = self.read(|bytes| reading.set_position(bytes))?;
        reading.finish_and_clear();
        let Contents { software, mut recording, outputs, publishing, damages } = contents;
        let contours = self.prepare(&mut recording, &outputs)?;
        let replay = self.replay(&recording, contours.as_ref())?;
        // Of a log that begins in the middle of a drive the map of contours is a part.
        let is_as_recorded = self.is_as_recorded() || (recording.state.is_some() && self.adds_contours_only());
        let comparisons = if is_as_recorded {
            Comparisons::of(&outputs, &publishing, &recording, &replay)
        } else {
            Comparisons::default()
        };
        if let Some(path) = &self.output {
            log::write_with_outputs(path, &recording, |event| replay.output(event))?;
        }
        let track = Track::new(&recording, &replay);
        let figures = Figures::new(&recording, &replay, &track);
        let mut remarks = self.remarks(&software, &comparisons, &damages);
        if figures.poses == 0 {
            remarks.push(["start".to_owned(), "no pose is given in the log; --start gives one".to_owned()]);
        }
        if let Some(folder) = &self.report {
            let name = self.log.file_name().unwrap_or_default().to_string_lossy();
            let mut page = Page::new(&format!("Replay of {name}"));
            add_drive(&mut page, &remarks, &recording, &replay, &track, &figures)?;
            let path = folder.join("index.html");
            page.write(&path).with_context(|| path.display().to_string())?;
        }
        if self.json {
            let summary = DriveSummary::new(&software, &figures, comparisons, &damages);
            println!("{}", serde_json::to_string_pretty(&summary)?);
        } else {
            self.print(remarks, &figures);
        }
        Ok(())
    }

    fn read(&self, progress: impl FnMut(u64)) -> anyhow::Result<Contents> {
        let Some(like) = &self.like else { return Ok(log::read_contents(&self.log, progress)?) };
        let like = like::drive_like(Some(like))?;
        Ok(log::read_part(&self.log, &like, progress)?)
    }

    /// Whether nothing is changed of what the log says. What a vehicle knew before a part of a log is not known.
    fn is_as_recorded(&self) -> bool {
        self.map.is_empty() && self.is_otherwise_as_recorded()
    }

    /// Whether the one thing that the log does not say is added: the map of contours of its vehicle.
    fn adds_contours_only(&self) -> bool {
        self.map.iter().all(|path| contour_file::is_contour_map(path)) && self.is_otherwise_as_recorded()
    }

    fn is_otherwise_as_recorded(&self) -> bool {
        self.like.is_none()
            && self.landmarks.is_empty()
            && self.start.is_none()
            && self.vehicle.vehicle.is_none()
            && self.settings.is_empty()
            && !self.relocalisation.is_wanted()
    }

    /// Changes what the log says to what is wanted. A map of contours is given back.
    fn prepare(&self, recording: &mut Recording, answers: &[RecordedOutput]) -> anyhow::Result<Option<ContourMap>> {
        let of_log = || self.log.display().to_string();
        // What was known before the log was so of the vehicle and the map of the log.
        if !self.is_as_recorded() && !self.adds_contours_only() {
            recording.state = None;
        }
        self.settings.apply(&mut recording.parameters)?;
        self.vehicle.apply(&mut recording.parameters, &self.log)?;
        let mut contours = None;
        for path in &self.map {
            if contour_file::is_contour_map(path) {
                contours = Some(contour_file::read(path)?);
                continue;
            }
            let map = map_file::read(path)?;
            ensure!(
                !map.is_empty(),
                "{}: there are no landmarks in the map; --landmarks none uses none",
                path.display()
            );
            use_map(recording, map);
        }
        if !self.landmarks.is_empty() {
            recording.parameters.maps = self.maps()?;
        }
        // Of an odometry that others have recorded nobody has stated the noise.
        let is_stated = recording.state.is_some();
        if contours.is_some() && recording.parameters.vehicle == Vehicle::Increments && !is_stated {
            recording.parameters.odometry_noise = odometry_noise(recording).with_context(of_log)?;
        }
        self.relocalisation.apply(recording, contours.as_ref()).with_context(of_log)?;
        if let Some(start) = self.start {
            set_start(recording, answers, start).with_context(of_log)?;
        }
        Ok(contours)
    }

    fn replay(&self, recording: &Recording, contours: Option<&ContourMap>) -> anyhow::Result<Replayed> {
        let running = progress::bar("replaying", recording.events.len() as u64);
        let done = |events: usize| running.set_position(events as u64);
        // A map that was read here is in order.
        let contours = contours.map(ContourMap::view);
        let replay = replay_in(recording, contours, done).with_context(|| self.log.display().to_string())?;
        running.finish_and_clear();
        Ok(replay)
    }

    fn print(&self, remarks: Vec<[String; 2]>, figures: &Figures) {
        let mut rows = remarks;
        rows.extend(figure_rows(figures));
        let poor = poor_share(figures);
        if poor > POOR {
            let next = format!("for {:.0} % of the time; agv check {} says why", 100.0 * poor, self.log.display());
            rows.push(["lost or poor".to_owned(), next]);
        }
        if let Some(folder) = &self.report {
            rows.push(["report".to_owned(), folder.join("index.html").display().to_string()]);
        }
        output::print_rows(&rows);
    }

    fn maps(&self) -> anyhow::Result<MapUse> {
        let has = |wanted| self.landmarks.contains(&wanted);
        if has(Landmarks::None) && self.landmarks.len() > 1 {
            // The command line is wrong, as with a word that is no kind.
            eprintln!("error: --landmarks: 'none' goes with nothing else");
            std::process::exit(2);
        }
        Ok(MapUse {
            reflectors: has(Landmarks::Reflectors),
            features: has(Landmarks::Features),
            dynamic: has(Landmarks::Dynamic),
            slam: has(Landmarks::Slam),
        })
    }

    /// What there is to say about the log itself.
    fn remarks(&self, software: &str, comparisons: &Comparisons, damages: &[Damage]) -> Vec<[String; 2]> {
        let mut rows = vec![["log".to_owned(), self.log.display().to_string()]];
        // A part of a log does not tell it.
        rows.extend((!software.is_empty()).then(|| ["written by".to_owned(), software.to_owned()]));
        rows.extend(self.like.iter().map(|path| ["vehicle and map of".to_owned(), path.display().to_string()]));
        rows.extend(self.vehicle.vehicle.iter().map(|path| ["vehicle".to_owned(), path.display().to_string()]));
        for map in &self.map {
            rows.push(["map".to_owned(), map.display().to_string()]);
        }
        let listed = damages.iter().take(LISTED_DAMAGES);
        rows.extend(listed.map(|damage| ["damage".to_owned(), damage.to_string()]));
        if damages.len() > LISTED_DAMAGES {
            rows.push(["damage".to_owned(), format!("in {} more places", damages.len() - LISTED_DAMAGES)]);
        }
        rows.extend(comparisons.remarks());
        rows
    }
}

/// Standard deviations of a start pose that somebody states, m and rad.
const STATED_DEVIATIONS: (f64, f64) = (0.3, 5.0 * std::f64::consts::PI / 180.0);

/// Standard deviations of a start pose that has been measured, m and rad.
const RECORDED_DEVIATIONS: (f64, f64) = (0.05, 1.0 * std::f64::consts::PI / 180.0);

/// A pose that the log gives in the first moment is that of the start, s.
const FIRST_MOMENT: f64 = 1.0;

/// Puts a start pose before all events, instead of those that the log gives in the first moment; others stay.
fn set_start(recording: &mut Recording, answers: &[RecordedOutput], start: Start) -> anyhow::Result<()> {
    let answer = || {
        let is_known = |answer: &&RecordedOutput| !matches!(answer.pose.mode, Mode::NotLocalised | Mode::Lost);
        answers.iter().find(is_known).map(|RecordedOutput { pose, .. }| Truth { time: pose.time, pose: pose.pose })
    };
    let known = || {
        let true_one = recording.truth.first().copied();
        true_one.or_else(|| recording.referenced_poses().first().copied()).or_else(answer)
    };
    let (time, pose, (position_deviation, heading_deviation)) = match start {
        Start::Given(pose) => {
            let first = recording.events.iter().filter_map(RecordedEvent::time).min();
            (first.context("the log has no events")?, pose, STATED_DEVIATIONS)
        }
        Start::Recorded => {
            let Truth { time, pose } = known().context("there is no pose with a heading in the log")?;
            (time, pose, RECORDED_DEVIATIONS)
        }
    };
    let fix = PoseFix { time, pose, position_deviation, heading_deviation };
    // By their arrival: the time of a pose that is to be replaced may be that of another clock.
    let end = time.offset(FIRST_MOMENT);
    let is_past = |event: &RecordedEvent| !event.is_told() && event.time().is_some_and(|other| other > end);
    let moment = recording.events.iter().position(is_past).unwrap_or(recording.events.len());
    let mut index = 0;
    recording.events.retain(|event| {
        index += 1;
        !(event.is_told() && index <= moment)
    });
    // Behind what happened before: a pose from the future is not believed.
    let is_later = |event: &RecordedEvent| event.time().is_some_and(|other| other >= time);
    let place = recording.events.iter().position(is_later).unwrap_or(recording.events.len());
    recording.events.insert(place, RecordedEvent::SetPose(fix));
    Ok(())
}

/// Places of damage that are listed at the most.
const LISTED_DAMAGES: usize = 10;

/// Replaces the landmarks of the groups that the map holds, and switches these groups on.
fn use_map(recording: &mut Recording, map: Vec<Landmark>) {
    let is_reflector = |landmark: &Landmark| landmark.kind == LandmarkKind::Reflector;
    for group in [true, false] {
        if map.iter().any(|landmark| is_reflector(landmark) == group) {
            recording.landmarks.retain(|landmark| is_reflector(landmark) != group);
            let maps = &mut recording.parameters.maps;
            *(if group { &mut maps.reflectors } else { &mut maps.features }) = true;
        }
    }
    recording.landmarks.extend(map);
}
