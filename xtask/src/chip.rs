//! `cargo xtask chip`: the image that is flashed, in the emulated chip of its board.
//!
//! The emulated chip is a program of its own, `tests/chip`, in a process of its own: Unicorn, on which it stands, is under
//! the GPL and belongs to no product.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, bail};

use crate::firmware::image::{Board, H743};
use crate::{firmware, repository, requirements};

/// Check the image that is flashed in the emulated chip of its board
#[derive(clap::Args)]
pub struct Chip {
    /// Checks to run, by name; all of them if none is named.
    checks: Vec<String>,
    /// Feature of the board: h743 or h723.
    #[arg(long, default_value = H743.feature)]
    board: String,
    /// Only name the checks.
    #[arg(long)]
    list: bool,
    /// Full sweeps instead of samples of them.
    #[arg(long)]
    long: bool,
    /// Be a part of a vehicle that `agv emulate --chip` plays, over standard input and output.
    #[arg(long)]
    serve: bool,
    /// Another image than the one that is built.
    #[arg(long)]
    image: Option<PathBuf>,
}

impl Chip {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let mut python = command(Board::named(&self.board)?, self.image)?;
        for (is_wanted, option) in [(self.list, "--list"), (self.long, "--long"), (self.serve, "--serve")] {
            if is_wanted {
                python.arg(option);
            }
        }
        python.args(self.checks);
        if python.status().context("the Python of the tests cannot be started")?.success() {
            Ok(())
        } else {
            bail!("a check has failed")
        }
    }
}

/// The program that emulates the chip of a board, with an image, or the one that is built.
pub fn command(board: &Board, image: Option<PathBuf>) -> anyhow::Result<Command> {
    for missing in requirements::prepare_chip() {
        eprintln!("{missing}");
    }
    let description = describe(board.chip()?.metadata)?;
    let image = image.map_or_else(|| firmware::flashed_vehicle(board), Ok)?;
    let mut python = Command::new(requirements::python());
    python.arg(repository().join("tests/chip")).arg("--image").arg(image);
    python.arg("--description").arg(description).arg("--hook").arg(build_hook()?);
    Ok(python)
}

/// Writes the description of a chip, and returns where.
fn describe(chip: &str) -> anyhow::Result<PathBuf> {
    let path = folder()?.join(chip).with_extension("json");
    let cargo = std::env::var_os("CARGO").map_or_else(|| PathBuf::from("cargo"), PathBuf::from);
    let mut describe = Command::new(cargo);
    describe.args(["run", "--quiet", "--release", "--package", "agv-chip-description", "--features", chip]);
    let output = describe.current_dir(repository()).output().context("cargo cannot be started")?;
    if !output.status.success() {
        bail!("{chip} is not described: {}", String::from_utf8_lossy(&output.stderr));
    }
    std::fs::write(&path, output.stdout).with_context(|| path.display().to_string())?;
    Ok(path)
}

/// Builds what counts blocks of code, and returns where it is.
fn build_hook() -> anyhow::Result<PathBuf> {
    let path = folder()?.join("block_hook.so");
    let mut compiler = Command::new(std::env::var_os("CC").unwrap_or_else(|| "cc".into()));
    compiler.args(["-O2", "-shared", "-fPIC", "-o"]).arg(&path);
    compiler.arg(repository().join("tests/chip/emulated_chip/block_hook.c"));
    if compiler.status().context("no compiler for C can be started; install the Debian package gcc")?.success() {
        Ok(path)
    } else {
        bail!("block_hook.c does not build")
    }
}

fn folder() -> anyhow::Result<PathBuf> {
    let path = repository().join("target/chip");
    std::fs::create_dir_all(&path).with_context(|| path.display().to_string())?;
    Ok(path)
}
