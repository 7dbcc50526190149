//! Archives whose bytes depend on nothing but their files.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::Context;

use super::{output, run, write};

/// Packs a folder into `NAME.tar.gz` beside it: names in order, one time, nobody's files.
pub fn pack(root: &Path, epoch: &str) -> anyhow::Result<PathBuf> {
    let name = root.file_name().context("the folder has no name")?;
    let parent = root.parent().context("the folder is nowhere")?;
    let tar = root.with_file_name(format!("{}-{}-linux.tar", name.to_string_lossy(), std::env::consts::ARCH));
    run(Command::new("tar")
        .args(["--sort=name", "--owner=0", "--group=0", "--numeric-owner", "--mode=u+rwX,go+rX,go-w", "--format=gnu"])
        .arg(format!("--mtime=@{epoch}"))
        .arg("--directory")
        .arg(parent)
        .arg("--create")
        .arg("--file")
        .arg(&tar)
        .arg(name))?;
    run(Command::new("gzip").args(["--no-name", "--force"]).arg(&tar))?;
    let mut packed = tar.into_os_string();
    packed.push(".gz");
    Ok(packed.into())
}

/// Writes `SHA256SUMS` of all files in a folder, and of those in folders below it down to `depth`, as `sha256sum --check`
/// reads it.
pub fn write_checksums(folder: &Path, depth: usize) -> anyhow::Result<()> {
    let find = format!("find . -maxdepth {depth} -type f ! -name SHA256SUMS -print0");
    let script = format!("cd '{}' && {find} | LC_ALL=C sort -z | xargs -0 sha256sum", folder.display());
    let sums = output(Command::new("sh").arg("-c").arg(script))?;
    write(&folder.join("SHA256SUMS"), &sums)
}
