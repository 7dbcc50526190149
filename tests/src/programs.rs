//! Programs of others, and the images of the boards.

use std::path::PathBuf;
use std::process::Command;

use crate::{repository, skip};

/// The Python that `cargo xtask test` has made, if it has the modules (`module, module`). Otherwise `test` is skipped.
#[must_use]
pub fn python(test: &str, modules: &str) -> Option<Command> {
    let own = repository("target/python/bin/python3");
    let program = if own.exists() { own } else { PathBuf::from("python3") };
    let has_modules = Command::new(&program).args(["-c", &format!("import {modules}")]).output();
    if has_modules.is_ok_and(|run| run.status.success()) {
        return Some(Command::new(program));
    }
    skip(test, &format!("python3 with {modules} is not there; cargo xtask test installs it"));
    None
}

/// The command `agv` as it was built last; it belongs to another package, so Cargo does not build it for these tests. Where
/// it is not, `test` is skipped.
#[must_use]
pub fn agv(test: &str) -> Option<PathBuf> {
    let program = std::env::current_exe().ok()?;
    let built = program
        .ancestors()
        .skip(1)
        .take(3)
        .flat_map(|folder| ["agv", "release/agv", "debug/agv"].map(|name| folder.join(name)));
    let age = |path: &PathBuf| path.metadata().and_then(|data| data.modified()).ok();
    let newest = built.filter(|path| path.is_file()).max_by_key(age);
    if newest.is_none() {
        skip(test, "the command agv is not built; cargo build --release --package agv --features full");
    }
    newest
}

/// Whether a program is on the path, or where the programs of root are.
#[must_use]
pub fn is_on_path(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders = std::env::split_paths(&path).chain(["/usr/sbin", "/sbin"].map(PathBuf::from));
    folders.into_iter().any(|folder| folder.join(program).is_file())
}

/// Whether the emulator of the board is there. Otherwise `test` is skipped.
#[must_use]
pub fn emulator(test: &str) -> bool {
    let is_there = is_on_path("qemu-system-arm");
    if !is_there {
        skip(test, "there is no qemu-system-arm (Debian package of that name)");
    }
    is_there
}

/// An image of the firmware of `board`, if it is built. Otherwise `test` is skipped.
#[must_use]
pub fn image(test: &str, board: &str, name: &str) -> Option<PathBuf> {
    let folder = repository("target/firmware").join(board).join("thumbv7em-none-eabihf/firmware");
    let image = folder.join(name).canonicalize().ok();
    if image.is_none() {
        skip(test, "the firmware is not built; cargo xtask firmware build");
    }
    image
}
