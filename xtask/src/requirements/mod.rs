//! Programs of others that the tests call: each is looked for, installed if it is missing, and named if it cannot be.

pub mod debian;
mod node;
mod packages;
mod programs;
mod python;

use std::process::{Command, Stdio};

pub use programs::prepare_emulator;
pub use python::{interpreter as python, prepare_chip};

/// Installs whatever is missing, each apart, so that one that cannot be had keeps no other from being installed. Returns
/// what is still missing, one line each.
pub fn prepare() -> Vec<String> {
    let mut missing = programs::prepare();
    missing.extend(python::prepare());
    missing.extend(node::prepare());
    missing.extend(packages::prepare());
    missing
}

/// Whether a command can be started and ends well; what it prints is not shown.
fn succeeds(command: &mut Command) -> bool {
    command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}

/// Lines of a failed installation that are shown: the last ones say why.
const SHOWN: usize = 12;

/// Runs a command that installs something.
///
/// # Errors
/// Why it failed: the last lines that it printed.
fn install(command: &mut Command) -> Result<(), String> {
    let program = command.get_program().to_string_lossy().into_owned();
    let output = command.stdin(Stdio::null()).output().map_err(|error| format!("{program}: {error}"))?;
    if output.status.success() {
        return Ok(());
    }
    let printed = [output.stdout, output.stderr].concat();
    let printed = String::from_utf8_lossy(&printed);
    let lines: Vec<&str> = printed.lines().filter(|line| !line.trim().is_empty()).collect();
    let shown = lines[lines.len().saturating_sub(SHOWN)..].join("\n  ");
    Err(format!("{program} ended with {}:\n  {shown}", output.status))
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use super::{install, succeeds};

    #[test]
    fn a_failed_installation_says_why() {
        let why = install(Command::new("sh").args(["-c", "echo begun; echo no such package >&2; exit 3"])).unwrap_err();
        assert!(why.contains("no such package") && why.contains('3'), "{why}");
        let why = install(&mut Command::new("no-such-program-anywhere")).unwrap_err();
        assert!(why.contains("no-such-program-anywhere"), "{why}");
        assert!(install(&mut Command::new("true")).is_ok());
    }

    #[test]
    fn a_program_that_is_not_there_does_not_succeed() {
        assert!(!succeeds(&mut Command::new("no-such-program-anywhere")));
        assert!(succeeds(&mut Command::new("true")));
    }
}
