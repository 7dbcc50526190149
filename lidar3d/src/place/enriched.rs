//! A signature of normals, heights and ranges (M 6.3), blind to the heading of the sensor.
//!
//! Normals: the histogram of vertical parts, as square roots (their Euclidean distance is Hellinger's). Heights and
//! ranges: a polar image of the greatest height above the ground, its root, of which each ring keeps the amplitudes of
//! its first frequencies, and each pair of neighbouring rings their cross spectra. Amplitudes of a Fourier transform
//! round the axis do not change when the sensor turns, nor do phases of one ring against the next.

use super::histogram::{BINS, Histogram};
use crate::cloud::Cloud;

const RINGS: usize = 13;
const RING_WIDTH: f32 = 6.0;
const SECTORS: usize = 60;
const FREQUENCIES: usize = 6;
/// Real and imaginary parts of the cross spectra from the first frequency on, and amplitudes from the zeroth on.
const IMAGE: usize = RINGS * FREQUENCIES + (RINGS - 1) * (FREQUENCIES - 1) * 2;
/// Numbers in a signature, one byte each.
pub const ENRICHED_LENGTH: usize = BINS + IMAGE + COUNTS;
const COUNTS: usize = RINGS * FREQUENCIES + (RINGS - 1) * (FREQUENCIES - 1) * 2;
/// Points so far above the ground are obstacles, m.
const OBSTACLE: f32 = 0.5;
/// Weight of the image of heights against the histogram of normals, and of that of counts.
const HEIGHT_WEIGHT: f32 = 0.5;
const COUNT_WEIGHT: f32 = 0.5;
/// Greatest magnitude that a byte can hold.
const FULL_SCALE: f32 = 127.0;

/// The signature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Enriched(pub [i8; ENRICHED_LENGTH]);

impl Enriched {
    /// The signature of a scan whose sensor stands `sensor_height` m above the ground; `histogram` is that of the scan.
    #[must_use]
    pub fn new(cloud: &Cloud<'_>, histogram: &Histogram, sensor_height: f32) -> Self {
        let mut heights = [[0.0f32; SECTORS]; RINGS];
        let mut counts = [[0.0f32; SECTORS]; RINGS];
        for [x, y, z] in cloud.seen() {
            let height = z + sensor_height;
            let ring = (libm::sqrtf(x * x + y * y) / RING_WIDTH) as usize;
            if height <= 0.0 || ring >= RINGS {
                continue;
            }
            let sector = ((direction(x, y) * SECTORS as f32) as usize).min(SECTORS - 1);
            if let (Some(row), Some(count)) = (heights.get_mut(ring), counts.get_mut(ring)) {
                row[sector] = row[sector].max(height);
                count[sector] += f32::from(u8::from(height > OBSTACLE));
            }
        }
        // A share of the columns, not their number, is what the place determines.
        let per_column = 870.0 / cloud.columns().max(1) as f32;
        let heights = heights.map(|row| row.map(libm::sqrtf));
        let counts = counts.map(|row| row.map(|count| libm::log1pf(count * per_column)));
        let mut values = [0.0f32; ENRICHED_LENGTH];
        let (normals, images) = values.split_at_mut(BINS);
        for (value, share) in normals.iter_mut().zip(histogram.normalised().0) {
            *value = libm::sqrtf(share as f32);
        }
        let (height_part, count_part) = images.split_at_mut(IMAGE);
        spectrum(&heights, HEIGHT_WEIGHT, height_part);
        spectrum(&counts, COUNT_WEIGHT, count_part);
        Self(values.map(|value| libm::roundf(value * FULL_SCALE).clamp(-FULL_SCALE, FULL_SCALE) as i8))
    }

    /// Euclidean distance, where the histograms of normals have length one.
    #[must_use]
    pub fn distance(&self, other: &Self) -> f32 {
        let pairs = self.0.iter().zip(&other.0);
        let squared: i32 = pairs.map(|(a, b)| (i32::from(*a) - i32::from(*b)) * (i32::from(*a) - i32::from(*b))).sum();
        libm::sqrtf(squared as f32) / FULL_SCALE
    }
}

/// The direction of a point as a share of the turn, 0 to 1; monotonic in the angle is enough for sectors that all of the
/// scans share, but turned scans need equal sectors, so it is the angle itself.
fn direction(x: f32, y: f32) -> f32 {
    libm::atan2f(y, x) / core::f32::consts::TAU + 0.5
}

/// Amplitudes of each ring and cross spectra of neighbours, scaled to the length `weight`.
fn spectrum(image: &[[f32; SECTORS]; RINGS], weight: f32, out: &mut [f32]) {
    let mut waves = [[[0.0f32; 2]; FREQUENCIES]; RINGS];
    for frequency in 0..FREQUENCIES {
        for sector in 0..SECTORS {
            let phase = (frequency * sector % SECTORS) as f32 * (core::f32::consts::TAU / SECTORS as f32);
            let (sin, cos) = libm::sincosf(phase);
            for (wave, row) in waves.iter_mut().zip(image) {
                wave[frequency][0] += row[sector] * cos;
                wave[frequency][1] -= row[sector] * sin;
            }
        }
    }
    let amplitude = |[re, im]: [f32; 2]| libm::sqrtf(re * re + im * im);
    let mut out_values = out.iter_mut();
    let mut put = |value: f32| {
        if let Some(target) = out_values.next() {
            *target = value;
        }
    };
    for wave in &waves {
        for value in wave {
            put(amplitude(*value));
        }
    }
    for (inner, outer) in waves.iter().zip(waves.iter().skip(1)) {
        for (a, b) in inner.iter().zip(outer).skip(1) {
            let product = [a[0] * b[0] + a[1] * b[1], a[1] * b[0] - a[0] * b[1]];
            // The root of the size, so that it counts like an amplitude.
            let size = libm::sqrtf(amplitude(product)).max(f32::MIN_POSITIVE);
            put(product[0] / size);
            put(product[1] / size);
        }
    }
    let length = libm::sqrtf(out.iter().map(|value| value * value).sum());
    if length > 0.0 {
        for value in out {
            *value *= weight / length;
        }
    }
}
