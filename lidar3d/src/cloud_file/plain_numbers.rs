//! Points as plain 32-bit floats, one after the other (`.bin`): nothing in the file says how many numbers a point has.
//!
//! KITTI has four (x, y, z, reflectance), nuScenes five (and the ring), others none but the place, or a time as well. Which it is shows
//! in the numbers: read with a wrong length, places stand where the intensity should, and are negative as often as not.

use std::format;
use std::string::String;
use std::vec::Vec;

use super::{FileCloud, FilePoint};

/// A way to write points.
struct Layout {
    /// Who does so, for messages.
    name: &'static str,
    /// Numbers of a point.
    numbers: usize,
    /// Which of them is the intensity, and which the ring.
    intensity: Option<usize>,
    ring: Option<usize>,
}

/// From the most usual one on.
const LAYOUTS: [Layout; 4] = [
    Layout { name: "x, y, z, intensity (KITTI)", numbers: 4, intensity: Some(3), ring: None },
    Layout { name: "x, y, z, intensity, ring (nuScenes)", numbers: 5, intensity: Some(3), ring: Some(4) },
    Layout { name: "x, y, z, intensity, ring, time", numbers: 6, intensity: Some(3), ring: Some(4) },
    Layout { name: "x, y, z", numbers: 3, intensity: None, ring: None },
];

/// Coordinates of a scan are smaller, m.
const FARTHEST: f32 = 1e4;
/// Intensities are not larger.
const BRIGHTEST: f32 = 65_535.0;
/// Rings are fewer.
const RINGS: f32 = 256.0;
/// Smaller numbers than this, but for zero, are bytes of something else.
const SMALLEST: f32 = 1e-20;

impl Layout {
    fn fits(&self, numbers: &[f32]) -> bool {
        let is_length = numbers.len().is_multiple_of(self.numbers);
        is_length && numbers.chunks_exact(self.numbers).all(|point| self.is_point(point))
    }

    fn is_point(&self, point: &[f32]) -> bool {
        let value = |place: Option<usize>| place.and_then(|place| point.get(place)).copied().unwrap_or_default();
        let is_coordinate = |value: &f32| value.abs() < FARTHEST && (*value == 0.0 || value.abs() > SMALLEST);
        let (intensity, ring) = (value(self.intensity), value(self.ring));
        point.iter().take(3).all(is_coordinate)
            && (0.0..=BRIGHTEST).contains(&intensity)
            && (0.0..RINGS).contains(&ring)
    }

    /// How far a point is from the one before, on average and of its distance: scans are in the order of the head.
    fn roughness(&self, numbers: &[f32]) -> f64 {
        let place = |point: &[f32]| -> [f64; 3] {
            let mut place = [0.0; 3];
            place.iter_mut().zip(point).for_each(|(to, from)| *to = f64::from(*from));
            place
        };
        let length = |[x, y, z]: [f64; 3]| (x * x + y * y + z * z).sqrt();
        let points: Vec<[f64; 3]> = numbers.chunks_exact(self.numbers).map(place).collect();
        let step = |pair: &[[f64; 3]]| {
            let away = [0, 1, 2].map(|axis| pair[1][axis] - pair[0][axis]);
            length(away) / (1.0 + length(pair[0]))
        };
        points.windows(2).map(step).sum::<f64>() / points.len().max(1) as f64
    }
}

/// The points of bytes.
pub(super) fn read(bytes: &[u8]) -> Result<FileCloud, String> {
    let (words, rest) = bytes.as_chunks::<4>();
    let numbers: Vec<f32> = words.iter().map(|word| f32::from_le_bytes(*word)).collect();
    let known = || LAYOUTS.map(|layout| format!("{} ({} bytes)", layout.name, 4 * layout.numbers)).join("; ");
    let is_whole = LAYOUTS.iter().any(|layout| numbers.len().is_multiple_of(layout.numbers));
    if !rest.is_empty() || !is_whole {
        return Err(format!("{} bytes are no whole number of points: known are {}", bytes.len(), known()));
    }
    let mut fitting: Vec<&Layout> = LAYOUTS.iter().filter(|layout| layout.fits(&numbers)).collect();
    if fitting.len() > 1 {
        fitting.sort_by(|a, b| a.roughness(&numbers).total_cmp(&b.roughness(&numbers)));
    }
    let Some(layout) = fitting.first() else {
        return Err(format!("its numbers are no coordinates in any of the known ways: {}", known()));
    };
    let mut cloud = FileCloud::default();
    if layout.numbers != LAYOUTS[0].numbers {
        cloud.notes.push(format!("points of {} numbers: {}", layout.numbers, layout.name));
    }
    let ring = |point: &[f32]| layout.ring.and_then(|place| point.get(place)).copied();
    // Some write a time where others have the ring.
    let are_rings =
        layout.ring.is_some() && numbers.chunks_exact(layout.numbers).filter_map(ring).all(|ring| ring.fract() == 0.0);
    let point = |point: &[f32]| FilePoint {
        position: [0, 1, 2].map(|axis: usize| f64::from(point[axis])),
        intensity: layout.intensity.and_then(|place| point.get(place)).map_or(0.0, |value| f64::from(*value)),
        ring: ring(point).filter(|_| are_rings).map(|ring| ring as u16),
    };
    cloud.points = numbers.chunks_exact(layout.numbers).map(point).collect();
    Ok(cloud)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall around, seen by four rings one after the other, as `layout` writes it.
    fn wall(layout: &[&str]) -> Vec<u8> {
        let mut bytes = Vec::new();
        for index in 0..720_u16 {
            let (angle, ring) = (f32::from(index % 180).to_radians() * 2.0, index / 180);
            let (x, y, z) = (8.0 * angle.cos(), 8.0 * angle.sin(), f32::from(ring) - 1.5);
            for number in layout {
                let value = match *number {
                    "x" => x,
                    "y" => y,
                    "z" => z,
                    "i" => f32::from(index % 100) / 100.0,
                    "r" => f32::from(ring),
                    _ => f32::from(index) * 1e-4,
                };
                bytes.extend(value.to_le_bytes());
            }
        }
        bytes
    }

    #[test]
    fn the_length_of_a_point_is_told_by_its_numbers() {
        for (layout, has_ring) in [
            (&["x", "y", "z", "i"][..], false),
            (&["x", "y", "z", "i", "r"], true),
            (&["x", "y", "z", "i", "t"], false),
            (&["x", "y", "z", "i", "r", "t"], true),
            (&["x", "y", "z"], false),
        ] {
            let cloud = read(&wall(layout)).unwrap_or_else(|error| panic!("{layout:?}: {error}"));
            assert_eq!(cloud.points.len(), 720, "{layout:?}");
            for point in &cloud.points {
                let [x, y, _] = point.position;
                assert!((x.hypot(y) - 8.0).abs() < 1e-5, "{layout:?}: {point:?}");
                assert_eq!(point.ring.is_some(), has_ring, "{layout:?}");
            }
        }
        let error = read(&[0x7F; 48]).map(|cloud| cloud.points.len()).unwrap_err();
        assert!(error.contains("nuScenes"), "{error}");
    }
}
