//! The formats themselves.

use std::format;
use std::io::Cursor;
use std::string::{String, ToString};
use std::vec::Vec;

use pcd_rs::{DynReader, DynRecord, Field};
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};

use super::{FileCloud, FilePoint};

/// Names under which others write the ring.
const RINGS: [&str; 3] = ["ring", "channel", "laser"];
const INTENSITIES: [&str; 3] = ["intensity", "reflectivity", "reflectance"];

/// The name of a number of a point, as everybody means it: CloudCompare puts a word before the names of its own.
fn plain(name: &str) -> String {
    let name = name.to_ascii_lowercase();
    name.strip_prefix("scalar_").map_or(name.clone(), ToString::to_string)
}

/// The columns of a header that have a value for each field.
const HEADER: [&str; 4] = ["FIELDS", "SIZE", "TYPE", "COUNT"];

/// The file without fields that fill up nothing: PCL writes some of which there are none, `COUNT 0`, which readers take for one.
fn without_empty_fields(bytes: &[u8]) -> Option<Vec<u8>> {
    let data = bytes.windows(5).position(|window| window == b"\nDATA")?;
    let header = core::str::from_utf8(bytes.get(..data)?).ok()?;
    let values =
        |line: &str| -> Vec<String> { line.split_ascii_whitespace().skip(1).map(ToString::to_string).collect() };
    let counts = header.lines().find(|line| line.starts_with("COUNT")).map(values)?;
    if !counts.iter().any(|count| count == "0") {
        return None;
    }
    let mut shorter = String::new();
    for line in header.lines() {
        match HEADER.iter().find(|name| line.split_ascii_whitespace().next() == Some(**name)) {
            Some(name) => {
                let kept =
                    values(line).into_iter().zip(&counts).filter(|(_, count)| *count != "0").map(|(value, _)| value);
                shorter += &format!("{name} {}\n", kept.collect::<Vec<_>>().join(" "));
            }
            None => shorter += &format!("{line}\n"),
        }
    }
    Some([shorter.trim_end().as_bytes(), bytes.get(data..)?].concat())
}

pub(super) fn pcd(bytes: &[u8]) -> Result<FileCloud, String> {
    let shorter = without_empty_fields(bytes);
    let reader =
        DynReader::from_bytes(shorter.as_deref().unwrap_or(bytes)).map_err(|error| one_line(&error.to_string()))?;
    // What fills a point up is in no record.
    let fields = reader.meta().field_defs.iter().filter(|field| !field.is_padding());
    let names: Vec<String> = fields.map(|field| plain(&field.name)).collect();
    let promised = reader.meta().num_points;
    let place = |wanted: &str| names.iter().position(|name| name == wanted);
    let any = |wanted: [&str; 3]| wanted.into_iter().find_map(place);
    let [Some(x), Some(y), Some(z)] = ["x", "y", "z"].map(place) else {
        return Err(format!("it states no x, y and z, but {}", names.join(", ")));
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
    let mut cloud = FileCloud::default();
    for record in reader {
        match record {
            Ok(record) => cloud.points.push(point(record)),
            Err(error) if cloud.points.is_empty() => return Err(one_line(&error.to_string())),
            Err(_) => {
                let read = cloud.points.len();
                cloud.warnings.push(format!("the file ends early: {read} of {promised} points were read"));
                break;
            }
        }
    }
    Ok(cloud)
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

pub(super) fn ply(bytes: &[u8]) -> Result<FileCloud, String> {
    let ply = Parser::<DefaultElement>::new().read_ply(&mut Cursor::new(bytes));
    let ply = ply.map_err(|error| one_line(&error.to_string()))?;
    let vertices = ply.payload.get("vertex").ok_or("it has no element vertex")?;
    let Some(first) = vertices.first() else { return Ok(FileCloud::default()) };
    let names: Vec<(String, String)> = first.keys().map(|name| (plain(name), name.to_string())).collect();
    let named = |wanted: &str| names.iter().find(|(name, _)| name == wanted).map(|(_, own)| own.as_str());
    let [Some(x), Some(y), Some(z)] = ["x", "y", "z"].map(named) else {
        let names: Vec<&str> = names.iter().map(|(name, _)| name.as_str()).collect();
        return Err(format!("a vertex has no x, y and z, but {}", names.join(", ")));
    };
    let (intensity, ring) = (INTENSITIES.into_iter().find_map(named), RINGS.into_iter().find_map(named));
    let point = |vertex: &DefaultElement| {
        let value = |name: &str| vertex.get(name).and_then(scalar);
        let [x, y, z] = [x, y, z].map(value);
        Some(FilePoint {
            position: [x?, y?, z?],
            intensity: intensity.and_then(value).unwrap_or(0.0),
            ring: ring.and_then(value).map(|ring| ring as u16),
        })
    };
    let points: Option<Vec<FilePoint>> = vertices.iter().map(point).collect();
    Ok(FileCloud { points: points.ok_or("a vertex has no x, y and z")?, ..FileCloud::default() })
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

/// Bit of the kind of points that says that they are compressed, and where that kind stands in the header.
const COMPRESSED: u8 = 0x80;
const KIND: usize = 104;
/// What is farther from the origin is a place on the earth, m.
const FARTHEST: f64 = 10_000.0;

pub(super) fn las(bytes: Vec<u8>) -> Result<FileCloud, String> {
    if bytes.get(KIND).is_some_and(|kind| kind & COMPRESSED != 0) {
        return Err(
            "its points are compressed as in .laz: `pdal translate IN.laz OUT.las` writes them as they are".to_string()
        );
    }
    let mut reader = las::Reader::new(Cursor::new(bytes)).map_err(|error| one_line(&error.to_string()))?;
    let transforms = reader.header().transforms();
    let stated = [transforms.x.offset, transforms.y.offset, transforms.z.offset];
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
    let mut cloud = FileCloud { points, ..FileCloud::default() };
    cloud.bring_near(stated);
    Ok(cloud)
}

impl FileCloud {
    /// Moves points on the earth so that the origin of the file, or else their middle, is the origin.
    fn bring_near(&mut self, stated: [f64; 3]) {
        let is_near = |from: [f64; 3]| {
            let near = |point: &FilePoint| (0..2).all(|axis| (point.position[axis] - from[axis]).abs() < FARTHEST);
            self.points.iter().filter(|point| point.is_seen()).all(near)
        };
        if is_near([0.0; 3]) {
            return;
        }
        let middle = |axis: usize| {
            let values = self.points.iter().map(|point| point.position[axis]).filter(|value| value.is_finite());
            let (least, most) = values.fold((f64::MAX, f64::MIN), |(least, most), one| (least.min(one), most.max(one)));
            0.5 * (least + most)
        };
        let origin = if is_near(stated) { stated } else { [middle(0), middle(1), 0.0] };
        let [x, y, z] = origin;
        self.warnings.push(format!(
            "its coordinates are those of a place on the earth: ({x:.3}, {y:.3}, {z:.3}) was taken for the origin"
        ));
        for point in &mut self.points {
            for (value, origin) in point.position.iter_mut().zip(origin) {
                *value -= origin;
            }
        }
    }
}

/// Parsers repeat what they read, which may be long.
fn one_line(reason: &str) -> String {
    reason.lines().next().unwrap_or_default().chars().take(120).collect()
}
