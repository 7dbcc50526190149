//! Boards, and the images that are built for them.

use std::path::PathBuf;

use anyhow::{Context, bail};

use crate::repository;

/// What the boards' processors are called.
pub const TARGET: &str = "thumbv7em-none-eabihf";

/// Where cargo leaves images, in a folder that it builds in.
const IMAGES: &str = "thumbv7em-none-eabihf/firmware";

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

/// Where cargo builds for all boards, so that what they share is built once.
pub fn build_folder() -> PathBuf {
    repository().join("target/firmware/build")
}

impl Board {
    /// The file of an image.
    pub fn image(&self, name: &str) -> anyhow::Result<PathBuf> {
        if !self.images.contains(&name) {
            bail!("{name} is no image of {}; there are {}", self.feature, self.images.join(", "));
        }
        Ok(repository().join("target/firmware").join(self.feature).join(IMAGES).join(name))
    }

    /// Puts the images that were built last where they do not meet those of the other boards, which have the same names.
    pub fn keep_images(&self) -> anyhow::Result<()> {
        for name in self.images {
            let (built, kept) = (build_folder().join(IMAGES).join(name), self.image(name)?);
            let copy = || {
                std::fs::create_dir_all(kept.parent().unwrap_or(&kept))?;
                std::fs::copy(&built, &kept)
            };
            copy().with_context(|| format!("{} cannot be copied to {}", built.display(), kept.display()))?;
        }
        Ok(())
    }
}
