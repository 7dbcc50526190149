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
    /// Most flash of an image, bytes.
    pub flash: u64,
    /// Its RAM.
    pub ram: &'static [Region],
}

/// A part of memory.
pub struct Region {
    /// What the manual calls it.
    pub name: &'static str,
    /// Its addresses.
    pub addresses: std::ops::Range<u64>,
    /// Most that an image may take of it, bytes.
    pub budget: u64,
}

impl Region {
    /// A part of the chip's memory from an address on, of which a tenth is left.
    const fn of_chip(name: &'static str, start: u64, size: u64) -> Self {
        Self { name, addresses: start..start + size, budget: size / 10 * 9 }
    }
}

/// The emulated board, in as much RAM as the vehicle's had for everything. Its flash has 4 MB.
pub const AN500: Board = Board {
    feature: "an500",
    images: &["calibrate", "deliberate_panic", "latency", "measure", "no_panic", "replay", "restart", "vehicle"],
    flash: 544 * 1024,
    ram: &[Region { name: "RAM", addresses: 0x2000_0000..0x2040_0000, budget: 368 * 1024 }],
};

/// The vehicle's board, a Nucleo-H743ZI. The stack has the DTCM for itself, and the program the first bank of flash, of which a
/// tenth is left.
pub const H743: Board = Board {
    feature: "h743",
    images: &["vehicle"],
    flash: 1024 * 1024 / 10 * 9,
    ram: &[
        Region::of_chip("AXI", 0x2400_0000, 512 * 1024),
        Region::of_chip("D2", 0x3000_0000, 128 * 1024),
        Region::of_chip("D3", 0x3800_0000, 64 * 1024),
    ],
};

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
