//! Stands for messages of ROS 2 where they were left out.

use std::collections::BTreeMap;
use std::path::Path;

use agv_host_sim::left_out::BAGS;
use agv_host_sim::recording::Recording;
use agv_host_sim::replay::Replay;

/// Refuses.
pub type Write = fn(&Path, &Recording, &Replay, Box<dyn FnMut(usize)>) -> anyhow::Result<BTreeMap<&'static str, u64>>;

pub fn mcap(
    _: &Path,
    _: &Recording,
    _: &Replay,
    _: Box<dyn FnMut(usize)>,
) -> anyhow::Result<BTreeMap<&'static str, u64>> {
    anyhow::bail!(BAGS)
}

pub use mcap as rosbag2;
