//! `agv export`.

#[cfg(feature = "bags")]
mod messages;
#[cfg(not(feature = "bags"))]
#[path = "no_messages.rs"]
mod messages;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use agv_host_sim::drive::Track;
use agv_host_sim::export::{answered, candump, csv, tum};
use agv_host_sim::left_out;
use agv_host_sim::output_file::OutputFile;
use agv_host_sim::recording::Recording;
use agv_host_sim::replay::Replay;
use anyhow::{Context, bail, ensure};

use super::{output, progress};

const HELP: &str = "\
Poses are those of the log where it has any, else those of a replay. --json prints how many of what were written: messages
by topic, poses, or frames.

Examples:
  agv export mcap drive.agvlog --output drive.mcap
  agv export rosbag2 drive.agvlog --output drive_bag
  agv export csv drive.agvlog --output drive.csv
  agv export tum drive.agvlog --output drive.tum --truth truth.tum && evo_ape tum truth.tum drive.tum
  agv export candump drive.agvlog --interface vcan0 --output drive.candump && canplayer -I drive.candump";

/// Write what a log holds in the formats of others
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Export {
    #[command(subcommand)]
    format: Format,
}

#[derive(clap::Subcommand)]
enum Format {
    /// Messages of ROS 2 in an MCAP file, for Foxglove, Rerun, PlotJuggler and ROS 2
    Mcap(Drive),
    /// The same as a folder of rosbag2
    Rosbag2(Drive),
    /// Poses as a table for spreadsheets
    Csv(Drive),
    Tum(Tum),
    Candump(Candump),
}

/// A log, and where it goes.
#[derive(clap::Args)]
struct Drive {
    /// The log.
    log: PathBuf,
    /// File to write, or folder of rosbag2; an older file is replaced.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

/// Poses as evo reads them: time, position and quaternion
#[derive(clap::Args)]
struct Tum {
    #[command(flatten)]
    drive: Drive,
    /// Write the true poses at the same times to this file.
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
}

/// The frames of a CAN bus, as candump -l writes them
#[derive(clap::Args)]
struct Candump {
    /// Log with the raw bytes of a bus.
    log: PathBuf,
    /// Name of the interface in the output.
    #[arg(long, default_value = "can0")]
    interface: String,
    /// File to write; an older one is replaced.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

impl Export {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        match self.format {
            Format::Mcap(command) => command.run_messages(messages::mcap),
            Format::Rosbag2(command) => command.run_messages(messages::rosbag2),
            Format::Csv(command) => command.run_csv(),
            Format::Tum(command) => command.run(),
            Format::Candump(command) => command.run(),
        }
    }
}

fn create(path: &Path) -> anyhow::Result<OutputFile> {
    OutputFile::create(path).with_context(|| path.display().to_string())
}

/// Prints how many of what were written.
fn print_counts(counts: &BTreeMap<&'static str, u64>, as_json: bool) -> anyhow::Result<()> {
    if as_json {
        println!("{}", serde_json::to_string(counts)?);
    } else {
        let rows: Vec<_> = counts.iter().map(|(name, count)| [(*name).to_owned(), count.to_string()]).collect();
        output::print_rows(&rows);
    }
    Ok(())
}

impl Drive {
    fn read(&self) -> anyhow::Result<(Recording, Replay)> {
        let bar = progress::bar("replaying", 0);
        let answered = answered::read(&self.log, |done, all| {
            bar.set_length(all as u64);
            bar.set_position(done as u64);
        })?;
        bar.finish_and_clear();
        Ok(answered)
    }

    fn run_messages(self, write: messages::Write) -> anyhow::Result<()> {
        left_out::BAGS.check()?;
        let (recording, answers) = self.read()?;
        let bar = progress::bar("writing", recording.events.len() as u64);
        let shown = bar.clone();
        let counts = write(&self.output, &recording, &answers, Box::new(move |done| shown.set_position(done as u64)))?;
        bar.finish_and_clear();
        print_counts(&counts, self.json)
    }

    fn run_csv(self) -> anyhow::Result<()> {
        let (recording, answers) = self.read()?;
        let track = Track::new(&recording, &answers);
        let name = || self.output.display().to_string();
        let mut file = create(&self.output)?;
        csv::write(&recording, &track, &mut file).with_context(name)?;
        file.finish().with_context(name)?;
        print_counts(&BTreeMap::from([("poses", track.points.len() as u64)]), self.json)
    }
}

impl Tum {
    fn run(self) -> anyhow::Result<()> {
        let Self { drive, truth } = self;
        let (recording, answers) = drive.read()?;
        ensure!(
            truth.is_none() || !recording.truth.is_empty(),
            "{}: nobody knows where the vehicle really was; leave --truth out",
            drive.log.display()
        );
        let track = Track::new(&recording, &answers);
        let mut file = create(&drive.output)?;
        tum::write(tum::estimated(&track), &mut file)
            .and_then(|()| file.finish())
            .with_context(|| drive.output.display().to_string())?;
        if let Some(path) = truth {
            let mut file = create(&path)?;
            tum::write(tum::truth(&recording, &track), &mut file)
                .and_then(|()| file.finish())
                .with_context(|| path.display().to_string())?;
        }
        print_counts(&BTreeMap::from([("poses", track.points.len() as u64)]), drive.json)
    }
}

impl Candump {
    fn run(self) -> anyhow::Result<()> {
        let mut file = create(&self.output)?;
        let frames = candump::write(&self.log, &self.interface, &mut file)?;
        if frames == 0 {
            bail!("{}: there are no frames of a bus in the log", self.log.display());
        }
        file.finish().with_context(|| self.output.display().to_string())?;
        print_counts(&BTreeMap::from([("frames", frames as u64)]), self.json)
    }
}
