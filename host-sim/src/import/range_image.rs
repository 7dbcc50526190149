//! Range images of a multi-beam lidar: a folder of 16-bit PNG, 2 mm a count, with the angles in a text beside them.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use agv_lidar3d::calibration::{Calibration, Laser};
use agv_lidar3d::packet::LENGTH;

use crate::hdl64e_packets::hdl64e_packets;

/// Why range images could not be read.
#[derive(Debug, thiserror::Error)]
pub enum RangeImageError {
    /// The operating system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// A file is not what is expected.
    #[error("{}: {reason}", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
}

/// The images of a drive, unread, and the angles of their pixels.
#[derive(Clone, Debug)]
pub struct RangeImages {
    /// The files in order.
    pub files: Vec<PathBuf>,
    /// Length of a count, m.
    pub resolution: f64,
    /// Rotation of each column, rad, counter-clockwise.
    pub rotations: Vec<f64>,
    /// Elevation of each row, rad.
    pub elevations: Vec<f64>,
}

impl RangeImages {
    /// Finds the images in `folder`/data and reads `folder`/velodyne_config.txt.
    ///
    /// # Errors
    /// See [`RangeImageError`].
    pub fn open(folder: &Path) -> Result<Self, RangeImageError> {
        let path = folder.join("velodyne_config.txt");
        let text =
            std::fs::read_to_string(&path).map_err(|source| RangeImageError::Io { path: path.clone(), source })?;
        let foreign = |reason: &str| RangeImageError::Foreign { path: path.clone(), reason: reason.to_owned() };
        let line = text.lines().rfind(|line| !line.trim().is_empty() && !line.starts_with('#'));
        let values: Option<Vec<f64>> =
            line.unwrap_or_default().split_whitespace().map(|value| value.parse().ok()).collect();
        let values = values.ok_or_else(|| foreign("a value is no number"))?;
        let [multiplier, columns, rows, start, stop, angles @ ..] = values.as_slice() else {
            return Err(foreign("it states fewer than five values"));
        };
        if angles.len() as f64 != *rows || *multiplier <= 0.0 || *columns < 1.0 {
            return Err(foreign("it states another number of angles than of rows"));
        }
        let step = (stop - start) / columns;
        let rotations = (0..*columns as usize).map(|column| (start + step * column as f64).to_radians()).collect();
        let elevations = angles.iter().map(|angle| -angle.to_radians()).collect();
        let data = folder.join("data");
        let entries = std::fs::read_dir(&data).map_err(|source| RangeImageError::Io { path: data.clone(), source })?;
        let mut files: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
        files.retain(|file| file.extension().is_some_and(|extension| extension == "png"));
        files.sort();
        Ok(Self { files, resolution: 1.0 / multiplier, rotations, elevations })
    }

    /// The counts of an image, row after row.
    ///
    /// # Errors
    /// See [`RangeImageError`].
    pub fn counts(&self, index: usize) -> Result<Vec<u16>, RangeImageError> {
        let path = self.files.get(index).cloned().unwrap_or_default();
        let file = File::open(&path).map_err(|source| RangeImageError::Io { path: path.clone(), source })?;
        let foreign = |reason: String| RangeImageError::Foreign { path: path.clone(), reason };
        let mut reader =
            png::Decoder::new(BufReader::new(file)).read_info().map_err(|error| foreign(error.to_string()))?;
        let (columns, rows) = (self.rotations.len(), self.elevations.len());
        let info = reader.info();
        if (info.width as usize, info.height as usize) != (columns, rows) || info.bit_depth != png::BitDepth::Sixteen {
            return Err(foreign(format!("it is no 16-bit image of {columns} x {rows}")));
        }
        let mut bytes = vec![0; 2 * columns * rows];
        reader.next_frame(&mut bytes).map_err(|error| foreign(error.to_string()))?;
        Ok(bytes.as_chunks::<2>().0.iter().map(|pair| u16::from_be_bytes(*pair)).collect())
    }

    /// The points of an image, row after row.
    ///
    /// # Errors
    /// See [`RangeImageError`].
    pub fn points(&self, index: usize) -> Result<Vec<Option<[f32; 3]>>, RangeImageError> {
        let counts = self.counts(index)?;
        let columns: Vec<(f64, f64)> = self.rotations.iter().map(|angle| angle.sin_cos()).collect();
        let rows = counts.chunks_exact(columns.len()).zip(&self.elevations);
        Ok(rows
            .flat_map(|(row, elevation)| {
                let (sin_elevation, cos_elevation) = elevation.sin_cos();
                row.iter().zip(&columns).map(move |(count, (sin, cos))| {
                    let range = f64::from(*count) * self.resolution;
                    let point = [range * cos_elevation * cos, range * cos_elevation * sin, range * sin_elevation];
                    (*count > 0).then_some(point.map(|value| value as f32))
                })
            })
            .collect())
    }

    /// The sensor that they are of: no corrections, and the elevations of the rows.
    #[must_use]
    pub fn calibration(&self) -> Calibration {
        let laser = |elevation: &f64| Laser { elevation: *elevation, is_enabled: true, ..Laser::default() };
        Calibration { distance_resolution: Some(self.resolution), lasers: self.elevations.iter().map(laser).collect() }
    }

    /// Angle of the head at the first column, 0.01 degrees.
    #[must_use]
    pub fn first_azimuth(&self) -> u16 {
        self.rotations.first().map_or(0, clockwise)
    }

    /// Counts as the packets of an HDL-64E S2, the angles of the columns rounded to 0.01 degrees.
    #[must_use]
    pub fn packets(&self, counts: &[u16]) -> Vec<[u8; LENGTH]> {
        let columns = self.rotations.len();
        let azimuths: Vec<u16> = self.rotations.iter().map(clockwise).collect();
        hdl64e_packets(&azimuths, |column, row| counts.get(row * columns + column).copied().unwrap_or(0))
    }
}

/// The angle of the head, 0.01 degrees, that looks in a direction, rad.
fn clockwise(rotation: &f64) -> u16 {
    (-rotation.to_degrees() * 100.0).round().rem_euclid(36_000.0) as u16
}
