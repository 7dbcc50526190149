//! The Python of the tests: an environment of the project's own, so that it does not matter whose `python3` is on the path.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::{debian, install, succeeds};
use crate::repository;

/// A package, and the module that it brings.
type Package = (&'static str, &'static str);

/// What the emulated chip stands on.
const CHIP: [Package; 2] = [
    // The processor; under the GPL, so in a process of its own.
    ("unicorn>=2.1.4,<2.2", "unicorn"),
    // The file that is flashed.
    ("pyelftools>=0.31,<1", "elftools"),
];

/// It asks for an older `rosbags` than others do, and works without; so it is installed before them.
const OUSTER: Package = ("ouster-sdk>=1,<2", "ouster.sdk");

const PACKAGES: [Package; 14] = [
    CHIP[0],
    CHIP[1],
    ("numpy>=1.24,<3", "numpy"),
    ("scipy>=1.10,<2", "scipy"),
    ("shapely>=2,<3", "shapely"),
    ("cantools>=39,<50", "cantools"),
    ("canopen>=2.2,<3", "canopen"),
    // Says whether the description file of the controller's node is one.
    ("eds-utils>=0.3.1,<1", "eds_utils"),
    ("mcap>=1.2,<2", "mcap"),
    ("mcap-ros2-support>=0.5,<1", "mcap_ros2"),
    ("rosbags>=0.10,<1", "rosbags"),
    ("evo>=1.30,<2", "evo"),
    ("velodyne-decoder>=3.1,<4", "velodyne_decoder"),
    (include_str!("../../../lab/ray/requirements.txt").trim_ascii(), "ray"),
];

/// Debian's own, for machines whose first `python3` cannot make environments.
const DEBIAN: &str = "/usr/bin/python3";

fn folder() -> PathBuf {
    repository().join("target/python")
}

/// The Python of the environment.
pub fn interpreter() -> PathBuf {
    folder().join("bin/python3")
}

/// Makes the environment. Returns what is still missing, one line each.
pub fn prepare() -> Vec<String> {
    let had_ouster = has(&interpreter(), OUSTER.1);
    let mut missing = install_all(&[OUSTER]);
    if !had_ouster {
        // What it has put in the place of newer ones is replaced; what cannot be had is told below.
        let _ = pip(&interpreter(), &PACKAGES.map(|(package, _)| package));
    }
    missing.extend(install_all(&PACKAGES));
    missing
}

/// The same for the emulated chip alone.
pub fn prepare_chip() -> Vec<String> {
    install_all(&CHIP)
}

fn install_all(packages: &[Package]) -> Vec<String> {
    let (folder, python) = (folder(), interpreter());
    let is_missing = |(_, module): &&Package| !has(&python, module);
    let missing: Vec<&str> = packages.iter().filter(is_missing).map(|(package, _)| *package).collect();
    if missing.is_empty() {
        return Vec::new();
    }
    if !has(&python, "pip")
        && let Err(why) = make(&folder)
    {
        return vec![format!("missing: Python for the tests; install the Debian package python3-venv: {why}")];
    }
    eprintln!("installing {} into {}", missing.join(" "), folder.display());
    // Installed together they agree about what they share. If one cannot be had, the others are installed all the same.
    let _ = pip(&python, &missing);
    let still_missing = packages.iter().filter(is_missing);
    still_missing
        .filter_map(|package @ (name, _)| {
            let why = pip(&python, &[name]).err().unwrap_or_else(|| "it cannot be imported".to_owned());
            is_missing(&package).then(|| format!("missing: {name} in {}: {why}", folder.display()))
        })
        .collect()
}

fn has(python: &Path, module: &str) -> bool {
    succeeds(Command::new(python).args(["-c", &format!("import {module}")]))
}

fn make(folder: &Path) -> Result<(), String> {
    let venv = |python: &Path| install(Command::new(python).args(["-m", "venv", "--clear"]).arg(folder));
    let first = PathBuf::from("python3");
    venv(&first).or_else(|why| {
        debian::install("python3-venv").map_err(|debian| format!("{why}\n{debian}"))?;
        venv(Path::new(DEBIAN))
    })
}

fn pip(python: &Path, packages: &[&str]) -> Result<(), String> {
    let arguments = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"];
    install(Command::new(python).args(arguments).args(packages))
}
