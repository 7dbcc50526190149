//! `cargo xtask chip`: the image that is flashed, in the emulated STM32H743.
//!
//! The emulated chip is a program of its own, `tests/chip`, in a process of its own: Unicorn, on which it stands, is under
//! the GPL and belongs to no product.

mod metadata;

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, bail};

use crate::{firmware, repository, requirements};

/// Check the image that is flashed in the emulated STM32H743
#[derive(clap::Args)]
pub struct Chip {
    /// Checks to run, by name; all of them if none is named.
    checks: Vec<String>,
    /// Only name the checks.
    #[arg(long)]
    list: bool,
    /// Full sweeps instead of samples of them.
    #[arg(long)]
    long: bool,
    /// Another image than the one that is built.
    #[arg(long)]
    image: Option<PathBuf>,
}

impl Chip {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        for missing in requirements::prepare_chip() {
            eprintln!("{missing}");
        }
        let image = self.image.map_or_else(firmware::flashed_vehicle, Ok)?;
        let mut python = Command::new(requirements::python());
        python.arg(repository().join("tests/chip")).arg("--image").arg(image);
        python.arg("--description").arg(describe()?).arg("--hook").arg(build_hook()?);
        for (is_wanted, option) in [(self.list, "--list"), (self.long, "--long")] {
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

/// Writes the chip's description, and returns where.
fn describe() -> anyhow::Result<PathBuf> {
    let path = folder()?.join("stm32h743zi.json");
    let text = serde_json::to_string(&metadata::describe()?)?;
    std::fs::write(&path, text).with_context(|| path.display().to_string())?;
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
