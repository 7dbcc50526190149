//! Scans as `sensor_msgs/PointCloud2` in recordings of ROS 2.

use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::path::Path;

use agv_lidar3d::calibration::Laser;

use super::point_cloud2::{KIND, revolution};
use super::revolution::Revolution;
use crate::ros::messages::PointCloud2;
use crate::ros::{Bag, decode};

/// The topic of the clouds in a recording, and how many there are.
///
/// # Errors
/// One line: there is none, or there are several and none was named.
pub fn topic(path: &Path, stated: Option<&str>) -> Result<(String, usize), String> {
    let bag = Bag::open(path).map_err(|error| error.to_string())?;
    let mut topics: Vec<(String, usize)> = Vec::new();
    bag.read(|message| {
        if message.kind == KIND && stated.is_none_or(|stated| stated == message.topic) {
            match topics.iter_mut().find(|(topic, _)| topic == message.topic) {
                Some((_, count)) => *count += 1,
                None => topics.push((message.topic.to_owned(), 1)),
            }
        }
    })
    .map_err(|error| error.to_string())?;
    match topics.as_slice() {
        [one] => Ok(one.clone()),
        [] => Err(format!(
            "{}: it holds no {KIND}{}",
            path.display(),
            stated.map_or(String::new(), |t| format!(" on {t}"))
        )),
        several => {
            let names: BTreeSet<&str> = several.iter().map(|(topic, _)| topic.as_str()).collect();
            let names = names.into_iter().collect::<Vec<_>>().join(", ");
            Err(format!("{}: clouds are on {names}; name one behind the file: FILE#TOPIC", path.display()))
        }
    }
}

/// Calls `take` with each cloud of a topic until it breaks off. Times count from the first stamp.
///
/// # Errors
/// One line.
pub fn for_each(
    path: &Path,
    topic: &str,
    mut take: impl FnMut(Revolution, Vec<Laser>) -> ControlFlow<()>,
) -> Result<(), String> {
    let bag = Bag::open(path).map_err(|error| error.to_string())?;
    let (mut first, mut flow, mut problem) = (None, ControlFlow::Continue(()), None);
    bag.read(|message| {
        if message.kind != KIND || message.topic != topic || flow.is_break() || problem.is_some() {
            return;
        }
        let cloud = decode::<PointCloud2>(message.data).map_err(|error| error.to_string());
        match cloud.and_then(|cloud| revolution(&cloud, &mut first)) {
            Ok((revolution, lasers)) => flow = take(revolution, lasers),
            Err(reason) => problem = Some(format!("{}: {topic}: {reason}", path.display())),
        }
    })
    .map_err(|error| error.to_string())?;
    problem.map_or(Ok(()), Err)
}
