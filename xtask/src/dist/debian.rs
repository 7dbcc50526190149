//! The Debian package.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, bail};

use super::{VERSION, copy, output, run, write};

/// Packs the tree of the archive as a package that installs below `/usr`.
pub fn pack(root: &Path, epoch: &str) -> anyhow::Result<PathBuf> {
    let architecture = match std::env::consts::ARCH {
        "x86_64" => "amd64",
        "aarch64" => "arm64",
        other => bail!("there is no name of Debian for {other}"),
    };
    let tree = root.with_file_name("debian");
    run(Command::new("cp").args(["--recursive"]).arg(root).arg(&tree).env("LC_ALL", "C"))?;
    let usr = root.with_file_name("package/usr");
    std::fs::create_dir_all(usr.parent().unwrap_or(&usr)).context("target/dist/package cannot be made")?;
    std::fs::rename(&tree, &usr).context("target/dist/package cannot be made")?;
    let sums = usr.join("SHA256SUMS");
    std::fs::remove_file(&sums).with_context(|| sums.display().to_string())?;
    let doc = usr.join("share/doc/agv");
    copy(&doc.join("LICENSE-MIT"), &doc.join("copyright"))?;
    let folder = root.with_file_name("package");
    let size = output(Command::new("du").args(["--summarize", "--apparent-size", "--block-size=1024"]).arg(&usr))?;
    let size = String::from_utf8(size)?.split_whitespace().next().unwrap_or("0").to_owned();
    write(&folder.join("DEBIAN/control"), control(architecture, &size).as_bytes())?;
    let package = root.with_file_name(format!("agv_{VERSION}_{architecture}.deb"));
    run(Command::new("chmod").args(["--recursive", "u+rwX,go+rX,go-w"]).arg(&folder))?;
    run(Command::new("dpkg-deb")
        .args(["--root-owner-group", "-Zgzip", "--build"])
        .arg(&folder)
        .arg(&package)
        .env("SOURCE_DATE_EPOCH", epoch))?;
    std::fs::remove_dir_all(&folder).context("target/dist/package cannot be removed")?;
    Ok(package)
}

fn control(architecture: &str, size: &str) -> String {
    format!(
        "Package: agv\nVersion: {VERSION}\nArchitecture: {architecture}\nMaintainer: The project's builders <agv@localhost>\n\
         Installed-Size: {size}\nDepends: libc6, libgcc-s1\nSection: science\nPriority: optional\n\
         Description: Localisation of automated guided vehicles\n \
         Replays, simulates, calibrates and measures the localisation controller of an\n \
         automated guided vehicle, and speaks with its sensors and with the controller.\n"
    )
}
