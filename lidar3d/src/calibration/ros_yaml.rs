//! The YAML of the ROS driver `velodyne_pointcloud`: radians and metres.

use std::string::{String, ToString};
use std::vec::Vec;

use serde::{Deserialize, Serialize};

use super::{Calibration, CalibrationError, Full, Laser};

/// Characters of a complaint of the parser.
const LONGEST_REASON: usize = 120;

#[derive(Serialize, Deserialize)]
struct File {
    #[serde(skip_serializing_if = "Option::is_none")]
    distance_resolution: Option<f64>,
    lasers: Vec<Entry>,
    #[serde(skip_serializing_if = "Option::is_none")]
    num_lasers: Option<usize>,
}

#[derive(Serialize, Deserialize)]
struct Entry {
    laser_id: i64,
    #[serde(default)]
    rot_correction: f64,
    vert_correction: f64,
    #[serde(default)]
    dist_correction: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    dist_correction_x: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    dist_correction_y: Option<f64>,
    #[serde(default)]
    vert_offset_correction: f64,
    #[serde(default)]
    horiz_offset_correction: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    focal_distance: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    focal_slope: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    min_intensity: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    max_intensity: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    two_pt_correction_available: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    enabled: Option<bool>,
}

pub(super) fn read(text: &str) -> Result<Calibration, CalibrationError> {
    // The parser repeats what it read, which may be the whole of a foreign file.
    let reason = |error: serde_yaml_ng::Error| error.to_string().chars().take(LONGEST_REASON).collect();
    let file: File =
        serde_yaml_ng::from_str(text).map_err(|error| CalibrationError::Foreign { reason: reason(error) })?;
    if let Some((place, entry)) = file.lasers.iter().enumerate().find(|(place, entry)| entry.laser_id != *place as i64)
    {
        return Err(CalibrationError::Numbers { place, found: entry.laser_id });
    }
    let found = file.lasers.len();
    let wanted = file.num_lasers.unwrap_or(found);
    if found != wanted || found == 0 {
        return Err(CalibrationError::Count { found, wanted });
    }
    let lasers = file.lasers.iter().map(|entry| Laser {
        distance: entry.dist_correction,
        elevation: entry.vert_correction,
        rotation: entry.rot_correction,
        vertical_offset: entry.vert_offset_correction,
        horizontal_offset: entry.horiz_offset_correction,
        is_enabled: entry.enabled.unwrap_or(true),
        full: entry.dist_correction_x.map(|distance_x| Full {
            distance_x,
            distance_y: entry.dist_correction_y.unwrap_or_default(),
            focal_distance: entry.focal_distance.unwrap_or_default(),
            focal_slope: entry.focal_slope.unwrap_or_default(),
            min_intensity: entry.min_intensity.unwrap_or(0.0) as u8,
            max_intensity: entry.max_intensity.unwrap_or(255.0) as u8,
            has_two_points: entry.two_pt_correction_available.unwrap_or(false),
        }),
    });
    Ok(Calibration { distance_resolution: file.distance_resolution, lasers: lasers.collect() })
}

pub(super) fn write(calibration: &Calibration) -> String {
    let entry = |(id, laser): (usize, &Laser)| Entry {
        laser_id: id as i64,
        rot_correction: laser.rotation,
        vert_correction: laser.elevation,
        dist_correction: laser.distance,
        dist_correction_x: laser.full.map(|full| full.distance_x),
        dist_correction_y: laser.full.map(|full| full.distance_y),
        vert_offset_correction: laser.vertical_offset,
        horiz_offset_correction: laser.horizontal_offset,
        focal_distance: laser.full.map(|full| full.focal_distance),
        focal_slope: laser.full.map(|full| full.focal_slope),
        min_intensity: laser.full.map(|full| f64::from(full.min_intensity)),
        max_intensity: laser.full.map(|full| f64::from(full.max_intensity)),
        two_pt_correction_available: laser.full.map(|full| full.has_two_points),
        enabled: (!laser.is_enabled).then_some(false),
    };
    let file = File {
        distance_resolution: calibration.distance_resolution,
        lasers: calibration.lasers.iter().enumerate().map(entry).collect(),
        num_lasers: Some(calibration.lasers.len()),
    };
    // Numbers and names only: there is nothing that YAML could not express.
    serde_yaml_ng::to_string(&file).unwrap_or_default()
}
