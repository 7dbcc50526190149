//! The Debian package.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, bail};
use object::{Object as _, ObjectSection as _};

use super::{VERSION, copy, output, run, write};
use crate::repository;

const MAINTAINER: &str = "The project's builders <agv@localhost>";

/// What the package does beside its files: the service's user comes, and the service ends with its program.
const SCRIPTS: [&str; 3] = ["postinst", "prerm", "postrm"];

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
    write(&doc.join("copyright"), copyright(&doc)?.as_bytes())?;
    write(&doc.join("changelog"), changelog(epoch)?.as_bytes())?;
    compress(&[doc.join("changelog")])?;
    compress(&files(&usr.join("share/man/man1"))?)?;
    write(&usr.join("share/lintian/overrides/agv"), OVERRIDES.as_bytes())?;
    let libc = libc(&usr.join("bin/agv"))?;
    let folder = root.with_file_name("package");
    let size = output(Command::new("du").args(["--summarize", "--apparent-size", "--block-size=1024"]).arg(&usr))?;
    let size = String::from_utf8(size)?.split_whitespace().next().unwrap_or("0").to_owned();
    write(&folder.join("DEBIAN/control"), control(architecture, &size, &libc).as_bytes())?;
    for script in SCRIPTS {
        copy(&repository().join("agv/service").join(script), &folder.join("DEBIAN").join(script))?;
    }
    let package = root.with_file_name(format!("agv_{VERSION}_{architecture}.deb"));
    run(Command::new("chmod").args(["--recursive", "u+rwX,go+rX,go-w"]).arg(&folder))?;
    run(Command::new("chmod").arg("0755").args(SCRIPTS.map(|script| folder.join("DEBIAN").join(script))))?;
    run(Command::new("dpkg-deb")
        .args(["--root-owner-group", "-Zgzip", "-z6", "--build"])
        .arg(&folder)
        .arg(&package)
        .env("SOURCE_DATE_EPOCH", epoch))?;
    std::fs::remove_dir_all(&folder).context("target/dist/package cannot be removed")?;
    Ok(package)
}

/// What lintian takes for errors, and why it is none.
const OVERRIDES: &str = "\
# Who distributes the package states an address; nobody here can be asked by mail.
agv: bogus-mail-host *
agv: bogus-mail-host-in-debian-changelog *
# A translation of libyaml into Rust, of which Debian has no library.
agv: embedded-library *libyaml*
";

fn compress(files: &[PathBuf]) -> anyhow::Result<()> {
    run(Command::new("gzip").args(["-9", "--no-name"]).args(files))
}

/// The files of a folder, in the order of their names.
fn files(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let mut files = entries.map(|entry| Ok(entry?.path())).collect::<anyhow::Result<Vec<_>>>()?;
    files.sort();
    Ok(files)
}

/// What Debian's tools read of the versions; people read `CHANGELOG.md`.
fn changelog(epoch: &str) -> anyhow::Result<String> {
    let date = output(Command::new("date").args(["--utc", "--rfc-email", "--date"]).arg(format!("@{epoch}")))?;
    let date = String::from_utf8(date)?;
    Ok(format!(
        "agv ({VERSION}) unstable; urgency=medium\n\n  * What has changed is in CHANGELOG.md.\n\n -- {MAINTAINER}  {}\n",
        date.trim()
    ))
}

/// Who may do what with the package. Debian has the text of the Apache licence once for all packages.
fn copyright(doc: &Path) -> anyhow::Result<String> {
    let mit = std::fs::read_to_string(doc.join("LICENSE-MIT")).context("LICENSE-MIT")?;
    Ok(format!(
        "Either of the two licences below, as you like. What the program is built on has the licences that stand in\n\
         LICENSES-OF-OTHERS.\n\n{mit}\n\
         Apache License, Version 2.0: see /usr/share/common-licenses/Apache-2.0.\n"
    ))
}

/// The version of the C library that a program asks for: its symbols have the names of the versions that brought them.
fn libc(program: &Path) -> anyhow::Result<String> {
    let bytes = std::fs::read(program).with_context(|| program.display().to_string())?;
    let file = object::File::parse(&*bytes).with_context(|| program.display().to_string())?;
    let names = file.section_by_name(".dynstr").context("the program has no names of symbols")?.data()?;
    let names = names.split(|byte| *byte == 0).filter_map(|name| std::str::from_utf8(name).ok());
    let version = |name: &str| -> Option<Vec<u32>> {
        name.strip_prefix("GLIBC_")?.split('.').map(|number| number.parse().ok()).collect()
    };
    let newest = names.filter_map(version).max().context("the program asks for no version of the C library")?;
    Ok(newest.iter().map(u32::to_string).collect::<Vec<_>>().join("."))
}

fn control(architecture: &str, size: &str, libc: &str) -> String {
    format!(
        "Package: agv\nVersion: {VERSION}\nArchitecture: {architecture}\nMaintainer: {MAINTAINER}\n\
         Installed-Size: {size}\nDepends: libc6 (>= {libc}), libgcc-s1\nSection: science\nPriority: optional\n\
         Description: Localisation of automated guided vehicles\n \
         Replays, simulates, calibrates and measures the localisation controller of an\n \
         automated guided vehicle, and speaks with its sensors and with the controller.\n"
    )
}
