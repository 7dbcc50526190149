//! `agv lidar3d decode`.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use agv_host_sim::export::point_cloud::{self, Format, PointCloudError};
use agv_host_sim::lidar3d::{Revolution, Source};
use agv_lidar3d::cloud::RingOrder;
use anyhow::ensure;
use serde_json::json;

use super::arguments::{SOURCES, SensorArguments, tally_object, tally_rows};
use crate::command::{import_summary, progress, stop};

const HELP: &str = "\
Each revolution becomes a file of its own if there is more than one: scan.pcd becomes scan_0000.pcd and so on.

Examples:
  agv lidar3d decode drive.pcap --output scan.pcd
  agv lidar3d decode drive.pcap --calibration db.xml --first 10 --count 1 --output scan.las
  agv lidar3d decode udp --count 5 --output live.ply
  agv lidar3d decode ouster.pcap --calibration ouster.json --output scan.pcd
  agv lidar3d decode drive.pcap --organised --output scan.pcd --json

Keys of --json: revolutions, files, returns {points, empty, false_near, false_far, unused, equal}, left_out, beside, notes, warnings.";

/// Write the points of each revolution as PCD, PLY or LAS.
#[derive(clap::Args)]
#[command(after_help = HELP, after_long_help = format!("{SOURCES}\n\n{HELP}"))]
pub struct Decode {
    /// Capture, folder of range images, or udp[:PORT].
    #[arg(value_name = "SOURCE", value_parser = Source::parse)]
    source: Source,
    #[command(flatten)]
    sensor: SensorArguments,
    /// File to write, .pcd, .ply or .las; an older one is replaced.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// First revolution to write, counted from 0.
    #[arg(long, default_value_t = 0)]
    first: usize,
    /// How many revolutions to write; all of them if absent.
    #[arg(long)]
    count: Option<usize>,
    /// Write a ring a row and a direction a column, not a number where nothing was seen (PCD only).
    #[arg(long)]
    organised: bool,
    /// Write revolutions that are not whole as well, at the beginning and at the end of a stream.
    #[arg(long)]
    parts: bool,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
    /// End with exit code 3 if there is a warning.
    #[arg(long)]
    strict: bool,
}

impl Decode {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<ExitCode> {
        let format = Format::of(&self.output)?;
        ensure!(!self.organised || format == Format::Pcd, "--organised goes with a name that ends in .pcd");
        ensure!(self.count != Some(0), "--count must be at least 1");
        let stop = stop::on_interrupt()?;
        let source = self.source.clone().open(&self.sensor.options(), &stop)?;
        let setup = source.setup()?;
        let order = RingOrder::new(&setup.lasers);
        if let Some(warning) = &setup.warning {
            eprintln!("{warning}");
        }
        let account = source.survey.account.clone();
        let name = self.source.name();
        let length = source.length();
        let bar = progress::bar("decoding", length.unwrap_or(0));
        let is_single = self.count == Some(1);
        let (mut number, mut files) = (0, 0);
        let mut failure = None;
        let tally = source.revolutions(&stop, |revolution| {
            bar.inc(1);
            if !revolution.is_whole && !self.parts {
                return ControlFlow::Continue(());
            }
            let index = number;
            number += 1;
            if index < self.first {
                return ControlFlow::Continue(());
            }
            let path = if is_single { self.output.clone() } else { numbered(&self.output, index) };
            if let Err(error) = self.write(&path, &revolution, &order) {
                failure = Some(error);
                return ControlFlow::Break(());
            }
            files += 1;
            if self.count.is_some_and(|count| files >= count) {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        })?;
        bar.finish_and_clear();
        if let Some(error) = failure {
            return Err(error.into());
        }
        ensure!(
            files > 0,
            "there are {number} whole revolutions, none from number {} on; --parts takes those that are not whole",
            self.first
        );
        let mut rows = vec![["files".to_owned(), files.to_string()]];
        rows.extend(tally_rows(tally));
        let found = json!({ "revolutions": number, "files": files, "returns": tally_object(tally) });
        import_summary::print_account(Path::new(&name), &rows, found, &account, self.json)?;
        Ok(import_summary::exit_code(&account.warnings(), self.strict))
    }

    fn write(&self, path: &Path, revolution: &Revolution, order: &RingOrder) -> Result<(), PointCloudError> {
        if !self.organised {
            return point_cloud::write(path, &revolution.points);
        }
        let columns = revolution.columns();
        point_cloud::write_organised(path, &revolution.organised(order, columns), order.rings())
    }
}

/// The name with a number before its ending.
fn numbered(path: &Path, number: usize) -> PathBuf {
    let part = |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
    path.with_file_name(format!("{}_{number:04}.{}", part(path.file_stem()), part(path.extension())))
}
