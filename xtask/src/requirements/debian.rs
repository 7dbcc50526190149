//! Packages of Debian.

use std::process::Command;

use super::succeeds;

/// How long to wait for another installation to end, s.
const LOCK_TIMEOUT: &str = "DPkg::Lock::Timeout=600";

/// Installs a package, if this is Debian and this user may.
///
/// # Errors
/// Why it is not installed.
pub fn install(package: &str) -> Result<(), String> {
    if !succeeds(Command::new("apt-get").arg("--version")) {
        return Err("there is no apt-get".to_owned());
    }
    if !is_root() {
        return Err("only root may install packages".to_owned());
    }
    eprintln!("installing {package}");
    let apt = |arguments: &[&str]| {
        let mut command = Command::new("apt-get");
        command.args(["-o", LOCK_TIMEOUT]).args(arguments).env("DEBIAN_FRONTEND", "noninteractive");
        super::install(&mut command)
    };
    let options = ["install", "--yes", "--no-install-recommends", package];
    // A new machine has no list of packages yet, or an old one.
    apt(&options).or_else(|_| apt(&["update"]).and_then(|()| apt(&options)))
}

fn is_root() -> bool {
    Command::new("id").arg("-u").output().is_ok_and(|output| output.stdout.trim_ascii() == b"0")
}
