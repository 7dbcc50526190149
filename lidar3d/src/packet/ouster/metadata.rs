//! The JSON in which a sensor states itself: of one level before firmware 3, of several since.

use std::string::{String, ToString};
use std::vec::Vec;

use serde_json::Value;

use super::{PIXELS, Profile, Sensor};

/// Columns of a packet where nothing is said: of all firmware that says nothing.
const COLUMNS_PER_PACKET: usize = 16;

/// Why a text is no metadata.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MetadataError {
    /// Not of this format.
    #[error("this is no metadata of an Ouster: {reason}")]
    Foreign {
        /// What the parser says, one line.
        reason: String,
    },
    /// A value is absent or not what it must be.
    #[error("the metadata state no valid {name}")]
    Value {
        /// Name of the value.
        name: &'static str,
    },
    /// A profile that is not known.
    #[error("the packets are of the profile {found}, which is not read")]
    Profile {
        /// What is stated.
        found: String,
    },
}

impl Sensor {
    /// Reads the metadata of a sensor.
    ///
    /// # Errors
    /// See [`MetadataError`].
    pub fn read(text: &str) -> Result<Self, MetadataError> {
        let root: Value =
            serde_json::from_str(text).map_err(|error| MetadataError::Foreign { reason: error.to_string() })?;
        if !root.is_object() {
            return Err(MetadataError::Foreign { reason: "it is no object".to_string() });
        }
        let (altitudes, pixels) = angles(&root, "beam_altitude_angles")?;
        let (azimuths, others) = angles(&root, "beam_azimuth_angles")?;
        let stated = number(&root, "pixels_per_column").unwrap_or(pixels as f64);
        if others != pixels || stated != pixels as f64 {
            return Err(MetadataError::Value { name: "pixels_per_column" });
        }
        Ok(Self {
            profile: profile(&root)?,
            port: number(&root, "udp_port_lidar").map(|port| port as u16).filter(|port| *port > 0),
            columns_per_frame: columns_per_frame(&root)?,
            columns_per_packet: columns_per_packet(&root)?,
            pixels,
            altitudes,
            azimuths,
            beam_origin: beam_origin(&root)?,
            lidar_to_sensor: matrix(&root, "lidar_to_sensor_transform")?,
        })
    }
}

/// A value by its name, wherever it stands.
fn find<'a>(value: &'a Value, name: &str) -> Option<&'a Value> {
    let object = value.as_object()?;
    object.get(name).or_else(|| object.values().find_map(|inner| find(inner, name)))
}

fn number(root: &Value, name: &str) -> Option<f64> {
    find(root, name)?.as_f64()
}

fn numbers(root: &Value, name: &'static str) -> Result<Vec<f64>, MetadataError> {
    let list = find(root, name).and_then(Value::as_array).ok_or(MetadataError::Value { name })?;
    // Some firmware writes a matrix row by row.
    let flat = list.iter().flat_map(|value| value.as_array().map_or(core::slice::from_ref(value), Vec::as_slice));
    flat.map(|value| value.as_f64().ok_or(MetadataError::Value { name })).collect()
}

fn angles(root: &Value, name: &'static str) -> Result<([f64; PIXELS], usize), MetadataError> {
    let found = numbers(root, name)?;
    let mut angles = [0.0; PIXELS];
    if found.is_empty() || found.len() > PIXELS {
        return Err(MetadataError::Value { name });
    }
    for (angle, found) in angles.iter_mut().zip(&found) {
        *angle = *found;
    }
    Ok((angles, found.len()))
}

fn profile(root: &Value) -> Result<Profile, MetadataError> {
    let Some(found) = find(root, "udp_profile_lidar").and_then(Value::as_str) else { return Ok(Profile::Legacy) };
    let profile = Profile::ALL.into_iter().find(|profile| profile.name() == found);
    profile.ok_or_else(|| MetadataError::Profile { found: found.to_string() })
}

fn columns_per_frame(root: &Value) -> Result<u16, MetadataError> {
    let of_mode = || find(root, "lidar_mode")?.as_str()?.split('x').next()?.parse().ok();
    let columns = number(root, "columns_per_frame").or_else(of_mode);
    let name = "columns_per_frame";
    columns
        .filter(|columns| (1.0..=8192.0).contains(columns))
        .map(|columns| columns as u16)
        .ok_or(MetadataError::Value { name })
}

fn columns_per_packet(root: &Value) -> Result<usize, MetadataError> {
    let columns = number(root, "columns_per_packet").unwrap_or(COLUMNS_PER_PACKET as f64);
    let name = "columns_per_packet";
    Some(columns)
        .filter(|columns| (1.0..=128.0).contains(columns))
        .map(|columns| columns as usize)
        .ok_or(MetadataError::Value { name })
}

/// A matrix of four rows, in mm, of which the first three are used, in m.
fn matrix(root: &Value, name: &'static str) -> Result<[[f64; 4]; 3], MetadataError> {
    let values = numbers(root, name)?;
    let rows = values.as_chunks::<4>().0;
    let [first, second, third, _] = rows else { return Err(MetadataError::Value { name }) };
    Ok([first, second, third].map(|[a, b, c, millimetres]| [*a, *b, *c, 0.001 * millimetres]))
}

fn beam_origin(root: &Value) -> Result<[f64; 2], MetadataError> {
    if find(root, "beam_to_lidar_transform").is_some() {
        let [[.., ahead], _, [.., above]] = matrix(root, "beam_to_lidar_transform")?;
        return Ok([ahead, above]);
    }
    Ok([0.001 * number(root, "lidar_origin_to_beam_origin_mm").unwrap_or(0.0), 0.0])
}
