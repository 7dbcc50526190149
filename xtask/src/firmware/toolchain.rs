//! Which compiler builds for the boards.

use std::path::Path;
use std::process::Command;

use anyhow::bail;

use super::image::TARGET;
use crate::repository;
use crate::requirements::debian;

/// Compiler of Debian's package `rustc-web`, which comes with the sources of its own `core` in `rust-web-src`.
const DEBIAN: &str = "/usr/bin/rustc";

/// `cargo`, set up to build for the boards: the target of rustup where it is installed, else Debian's matched pair of
/// compiler and sources.
///
/// # Errors
/// If there is neither, with what to install.
pub fn cargo() -> anyhow::Result<Command> {
    let mut cargo = Command::new("cargo");
    cargo.current_dir(repository());
    if has_target() {
        return Ok(cargo);
    }
    for package in ["rustc-web", "rust-web-src"] {
        if !has_sources()
            && let Err(why) = debian::install(package)
        {
            eprintln!("{package} is not installed: {why}");
        }
    }
    if !has_sources() {
        bail!("nothing here builds for {TARGET}: `rustup target add {TARGET}`, or Debian's rustc-web and rust-web-src");
    }
    cargo.env("RUSTC", DEBIAN).env("RUSTC_BOOTSTRAP", "1").env_remove("RUSTUP_TOOLCHAIN");
    cargo.arg("-Zbuild-std=core");
    Ok(cargo)
}

fn output(command: &mut Command) -> Option<String> {
    let output = command.output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// Whether a compiler that says `rustc 1.95.0 (...)` of itself builds this workspace.
fn is_new_enough(version: &str) -> bool {
    let number = |text: &str| {
        let mut parts = text.split('.').map_while(|part| part.parse::<u32>().ok());
        Some((parts.next()?, parts.next()?))
    };
    let told = version.split_whitespace().nth(1).and_then(number);
    told.zip(number(env!("CARGO_PKG_RUST_VERSION"))).is_some_and(|(told, needed)| told >= needed)
}

fn has_target() -> bool {
    let folder = output(Command::new("rustc").args(["--print", "target-libdir", "--target", TARGET]));
    folder.is_some_and(|folder| Path::new(&folder).is_dir())
}

/// Whether Debian's pair is there, and new enough.
fn has_sources() -> bool {
    let version = output(Command::new(DEBIAN).arg("--version"));
    if !version.is_some_and(|version| is_new_enough(&version)) {
        return false;
    }
    let root = output(Command::new(DEBIAN).args(["--print", "sysroot"]));
    root.is_some_and(|root| Path::new(&root).join("lib/rustlib/src/rust/library/core").is_dir())
}

#[cfg(test)]
mod tests {
    use super::is_new_enough;

    #[test]
    fn an_old_compiler_is_not_taken() {
        assert!(is_new_enough("rustc 1.96.0 (ac68faa20 2026-05-25) (built from a source tarball)"));
        assert!(is_new_enough("rustc 2.0.0"));
        assert!(!is_new_enough("rustc 1.85.0 (4d91de4e4 2025-02-17) (built from a source tarball)"));
        assert!(!is_new_enough("") && !is_new_enough("rustc what"));
    }
}
