//! Running an import and looking at how it ended.

use serde_json::Value;

use crate::support::{agv, text};

/// What an import said.
#[derive(Debug)]
pub struct Ended {
    pub code: Option<i32>,
    pub summary: Value,
    pub complaint: String,
}

impl Ended {
    /// Runs a command that prints JSON.
    pub fn of(arguments: &[&str]) -> Self {
        let output = agv(&[arguments, &["--json"]].concat());
        let summary = serde_json::from_slice(&output.stdout).unwrap_or(Value::Null);
        Self { code: output.status.code(), summary, complaint: text(&output.stderr).to_owned() }
    }

    pub fn count(&self, key: &str) -> u64 {
        self.summary[key].as_u64().unwrap_or_else(|| panic!("no {key} in {self:?}"))
    }

    pub fn number(&self, key: &str) -> f64 {
        self.summary[key].as_f64().unwrap_or_else(|| panic!("no {key} in {self:?}"))
    }

    pub fn warnings(&self) -> Vec<String> {
        let warnings = self.summary["warnings"].as_array();
        warnings.into_iter().flatten().filter_map(|one| one.as_str().map(str::to_owned)).collect()
    }

    /// Whether a warning says that.
    pub fn warns(&self, of: &str) -> bool {
        self.warnings().iter().any(|warning| warning.contains(of))
    }
}
