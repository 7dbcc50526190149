//! The package of Node that drives a browser.

use std::process::Command;

use super::{install, succeeds};
use crate::repository;

const PACKAGE: &str = "playwright-core@1";

/// Puts the package into a folder of the project's own. Returns what is still missing, one line each.
pub fn prepare() -> Vec<String> {
    let folder = repository().join("target/node");
    let is_there = || {
        let modules = folder.join("node_modules");
        succeeds(Command::new("node").args(["-e", "require('playwright-core')"]).env("NODE_PATH", modules))
    };
    if is_there() {
        return Vec::new();
    }
    eprintln!("installing {PACKAGE} into {}", folder.display());
    let arguments = ["install", "--no-audit", "--no-fund", "--silent", "--prefix"];
    let why = install(Command::new("npm").args(arguments).arg(&folder).arg(PACKAGE)).err();
    if is_there() {
        return Vec::new();
    }
    let why = why.unwrap_or_else(|| "it was installed, and is not found".to_owned());
    vec![format!("missing: what drives the browser of the tests, {PACKAGE} from npm: {why}")]
}
