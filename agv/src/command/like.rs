//! A vehicle and a map from another log.

use std::path::Path;

use agv_core::geometry::Pose;
use agv_core::localizer::Parameters;
use agv_core::odometry::Vehicle;
use agv_host_sim::log;
use agv_host_sim::recording::Recording;

/// A drive without events, with the vehicle and the map of a log; without either if there is no log.
pub fn drive_like(path: Option<&Path>) -> anyhow::Result<Recording> {
    let (parameters, landmarks) = match path {
        Some(path) => {
            let (recording, _) = log::read(path)?;
            (recording.parameters, recording.landmarks)
        }
        None => (Parameters::new(Vehicle::Increments, Pose::default()), Vec::new()),
    };
    Ok(Recording { parameters, landmarks, events: Vec::new(), truth: Vec::new(), references: Vec::new(), state: None })
}
