//! Sources of all packages that are built, for a host or a board: the test of their licences reads them.

use std::process::Command;

use crate::repository;

/// What is built for; packages of other systems are not needed.
const TARGETS: [&str; 2] = ["x86_64-unknown-linux-gnu", "thumbv7em-none-eabihf"];

/// Downloads what is not there yet, optional packages too. Returns what is missing.
pub fn prepare() -> Vec<String> {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.current_dir(repository()).args(["fetch", "--quiet", "--locked"]);
    for target in TARGETS {
        cargo.args(["--target", target]);
    }
    super::install(&mut cargo).err().map(|why| format!("missing: sources of all packages; {why}")).into_iter().collect()
}
