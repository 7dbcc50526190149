//! The drive of Moosmann: range images of an HDL-64E, and poses that another program computed.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use super::recordings;

/// Rows and columns of an image.
pub const RINGS: usize = 64;
pub const COLUMNS: usize = 870;

/// One scan every metre of the way.
pub struct Key {
    pub position: [f64; 2],
    pub travelled: f64,
    pub scan: usize,
}

pub struct Drive {
    folder: PathBuf,
    elevations: Vec<f64>,
    pub keys: Vec<Key>,
}

impl Drive {
    /// None if there is no recording.
    pub fn open(test: &str) -> Option<Self> {
        let folder = recordings(test, "moosmann/MuehlburgerTor")?;
        let text = std::fs::read_to_string(folder.join("velodyne_dist/velodyne_config.txt")).unwrap();
        let line = text.lines().rfind(|line| !line.trim().is_empty() && !line.starts_with('#')).unwrap();
        let values: Vec<f64> = line.split_whitespace().map(|value| value.parse().unwrap()).collect();
        let elevations = values[5..].iter().map(|angle| -angle.to_radians()).collect();
        let keys = keys(&folder.join("kiss_icp_poses_derived.txt"));
        Some(Self { folder, elevations, keys })
    }

    /// The points of a scan, ring after ring.
    pub fn points(&self, scan: usize) -> Vec<Option<[f32; 3]>> {
        let path = self.folder.join(format!("velodyne_dist/data/{scan:010}.png"));
        let mut reader = png::Decoder::new(BufReader::new(File::open(path).unwrap())).read_info().unwrap();
        let mut bytes = vec![0; 2 * RINGS * COLUMNS];
        reader.next_frame(&mut bytes).unwrap();
        let counts = bytes.as_chunks::<2>().0.iter().map(|pair| u16::from_be_bytes(*pair));
        let point = |(at, count): (usize, u16)| {
            let range = 0.002 * f64::from(count);
            let rotation = (180.0 - 360.0 * (at % COLUMNS) as f64 / COLUMNS as f64).to_radians();
            let (sin, cos) = self.elevations[at / COLUMNS].sin_cos();
            let point = [range * cos * rotation.cos(), range * cos * rotation.sin(), range * sin];
            (count > 0).then_some(point.map(|value| value as f32))
        };
        counts.enumerate().map(point).collect()
    }
}

fn keys(path: &Path) -> Vec<Key> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut keys: Vec<Key> = Vec::new();
    let (mut last, mut travelled): (Option<[f64; 2]>, f64) = (None, 0.0);
    for (scan, line) in text.lines().enumerate().take(501) {
        let values: Vec<f64> = line.split_whitespace().map(|value| value.parse().unwrap()).collect();
        let (x, y) = (values[3], values[7]);
        if let Some([a, b]) = last.replace([x, y]) {
            travelled += (x - a).hypot(y - b);
        }
        if keys.last().is_none_or(|key| travelled - key.travelled >= 1.0) {
            keys.push(Key { position: [x, y], travelled, scan });
        }
    }
    keys
}
