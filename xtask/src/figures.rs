//! `cargo xtask figures`.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, ensure};

use crate::repository;

/// What the tables of the chapter on driving blind are made with, in their order there.
const BLIND: [&str; 15] = [
    "warehouse --map slam --disturb-all --first-seed 100000 --runs 100",
    "windows",
    "windows --set freiburg-079",
    "windows --set intel",
    "windows --set aces",
    "windows --set fhw",
    "contour-map --set freiburg-079",
    "contour-map --set intel",
    "contour-map --set aces",
    "contour-map --set fhw",
    "falko --set fr079",
    "falko --set intel",
    "contour-starts --starts 1250 --seed 420000",
    "contour-drives --drives 10 --seconds 30 --seed 380000",
    "drives",
];

/// Make the tables of the chapter on driving by features and contours, by `agv evaluate`, one after the other, from the recordings in AGV_DATA: some minutes
#[derive(clap::Args)]
pub struct Figures {
    /// Only those whose command contains this.
    #[arg(long, default_value = "")]
    only: String,
}

impl Figures {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let chosen: Vec<_> = BLIND.into_iter().filter(|command| command.contains(&self.only)).collect();
        ensure!(!chosen.is_empty(), "no command contains '{}'", self.only);
        let cargo = std::env::var_os("CARGO").map_or_else(|| PathBuf::from("cargo"), PathBuf::from);
        for arguments in chosen {
            println!("\nagv evaluate {arguments}\n");
            let mut agv = Command::new(&cargo);
            agv.args([
                "run",
                "--quiet",
                "--release",
                "--package",
                "agv",
                "--features",
                "full",
                "--",
                "--quiet",
                "evaluate",
            ]);
            let status = agv.args(arguments.split(' ')).current_dir(repository()).status();
            ensure!(status.context("cargo cannot be started")?.success(), "agv evaluate {arguments} has failed");
        }
        Ok(())
    }
}
