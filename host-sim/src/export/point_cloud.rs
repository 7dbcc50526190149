//! Point clouds for other programs: PCD, PLY and LAS.

use std::fs::File;
use std::io::{self, BufWriter, Seek, Write};
use std::path::{Path, PathBuf};

use agv_lidar3d::packet::Point;
use pcd_rs::{DataKind, PcdSerialize, Schema, ValueKind, WriterInit};
use ply_rs_bw::ply::{Addable, ElementDef, Encoding, Ply, PropertyAccess, PropertyDef, PropertyType, ScalarType};

/// Length of a count of a coordinate in LAS, m.
const LAS_RESOLUTION: f64 = 1e-4;

/// Why a cloud could not be written.
#[derive(Debug, thiserror::Error)]
pub enum PointCloudError {
    /// The ending of the name is none of those that are known.
    #[error("{}: the name does not end in .pcd, .ply or .las", path.display())]
    Format {
        /// The file.
        path: PathBuf,
    },
    /// The file cannot be written.
    #[error("{}: {reason}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the operating system or the format says.
        reason: String,
    },
}

/// A format of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Point Cloud Library.
    Pcd,
    /// Stanford polygon file.
    Ply,
    /// ASPRS LAS 1.2.
    Las,
}

impl Format {
    /// By the ending of a name.
    ///
    /// # Errors
    /// [`PointCloudError::Format`].
    pub fn of(path: &Path) -> Result<Self, PointCloudError> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
        match ending.as_deref() {
            Some("pcd") => Ok(Self::Pcd),
            Some("ply") => Ok(Self::Ply),
            Some("las") => Ok(Self::Las),
            _ => Err(PointCloudError::Format { path: path.to_owned() }),
        }
    }
}

/// Writes points: x, y, z in m, intensity and the number of the laser (in LAS: user data).
///
/// # Errors
/// See [`PointCloudError`].
pub fn write(path: &Path, points: &[Point]) -> Result<(), PointCloudError> {
    let outcome = match Format::of(path)? {
        Format::Pcd => write_pcd(path, points.iter().map(|point| PcdPoint(Some(*point))), points.len(), 1),
        Format::Ply => write_ply(path, points).map_err(|error| error.to_string()),
        Format::Las => write_las(path, points).map_err(|error| error.to_string()),
    };
    outcome.map_err(|reason| PointCloudError::Write { path: path.to_owned(), reason })
}

/// Writes an organised cloud as PCD: a ring a row, not a number where nothing was seen.
///
/// # Errors
/// See [`PointCloudError`].
pub fn write_organised(path: &Path, cloud: &[Option<[f32; 3]>], rings: usize) -> Result<(), PointCloudError> {
    if Format::of(path)? != Format::Pcd {
        let reason = "only PCD holds organised clouds".to_owned();
        return Err(PointCloudError::Write { path: path.to_owned(), reason });
    }
    let columns = cloud.len() / rings.max(1);
    let points = cloud.iter().enumerate().map(|(place, position)| {
        let laser = (place / columns.max(1)) as u8;
        PcdPoint(position.map(|position| Point { position, azimuth: 0, laser, intensity: 0 }))
    });
    write_pcd(path, points, columns, rings).map_err(|reason| PointCloudError::Write { path: path.to_owned(), reason })
}

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
        ])
    }

    fn write_chunk<W: Write + Seek>(&self, writer: &mut W, _: &Schema) -> pcd_rs::Result<()> {
        let [x, y, z] = self.0.map_or([f32::NAN; 3], |point| point.position);
        let (intensity, laser) = self.0.map_or((0, 0), |point| (point.intensity, point.laser));
        for value in [x, y, z, f32::from(intensity)] {
            writer.write_all(&value.to_le_bytes())?;
        }
        writer.write_all(&[laser])?;
        Ok(())
    }

    fn write_line<W: Write + Seek>(&self, _: &mut W, _: &Schema) -> pcd_rs::Result<()> {
        Err(io::Error::from(io::ErrorKind::Unsupported).into())
    }
}

fn write_pcd(path: &Path, points: impl Iterator<Item = PcdPoint>, width: usize, height: usize) -> Result<(), String> {
    let init = WriterInit {
        width: width as u64,
        height: height as u64,
        viewpoint: pcd_rs::ViewPoint::default(),
        data_kind: DataKind::Binary,
        schema: None,
        version: None,
    };
    let mut writer = init.create(path).map_err(|error| error.to_string())?;
    for point in points {
        writer.push(&point).map_err(|error| error.to_string())?;
    }
    writer.finish().map_err(|error| error.to_string())
}

/// A point as the writer of PLY asks for it.
struct PlyPoint(Point);

impl PropertyAccess for PlyPoint {
    fn new() -> Self {
        Self(Point { position: [0.0; 3], azimuth: 0, laser: 0, intensity: 0 })
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

    fn get_uchar(&self, name: &str) -> Option<u8> {
        match name {
            "intensity" => Some(self.0.intensity),
            "ring" => Some(self.0.laser),
            _ => None,
        }
    }
}

fn write_ply(path: &Path, points: &[Point]) -> io::Result<()> {
    let mut element = ElementDef::new("vertex".to_owned());
    for name in ["x", "y", "z"] {
        element.properties.add(PropertyDef::new(name.to_owned(), PropertyType::Scalar(ScalarType::Float)));
    }
    for name in ["intensity", "ring"] {
        element.properties.add(PropertyDef::new(name.to_owned(), PropertyType::Scalar(ScalarType::UChar)));
    }
    let mut ply = Ply::<PlyPoint>::new();
    ply.header.encoding = Encoding::BinaryLittleEndian;
    ply.header.elements.add(element);
    ply.payload.insert("vertex".to_owned(), points.iter().map(|point| PlyPoint(*point)).collect());
    let mut file = BufWriter::new(File::create(path)?);
    ply_rs_bw::writer::Writer::new().write_ply(&mut file, &mut ply)?;
    file.flush()
}

fn write_las(path: &Path, points: &[Point]) -> las::Result<()> {
    let mut builder = las::Builder::from((1, 2));
    let transform = las::Transform { scale: LAS_RESOLUTION, offset: 0.0 };
    builder.transforms = las::Vector { x: transform, y: transform, z: transform };
    builder.generating_software = concat!("agv ", env!("CARGO_PKG_VERSION")).to_owned();
    let mut writer = las::Writer::from_path(path, builder.into_header()?)?;
    for point in points {
        let [x, y, z] = point.position.map(f64::from);
        let intensity = u16::from(point.intensity);
        writer.write_point(las::Point { x, y, z, intensity, user_data: point.laser, ..las::Point::default() })?;
    }
    writer.close()
}
