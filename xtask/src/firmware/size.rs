//! How much of a board an image takes.

use std::path::Path;

use anyhow::{Context, bail};
use object::{Object, ObjectSection, SectionFlags, SectionKind};

use super::image::BOARDS;

/// Most flash of an image, bytes.
const FLASH: u64 = 512 * 1024;
/// Most static RAM of an image, bytes.
const RAM: u64 = 320 * 1024;

/// Images that only measure need not fit a vehicle.
const UNLIMITED: [&str; 7] = ["calibrate", "deliberate_panic", "latency", "measure", "no_panic", "replay", "restart"];

struct Size {
    flash: u64,
    ram: u64,
}

/// Prints the table.
///
/// # Errors
/// If an image is missing, or larger than it may be.
pub fn print() -> anyhow::Result<()> {
    println!("{:<8} {:<10} {:>12} {:>12}", "board", "image", "flash", "RAM");
    let mut too_large = Vec::new();
    for board in BOARDS {
        for name in board.images {
            let size = read(&board.image(name)?)?;
            println!("{:<8} {name:<10} {:>12} {:>12}", board.feature, size.flash, size.ram);
            if !UNLIMITED.contains(name) && (size.flash > FLASH || size.ram > RAM) {
                too_large.push(format!("{} of {}", name, board.feature));
            }
        }
    }
    println!("at most  {:<10} {FLASH:>12} {RAM:>12}", "");
    if too_large.is_empty() { Ok(()) } else { bail!("too large: {}", too_large.join(", ")) }
}

fn read(path: &Path) -> anyhow::Result<Size> {
    let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
    let file = object::File::parse(&*bytes).with_context(|| path.display().to_string())?;
    let mut size = Size { flash: 0, ram: 0 };
    for section in file.sections() {
        let SectionFlags::Elf { sh_flags } = section.flags() else { continue };
        if sh_flags & u64::from(object::elf::SHF_ALLOC) == 0 {
            continue;
        }
        let is_written = sh_flags & u64::from(object::elf::SHF_WRITE) != 0;
        let is_empty = section.kind() == SectionKind::UninitializedData;
        if !is_empty {
            size.flash += section.size();
        }
        if is_written {
            size.ram += section.size();
        }
    }
    Ok(size)
}
