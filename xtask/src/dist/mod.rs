//! `cargo xtask dist`.

mod archive;
mod book;
mod debian;
mod licences;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, bail};

use crate::firmware::image::BOARDS;
use crate::{firmware, repository};

/// Make what a machine without a toolchain needs: an archive and a Debian package, with checksums, in target/dist
#[derive(clap::Args)]
pub struct Dist {
    /// Leave the firmware out, which needs the toolchain of the board.
    #[arg(long)]
    without_firmware: bool,
}

/// Folders of the archive lie in each other less deep than that.
const DEEPEST: usize = 16;

/// Version of everything.
const VERSION: &str = env!("CARGO_PKG_VERSION");

impl Dist {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let folder = repository().join("target/dist");
        if folder.exists() {
            std::fs::remove_dir_all(&folder).context("target/dist cannot be emptied")?;
        }
        let agv = build()?;
        if !self.without_firmware {
            firmware::build()?;
        }
        let texts = licences::of_program()?;
        for path in pack(&folder, &Parts { agv, has_firmware: !self.without_firmware, texts }, &epoch()?)? {
            println!("{}", path.display());
        }
        Ok(())
    }
}

/// What was built, and goes into the archive.
struct Parts {
    /// The command.
    agv: PathBuf,
    /// Whether the images of the boards are packed, too.
    has_firmware: bool,
    /// The licences of what the command is built on.
    texts: String,
}

/// Packs the archive and the Debian package into a folder, with their checksums. Nothing is built.
fn pack(folder: &Path, parts: &Parts, epoch: &str) -> anyhow::Result<[PathBuf; 2]> {
    let root = folder.join(format!("agv-{VERSION}"));
    program(&root, &parts.agv)?;
    documents(&root)?;
    service(&root)?;
    write(&root.join("share/doc/agv/LICENSES-OF-OTHERS"), parts.texts.as_bytes())?;
    book::write(&repository().join("docs/src"), &root.join("share/doc/agv/book"))?;
    if parts.has_firmware {
        images(&root.join("share/agv/firmware"))?;
    }
    archive::write_checksums(&root, DEEPEST)?;
    let packed = [archive::pack(&root, epoch)?, debian::pack(&root, epoch)?];
    // Who has the two files has not what they were packed from.
    archive::write_checksums(folder, 1)?;
    Ok(packed)
}

/// Builds the command; gives its file.
fn build() -> anyhow::Result<PathBuf> {
    run(cargo().args(["build", "--release", "--package", "agv", "--features", "full"]))?;
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| repository().join("target"), PathBuf::from);
    Ok(target.join("release/agv"))
}

fn cargo() -> Command {
    Command::new(std::env::var_os("CARGO").map_or_else(|| PathBuf::from("cargo"), PathBuf::from))
}

/// The command, with what a shell and `man` know of it.
fn program(root: &Path, built: &Path) -> anyhow::Result<()> {
    let agv = root.join("bin/agv");
    copy(built, &agv)?;
    run(Command::new("strip").arg(&agv))?;
    for (shell, place) in [
        ("bash", "share/bash-completion/completions/agv"),
        ("zsh", "share/zsh/vendor-completions/_agv"),
        ("fish", "share/fish/vendor_completions.d/agv.fish"),
    ] {
        write(&root.join(place), &output(Command::new(&agv).args(["completion", shell]))?)?;
    }
    let pages = root.join("share/man/man1");
    make(&pages)?;
    run(Command::new(&agv).args(["manual", "--output"]).arg(&pages))
}

/// Licences, what has changed, and what other programs read of the controller.
fn documents(root: &Path) -> anyhow::Result<()> {
    for name in ["README.md", "CHANGELOG.md", "CONTRIBUTING.md", "LICENSE-MIT", "LICENSE-APACHE"] {
        copy(&repository().join(name), &root.join("share/doc/agv").join(name))?;
    }
    for name in ["agv.dbc", "agv.eds"] {
        copy(&repository().join("docs").join(name), &root.join("share/agv").join(name))?;
    }
    Ok(())
}

/// The controller as a service of systemd: its unit, its user, and an example of what it is told.
fn service(root: &Path) -> anyhow::Result<()> {
    for (name, place) in [
        ("agv.service", "lib/systemd/system/agv.service"),
        ("sysusers.conf", "lib/sysusers.d/agv.conf"),
        ("vehicle.toml", "share/agv/vehicle.toml"),
    ] {
        copy(&repository().join("agv/service").join(name), &root.join(place))?;
    }
    Ok(())
}

/// The vehicle's image of each board, and the map of its memory.
fn images(folder: &Path) -> anyhow::Result<()> {
    for board in BOARDS {
        copy(&board.image("vehicle")?, &folder.join(board.feature).join("vehicle.elf"))?;
        // As the firmware's build script chooses it.
        let own = repository().join("firmware/src/board").join(board.feature).join("memory.x");
        let map = if own.exists() { own } else { repository().join("memory.x") };
        copy(&map, &folder.join(board.feature).join("memory.x"))?;
    }
    Ok(())
}

/// When the sources were committed, s since 1970: the time of every file, so that the same sources give the same bytes.
fn epoch() -> anyhow::Result<String> {
    if let Ok(epoch) = std::env::var("SOURCE_DATE_EPOCH") {
        return Ok(epoch);
    }
    let said = output(Command::new("git").args(["log", "-1", "--format=%ct"]))?;
    Ok(String::from_utf8(said)?.trim().to_owned())
}

fn make(folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())
}

fn write(path: &Path, content: &[u8]) -> anyhow::Result<()> {
    make(path.parent().unwrap_or(path))?;
    std::fs::write(path, content).with_context(|| path.display().to_string())
}

fn copy(from: &Path, to: &Path) -> anyhow::Result<()> {
    make(to.parent().unwrap_or(to))?;
    std::fs::copy(from, to).with_context(|| from.display().to_string())?;
    Ok(())
}

fn output(command: &mut Command) -> anyhow::Result<Vec<u8>> {
    let name = format!("{command:?}");
    let output = command.current_dir(repository()).output().with_context(|| name.clone())?;
    if !output.status.success() {
        bail!("{name}: {}", String::from_utf8_lossy(&output.stderr).trim());
    }
    Ok(output.stdout)
}

fn run(command: &mut Command) -> anyhow::Result<()> {
    let name = format!("{command:?}");
    if !command.current_dir(repository()).status().with_context(|| name.clone())?.success() {
        bail!("{name} failed");
    }
    Ok(())
}
