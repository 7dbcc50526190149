//! The command `agv` as people run it, and files for it.
#![allow(dead_code, reason = "each test file uses a part")]

use std::process::{Command, Output};

/// A pose graph of two scans.
pub const GRAPH: &str = "VERTEX2 0 0 0 0
ROBOTLASER1 0 -1.57 3.14 1.57 50 0.1 0 3 1.5 2.5 3.5 0 0 0 0 0 0 0 0 0 0 0 0 10.5 host 0.5
VERTEX2 1 1 0 0.5
ROBOTLASER1 0 -1.57 3.14 1.57 50 0.1 0 3 1.5 2.5 3.5 0 0 0 0 0 0 0 0 0 0 0 0 11.5 host 1.5
EDGE2 0 1 1 0 0.5 1 0 1 1 0 0
";

pub fn agv(arguments: &[&str]) -> Output {
    // A backtrace would be more than one line.
    Command::new(env!("CARGO_BIN_EXE_agv")).args(arguments).env("RUST_BACKTRACE", "1").output().unwrap()
}

pub fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

/// Runs a command that must refuse its input, and gives the one line that says why.
pub fn refusal(arguments: &[&str]) -> String {
    let output = agv(arguments);
    let complaint = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {complaint}");
    assert!(output.stdout.is_empty(), "{arguments:?} printed results");
    assert!(complaint.starts_with("agv: ") && complaint.ends_with('\n'), "{arguments:?}: {complaint}");
    assert_eq!(complaint.lines().count(), 1, "{arguments:?}: {complaint}");
    complaint.to_owned()
}

pub struct Files {
    folder: tempfile::TempDir,
}

impl Files {
    pub fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    pub fn path(&self, name: &str) -> String {
        self.folder.path().join(name).to_str().unwrap().to_owned()
    }

    pub fn write(&self, name: &str, content: &[u8]) -> String {
        std::fs::write(self.folder.path().join(name), content).unwrap();
        self.path(name)
    }

    /// The folder itself.
    pub fn folder(&self) -> String {
        self.folder.path().to_str().unwrap().to_owned()
    }
}

/// The keys of all objects in a JSON value.
pub fn json_keys(value: &serde_json::Value) -> Vec<String> {
    match value {
        serde_json::Value::Object(entries) => {
            entries.iter().flat_map(|(key, value)| [vec![key.clone()], json_keys(value)].concat()).collect()
        }
        serde_json::Value::Array(entries) => entries.iter().flat_map(json_keys).collect(),
        _ => Vec::new(),
    }
}
