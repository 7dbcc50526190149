//! A folder as rosbag2 writes it: an MCAP file, and a description of it.

use std::path::{Path, PathBuf};

use super::mcap::{self, McapExportError, McapSummary};
use crate::output_file;
use crate::recording::{RecordedEvent, Recording};
use crate::replay::Replay;

/// Writes a drive and what the localiser answered to `folder`, which is made.
///
/// # Errors
/// If a file cannot be written.
pub fn write(
    folder: &Path,
    recording: &Recording,
    answers: &Replay,
    progress: Box<dyn FnMut(usize)>,
) -> Result<McapSummary, McapExportError> {
    let io = |path: PathBuf| move |source| McapExportError::Io { path, source };
    std::fs::create_dir_all(folder).map_err(io(folder.to_owned()))?;
    let name = format!("{}_0.mcap", folder.file_name().unwrap_or_default().to_string_lossy());
    let summary = mcap::write(&folder.join(&name), recording, answers, progress)?;
    let path = folder.join("metadata.yaml");
    output_file::write(&path, description(&name, recording, &summary)).map_err(io(path.clone()))?;
    Ok(summary)
}

fn description(name: &str, recording: &Recording, summary: &McapSummary) -> String {
    let times = || recording.events.iter().filter_map(RecordedEvent::time);
    let (first, last) = (times().min().unwrap_or_default(), times().max().unwrap_or_default());
    let [start, duration] = [first.micros() * 1000, (last.micros() - first.micros()) * 1000];
    let count: u64 = summary.messages.values().sum();
    let topics: String = mcap::topics()
        .map(|topic| {
            let mcap::TopicDescription { name, kind, qualities } = topic;
            let messages = summary.messages.get(name).copied().unwrap_or_default();
            let qualities = qualities.replace('\n', "\\n");
            format!(
                "    - topic_metadata:\n        name: {name}\n        type: {kind}\n        serialization_format: cdr\n\
                 \x20       offered_qos_profiles: \"{qualities}\"\n      message_count: {messages}\n"
            )
        })
        .collect();
    format!(
        "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n  duration:\n    nanoseconds: {duration}\n\
         \x20 starting_time:\n    nanoseconds_since_epoch: {start}\n  message_count: {count}\n  topics_with_message_count:\n\
         {topics}  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n    - {name}\n  files:\n\
         \x20   - path: {name}\n      starting_time:\n        nanoseconds_since_epoch: {start}\n      duration:\n\
         \x20       nanoseconds: {duration}\n      message_count: {count}\n"
    )
}
