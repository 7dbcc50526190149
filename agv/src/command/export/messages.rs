//! Drives as messages of ROS 2.

use std::collections::BTreeMap;
use std::path::Path;

use agv_host_sim::export;
use agv_host_sim::export::mcap::McapSummary;
use agv_host_sim::recording::Recording;
use agv_host_sim::replay::Replay;

use crate::command::output;

/// Writes a drive; gives how many messages of which topic.
pub type Write = fn(&Path, &Recording, &Replay, Box<dyn FnMut(usize)>) -> anyhow::Result<Counts>;

/// Messages by topic.
type Counts = BTreeMap<&'static str, u64>;

/// As a file.
pub fn mcap(
    path: &Path,
    recording: &Recording,
    answers: &Replay,
    progress: Box<dyn FnMut(usize)>,
) -> anyhow::Result<Counts> {
    Ok(counts(export::mcap::write(path, recording, answers, progress)?))
}

/// As a folder.
pub fn rosbag2(
    path: &Path,
    recording: &Recording,
    answers: &Replay,
    progress: Box<dyn FnMut(usize)>,
) -> anyhow::Result<Counts> {
    Ok(counts(export::rosbag2::write(path, recording, answers, progress)?))
}

fn counts(summary: McapSummary) -> Counts {
    if !summary.has_log {
        output::note(
            "warning: the log is too long to be attached; an import of the file has neither reflectors nor the map",
        );
    }
    summary.messages
}
