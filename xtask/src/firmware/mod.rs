//! `cargo xtask firmware`.

pub mod image;
mod size;
mod toolchain;

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, bail};

use crate::repository;
use image::{AN500, BOARDS, Board, H743};

/// Build the firmware, run it in emulation, say how large it is, flash it
#[derive(clap::Args)]
pub struct Firmware {
    #[command(subcommand)]
    action: Action,
}

#[derive(clap::Subcommand)]
enum Action {
    /// Build the images of every board, or of one.
    Build {
        /// Feature of the board: an500, h743 or h723.
        #[arg(long)]
        board: Option<String>,
    },
    /// Run an image of the emulated board in this folder, with this folder's files.
    Run {
        /// Name of the image.
        image: String,
        /// Count instructions exactly: no input from outside.
        #[arg(long)]
        icount: bool,
    },
    /// Flash and RAM of every image, against its budget.
    Size {
        /// Only the vehicle's images of real boards, as the book has them.
        #[arg(long)]
        table: bool,
    },
    /// Flash an image to a vehicle's board, through probe-rs.
    Flash {
        /// Name of the image.
        #[arg(default_value = "vehicle")]
        image: String,
        /// Feature of the board: h743 or h723.
        #[arg(long, default_value = H743.feature)]
        board: String,
    },
}

impl Firmware {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        match self.action {
            Action::Build { board: None } => build(),
            Action::Build { board: Some(board) } => build_board(Board::named(&board)?),
            Action::Run { image, icount } => {
                build_board(&AN500)?;
                emulate(&image, icount)
            }
            Action::Size { table } => {
                build()?;
                if table { size::print_table() } else { size::print() }
            }
            Action::Flash { image, board } => flash(&image, Board::named(&board)?),
        }
    }
}

/// Builds the images of every board, and what no image uses but every board could.
pub fn build() -> anyhow::Result<()> {
    BOARDS.iter().try_for_each(|board| build_board(board))?;
    build_lidar3d()
}

/// Packets and signatures of multi-beam lidars, without an operating system.
fn build_lidar3d() -> anyhow::Result<()> {
    let mut cargo = toolchain::cargo()?;
    cargo.args(["build", "--package", "agv-lidar3d", "--no-default-features", "--profile", "firmware"]);
    cargo.args(["--target", image::TARGET, "--target-dir"]).arg(image::build_folder());
    if !cargo.status().context("cargo cannot be started")?.success() {
        bail!("agv-lidar3d does not build without std");
    }
    Ok(())
}

/// The vehicle's image for the emulated board, built.
pub fn emulated_vehicle() -> anyhow::Result<PathBuf> {
    build_board(&AN500)?;
    AN500.image("vehicle")
}

/// The vehicle's image that is flashed to a board, built.
pub fn flashed_vehicle(board: &Board) -> anyhow::Result<PathBuf> {
    build_board(board)?;
    board.image("vehicle")
}

/// Fails if an image is larger than its budget.
pub fn check_sizes() -> anyhow::Result<()> {
    size::print()
}

fn build_board(board: &Board) -> anyhow::Result<()> {
    if board.images.is_empty() {
        return Ok(());
    }
    // Two at once would keep each other's images: they are built in one folder, under the same names.
    let lock = image::lock()?;
    let mut cargo = toolchain::cargo()?;
    cargo.args(["build", "--package", "agv-firmware", "--profile", "firmware"]);
    cargo.args(["--target", image::TARGET, "--features", board.feature, "--target-dir"]);
    cargo.arg(image::build_folder());
    for image in board.images {
        cargo.args(["--bin", image]);
    }
    if !cargo.status().context("cargo cannot be started")?.success() {
        bail!("the firmware of {} does not build", board.feature);
    }
    board.keep_images()?;
    drop(lock);
    Ok(())
}

fn emulate(name: &str, icount: bool) -> anyhow::Result<()> {
    let mut qemu = Command::new("qemu-system-arm");
    qemu.args(["-M", "mps2-an500", "-nographic", "-monitor", "none", "-serial", "none"]);
    qemu.args(["-semihosting-config", "enable=on,target=native"]);
    if icount {
        qemu.args(["-icount", "shift=6,sleep=off"]);
    }
    qemu.arg("-kernel").arg(AN500.image(name)?);
    let status = qemu.status().context("qemu-system-arm cannot be started; apt-get install qemu-system-arm")?;
    if status.success() { Ok(()) } else { bail!("{name} failed") }
}

fn flash(name: &str, board: &Board) -> anyhow::Result<()> {
    let chip = board.chip()?;
    build_board(board)?;
    let mut probe = Command::new("probe-rs");
    probe.args(["download", "--chip", chip.probe]).arg(board.image(name)?).current_dir(repository());
    let status = probe.status().context("probe-rs cannot be started; cargo install probe-rs-tools")?;
    if status.success() { Ok(()) } else { bail!("{name} was not flashed") }
}
