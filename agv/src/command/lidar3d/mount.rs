//! `agv lidar3d mount`.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use agv_core::geometry::Pose;
use agv_core::measurement::Time;
use agv_host_sim::import::poses;
use agv_host_sim::lidar3d::mount::{Mount as Found, MountFinder};
use agv_host_sim::lidar3d::{Revolution, Source};
use agv_host_sim::log;
use agv_host_sim::mapping::odometry_poses;
use agv_host_sim::output_file;
use agv_host_sim::recording::Truth;
use agv_lidar3d::cloud::RingOrder;
use agv_lidar3d::mount::Known;
use anyhow::ensure;
use serde_json::{Value, json};

use super::arguments::{SOURCES, SensorArguments};
use crate::command::{import_summary, output, progress, stop};

const HELP: &str = "\
Height, roll and pitch are those of the floor. Heading and place come of a drive with bends both ways: the motions of the sensor between
its scans are compared with those of the vehicle by its odometry, which must be calibrated before. A straight drive leaves the place open,
and a drive that bends one way only says little of it; deviations come from what remains. The scale is that of the odometry; far from 1 it
contradicts the calibration of the vehicle.

The odometry is a log of the vehicle, or the pose of the vehicle at each scan, twelve numbers a line. --shift is the time of the log
at time 0 of the scans.

Examples:
  agv lidar3d mount drive.pcap --log drive.agvlog --shift 0.35 --height 1.9
  agv lidar3d mount clouds --poses odometry.txt --output mount.json
  agv lidar3d mount drive.pcap --log drive.agvlog --json

Keys of --json and of the file: height_m, roll_deg, pitch_deg, yaw_deg, x_m, y_m, odometry_scale, each {value, deviation} or null where it is
left open; revolutions, motions, motions_used, residual_m, turn_residual_deg.";

/// Find where the sensor is on the vehicle, by the floor and a drive.
#[derive(clap::Args)]
#[command(after_help = HELP, after_long_help = format!("{SOURCES}\n\n{HELP}"))]
pub struct Mount {
    /// Capture, folder of clouds or range images, or udp[:PORT].
    #[arg(value_name = "SOURCE", value_parser = Source::parse)]
    source: Source,
    #[command(flatten)]
    sensor: SensorArguments,
    /// Log of the vehicle during the drive.
    #[arg(long, value_name = "FILE", required_unless_present = "poses", conflicts_with = "poses")]
    log: Option<PathBuf>,
    /// Pose of the vehicle by its odometry at each scan.
    #[arg(long, value_name = "FILE")]
    poses: Option<PathBuf>,
    /// Time of the log at time 0 of the scans, s; without it both have the same clock.
    #[arg(long, value_name = "S", requires = "log", allow_negative_numbers = true)]
    shift: Option<f64>,
    /// Height of the sensor above the floor, m, if it is known: to 25 cm is enough.
    #[arg(long, value_name = "M")]
    height: Option<f64>,
    /// File to write, JSON; an older one is replaced.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

/// Time between two clouds of files, which state none, s.
const INTERVAL: f64 = 0.1;

impl Mount {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        ensure!(self.height.is_none_or(|height| height > 0.0 && height < 50.0), "--height must be from 0 to 50 m");
        let found = match (&self.poses, &self.log) {
            (Some(path), _) => self.by_poses(path)?,
            (None, Some(path)) => self.by_log(path)?,
            (None, None) => anyhow::bail!("an odometry is needed: --log or --poses"),
        };
        ensure!(found.revolutions > 0, "{}: no scan falls into the time of the odometry", self.source.name());
        ensure!(
            found.attitude.is_some() || found.drive.is_some_and(|drive| drive.yaw.is_some()),
            "{}: neither a floor nor enough motions were found in {} scans",
            self.source.name(),
            found.revolutions
        );
        let summary = object(&found);
        if let Some(path) = &self.output {
            output_file::write(path, format!("{summary:#}\n"))?;
        }
        if self.json {
            println!("{summary:#}");
        } else {
            output::print_rows(&rows(&found));
        }
        Ok(())
    }

    /// Each scan with its pose: the times are made.
    fn by_poses(&self, path: &Path) -> anyhow::Result<Found> {
        let poses::ReadPoses { poses, account } = poses::read_all(path)?;
        account.notes().iter().for_each(|text| output::note(&format!("agv: {}: {text}", path.display())));
        import_summary::complain(path, &account.warnings());
        let time = |number: usize| Time::from_seconds(1.0 + INTERVAL * number as f64);
        let odometry: Vec<Truth> = poses
            .iter()
            .enumerate()
            .map(|(number, [x, y, heading])| Truth { time: time(number), pose: Pose::new(*x, *y, *heading) })
            .collect();
        let mut number = 0;
        self.find(&odometry, |_| {
            number += 1;
            Some(time(number - 1))
        })
    }

    fn by_log(&self, path: &Path) -> anyhow::Result<Found> {
        let (recording, _) = log::read(path)?;
        let odometry = odometry_poses(&recording)?;
        ensure!(odometry.len() > 1, "{}: there is no odometry in it", path.display());
        let shift = self.shift.unwrap_or(0.0);
        self.find(&odometry, |revolution| {
            let seconds = revolution.start.since(Time::default()) + shift;
            (seconds >= 0.0).then(|| Time::from_seconds(seconds))
        })
    }

    fn find(&self, odometry: &[Truth], mut time: impl FnMut(&Revolution) -> Option<Time>) -> anyhow::Result<Found> {
        let stop = stop::on_interrupt()?;
        let source = self.source.clone().open(&self.sensor.options(), &stop)?;
        let setup = source.setup()?;
        let mut finder = MountFinder::new(RingOrder::new(&setup.lasers), odometry, self.height);
        let bar = progress::bar("scans", source.length().unwrap_or(0));
        source.revolutions(&stop, |revolution| {
            bar.inc(1);
            if revolution.is_whole
                && let Some(start) = time(&revolution)
            {
                finder.add(&revolution, start);
            }
            ControlFlow::Continue(())
        })?;
        bar.set_message("aligning");
        let found = finder.find();
        bar.finish_and_clear();
        Ok(found)
    }
}

fn known(known: Option<Known>, scale: f64) -> Value {
    known.map_or(Value::Null, |known| json!({ "value": scale * known.value, "deviation": scale * known.deviation }))
}

/// Degrees of a radian.
const DEGREES: f64 = 180.0 / std::f64::consts::PI;

fn attitude(found: &Found) -> [Option<Known>; 3] {
    let values = found.attitude.map(|attitude| [attitude.height, attitude.roll, attitude.pitch]);
    std::array::from_fn(|at| {
        let (values, attitude) = values.zip(found.attitude)?;
        Some(Known { value: values[at], deviation: attitude.deviations[at] })
    })
}

fn object(found: &Found) -> Value {
    let [height, roll, pitch] = attitude(found);
    let drive = found.drive;
    json!({
        "height_m": known(height, 1.0),
        "roll_deg": known(roll, DEGREES),
        "pitch_deg": known(pitch, DEGREES),
        "yaw_deg": known(drive.and_then(|drive| drive.yaw), DEGREES),
        "x_m": known(drive.and_then(|drive| drive.x), 1.0),
        "y_m": known(drive.and_then(|drive| drive.y), 1.0),
        "odometry_scale": known(drive.and_then(|drive| drive.scale), 1.0),
        "revolutions": found.revolutions,
        "motions": drive.map(|drive| drive.motions[1]),
        "motions_used": drive.map(|drive| drive.motions[0]),
        "residual_m": drive.map(|drive| drive.residual),
        "turn_residual_deg": drive.map(|drive| drive.turn_residual.to_degrees()),
    })
}

fn rows(found: &Found) -> Vec<[String; 2]> {
    let row = |name: &str, known: Option<Known>, scale: f64, unit: &str, digits: usize| {
        let value = known.map_or("left open".to_owned(), |known| {
            let (value, deviation) = (scale * known.value, scale * known.deviation);
            format!("{value:.digits$} +- {deviation:.digits$}{unit}")
        });
        [name.to_owned(), value]
    };
    let [height, roll, pitch] = attitude(found);
    let drive = found.drive;
    let mut rows = vec![
        row("height", height, 1.0, " m", 4),
        row("roll", roll, DEGREES, " deg", 3),
        row("pitch", pitch, DEGREES, " deg", 3),
        row("yaw", drive.and_then(|drive| drive.yaw), DEGREES, " deg", 3),
        row("x", drive.and_then(|drive| drive.x), 1.0, " m", 4),
        row("y", drive.and_then(|drive| drive.y), 1.0, " m", 4),
        row("scale of the odometry", drive.and_then(|drive| drive.scale), 1.0, "", 4),
        ["scans used".to_owned(), found.revolutions.to_string()],
    ];
    if let Some(drive) = drive {
        rows.push(["motions used".to_owned(), format!("{} of {}", drive.motions[0], drive.motions[1])]);
        rows.push(["remains of a way".to_owned(), format!("{:.1} mm", 1e3 * drive.residual)]);
        rows.push(["remains of a turn".to_owned(), format!("{:.3} deg", drive.turn_residual.to_degrees())]);
    }
    rows
}
