//! Programs of others that the tests call.

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

const REQUIREMENTS: [Requirement; 1] = [Requirement {
    purpose: "the script that scores keypoints apart from this program",
    probe: &["python3", "-c", "import numpy, scipy, shapely"],
    packages: &["python3", "python3-numpy", "python3-scipy", "python3-shapely"],
}];

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
    if is_root() && succeeds(Command::new("apt-get").arg("--version")) {
        eprintln!("installing {}", packages.join(" "));
        let install = |arguments: &[&str]| {
            succeeds(Command::new("apt-get").args(arguments).env("DEBIAN_FRONTEND", "noninteractive"))
        };
        let options = ["install", "--yes", "--no-install-recommends"];
        if !install(&[&options[..], &packages].concat()) {
            install(&["update"]);
            install(&[&options[..], &packages].concat());
        }
    }
    let still_missing = missing.iter().filter(|requirement| !requirement.is_met());
    still_missing
        .map(|requirement| {
            let packages = requirement.packages.join(" ");
            format!("missing: {}; install the Debian packages {packages}", requirement.purpose)
        })
        .collect()
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
