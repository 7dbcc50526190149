//! Scans with poses, of any log that has them.

use std::io::Read;
use std::path::Path;

use agv_core::record::MAGIC;
use agv_host_sim::import::{PosedScan, carmen, graph_log};
use agv_host_sim::log;
use anyhow::Context;

/// Scans of a log whose format its first bytes tell; at least one.
pub fn read(path: &Path) -> anyhow::Result<Vec<PosedScan>> {
    let mut start = [0; 7];
    let opened = std::fs::File::open(path).with_context(|| format!("cannot read {}", path.display()))?;
    // A file shorter than the word is no graph.
    let is_graph = { opened }.read_exact(&mut start).is_ok() && &start == b"VERTEX2";
    let scans = if start.starts_with(&MAGIC) {
        PosedScan::of_recording(&log::read(path)?.0)
    } else if is_graph {
        graph_log::read(path)?.log.scans
    } else {
        carmen::read(path)?.front.scans
    };
    anyhow::ensure!(!scans.is_empty(), "{} has no scans with poses", path.display());
    Ok(scans)
}
