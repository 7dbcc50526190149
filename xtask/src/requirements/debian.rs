//! Packages of Debian.

use std::process::Command;
use std::sync::Once;

use super::succeeds;

/// How long to wait for another installation to end, s.
const LOCK_TIMEOUT: &str = "DPkg::Lock::Timeout=600";

/// Installs a package, or a newer one than is there, if this is Debian and this user may.
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
    // A new machine has no list of packages yet, or an old one, which names packages that are gone or too old.
    static UPDATED: Once = Once::new();
    UPDATED.call_once(|| {
        if let Err(why) = apt(&["update"]) {
            eprintln!("the list of packages stays as it is: {why}");
        }
    });
    apt(&["install", "--yes", "--no-install-recommends", package])
}

fn is_root() -> bool {
    Command::new("id").arg("-u").output().is_ok_and(|output| output.stdout.trim_ascii() == b"0")
}
