//! Boards, and the images that are built for them.

use std::fs::File;
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
    /// Its chip, if it is a real one: as `stm32-metapac` names it, and as `probe-rs` does.
    pub chip: Option<Chip>,
    /// Binaries that are built for it.
    pub images: &'static [&'static str],
    /// Most flash of an image, bytes.
    pub flash: u64,
    /// Its RAM.
    pub ram: &'static [Region],
}

/// What others call a chip.
pub struct Chip {
    /// `stm32-metapac`.
    pub metadata: &'static str,
    /// `probe-rs`.
    pub probe: &'static str,
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

/// Bytes of a map of contours, which the vehicle's board reads where they lie in flash, and the emulated one in RAM.
const CONTOUR_MAP: u64 = 128 * 1024;

/// The emulated board, with what the vehicle's has: its flash, and its RAM in domains D1 to D3 together.
pub const AN500: Board = Board {
    feature: "an500",
    chip: None,
    images: &[
        "calibrate",
        "deliberate_panic",
        "latency",
        "measure",
        "no_panic",
        "play",
        "replay",
        "restart",
        "vehicle",
    ],
    flash: H743.flash,
    ram: &[Region {
        name: "RAM",
        addresses: 0x2000_0000..0x2040_0000,
        budget: H743.ram[0].budget + H743.ram[1].budget + H743.ram[2].budget + CONTOUR_MAP,
    }],
};

/// The vehicle's board, a Nucleo-H743ZI. The stack has the DTCM for itself, and the program the first bank of flash, of which a
/// tenth is left.
pub const H743: Board = Board {
    feature: "h743",
    chip: Some(Chip { metadata: "stm32h743zi", probe: "STM32H743ZITx" }),
    images: &["vehicle"],
    flash: 1024 * 1024 / 10 * 9,
    ram: &[
        Region::of_chip("AXI", 0x2400_0000, 512 * 1024),
        Region::of_chip("D2", 0x3000_0000, 256 * 1024),
        Region::of_chip("D3", 0x3800_0000, 64 * 1024),
    ],
};

/// Bytes of the H723's DTCM that are the stack's: large values are before it.
const H723_STACK: u64 = 76 * 1024;

/// A smaller board, a Nucleo-H723ZG, as the option bytes of the factory divide its memory. The program has six of the eight pages
/// of its only bank of flash.
pub const H723: Board = Board {
    feature: "h723",
    chip: Some(Chip { metadata: "stm32h723zg", probe: "STM32H723ZGTx" }),
    images: &["vehicle"],
    flash: 768 * 1024 / 10 * 9,
    ram: &[
        Region::of_chip("AXI", 0x2400_0000, 320 * 1024),
        Region::of_chip("D2", 0x3000_0000, 16 * 1024),
        Region::of_chip("D3", 0x3800_0000, 16 * 1024),
        Region::of_chip("DTCM", 0x2000_0000, 128 * 1024 - H723_STACK),
    ],
};

/// All boards.
pub const BOARDS: [&Board; 3] = [&AN500, &H743, &H723];

/// Where cargo builds for all boards, so that what they share is built once.
pub fn build_folder() -> PathBuf {
    repository().join("target/firmware/build")
}

/// Waits until nobody else builds images, and keeps others waiting until the file is dropped.
pub fn lock() -> anyhow::Result<File> {
    let path = repository().join("target/firmware/lock");
    let take = || {
        std::fs::create_dir_all(path.parent().unwrap_or(&path))?;
        let file = File::create(&path)?;
        file.lock()?;
        Ok::<_, std::io::Error>(file)
    };
    take().with_context(|| format!("{} cannot be locked", path.display()))
}

impl Board {
    /// The file of an image.
    pub fn image(&self, name: &str) -> anyhow::Result<PathBuf> {
        if !self.images.contains(&name) {
            bail!("{name} is no image of {}; there are {}", self.feature, self.images.join(", "));
        }
        Ok(repository().join("target/firmware").join(self.feature).join(IMAGES).join(name))
    }

    /// The board with that feature.
    pub fn named(feature: &str) -> anyhow::Result<&'static Self> {
        let found = BOARDS.into_iter().find(|board| board.feature == feature);
        found.with_context(|| {
            format!("there is no board {feature}; there are {}", BOARDS.map(|one| one.feature).join(", "))
        })
    }

    /// Its chip.
    pub fn chip(&self) -> anyhow::Result<&Chip> {
        self.chip.as_ref().with_context(|| format!("{} is no real board", self.feature))
    }

    /// Puts the images that were built last where they do not meet those of the other boards, which have the same names.
    pub fn keep_images(&self) -> anyhow::Result<()> {
        for name in self.images {
            let (built, kept) = (build_folder().join(IMAGES).join(name), self.image(name)?);
            // Whoever reads the image meanwhile has the old one or the new one, never a part.
            let copy = || {
                std::fs::create_dir_all(kept.parent().unwrap_or(&kept))?;
                let aside = kept.with_extension("new");
                std::fs::copy(&built, &aside)?;
                std::fs::rename(&aside, &kept)
            };
            copy().with_context(|| format!("{} cannot be copied to {}", built.display(), kept.display()))?;
        }
        Ok(())
    }
}
