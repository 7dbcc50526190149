//! How much of a board an image takes.

use std::path::Path;

use anyhow::{Context, bail};
use object::{Object, ObjectSection, SectionFlags, SectionKind};

use super::image::{BOARDS, Board};

/// Images that only measure need not fit a vehicle.
const UNLIMITED: [&str; 8] =
    ["calibrate", "deliberate_panic", "latency", "measure", "no_panic", "play", "replay", "restart"];

struct Size {
    flash: u64,
    /// As the board's regions follow each other.
    ram: Vec<u64>,
}

/// Prints the table.
///
/// # Errors
/// If an image is missing, larger than it may be, or has something where there is no memory.
pub fn print() -> anyhow::Result<()> {
    println!("{:<8} {:<16} {:>12}   RAM", "board", "image", "flash");
    let mut too_large = Vec::new();
    for board in BOARDS {
        for name in board.images {
            let size = read(&board.image(name)?, board)?;
            println!("{:<8} {name:<16} {:>12}   {}", board.feature, size.flash, in_regions(board, &size.ram));
            let is_over = board.ram.iter().zip(&size.ram).any(|(region, used)| *used > region.budget);
            if !UNLIMITED.contains(name) && (size.flash > board.flash || is_over) {
                too_large.push(format!("{} of {}", name, board.feature));
            }
        }
        let budgets: Vec<u64> = board.ram.iter().map(|region| region.budget).collect();
        println!("{:<8} {:<16} {:>12}   {}", board.feature, "at most", board.flash, in_regions(board, &budgets));
    }
    if too_large.is_empty() { Ok(()) } else { bail!("too large: {}", too_large.join(", ")) }
}

/// Prints what the vehicle's image takes of each real board, as a table for the book.
///
/// # Errors
/// If an image is missing, or has something where there is no memory.
pub fn print_table() -> anyhow::Result<()> {
    println!("| board | memory | image | at most |\n|---|---|---|---|");
    for board in BOARDS.into_iter().filter(|board| board.chip.is_some()) {
        let size = read(&board.image("vehicle")?, board)?;
        println!("| {} | flash | {} | {} |", board.feature, size.flash, board.flash);
        for (region, used) in board.ram.iter().zip(&size.ram) {
            println!("| {} | {} | {used} | {} |", board.feature, region.name, region.budget);
        }
    }
    Ok(())
}

fn in_regions(board: &Board, bytes: &[u64]) -> String {
    let parts: Vec<String> =
        board.ram.iter().zip(bytes).map(|(region, bytes)| format!("{} {bytes:>7}", region.name)).collect();
    parts.join("  ")
}

fn read(path: &Path, board: &Board) -> anyhow::Result<Size> {
    let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
    let file = object::File::parse(&*bytes).with_context(|| path.display().to_string())?;
    let mut size = Size { flash: 0, ram: vec![0; board.ram.len()] };
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
        if is_written && section.size() > 0 {
            let place = board.ram.iter().position(|region| region.addresses.contains(&section.address()));
            let name = section.name().unwrap_or_default();
            let place = place.with_context(|| format!("{name} of {} is where there is no RAM", path.display()))?;
            size.ram[place] += section.size();
        }
    }
    Ok(size)
}
