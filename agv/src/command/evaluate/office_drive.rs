//! Which drive through an office an experiment is made with.

use std::path::{Path, PathBuf};

use agv_host_sim::data;
use agv_lab::evaluate::slam::OfficeDrive;
use anyhow::Context;
use clap::ValueEnum;

use crate::command::output::note;

/// A log with raw odometry and corrected poses.
#[derive(clap::Args)]
pub struct DriveChoice {
    /// CARMEN log with raw odometry and corrected poses; that of fr079 if absent.
    #[arg(long, conflicts_with = "set")]
    log: Option<PathBuf>,
    /// One of the recordings in the folder of AGV_DATA.
    #[arg(long)]
    set: Option<DriveSet>,
}

/// Buildings.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum DriveSet {
    /// An office in Freiburg.
    #[value(name = "freiburg-079")]
    Freiburg079,
    /// The laboratory of Intel in Seattle.
    Intel,
    /// The ACES building in Austin.
    Aces,
    /// A museum in Bonn.
    Fhw,
}

impl DriveSet {
    const fn file(self) -> &'static str {
        match self {
            Self::Freiburg079 => "freiburg-079-corrected.log.gz",
            Self::Intel => "intel-corrected.log.gz",
            Self::Aces => "aces-corrected.log.gz",
            Self::Fhw => "fhw-corrected.log.gz",
        }
    }

    /// Its name and its log.
    pub fn log(self) -> anyhow::Result<(String, PathBuf)> {
        let name = self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned());
        Ok((name, folder()?.join(self.file())))
    }
}

/// The folder of these recordings.
fn folder() -> anyhow::Result<PathBuf> {
    Ok(data::folder().context("set AGV_DATA to the folder of recordings")?.join("scans2d"))
}

impl DriveChoice {
    /// Reads the drive.
    pub fn read(&self) -> anyhow::Result<OfficeDrive> {
        let log = match (&self.log, self.set) {
            (Some(log), _) => log.clone(),
            (None, Some(set)) => folder()?.join(set.file()),
            (None, None) => {
                let folder = folder()?;
                let carmen_log = folder.join("freiburg-079-corrected.log.gz");
                return Ok(OfficeDrive::of_graph(&folder.join("fr079.log"), &carmen_log)?);
            }
        };
        read(&log)
    }
}

/// Reads a log, and says what was wrong with its times.
pub fn read(log: &Path) -> anyhow::Result<OfficeDrive> {
    let drive = OfficeDrive::of_carmen(log)?;
    if !drive.defects.is_none() {
        note(&format!("agv: {}: {}", log.display(), drive.defects));
    }
    Ok(drive)
}
