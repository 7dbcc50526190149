//! `cargo xtask audit`.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, bail};

use crate::firmware::image::{AN500, H743, TARGET};
use crate::repository;

/// Check licences, sources, bans and advisories of all dependencies, and write what every program is made of
#[derive(clap::Args)]
pub struct Audit {}

/// A program, and how its dependencies are chosen.
struct Program {
    /// Name of its bill of materials.
    name: &'static str,
    /// Folder of its package.
    package: &'static str,
    /// Its features.
    features: &'static str,
    /// What it is built for; the machine that runs this if None.
    target: Option<&'static str>,
}

const PROGRAMS: [Program; 3] = [
    Program { name: "firmware-h743", package: "firmware", features: H743.feature, target: Some(TARGET) },
    Program { name: "firmware-an500", package: "firmware", features: AN500.feature, target: Some(TARGET) },
    Program { name: "agv", package: "agv", features: "", target: None },
];

/// Version of CycloneDX.
const SPECIFICATION: &str = "1.5";

impl Audit {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        install("cargo-deny", &["deny", "--version"])?;
        install("cargo-cyclonedx", &["cyclonedx", "--version"])?;
        let folder = repository().join("target/sbom");
        std::fs::create_dir_all(&folder).context("target/sbom cannot be made")?;
        for program in &PROGRAMS {
            let count = program.write(&folder)?;
            println!("target/sbom/{}.cdx.json: {count} components", program.name);
        }
        // Everything else is checked even if the advisories are not there.
        let is_ok = succeeds(deny(&["check", "licenses", "bans", "sources"]))?;
        let is_sound = if succeeds(quiet(deny(&["fetch", "db"])))? {
            succeeds(deny(&["--offline", "check", "advisories"]))?
        } else {
            println!("advisories were not checked: their database cannot be fetched");
            true
        };
        if !(is_ok && is_sound) {
            bail!("cargo-deny has found something");
        }
        Ok(())
    }
}

fn cargo(arguments: &[&str]) -> Command {
    let mut command = Command::new("cargo");
    command.args(arguments).current_dir(repository());
    command
}

fn deny(arguments: &[&str]) -> Command {
    let mut command = cargo(&["deny"]);
    command.args(arguments);
    command
}

fn quiet(mut command: Command) -> Command {
    command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::null());
    command
}

fn succeeds(mut command: Command) -> anyhow::Result<bool> {
    Ok(command.status().context("cargo cannot be started")?.success())
}

/// Installs a command of cargo if it is not there.
fn install(package: &str, probe: &[&str]) -> anyhow::Result<()> {
    let is_there = || quiet(cargo(probe)).status().is_ok_and(|status| status.success());
    let is_ready = is_there() || (succeeds(cargo(&["install", "--locked", package]))? && is_there());
    if !is_ready {
        bail!("{package} is missing; `cargo install --locked {package}` brings it");
    }
    Ok(())
}

impl Program {
    /// Writes the bill of materials into `folder`; gives how many components it has.
    fn write(&self, folder: &Path) -> anyhow::Result<usize> {
        // The tool writes one file beside every manifest of the workspace.
        let name = "agv-bill-of-materials";
        let manifest = repository().join(self.package).join("Cargo.toml");
        let mut command = cargo(&["cyclonedx", "--quiet", "--format", "json", "--spec-version", SPECIFICATION]);
        command.args(["--override-filename", name, "--manifest-path"]).arg(manifest);
        if !self.features.is_empty() {
            command.args(["--features", self.features]);
        }
        if let Some(target) = self.target {
            command.args(["--target", target]);
        }
        // The same commit gives the same file.
        if let Some(time) = commit_time() {
            command.env("SOURCE_DATE_EPOCH", time);
        }
        let is_written = succeeds(command)?;
        let mut text = None;
        for package in packages()? {
            let file = package.join(format!("{name}.json"));
            if package.ends_with(self.package) {
                text = std::fs::read_to_string(&file).ok();
            }
            let _ = std::fs::remove_file(file);
        }
        let Some(text) = text.filter(|_| is_written) else { bail!("cargo-cyclonedx has failed for {}", self.name) };
        // Where this checkout lies says nothing to others.
        let text = text.replace(&repository().display().to_string(), "");
        std::fs::write(folder.join(format!("{}.cdx.json", self.name)), &text)?;
        let bill: serde_json::Value = serde_json::from_str(&text).context("a bill of materials cannot be read")?;
        Ok(bill["components"].as_array().map_or(0, Vec::len))
    }
}

/// When the present commit was made, in seconds since 1970.
fn commit_time() -> Option<String> {
    let mut git = Command::new("git");
    let output = git.args(["log", "-1", "--format=%ct"]).current_dir(repository()).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// The folders of the workspace's packages.
fn packages() -> anyhow::Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(repository()).context("the repository cannot be read")?;
    let folders = entries.filter_map(Result::ok).map(|entry| entry.path());
    Ok(folders.filter(|folder| folder.join("Cargo.toml").exists()).collect())
}
