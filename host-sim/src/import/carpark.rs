//! The car park data of ACFR (J. Guivant, E. Nebot, "Optimization of the simultaneous localization and map-building
//! algorithm for real-time implementation", IEEE Transactions on Robotics and Automation 17(3), 2001), as a folder of
//! tables: `odometry.csv`, `laser_ranges_m.csv`, `laser_intensity.csv`, `beacons.csv`, `gps.csv`, `events.csv`.

use std::ops::RangeInclusive;
use std::path::Path;

use agv_core::geometry::Pose;
use agv_core::localizer::Parameters;
use agv_core::maps::{Landmark, LandmarkKind};
use agv_core::measurement::{LaserId, SpeedSample, Time};
use agv_core::odometry::{Ackermann, Vehicle};

use super::table::{Row, read_rows};
use crate::recording::{RecordedEvent, RecordedScan, Recording, Reference, Truth};
use crate::text_file::TextFileError;

/// Geometry of the vehicle as its owners state it; encoder offset and wheelbase, m.
pub const VEHICLE: Ackermann = Ackermann { wheelbase: 2.83, encoder_offset: 0.76 };

/// Place of the laser in R, the centre of the rear axle: x and y, m. It looks ahead.
pub const LASER: [f64; 2] = [3.78, 0.5];

/// The part of the data in which the satellite receiver is good, s.
pub const WINDOW: RangeInclusive<f64> = 45.0..=157.0;

/// Standard deviation of a surveyed reflector's place along each axis, m: that of the receiver.
pub const BEACON_DEVIATION: f32 = 0.02;

/// Ranges from here on are codes of the laser for absent returns, m: 81.83, 81.87 and 81.91 occur.
const NO_RETURN: f64 = 81.8;

const BEAMS: usize = 361;

/// By how much the time of an event may differ between two files, s.
const SAME_TIME: f64 = 2e-3;

/// Reads the data within a window of time, s, in the order of arrival. Absent returns become zero. References are the
/// receiver's positions; the receiver stands on the laser. The time of a single beam is not known: all beams of a scan
/// count as simultaneous.
///
/// # Errors
/// If a file is missing, empty, not a table, has a bad row, or the files do not fit each other.
pub fn read(folder: &Path, window: &RangeInclusive<f64>) -> Result<Recording, TextFileError> {
    let odometry = read_rows(&folder.join("odometry.csv"), 3)?;
    let ranges = read_rows(&folder.join("laser_ranges_m.csv"), BEAMS + 1)?;
    let intensities = read_rows(&folder.join("laser_intensity.csv"), BEAMS + 1)?;
    let beacons = read_rows(&folder.join("beacons.csv"), 2)?;
    let gps = read_rows(&folder.join("gps.csv"), 3)?;
    let order_path = folder.join("events.csv");
    let order = read_rows(&order_path, 3)?;

    let mut events = Vec::new();
    let mut references = Vec::new();
    for row in &order {
        let [seconds, sensor, index] = row.numbers[..] else { continue };
        let problem = |problem| TextFileError::Line { path: order_path.clone(), line: row.line, problem };
        if !window.contains(&seconds) {
            continue;
        }
        let time = Time::from_seconds(seconds);
        let at = |rows: &[Row]| {
            let row = rows.get(index as usize).filter(|_| index >= 0.0 && index.fract() == 0.0);
            let row = row.ok_or_else(|| problem(format!("sensor {sensor} has no row {index}")))?;
            if (row.numbers[0] - seconds).abs() > SAME_TIME {
                return Err(problem(format!("row {index} of sensor {sensor} is of another time")));
            }
            Ok(row.numbers.clone())
        };
        if sensor == 1.0 {
            let row = at(&gps)?;
            references.push(Reference { time, x: row[1], y: row[2], heading: None });
        } else if sensor == 2.0 {
            let row = at(&odometry)?;
            events.push(RecordedEvent::Speed(SpeedSample { time, speed: row[1], steering: row[2] }));
        } else if sensor == 3.0 {
            events.push(RecordedEvent::Scan(scan(time, &at(&ranges)?, &at(&intensities)?)));
        } else {
            return Err(problem(format!("there is no sensor {sensor}")));
        }
    }
    let landmark = |(id, row): (u16, &Row)| Landmark {
        id,
        kind: LandmarkKind::Reflector,
        x: row.numbers[0],
        y: row.numbers[1],
        deviation: BEACON_DEVIATION,
    };
    Ok(Recording {
        parameters: Parameters::new(Vehicle::Ackermann(VEHICLE), Pose::new(LASER[0], LASER[1], 0.0)),
        landmarks: (0..).zip(&beacons).map(landmark).collect(),
        events,
        truth: Vec::new(),
        references,
        state: None,
    })
}

/// Reads the batch solution that comes with the data, `reference_smoothed.csv`: poses of R by odometry, laser and
/// reflectors of the whole drive at once, without the receiver.
///
/// # Errors
/// If the file is missing, empty, not a table, or has a bad row.
pub fn read_batch_solution(folder: &Path) -> Result<Vec<Truth>, TextFileError> {
    let rows = read_rows(&folder.join("reference_smoothed.csv"), 4)?;
    let pose = |row: &Row| Truth {
        time: Time::from_seconds(row.numbers[0]),
        pose: Pose::new(row.numbers[1], row.numbers[2], row.numbers[3]),
    };
    Ok(rows.iter().map(pose).collect())
}

/// The first column of both rows is the time; column k after it is the beam at 0.5 k - 90 degrees.
fn scan(time: Time, ranges: &[f64], intensities: &[f64]) -> RecordedScan {
    RecordedScan {
        laser: LaserId::FIRST,
        start: time,
        beam_interval: 0.0,
        first_bearing: -std::f64::consts::FRAC_PI_2,
        bearing_step: 0.5_f64.to_radians(),
        ranges: ranges[1..].iter().map(|range| if *range < NO_RETURN { *range as f32 } else { 0.0 }).collect(),
        intensities: intensities[1..].iter().map(|intensity| *intensity as u16).collect(),
    }
}
