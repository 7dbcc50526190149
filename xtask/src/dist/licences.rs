//! The licences of what a program is built on, which go wherever the program goes.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use anyhow::Context;
use serde_json::Value;

use super::{cargo, output};
use crate::firmware::image::TARGET;

/// Licences of the packages in the command and in the vehicle's image, each text once, under the packages that state it.
pub fn of_program() -> anyhow::Result<String> {
    const COMMAND: &[&str] = &["--package", "agv", "--features", "full"];
    const IMAGE: &[&str] = &["--package", "agv-firmware", "--features", "h743", "--target", TARGET];
    let mut used = Vec::new();
    for of in [COMMAND, IMAGE] {
        let mut tree = cargo();
        tree.args(["tree", "--edges", "normal", "--prefix", "none", "--no-dedupe", "--format", "{p}"]).args(of);
        let listed = String::from_utf8(output(&mut tree)?)?;
        used.extend(listed.lines().filter_map(name_and_version));
    }
    used.sort_unstable();
    used.dedup();
    let mut metadata = cargo();
    metadata.args(["metadata", "--format-version", "1", "--all-features"]);
    // Packages of other systems need not be there.
    for target in [&format!("{}-unknown-linux-gnu", std::env::consts::ARCH), TARGET] {
        metadata.args(["--filter-platform", target]);
    }
    let metadata = output(&mut metadata)?;
    let metadata: Value = serde_json::from_slice(&metadata)?;
    let packages = metadata["packages"].as_array().context("cargo metadata lists no packages")?;
    text(packages.iter().filter(|package| {
        let is_used = |(name, version): &(String, String)| package["name"] == **name && package["version"] == **version;
        !package["source"].is_null() && used.iter().any(is_used)
    }))
}

/// `name v1.2.3 (...)`, as `cargo tree` writes it.
fn name_and_version(line: &str) -> Option<(String, String)> {
    let mut words = line.split_whitespace();
    Some((words.next()?.to_owned(), words.next()?.strip_prefix('v')?.to_owned()))
}

fn text<'a>(packages: impl Iterator<Item = &'a Value>) -> anyhow::Result<String> {
    let mut list = String::new();
    let mut texts: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for package in packages {
        let name = format!(
            "{} {}",
            package["name"].as_str().unwrap_or_default(),
            package["version"].as_str().unwrap_or_default()
        );
        let stated = package["license"].as_str().unwrap_or("as its file says");
        let _ = writeln!(list, "{name}: {stated}");
        let manifest = Path::new(package["manifest_path"].as_str().unwrap_or_default());
        for text in files(manifest.parent().unwrap_or(manifest))? {
            texts.entry(text).or_default().push(name.clone());
        }
    }
    let mut groups: Vec<_> = texts.into_iter().map(|(text, names)| (names, text)).collect();
    groups.sort();
    for (names, text) in groups {
        let _ = write!(list, "\n{}\n{}\n\n{}\n", "-".repeat(80), names.join(", "), text.trim_end());
    }
    Ok(list)
}

/// The texts of licences in a folder, by the names of their files.
fn files(folder: &Path) -> anyhow::Result<Vec<String>> {
    let entries = std::fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let mut paths: Vec<_> = entries.map(|entry| entry.map(|entry| entry.path())).collect::<Result<_, _>>()?;
    paths.sort();
    let is_licence = |path: &Path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_uppercase();
        path.is_file()
            && ["LICEN", "COPYING", "NOTICE", "COPYRIGHT", "UNLICENSE"].iter().any(|start| name.starts_with(start))
    };
    paths.retain(|path| is_licence(path));
    let texts = paths.iter().map(|path| std::fs::read(path).with_context(|| path.display().to_string()));
    texts.map(|text| Ok(String::from_utf8_lossy(&text?).replace('\r', ""))).collect()
}
