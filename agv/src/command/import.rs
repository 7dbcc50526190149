//! `agv import`.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use agv_core::geometry::Pose;
use agv_host_sim::account::Account;
use agv_host_sim::import::raw::{self, RawBytes};
#[cfg(feature = "bags")]
use agv_host_sim::import::ros;
use agv_host_sim::import::{
    self, ImportSummary, Imported, ScanLog, can_log, capture, carmen, carmen::TimeDefects, carpark, graph_log,
    optiodom, overheard, sapienza, wheel_recording,
};
use agv_host_sim::{file_kind, log, text_file};
use anyhow::{Context, anyhow, bail, ensure};
use clap::ValueEnum;
use indicatif::ProgressBar;

use super::encoder_arguments::EncoderArguments;
use super::import_summary;
use super::like;
use super::pose_argument;
use super::progress;

const HELP: &str = "\
Examples:
  agv import auto fr079.log --output fr079.agvlog
  agv import carpark shared/data/carpark --output carpark.agvlog
  agv import candump candump-2026-05-04.log --like hall.agvlog --output encoders.agvlog
  agv import candump two_buses.asc --interface 2 --like hall.agvlog --output encoders.agvlog
  agv import capture nav350.pcapng --like hall.agvlog --output laser.agvlog
  agv import mcap drive.mcap --output drive.agvlog
  agv import rosbag2 rosbag2_2026_05_04 --scan-topic /front/scan --laser 1.2,0,0 --output drive.agvlog
  agv import raw drive.agvlog --output again.agvlog
  agv import optiodom shared/data/optiodom/diff/free/030120210001/030120210001_run-01.csv --output drive.agvlog
  agv import csv drive.csv --columns vehicle.toml --output drive.agvlog

A file of columns names the vehicle, and for each column its name and unit:
  vehicle = { wheels = { differential = { track = 0.5, left = { radius = 0.1, turn = { scale = 1e-5, range = 65536 } }, ... } } }
  sensor = { x = 0.3, y = 0.0, theta = 0.0 }             where that is whose poses the reference tells
  [table]
  time = { column = \"t\", unit = \"ms\" }
  wheel = [{ turn = { column = \"left\", unit = \"ticks\", ticks = 2000 } }, { turn = { column = \"right\", unit = \"rpm\" } }]
  reference = { x = { column = \"x\", unit = \"m\" }, y = { column = \"y\", unit = \"m\" }, heading = { column = \"h\", unit = \"deg\" } }";

/// Turn the recordings of others into logs.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Import {
    /// What the input is.
    format: Format,
    /// File, or for the car park and rosbag2 a folder.
    input: PathBuf,
    /// Where the log goes; an older one is replaced.
    #[arg(short, long, value_name = "LOG")]
    output: PathBuf,
    /// Log whose vehicle and map are those of the new one; for candump and capture.
    #[arg(long, value_name = "LOG")]
    like: Option<PathBuf>,
    /// Port of the sensor in a capture; 2111 and 2112 if absent.
    #[arg(long)]
    port: Option<u16>,
    /// File that says what the columns of a table are; for csv.
    #[arg(long, value_name = "TOML")]
    columns: Option<PathBuf>,
    #[command(flatten)]
    encoders: EncoderArguments,
    /// Topic of the laser in a recording of ROS 2 that has several.
    #[arg(long, value_name = "TOPIC")]
    scan_topic: Option<String>,
    /// Topic of the odometry in a recording of ROS 2 that has several.
    #[arg(long, value_name = "TOPIC")]
    odometry_topic: Option<String>,
    /// Topic of the gyro (sensor_msgs/Imu) in a recording of ROS 2 that has several.
    #[arg(long, value_name = "TOPIC")]
    imu_topic: Option<String>,
    /// Where the laser is on the vehicle, m, m and deg, for recordings of ROS 2; as their transforms say if absent.
    #[arg(long, value_name = "X,Y,HEADING", value_parser = pose_argument::pose, allow_hyphen_values = true)]
    laser: Option<Pose>,
    /// Field of view of the FLASER and RLASER lines of a CARMEN log, deg; as its PARAM lines say if absent, or else half a turn.
    #[arg(long, value_name = "DEG", value_parser = field_of_view)]
    field_of_view: Option<f64>,
    /// Interface or channel of the encoders in a log of several buses.
    #[arg(long, value_name = "NAME")]
    interface: Option<String>,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
    /// End with exit code 3 if there is a warning: more than 2 % was left out, a sensor was silent for over a second, the times of two
    /// sensors do not overlap, or something was cut or doubtful.
    #[arg(long)]
    strict: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    /// Whatever the input looks like.
    Auto,
    /// Folder of the ACFR car park tables: an Ackermann vehicle, laser, reflectors, satellite positions.
    Carpark,
    /// Tricycle dataset of the Sapienza University of Rome: raw encoder counters and tracked poses.
    Sapienza,
    /// Table with named columns and units: counters, speeds or rates of wheels, steering angles, poses of a reference.
    Csv,
    /// A run of the OptiOdom robots; the session's nominal values lie beside it.
    Optiodom,
    /// CARMEN log, plain or compressed (.gz): FLASER or ROBOTLASER1, and ODOM.
    Carmen,
    /// Log of a CAN bus: of candump, of Vector (.asc) or of PEAK (.trc); what encoders said there.
    #[value(alias = "asc", alias = "trc", alias = "can")]
    Candump,
    /// Network capture, pcap or pcapng: what a NAV350 and its host said over TCP.
    Capture,
    /// MCAP file with messages of ROS 2: LaserScan and Odometry, and Imu if there is a gyro.
    Mcap,
    /// Recording of rosbag2, folder or file, stored as MCAP or SQLite: LaserScan and Odometry, and Imu if there is a gyro.
    Rosbag2,
    /// Log of this program: its events are made anew of the raw bytes in it.
    Raw,
    /// Pose graph with scans: VERTEX2, ROBOTLASER1, EDGE2. Its corrected poses serve as odometry.
    Graph,
}

impl Import {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<ExitCode> {
        // Before a reader looks for files in a folder that is not there.
        let is_missing = self.input.try_exists().is_ok_and(|exists| !exists);
        ensure!(!is_missing, "{}: there is no such file or folder", self.input.display());
        let format = match self.format {
            Format::Auto => detect(&self.input)?,
            stated => stated,
        };
        // Shown on a terminal only, and gone when an error is reported.
        let progress = progress::spinner().with_message(format!("reading {}", self.input.display()));
        progress.enable_steady_tick(Duration::from_millis(100));
        let whole = |recording| Imported { recording, account: Account::default() };
        let found = match format {
            Format::Candump => self.can_drive(&progress)?,
            Format::Capture => self.captured_drive(&progress)?,
            Format::Raw => self.raw_drive()?,
            Format::Mcap | Format::Rosbag2 => self.ros_drive()?,
            Format::Carpark => whole(carpark::read(&self.input, &carpark::WINDOW)?),
            Format::Sapienza => whole(sapienza::read(&self.input)?),
            Format::Csv => self.table()?,
            Format::Optiodom => whole(optiodom::read_run(&self.input)?),
            Format::Carmen => self.carmen_drive()?,
            Format::Graph => self.graph_drive()?,
            Format::Auto => unreachable!("the format has been found above"),
        };
        // What came over a link is written with its bytes.
        if !matches!(format, Format::Candump | Format::Capture) {
            progress.set_message(format!("writing {}", self.output.display()));
            log::write(&self.output, &found.recording)?;
        }
        progress.finish_and_clear();
        let summary = ImportSummary::of(&found.recording, &found.account);
        import_summary::print(&self.input, &summary, self.json)?;
        Ok(import_summary::exit_code(&summary.warnings, self.strict))
    }
}

impl Import {
    /// The frames of a log of a bus, and what they mean.
    fn can_drive(&self, progress: &ProgressBar) -> anyhow::Result<Imported> {
        let like = like::drive_like(self.like.as_deref())?;
        let nodes = self.encoders.nodes(&like.parameters.vehicle);
        let encoders = overheard::encoders(&nodes, &like.parameters.vehicle);
        let mut log = can_log::read(&self.input)?;
        let ids: Vec<_> = encoders.iter().map(|encoder| encoder.id).collect();
        can_log::choose_interface(&mut log, self.interface.as_deref(), &ids).map_err(|found| {
            let (input, found) = (self.input.display(), found.join(", "));
            match &self.interface {
                Some(wanted) => {
                    anyhow!("{input}: there are no frames of interface {wanted}; --interface can be {found}")
                }
                None => anyhow!(
                    "{input}: the encoders are heard on several interfaces: choose one of {found} with --interface"
                ),
            }
        })?;
        let can_log::CanLog { frames, account } = log;
        let bytes: Vec<_> = frames.iter().filter_map(|seen| Some(RawBytes::of_can(seen.time?, &seen.frame))).collect();
        let mut found = self.import_raw(progress, &bytes, account)?;
        overheard::account(&found.recording, &bytes, &encoders, &mut found.account);
        Ok(found)
    }

    fn captured_drive(&self, progress: &ProgressBar) -> anyhow::Result<Imported> {
        let ports = self.port.map_or(capture::PORTS.to_vec(), |port| vec![port]);
        let captured = capture::read(&self.input, &ports)?;
        let mut account = Account::default();
        if captured.lost > 0 {
            account.warn(format!("{} bytes of the connection were not captured", captured.lost));
        }
        account.set_aside("connections beside the main one", captured.left_out);
        captured.seen.tell(&mut account);
        self.import_raw(progress, &captured.raw, account)
    }

    /// Writes raw bytes and what they mean.
    fn import_raw(&self, progress: &ProgressBar, bytes: &[RawBytes], account: Account) -> anyhow::Result<Imported> {
        progress.set_message(format!("writing {}", self.output.display()));
        let mut recording = like::drive_like(self.like.as_deref())?;
        let nodes = self.encoders.nodes(&recording.parameters.vehicle);
        if !raw::means_something(&recording, bytes, &nodes) {
            let like = if self.like.is_none() { "state the vehicle with --like LOG, and " } else { "" };
            let talking = overheard::talking_nodes(bytes);
            let talking = if talking.is_empty() {
                "no node tells anything where encoders do".to_owned()
            } else {
                format!("what may be positions comes from node {}", listed(&talking))
            };
            bail!(
                "{}: no position of two encoders and no revolution of a laser is in it; {talking}; {like}the nodes with --drive and \
                 --steering",
                self.input.display()
            );
        }
        raw::write(&self.output, &mut recording, bytes, &nodes)?;
        Ok(Imported { recording, account })
    }

    #[cfg(feature = "bags")]
    fn ros_drive(&self) -> anyhow::Result<Imported> {
        let Self { scan_topic, odometry_topic, imu_topic, laser, .. } = self;
        let (scan, odometry, imu) = (scan_topic.clone(), odometry_topic.clone(), imu_topic.clone());
        let choice = ros::Choice { scan, odometry, imu, laser: *laser };
        Ok(ros::read(&self.input, &choice)?)
    }

    #[cfg(not(feature = "bags"))]
    fn ros_drive(&self) -> anyhow::Result<Imported> {
        bail!(agv_host_sim::left_out::BAGS)
    }

    fn carmen_drive(&self) -> anyhow::Result<Imported> {
        let field_of_view = self.field_of_view.map(f64::to_radians);
        let log = carmen::read_with(&self.input, field_of_view)?;
        let mut found = scan_drive(&self.input, "CARMEN", &log.front, &log.defects)?;
        found.account.merge(log.account);
        found.account.set_aside("scans of the rear laser", log.rear.len());
        Ok(found)
    }

    fn graph_drive(&self) -> anyhow::Result<Imported> {
        let graph = graph_log::read(&self.input)?;
        let mut found = scan_drive(&self.input, "pose-graph", &graph.log, &graph.defects)?;
        found.account.merge(graph.account);
        found.account.note("the differences of the corrected poses serve as odometry");
        Ok(found)
    }

    fn table(&self) -> anyhow::Result<Imported> {
        let columns = self.columns.as_deref().context("--columns: a file that says what the columns are is needed")?;
        Ok(wheel_recording::read(&self.input, columns)?)
    }

    fn raw_drive(&self) -> anyhow::Result<Imported> {
        let (like, _) = log::read(&self.input)?;
        let nodes = self.encoders.nodes(&like.parameters.vehicle);
        let (recording, damages) = raw::read_drive(&self.input, &nodes)?;
        let mut account = Account::default();
        damages.iter().for_each(|damage| account.warn(damage.to_string()));
        if recording.events.is_empty() {
            bail!("{}: there are no raw bytes in the log that mean anything", self.input.display());
        }
        Ok(Imported { recording, account })
    }
}

/// An angle that a laser can see, deg.
fn field_of_view(text: &str) -> Result<f64, String> {
    let stated = text.parse::<f64>().ok().filter(|angle| *angle > 0.0 && *angle <= 360.0);
    stated.ok_or_else(|| "a field of view is an angle over 0 and up to 360 deg".to_owned())
}

fn listed(nodes: &[u8]) -> String {
    nodes.iter().map(u8::to_string).collect::<Vec<_>>().join(", ")
}

/// What the input looks like.
fn detect(input: &Path) -> anyhow::Result<Format> {
    let metadata = std::fs::metadata(input).with_context(|| input.display().to_string())?;
    if metadata.is_dir() {
        if input.join("laser_ranges_m.csv").exists() {
            return Ok(Format::Carpark);
        }
        if is_bag(input) {
            return Ok(Format::Rosbag2);
        }
        bail!(
            "{}: this folder holds neither the car park tables (laser_ranges_m.csv) nor a recording of rosbag2 (metadata.yaml, .mcap, .db3)",
            input.display()
        );
    }
    let beginning = beginning(input).with_context(|| input.display().to_string())?;
    if beginning.is_empty() {
        bail!("{}: the file is empty", input.display());
    }
    if file_kind::describe(&beginning).starts_with("a network capture") {
        return Ok(Format::Capture);
    }
    if beginning.starts_with(b"\x89MCAP") {
        return Ok(Format::Mcap);
    }
    if beginning.starts_with(b"SQLite format 3") {
        return Ok(Format::Rosbag2);
    }
    let text = text_file::beginning_of(&beginning);
    let begins_line = |word: &str| text.lines().any(|line| line.starts_with(word));
    if begins_line(sapienza::SIGNATURE) {
        Ok(Format::Sapienza)
    } else if begins_line("VERTEX2 ") {
        Ok(Format::Graph)
    } else if ["PARAM ", "FLASER ", "ROBOTLASER1 ", "RAWLASER1 ", "ODOM "].into_iter().any(begins_line) {
        Ok(Format::Carmen)
    } else if can_log::is_one(&text) {
        Ok(Format::Candump)
    } else {
        bail!("{}: this is no known recording but {}", input.display(), file_kind::describe(&beginning))
    }
}

#[cfg(feature = "bags")]
fn is_bag(folder: &Path) -> bool {
    agv_host_sim::ros::is_recording(folder)
}

#[cfg(not(feature = "bags"))]
fn is_bag(folder: &Path) -> bool {
    folder.join("metadata.yaml").exists()
}

/// The drive in a log of scans.
fn scan_drive(input: &Path, kind: &str, log: &ScanLog, defects: &TimeDefects) -> anyhow::Result<Imported> {
    let recording = import::drive(log)
        .with_context(|| format!("{}: there are no scans of a {kind} log in the file", input.display()))?;
    let mut account = Account::default();
    if !defects.is_none() {
        account.warn(defects.to_string());
    }
    Ok(Imported { recording, account })
}

/// The first few kilobytes of a file.
fn beginning(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut beginning = Vec::new();
    std::fs::File::open(path)?.take(1 << 16).read_to_end(&mut beginning)?;
    Ok(beginning)
}
