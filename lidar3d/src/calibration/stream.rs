//! The calibration that an HDL-64E carries in the status bytes of its packets.

use super::{Calibration, Full, Laser};
use crate::packet::{STATUS_CYCLE, Tail};

/// Bytes of the calibration in one cycle.
const CALIBRATION_LENGTH: usize = STATUS_CYCLE / 16 * 7;
const LASER_LENGTH: usize = 28;

/// The calibration of an HDL-64E S2 or S3 from the status bytes of [`STATUS_CYCLE`] or more consecutive packets
/// (HDL-64E S3 manual, appendix E). None if they hold no whole one.
#[must_use]
pub fn calibration_from_stream(tails: impl IntoIterator<Item = Tail>) -> Option<Calibration> {
    // In each group of 16 packets nine are of clock and state; the other seven carry the calibration.
    let values: std::vec::Vec<u8> = tails
        .into_iter()
        .map(Tail::status)
        .filter(|(kind, _)| (b'1'..=b'7').contains(kind))
        .map(|(_, value)| value)
        .collect();
    let starts = values.windows(5).enumerate().filter(|(_, window)| window == b"UNIT#").map(|(start, _)| start);
    for start in starts {
        let Some(cycle) = values.get(start..start + CALIBRATION_LENGTH) else { continue };
        let records = cycle[7..].as_chunks::<LASER_LENGTH>().0.iter().take(64);
        if records.clone().enumerate().any(|(id, record)| usize::from(record[0]) != id) {
            continue;
        }
        let lasers = records.map(|record| laser(record)).collect();
        return Some(Calibration { distance_resolution: None, lasers });
    }
    None
}

fn laser(record: &[u8]) -> Laser {
    let number = |at: usize| f64::from(i16::from_le_bytes([record[at], record[at + 1]]));
    Laser {
        elevation: (0.01 * number(1)).to_radians(),
        rotation: (0.01 * number(3)).to_radians(),
        distance: 0.001 * number(5),
        vertical_offset: 0.001 * number(11),
        horizontal_offset: 0.001 * number(13),
        is_enabled: true,
        full: Some(Full {
            distance_x: 0.001 * number(7),
            distance_y: 0.001 * number(9),
            focal_distance: 0.001 * number(15),
            focal_slope: 0.1 * number(17),
            min_intensity: record[19],
            max_intensity: record[20],
            has_two_points: true,
        }),
    }
}
