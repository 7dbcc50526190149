//! The formats of point clouds.

use std::io::{self, Seek, Write};
use std::path::Path;

use agv_lidar3d::packet::Point;
use pcd_rs::{DataKind, PcdSerialize, Schema, ValueKind, WriterInit};
use ply_rs_bw::ply::{Addable, ElementDef, Encoding, Ply, PropertyAccess, PropertyDef, PropertyType, ScalarType};

use crate::output_file::OutputFile;

/// Length of a count of a coordinate in LAS, m.
const LAS_RESOLUTION: f64 = 1e-4;

/// A point as the writer of PCD asks for it.
struct PcdPoint(Option<Point>);

impl PcdSerialize for PcdPoint {
    fn is_dynamic() -> bool {
        false
    }

    fn write_spec() -> Schema {
        Schema::from_iter([
            ("x", ValueKind::F32, 1),
            ("y", ValueKind::F32, 1),
            ("z", ValueKind::F32, 1),
            ("intensity", ValueKind::F32, 1),
            ("ring", ValueKind::U8, 1),
            ("return", ValueKind::U8, 1),
            ("time", ValueKind::F32, 1),
        ])
    }

    fn write_chunk<W: Write + Seek>(&self, writer: &mut W, _: &Schema) -> pcd_rs::Result<()> {
        let [x, y, z] = self.0.map_or([f32::NAN; 3], |point| point.position);
        let point = self.0.unwrap_or_default();
        for value in [x, y, z, f32::from(point.intensity)] {
            writer.write_all(&value.to_le_bytes())?;
        }
        writer.write_all(&[point.ring, point.kind as u8])?;
        writer.write_all(&(1e-9 * point.time as f32).to_le_bytes())?;
        Ok(())
    }

    fn write_line<W: Write + Seek>(&self, _: &mut W, _: &Schema) -> pcd_rs::Result<()> {
        Err(io::Error::from(io::ErrorKind::Unsupported).into())
    }
}

/// Writes points, or not a number where there is none, as PCD of `height` rows.
pub(super) fn write_pcd(
    path: &Path,
    points: impl Iterator<Item = Option<Point>>,
    width: usize,
    height: usize,
) -> Result<(), String> {
    let init = WriterInit {
        width: width as u64,
        height: height as u64,
        viewpoint: pcd_rs::ViewPoint::default(),
        data_kind: DataKind::Binary,
        schema: None,
        version: None,
    };
    let mut file = OutputFile::create(path).map_err(|error| error.to_string())?;
    let mut writer = init.build_from_writer(&mut file).map_err(|error| error.to_string())?;
    for point in points {
        writer.push(&PcdPoint(point)).map_err(|error| error.to_string())?;
    }
    writer.finish().map_err(|error| error.to_string())?;
    file.finish().map_err(|error| error.to_string())
}

/// A point as the writer of PLY asks for it.
struct PlyPoint(Point);

impl PropertyAccess for PlyPoint {
    fn new() -> Self {
        Self(Point::default())
    }

    fn get_float(&self, name: &str) -> Option<f32> {
        let [x, y, z] = self.0.position;
        match name {
            "x" => Some(x),
            "y" => Some(y),
            "z" => Some(z),
            _ => None,
        }
    }

    fn get_ushort(&self, name: &str) -> Option<u16> {
        (name == "intensity").then_some(self.0.intensity)
    }

    fn get_uchar(&self, name: &str) -> Option<u8> {
        (name == "ring").then_some(self.0.ring)
    }
}

/// Writes points as PLY.
pub(super) fn write_ply(path: &Path, points: &[Point]) -> Result<(), String> {
    try_ply(path, points).map_err(|error| error.to_string())
}

fn try_ply(path: &Path, points: &[Point]) -> io::Result<()> {
    let mut element = ElementDef::new("vertex".to_owned());
    for name in ["x", "y", "z"] {
        element.properties.add(PropertyDef::new(name.to_owned(), PropertyType::Scalar(ScalarType::Float)));
    }
    for (name, scalar) in [("intensity", ScalarType::UShort), ("ring", ScalarType::UChar)] {
        element.properties.add(PropertyDef::new(name.to_owned(), PropertyType::Scalar(scalar)));
    }
    let mut ply = Ply::<PlyPoint>::new();
    ply.header.encoding = Encoding::BinaryLittleEndian;
    ply.header.elements.add(element);
    ply.payload.insert("vertex".to_owned(), points.iter().map(|point| PlyPoint(*point)).collect());
    let mut file = OutputFile::create(path)?;
    ply_rs_bw::writer::Writer::new().write_ply(&mut file, &mut ply)?;
    file.finish()
}

/// Writes points as LAS.
pub(super) fn write_las(path: &Path, points: &[Point]) -> Result<(), String> {
    try_las(path, points).map_err(|error| error.to_string())
}

fn try_las(path: &Path, points: &[Point]) -> las::Result<()> {
    let mut builder = las::Builder::from((1, 2));
    let transform = las::Transform { scale: LAS_RESOLUTION, offset: 0.0 };
    builder.transforms = las::Vector { x: transform, y: transform, z: transform };
    builder.generating_software = concat!("agv ", env!("CARGO_PKG_VERSION")).to_owned();
    let mut writer = las::Writer::new(OutputFile::create(path)?, builder.into_header()?)?;
    for point in points {
        let [x, y, z] = point.position.map(f64::from);
        let intensity = point.intensity;
        writer.write_point(las::Point { x, y, z, intensity, user_data: point.ring, ..las::Point::default() })?;
    }
    Ok(writer.into_inner()?.finish()?)
}
