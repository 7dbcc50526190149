//! `agv lidar3d view`.

use std::ops::ControlFlow;
use std::path::PathBuf;

use agv_host_sim::lidar3d::Source;
use agv_host_sim::report::scan_picture;
use agv_lidar3d::cloud::RingOrder;
use anyhow::{Context, ensure};

use super::arguments::{SOURCES, SensorArguments};
use crate::command::stop;

const HELP: &str = "\
Above: the range of each beam, from the highest ring to the lowest, ahead in the middle; near is bright, nothing is black.
Below: the scan from above, the sensor in the middle, ahead is up; blue is low and red is high.

Examples:
  agv lidar3d view drive.pcap --output scan.png
  agv lidar3d view drive.pcap --calibration db.xml --scan 100 --reach 50 --output scan.png";

/// Draw one revolution as a picture.
#[derive(clap::Args)]
#[command(after_help = HELP, after_long_help = format!("{SOURCES}\n\n{HELP}"))]
pub struct View {
    /// Capture, folder of range images, or udp[:PORT].
    #[arg(value_name = "SOURCE", value_parser = Source::parse)]
    source: Source,
    #[command(flatten)]
    sensor: SensorArguments,
    /// Which revolution, counted from 0.
    #[arg(long, default_value_t = 0)]
    scan: usize,
    /// Half the width of the view from above, m.
    #[arg(long, default_value_t = 40.0, value_name = "M")]
    reach: f32,
    /// PNG to write; an older one is replaced.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

impl View {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        ensure!(self.reach > 0.0 && self.reach.is_finite(), "--reach must be greater than zero");
        let stop = stop::on_interrupt()?;
        let source = self.source.open(&self.sensor.options(), &stop)?;
        let setup = source.setup()?;
        let order = RingOrder::new(&setup.lasers);
        let (mut number, mut drawn) = (0, None);
        source.revolutions(&stop, |revolution| {
            if number == self.scan {
                let cloud = revolution.organised(&order, revolution.columns().max(1));
                drawn = Some((cloud, revolution.points.len()));
                return ControlFlow::Break(());
            }
            number += 1;
            ControlFlow::Continue(())
        })?;
        let (cloud, points) =
            drawn.with_context(|| format!("there is no revolution {}; there are {number}", self.scan))?;
        scan_picture::write(&self.output, &cloud, order.rings(), self.reach)
            .with_context(|| self.output.display().to_string())?;
        println!("points  {points}");
        Ok(())
    }
}
