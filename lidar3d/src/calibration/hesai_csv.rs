//! The angles of a Hesai sensor as it states them: number from 1, elevation and azimuth, deg; azimuth is clockwise.

use std::string::ToString;
use std::vec::Vec;

use super::{Calibration, CalibrationError, Laser};

/// Whether a text begins as such a table does.
pub(super) fn is_one(text: &str) -> bool {
    let head = text.lines().next().unwrap_or_default().to_ascii_lowercase();
    let names: Vec<&str> = head.split(',').map(str::trim).collect();
    matches!(names[..], ["laser id" | "laser_id" | "channel", "elevation", "azimuth", ..])
}

pub(super) fn read(text: &str) -> Result<Calibration, CalibrationError> {
    let mut lasers = Vec::new();
    for line in text.lines().skip(1).filter(|line| !line.trim().is_empty()) {
        let place = lasers.len();
        let mut fields = line.split(',');
        let mut value = |name| {
            let field = fields.next().and_then(|field| field.trim().parse::<f64>().ok());
            field.ok_or(CalibrationError::Value { laser: place, name })
        };
        let (number, elevation, azimuth) = (value("number")?, value("elevation")?, value("azimuth")?);
        if number != place as f64 + 1.0 {
            return Err(CalibrationError::Numbers { place, found: number as i64 });
        }
        lasers.push(Laser {
            elevation: elevation.to_radians(),
            rotation: -azimuth.to_radians(),
            is_enabled: true,
            ..Laser::default()
        });
    }
    if lasers.is_empty() {
        return Err(CalibrationError::Foreign { reason: "it holds no laser".to_string() });
    }
    Ok(Calibration { distance_resolution: None, lasers })
}
