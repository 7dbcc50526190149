//! `agv lidar3d places`.

mod find;
mod index;

use std::ops::ControlFlow;
use std::sync::atomic::AtomicBool;

use agv_host_sim::lidar3d::Source;
use agv_host_sim::lidar3d::view::Standing;
use agv_lidar3d::cloud::{Cloud, RingOrder};
use agv_lidar3d::place::{Floor, Span};
use anyhow::Context;

use super::arguments::SensorArguments;
use crate::command::evaluate::Lidar3dPlaces as Evaluate;
use crate::command::progress;

/// Store places in at most 16 kB each, and find out where a scan was taken.
#[derive(clap::Args)]
pub struct Places {
    #[command(subcommand)]
    action: Action,
}

#[derive(clap::Subcommand)]
enum Action {
    Index(index::Index),
    Find(find::Find),
    Evaluate(Evaluate),
}

impl Places {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        match self.action {
            Action::Index(command) => command.run(),
            Action::Find(command) => command.run(),
            Action::Evaluate(command) => command.run(),
        }
    }
}

/// The source of the scans of a drive.
#[derive(clap::Args)]
pub struct Drive {
    /// Capture, folder of range images, or udp[:PORT].
    #[arg(value_name = "SOURCE", value_parser = Source::parse)]
    pub source: Source,
    /// The sensor and its parameters.
    #[command(flatten)]
    pub sensor: SensorArguments,
}

/// A sensor, as places are recognised by it.
#[derive(Clone, Copy, Debug)]
pub struct Eye {
    /// How it stands above the floor.
    pub standing: Standing,
    /// Between which elevations it looks.
    pub span: Span,
}

impl Drive {
    /// Calls `take` with the number and the points of each whole revolution, and the sensor. How it stands is as given, or is
    /// found in the first revolution. Returns it.
    pub fn for_each(
        self,
        standing: Option<Standing>,
        stop: &AtomicBool,
        mut take: impl FnMut(usize, &Cloud<'_>, &Eye) -> ControlFlow<()>,
    ) -> anyhow::Result<Eye> {
        let name = self.source.name();
        let source = self.source.open(&self.sensor.options(), stop)?;
        let setup = source.setup()?;
        let order = RingOrder::new(&setup.lasers);
        let elevations = setup.lasers.iter().filter(|laser| laser.is_enabled).map(|laser| laser.elevation as f32);
        let span = Span::of_elevations(elevations).with_context(|| format!("{name}: the sensor has one ring only"))?;
        let bar = progress::bar("signatures", source.length().unwrap_or(0));
        let (mut number, mut eye, mut columns) = (0, None, None);
        source.revolutions(stop, |revolution| {
            bar.inc(1);
            if !revolution.is_whole {
                return ControlFlow::Continue(());
            }
            let points = revolution.organised(&order, *columns.get_or_insert_with(|| revolution.columns().max(1)));
            let Some(cloud) = Cloud::new(&points, order.rings()) else { return ControlFlow::Continue(()) };
            let found = || Standing::Found(Floor::find(&cloud).map_or(0.0, |floor| floor.height));
            let eye = eye.get_or_insert_with(|| Eye { standing: standing.unwrap_or_else(found), span });
            number += 1;
            take(number - 1, &cloud, eye)
        })?;
        bar.finish_and_clear();
        eye.with_context(|| format!("{name}: there is no whole revolution"))
    }
}
