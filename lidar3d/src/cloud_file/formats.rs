//! The formats themselves.

use std::format;
use std::io::Cursor;
use std::string::{String, ToString};
use std::vec::Vec;

use pcd_rs::{DynReader, DynRecord, Field};
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};

use super::FilePoint;

/// Names under which others write the ring.
const RINGS: [&str; 3] = ["ring", "channel", "laser"];
const INTENSITIES: [&str; 3] = ["intensity", "reflectivity", "scalar_intensity"];

pub(super) fn kitti(bytes: &[u8]) -> Result<Vec<FilePoint>, String> {
    let (points, rest) = bytes.as_chunks::<16>();
    if !rest.is_empty() {
        return Err(format!("{} bytes are no whole number of points of 16 bytes", bytes.len()));
    }
    let point = |bytes: &[u8; 16]| {
        let (numbers, _) = bytes.as_chunks::<4>();
        let [x, y, z, intensity] = [0, 1, 2, 3].map(|at: usize| f64::from(f32::from_le_bytes(numbers[at])));
        FilePoint { position: [x, y, z], intensity, ring: None }
    };
    let points: Vec<FilePoint> = points.iter().map(point).collect();
    // Bytes of something else are numbers as well, but not such ones.
    let is_near = |point: &FilePoint| point.position.iter().all(|value| value.abs() < 1e4);
    if points.iter().all(is_near) { Ok(points) } else { Err("its numbers are no coordinates".to_string()) }
}

pub(super) fn pcd(bytes: &[u8]) -> Result<Vec<FilePoint>, String> {
    let reader = DynReader::from_bytes(bytes).map_err(|error| one_line(&error.to_string()))?;
    let names: Vec<String> = reader.meta().field_defs.iter().map(|field| field.name.to_ascii_lowercase()).collect();
    let place = |wanted: &str| names.iter().position(|name| name == wanted);
    let any = |wanted: [&str; 3]| wanted.into_iter().find_map(place);
    let [Some(x), Some(y), Some(z)] = ["x", "y", "z"].map(place) else {
        return Err("it states no x, y and z".to_string());
    };
    let (intensity, ring) = (any(INTENSITIES), any(RINGS));
    let point = |record: DynRecord| {
        let value = |place: usize| record.0.get(place).and_then(number);
        FilePoint {
            position: [x, y, z].map(|place| value(place).unwrap_or(f64::NAN)),
            intensity: intensity.and_then(value).unwrap_or(0.0),
            ring: ring.and_then(value).map(|ring| ring as u16),
        }
    };
    reader.map(|record| record.map(point).map_err(|error| one_line(&error.to_string()))).collect()
}

fn number(field: &Field) -> Option<f64> {
    match field {
        Field::I8(values) => values.first().map(|value| f64::from(*value)),
        Field::I16(values) => values.first().map(|value| f64::from(*value)),
        Field::I32(values) => values.first().map(|value| f64::from(*value)),
        Field::I64(values) => values.first().map(|value| *value as f64),
        Field::U8(values) => values.first().map(|value| f64::from(*value)),
        Field::U16(values) => values.first().map(|value| f64::from(*value)),
        Field::U32(values) => values.first().map(|value| f64::from(*value)),
        Field::U64(values) => values.first().map(|value| *value as f64),
        Field::F32(values) => values.first().map(|value| f64::from(*value)),
        Field::F64(values) => values.first().copied(),
    }
}

pub(super) fn ply(bytes: &[u8]) -> Result<Vec<FilePoint>, String> {
    let ply = Parser::<DefaultElement>::new().read_ply(&mut Cursor::new(bytes));
    let ply = ply.map_err(|error| one_line(&error.to_string()))?;
    let vertices = ply.payload.get("vertex").ok_or("it has no element vertex")?;
    let point = |vertex: &DefaultElement| {
        let value = |name: &str| vertex.get(name).and_then(scalar);
        let [x, y, z] = ["x", "y", "z"].map(value);
        Some(FilePoint {
            position: [x?, y?, z?],
            intensity: INTENSITIES.into_iter().find_map(value).unwrap_or(0.0),
            ring: RINGS.into_iter().find_map(value).map(|ring| ring as u16),
        })
    };
    vertices.iter().map(|vertex| point(vertex).ok_or_else(|| "a vertex has no x, y and z".to_string())).collect()
}

fn scalar(property: &Property) -> Option<f64> {
    match property {
        Property::Char(value) => Some(f64::from(*value)),
        Property::UChar(value) => Some(f64::from(*value)),
        Property::Short(value) => Some(f64::from(*value)),
        Property::UShort(value) => Some(f64::from(*value)),
        Property::Int(value) => Some(f64::from(*value)),
        Property::UInt(value) => Some(f64::from(*value)),
        Property::Float(value) => Some(f64::from(*value)),
        Property::Double(value) => Some(*value),
        _ => None,
    }
}

pub(super) fn las(bytes: Vec<u8>) -> Result<Vec<FilePoint>, String> {
    let mut reader = las::Reader::new(Cursor::new(bytes)).map_err(|error| one_line(&error.to_string()))?;
    let data = reader.read_all().map_err(|error| one_line(&error.to_string()))?;
    let places = data.x().zip(data.y()).zip(data.z());
    // The ring stands where the format leaves it to the user.
    let values = data.intensity().zip(data.user_data());
    let point = |(((x, y), z), (intensity, ring)): (((f64, f64), f64), (u16, u8))| FilePoint {
        position: [x, y, z],
        intensity: f64::from(intensity),
        ring: Some(u16::from(ring)),
    };
    let mut points: Vec<FilePoint> = places.zip(values).map(point).collect();
    if points.iter().all(|point| point.ring == Some(0)) {
        points.iter_mut().for_each(|point| point.ring = None);
    }
    Ok(points)
}

/// Parsers repeat what they read, which may be long.
fn one_line(reason: &str) -> String {
    reason.lines().next().unwrap_or_default().chars().take(120).collect()
}
