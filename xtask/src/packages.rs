//! Programs of others that the tests call.

use std::path::Path;
use std::process::{Command, Stdio};

/// One thing that must be there.
struct Requirement {
    /// What needs it.
    purpose: &'static str,
    /// A command that succeeds if it is there.
    probe: &'static [&'static str],
    /// Debian packages that bring it.
    packages: &'static [&'static str],
}

const REQUIREMENTS: [Requirement; 4] = [
    Requirement {
        purpose: "the firmware in emulation",
        probe: &["qemu-system-arm", "--version"],
        packages: &["qemu-system-arm"],
    },
    Requirement {
        purpose: "the script that scores keypoints apart from this program",
        probe: &["python3", "-c", "import numpy, scipy, shapely"],
        packages: &["python3", "python3-numpy", "python3-scipy", "python3-shapely"],
    },
    Requirement {
        purpose: "the tests in a browser, and reports as PDF",
        probe: &["sh", "-c", "(command -v chromium || command -v \"$CHROMIUM\") && command -v node && command -v npm"],
        packages: &["chromium", "nodejs", "npm"],
    },
    // A kernel with CAN in an ordinary process, for machines whose own kernel has none.
    Requirement {
        purpose: "the tests on a real CAN stack",
        probe: &["sh", "-c", "command -v linux.uml && command -v candump && command -v insmod && command -v ip"],
        packages: &["user-mode-linux", "kmod", "iproute2", "can-utils"],
    },
];

/// Packages of Python that Debian does not have, and the modules that they bring.
const PYTHON_PACKAGES: [(&str, &str); 8] = [
    ("cantools>=39,<50", "cantools"),
    ("canopen>=2.2,<3", "canopen"),
    ("mcap>=1.2,<2", "mcap"),
    ("mcap-ros2-support>=0.5,<1", "mcap_ros2"),
    ("rosbags>=0.10,<1", "rosbags"),
    ("evo>=1.30,<2", "evo"),
    ("velodyne-decoder>=3.1,<4", "velodyne_decoder"),
    (include_str!("../../host-sim/ray/requirements.txt").trim_ascii(), "ray"),
];

/// What drives a browser, from npm.
const NODE_PACKAGE: &str = "playwright-core@1";

/// Puts the Python packages into `folder`. Returns what is still missing, one line each.
pub fn prepare_python(folder: &Path) -> Vec<String> {
    let modules: Vec<&str> = PYTHON_PACKAGES.iter().map(|(_, module)| *module).collect();
    let is_there = || {
        let import = format!("import {}", modules.join(", "));
        succeeds(Command::new("python3").args(["-c", &import]).env("PYTHONPATH", folder))
    };
    if is_there() {
        return Vec::new();
    }
    let packages = PYTHON_PACKAGES.map(|(package, _)| package);
    eprintln!("installing {} into {}", packages.join(" "), folder.display());
    let install = || {
        let arguments = ["-m", "pip", "install", "--quiet", "--target"];
        succeeds(Command::new("python3").args(arguments).arg(folder).args(packages))
    };
    if !install() && is_root() {
        let arguments = ["install", "--yes", "--no-install-recommends", "python3-pip"];
        succeeds(Command::new("apt-get").args(arguments).env("DEBIAN_FRONTEND", "noninteractive"));
        install();
    }
    if is_there() {
        return Vec::new();
    }
    vec![format!(
        "missing: the independent readers of what this program reads and writes; install them with `python3 -m pip install --target {} {}`",
        folder.display(),
        packages.map(|package| format!("'{package}'")).join(" ")
    )]
}

/// Puts the package of Node into `folder`. Returns what is still missing, one line each.
pub fn prepare_node(folder: &Path) -> Vec<String> {
    let is_there = || {
        let modules = folder.join("node_modules");
        succeeds(Command::new("node").args(["-e", "require('playwright-core')"]).env("NODE_PATH", modules))
    };
    if is_there() {
        return Vec::new();
    }
    eprintln!("installing {NODE_PACKAGE} into {}", folder.display());
    let arguments = ["install", "--no-audit", "--no-fund", "--silent", "--prefix"];
    succeeds(Command::new("npm").args(arguments).arg(folder).arg(NODE_PACKAGE));
    if is_there() {
        return Vec::new();
    }
    vec![format!(
        "missing: what drives the browser of the tests; install it with `npm install --prefix {} {NODE_PACKAGE}`",
        folder.display()
    )]
}

impl Requirement {
    fn is_met(&self) -> bool {
        let [program, arguments @ ..] = self.probe else { return true };
        succeeds(Command::new(program).args(arguments))
    }
}

/// Installs what is missing, if this user may. Returns what is still missing, one line each.
pub fn prepare() -> Vec<String> {
    let missing: Vec<&Requirement> = REQUIREMENTS.iter().filter(|requirement| !requirement.is_met()).collect();
    if missing.is_empty() {
        return Vec::new();
    }
    let packages: Vec<&str> = missing.iter().flat_map(|requirement| requirement.packages).copied().collect();
    install(&packages);
    let still_missing = missing.iter().filter(|requirement| !requirement.is_met());
    still_missing
        .map(|requirement| {
            let packages = requirement.packages.join(" ");
            format!("missing: {}; install the Debian packages {packages}", requirement.purpose)
        })
        .collect()
}

/// Installs Debian packages, if this is Debian and this user may.
pub fn install(packages: &[&str]) {
    if !(is_root() && succeeds(Command::new("apt-get").arg("--version"))) {
        return;
    }
    eprintln!("installing {}", packages.join(" "));
    let install =
        |arguments: &[&str]| succeeds(Command::new("apt-get").args(arguments).env("DEBIAN_FRONTEND", "noninteractive"));
    let options = ["install", "--yes", "--no-install-recommends"];
    if !install(&[&options[..], packages].concat()) {
        install(&["update"]);
        install(&[&options[..], packages].concat());
    }
}

fn is_root() -> bool {
    Command::new("id").arg("-u").output().is_ok_and(|output| output.stdout.trim_ascii() == b"0")
}

fn succeeds(command: &mut Command) -> bool {
    command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}
