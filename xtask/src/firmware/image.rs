//! Boards, and the images that are built for them.

use std::path::PathBuf;

use anyhow::bail;

use crate::repository;

/// What the boards' processors are called.
pub const TARGET: &str = "thumbv7em-none-eabihf";

/// A board.
pub struct Board {
    /// Feature of the firmware that chooses it.
    pub feature: &'static str,
    /// Binaries that are built for it.
    pub images: &'static [&'static str],
}

/// The emulated board.
pub const AN500: Board = Board {
    feature: "an500",
    images: &["calibrate", "deliberate_panic", "latency", "measure", "no_panic", "replay", "restart", "vehicle"],
};

/// The vehicle's board, a Nucleo-H743ZI.
pub const H743: Board = Board { feature: "h743", images: &["vehicle"] };

/// All boards.
pub const BOARDS: [&Board; 2] = [&AN500, &H743];

impl Board {
    /// Where cargo builds for the board: one folder for all, so that what they share is built once.
    pub fn folder(&self) -> PathBuf {
        repository().join("target/firmware").join(self.feature)
    }

    /// The file of an image.
    pub fn image(&self, name: &str) -> anyhow::Result<PathBuf> {
        if !self.images.contains(&name) {
            bail!("{name} is no image of {}; there are {}", self.feature, self.images.join(", "));
        }
        Ok(self.folder().join(TARGET).join("firmware").join(name))
    }
}
