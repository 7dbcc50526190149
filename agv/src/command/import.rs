//! `agv import`.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::Duration;

use agv_core::geometry::Pose;
use agv_host_sim::import::raw::{self, RawBytes};
#[cfg(feature = "bags")]
use agv_host_sim::import::ros;
use agv_host_sim::import::{
    self, ScanLog, candump, capture, carmen, carmen::TimeDefects, carpark, graph_log, optiodom, sapienza,
    wheel_recording,
};
use agv_host_sim::recording::Recording;
use agv_host_sim::{file_kind, log};
use anyhow::{Context, bail, ensure};
use clap::ValueEnum;
use flate2::read::MultiGzDecoder;
use indicatif::ProgressBar;

use super::encoder_arguments::EncoderArguments;
use super::like;
use super::output::note;
use super::pose_argument;
use super::progress;
use super::summary::Summary;

const HELP: &str = "\
Examples:
  agv import auto fr079.log --output fr079.agvlog
  agv import carpark shared/data/carpark --output carpark.agvlog
  agv import candump candump-2026-05-04.log --like hall.agvlog --output encoders.agvlog
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
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
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
    /// Log of candump -l: what two encoders said on a CAN bus.
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
    pub fn run(self) -> anyhow::Result<()> {
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
        let recording = match format {
            Format::Candump => return self.import_raw(&progress, candump_bytes(&self.input)?),
            Format::Capture => return self.import_raw(&progress, self.capture()?),
            Format::Raw => self.raw_drive()?,
            Format::Mcap | Format::Rosbag2 => self.ros_drive()?,
            Format::Carpark => carpark::read(&self.input, &carpark::WINDOW)?,
            Format::Sapienza => sapienza::read(&self.input)?,
            Format::Csv => self.table()?,
            Format::Optiodom => optiodom::read_run(&self.input)?,
            Format::Carmen => self.carmen_drive()?,
            Format::Graph => self.graph_drive()?,
            Format::Auto => unreachable!("the format has been found above"),
        };
        progress.set_message(format!("writing {}", self.output.display()));
        log::write(&self.output, &recording)?;
        progress.finish_and_clear();
        Summary::of(&recording).print(self.json)
    }
}

impl Import {
    /// Writes raw bytes and what they mean.
    fn import_raw(&self, progress: &ProgressBar, bytes: Vec<RawBytes>) -> anyhow::Result<()> {
        progress.set_message(format!("writing {}", self.output.display()));
        let mut drive = like::drive_like(self.like.as_deref())?;
        let nodes = self.encoders.nodes(&drive.parameters.vehicle);
        if !raw::means_something(&drive, &bytes, &nodes) {
            let like = if self.like.is_none() { "state the vehicle with --like LOG, and " } else { "" };
            bail!(
                "{}: no position of two encoders and no revolution of a laser is in it; {like}the nodes with --drive and \
                 --steering",
                self.input.display()
            );
        }
        raw::write(&self.output, &mut drive, &bytes, &nodes)?;
        progress.finish_and_clear();
        Summary::of(&drive).print(self.json)
    }

    #[cfg(feature = "bags")]
    fn ros_drive(&self) -> anyhow::Result<Recording> {
        let Self { scan_topic, odometry_topic, imu_topic, laser, .. } = self;
        let (scan, odometry, imu) = (scan_topic.clone(), odometry_topic.clone(), imu_topic.clone());
        let choice = ros::Choice { scan, odometry, imu, laser: *laser };
        Ok(ros::read(&self.input, &choice)?)
    }

    #[cfg(not(feature = "bags"))]
    fn ros_drive(&self) -> anyhow::Result<Recording> {
        bail!(agv_host_sim::left_out::BAGS)
    }

    fn capture(&self) -> anyhow::Result<Vec<RawBytes>> {
        let ports = self.port.map_or(capture::PORTS.to_vec(), |port| vec![port]);
        let found = capture::read(&self.input, &ports)?;
        let input = self.input.display();
        if found.lost > 0 {
            note(&format!("agv: {input}: {} bytes of the connection were not captured", found.lost));
        }
        if found.left_out > 0 {
            note(&format!("agv: {input}: {} connections beside the main one are left out", found.left_out));
        }
        if found.is_cut {
            note(&format!("agv: {input}: the capture is cut off or damaged behind packet {}", found.packets));
        }
        Ok(found.raw)
    }

    fn carmen_drive(&self) -> anyhow::Result<Recording> {
        let log = carmen::read(&self.input)?;
        self.note_times(&log.defects);
        drive(&self.input, "CARMEN", &log.front)
    }

    fn graph_drive(&self) -> anyhow::Result<Recording> {
        let graph = graph_log::read(&self.input)?;
        self.note_times(&graph.defects);
        drive(&self.input, "pose-graph", &graph.log)
    }

    fn note_times(&self, defects: &TimeDefects) {
        if !defects.is_none() {
            note(&format!("agv: {}: {defects}", self.input.display()));
        }
    }

    fn table(&self) -> anyhow::Result<Recording> {
        let columns = self.columns.as_deref().context("--columns: a file that says what the columns are is needed")?;
        Ok(wheel_recording::read(&self.input, columns)?)
    }

    fn raw_drive(&self) -> anyhow::Result<Recording> {
        let (like, _) = log::read(&self.input)?;
        let nodes = self.encoders.nodes(&like.parameters.vehicle);
        let (recording, damages) = raw::read_drive(&self.input, &nodes)?;
        for damage in &damages {
            note(&format!("agv: {}: {damage}", self.input.display()));
        }
        if recording.events.is_empty() {
            bail!("{}: there are no raw bytes in the log that mean anything", self.input.display());
        }
        Ok(recording)
    }
}

/// The frames of a log of candump.
fn candump_bytes(input: &Path) -> anyhow::Result<Vec<RawBytes>> {
    let frames = candump::read(input)?;
    let bytes: Vec<_> = frames.iter().filter_map(|seen| Some(RawBytes::of_can(seen.time?, &seen.frame))).collect();
    if bytes.is_empty() {
        bail!("{}: no frame in it has a time", input.display());
    }
    Ok(bytes)
}

/// What the input looks like.
fn detect(input: &Path) -> anyhow::Result<Format> {
    let metadata = std::fs::metadata(input).with_context(|| input.display().to_string())?;
    if metadata.is_dir() {
        if input.join("laser_ranges_m.csv").exists() {
            return Ok(Format::Carpark);
        }
        if input.join("metadata.yaml").exists() {
            return Ok(Format::Rosbag2);
        }
        bail!("{}: this folder holds neither the car park tables nor a recording of rosbag2", input.display());
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
    let mut unpacked = Vec::new();
    // What is not compressed, or cut, is looked at as far as it goes.
    let _ = MultiGzDecoder::new(&beginning[..]).read_to_end(&mut unpacked);
    let text = if unpacked.is_empty() { &beginning } else { &unpacked };
    let begins_line = |word: &str| text.split(|byte| *byte == b'\n').any(|line| line.starts_with(word.as_bytes()));
    if begins_line(sapienza::SIGNATURE) {
        Ok(Format::Sapienza)
    } else if begins_line("VERTEX2 ") {
        Ok(Format::Graph)
    } else if ["PARAM ", "FLASER ", "ROBOTLASER1 ", "ODOM "].into_iter().any(begins_line) {
        Ok(Format::Carmen)
    } else if first_line(text).is_some_and(|line| candump::parse_line(line).is_some()) {
        Ok(Format::Candump)
    } else {
        bail!("{}: this is no known recording but {}", input.display(), file_kind::describe(&beginning))
    }
}

fn first_line(text: &[u8]) -> Option<&str> {
    text.split(|byte| *byte == b'\n')
        .find_map(|line| std::str::from_utf8(line).ok().filter(|line| !line.trim().is_empty()))
}

/// The drive in a log of scans.
fn drive(input: &Path, kind: &str, log: &ScanLog) -> anyhow::Result<Recording> {
    import::drive(log).with_context(|| format!("{}: there are no scans of a {kind} log in the file", input.display()))
}

/// The first few kilobytes of a file.
fn beginning(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut beginning = Vec::new();
    std::fs::File::open(path)?.take(1 << 16).read_to_end(&mut beginning)?;
    Ok(beginning)
}
