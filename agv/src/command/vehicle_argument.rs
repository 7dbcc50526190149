//! A vehicle on a command line.

use std::path::{Path, PathBuf};

use agv_core::localizer::Parameters;
use agv_host_sim::calibrate::vehicle_file::VehicleFile;
use agv_host_sim::setting_doubts::doubt;
use anyhow::ensure;

use super::output::note;

/// The option of the commands that take another vehicle than a log has.
#[derive(clap::Args)]
pub struct VehicleArgument {
    /// Parameters of the vehicle, instead of those of the log; as `agv calibrate --apply` writes them.
    #[arg(long, value_name = "FILE")]
    pub vehicle: Option<PathBuf>,
}

impl VehicleArgument {
    /// Takes that vehicle, if one is given, and asks about values that hardly a vehicle has.
    pub fn apply(&self, parameters: &mut Parameters, log: &Path) -> anyhow::Result<()> {
        let Some(path) = &self.vehicle else { return Ok(()) };
        let vehicle = VehicleFile::read(path)?;
        let doubts = vehicle.settings().filter_map(|(name, value)| doubt(name, value));
        doubts.for_each(|doubt| note(&format!("agv: {}: {doubt}", path.display())));
        ensure!(vehicle.apply(parameters), "{}: the log is of another kind of vehicle", log.display());
        Ok(())
    }
}
