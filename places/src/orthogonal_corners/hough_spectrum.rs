//! The Hough spectrum: how much of a scan lies on straight lines, by the direction of the lines.

use core::f32::consts::FRAC_PI_2;

use agv_core::geometry::ScanPoint;
use agv_core::sensing::PointScan;

/// Directions between the first axis and the second one.
const DIRECTIONS: u8 = 90;
/// Cells of the distance of a line from the sensor.
const CELLS: usize = 1024;
/// Width of a cell, m.
const WIDTH: f32 = 0.05;

/// Scratch memory of the Hough transform of two orthogonal directions, 4 kB.
#[derive(Clone, Debug)]
pub struct HoughSpectrum {
    across: [u16; CELLS],
    along: [u16; CELLS],
}

impl Default for HoughSpectrum {
    fn default() -> Self {
        Self { across: [0; CELLS], along: [0; CELLS] }
    }
}

impl HoughSpectrum {
    /// The direction in [0, pi/2), rad, for which most points lie on lines along it or across it: the maximum of
    /// HS(theta) + HS(theta + pi/2), where HS is the sum of the squared counts of the Hough transform, refined by a
    /// parabola. None for a scan without returns within 25 m. Quiet for any input; costs 180 passes over the points.
    #[must_use]
    pub fn dominant_direction<const BEAMS: usize>(&mut self, scan: &PointScan<BEAMS>) -> Option<f32> {
        let step = FRAC_PI_2 / f32::from(DIRECTIONS);
        let mut powers = [0.0_f32; DIRECTIONS as usize];
        for (power, direction) in powers.iter_mut().zip(0..DIRECTIONS) {
            let (sine, cosine) = libm::sincosf(step * f32::from(direction));
            *power = self.power(scan, ScanPoint::new(cosine, sine));
        }
        let (best, most) = powers.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
        if most <= 0.0 {
            return None;
        }
        let count = powers.len();
        let beside = |index: usize| powers.get(index % count).copied().unwrap_or(most);
        let (before, after) = (beside(best + count - 1), beside(best + 1));
        let bend = before + after - 2.0 * most;
        let shift = if bend < 0.0 { 0.5 * (before - after) / bend } else { 0.0 };
        let direction = step * (best as f32 + shift);
        Some(if direction < 0.0 { direction + FRAC_PI_2 } else { direction })
    }

    /// Sum of the squared counts of lines along the unit vector `axis` and across it.
    fn power<const BEAMS: usize>(&mut self, scan: &PointScan<BEAMS>, axis: ScanPoint) -> f32 {
        self.across.fill(0);
        self.along.fill(0);
        let cell = |distance: f32| (distance / WIDTH + 0.5 * CELLS as f32) as usize;
        let add = |cells: &mut [u16; CELLS], index: usize| {
            if let Some(count) = cells.get_mut(index) {
                *count = count.saturating_add(1);
            }
        };
        let reach = 0.5 * CELLS as f32 * WIDTH;
        let returns = scan.points.iter().zip(&scan.ranges).filter(|(_, range)| **range > 0.0 && **range < reach);
        for (point, _) in returns {
            add(&mut self.across, cell(axis.x * point.x + axis.y * point.y));
            add(&mut self.along, cell(axis.x * point.y - axis.y * point.x));
        }
        let squares =
            |cells: &[u16; CELLS]| -> u64 { cells.iter().map(|&count| u64::from(count) * u64::from(count)).sum() };
        (squares(&self.across) + squares(&self.along)) as f32
    }
}
