//! Scans as `sensor_msgs/PointCloud2`, with the fields of several drivers.

use agv_core::measurement::Time;
use agv_lidar3d::calibration::Laser;
use agv_lidar3d::cloud_file::{FilePoint, ringed};

use super::revolution::Revolution;
use crate::ros::messages::{PointCloud2, PointField};

/// The kind of message.
pub const KIND: &str = "sensor_msgs/msg/PointCloud2";
/// An absolute time of a point is one of more seconds than a scan lasts.
const ABSOLUTE: f64 = 1e6;

/// A cloud as a revolution, and the lasers that its rings are of. Times count from `first`, ns, which is the stamp of the first one.
///
/// # Errors
/// What of it contradicts itself, or is missing.
pub fn revolution(cloud: &PointCloud2, first: &mut Option<i64>) -> Result<(Revolution, Vec<Laser>), String> {
    let stamp = cloud.header.stamp.nanoseconds();
    let first = *first.get_or_insert(stamp);
    let points = points(cloud)?;
    let seen: Vec<&(FilePoint, f64)> = points.iter().filter(|(point, _)| point.is_seen()).collect();
    let earliest = seen.iter().map(|(_, time)| *time).fold(f64::INFINITY, f64::min);
    let file_points: Vec<FilePoint> = seen.iter().map(|(point, _)| *point).collect();
    let mut cloud = ringed(&file_points);
    for (point, (_, time)) in cloud.points.iter_mut().zip(&seen) {
        point.time = (1e9 * (time - earliest)).round() as i32;
    }
    // Some drivers state the times from the stamp on, some up to it, some by the clock.
    let shift = if earliest.abs() < ABSOLUTE { earliest } else { 0.0 };
    let start = Time::from_micros(((stamp - first).max(0) / 1000).unsigned_abs()).offset(shift);
    Ok((Revolution { start, points: cloud.points, is_whole: true }, cloud.lasers))
}

/// The points with their times, s; without a field of time all are 0.
fn points(cloud: &PointCloud2) -> Result<Vec<(FilePoint, f64)>, String> {
    let field = |names: &[&str]| cloud.fields.iter().find(|field| names.contains(&field.name.as_str()));
    let needed = |name: &str| field(&[name]).ok_or_else(|| format!("a cloud has no field {name}"));
    let position = [needed("x")?, needed("y")?, needed("z")?];
    let intensity = field(&["intensity", "reflectivity"]);
    let ring = field(&["ring", "channel", "line"]);
    let time = field(&["t", "time", "timestamp", "time_stamp", "offset_time"]);
    let step = cloud.point_step as usize;
    let (count, row) = (cloud.width as usize, cloud.row_step as usize);
    let all = whole_points(cloud).ok_or("a cloud is shorter than it says")?;
    let place = |number: usize| (number / count.max(1)) * row + (number % count.max(1)) * step;
    let mut points = Vec::with_capacity(all);
    for number in 0..all {
        let at = place(number);
        let bytes = cloud.data.get(at..at + step).ok_or("a cloud is shorter than it says")?;
        let read = |field: &PointField| value(field, bytes, cloud.is_bigendian);
        let [x, y, z] = position.map(read);
        let missing = || "a field lies outside of its point, or is of no kind that ROS knows".to_owned();
        let time = time.map_or(Some(0.0), read).ok_or_else(missing)?;
        let point = FilePoint {
            position: [x.ok_or_else(missing)?, y.ok_or_else(missing)?, z.ok_or_else(missing)?],
            intensity: intensity.map_or(Some(0.0), read).ok_or_else(missing)?,
            ring: match ring {
                Some(field) => Some(read(field).ok_or_else(missing)? as u16),
                None => None,
            },
        };
        points.push((point, time));
    }
    // Whole numbers of time are nanoseconds.
    let unit = match time {
        Some(field) if field.datatype < FLOAT => 1e-9,
        _ => unit_of_times(&points, cloud.header.stamp.nanoseconds()),
    };
    points.iter_mut().for_each(|(_, time)| *time *= unit);
    Ok(points)
}

/// A scan lasts no longer, s.
const LONGEST_SCAN: f64 = 2.0;
/// Units in which drivers tell the times of points, s.
const UNITS: [f64; 4] = [1.0, 1e-3, 1e-6, 1e-9];
/// A time of a point by the clock is this near to the stamp of the cloud, s.
const NEAR: f64 = 1e5;

/// The unit of times that are no whole numbers, s: that in which they agree with the stamp, or the largest one in which the scan lasts no
/// longer than scans do. Drivers of Livox tell nanoseconds by the clock, others milliseconds from the stamp on.
fn unit_of_times(points: &[(FilePoint, f64)], stamp: i64) -> f64 {
    let times = || points.iter().map(|(_, time)| *time).filter(|time| time.is_finite());
    let (least, most) = times().fold((f64::MAX, f64::MIN), |(least, most), time| (least.min(time), most.max(time)));
    let stamp = stamp as f64 * 1e-9;
    let agrees = |unit: &&f64| (least * **unit - stamp).abs() < NEAR && stamp > ABSOLUTE;
    let is_short = |unit: &&f64| (most - least) * **unit <= LONGEST_SCAN;
    UNITS.iter().find(|unit| agrees(unit)).or_else(|| UNITS.iter().find(is_short)).copied().unwrap_or(1.0)
}

/// How many points there are; None if the bytes do not hold so many.
fn whole_points(cloud: &PointCloud2) -> Option<usize> {
    let [width, height, step, row] =
        [cloud.width, cloud.height, cloud.point_step, cloud.row_step].map(|value| value as usize);
    let all = width.checked_mul(height)?;
    let own = width.checked_mul(step)?;
    let end = height.saturating_sub(1).checked_mul(row)?.checked_add(own)?;
    let is_held = step > 0 && (height == 1 || row >= own) && end <= cloud.data.len();
    (all == 0 || is_held).then_some(all)
}

/// `PointField.FLOAT32`; smaller kinds are whole numbers.
const FLOAT: u8 = 7;

/// A number of a point, by the kinds of `sensor_msgs/PointField`.
fn value(field: &PointField, point: &[u8], is_big: bool) -> Option<f64> {
    let length = [1, 1, 2, 2, 4, 4, 4, 8].get(usize::from(field.datatype).checked_sub(1)?).copied()?;
    let offset = field.offset as usize;
    let mut bytes = [0_u8; 8];
    let own = bytes.get_mut(..length)?;
    own.copy_from_slice(point.get(offset..offset.checked_add(length)?)?);
    if is_big {
        own.reverse();
    }
    let whole = u64::from_le_bytes(bytes);
    Some(match field.datatype {
        1 => f64::from(whole as i8),
        2 => f64::from(whole as u8),
        3 => f64::from(whole as i16),
        4 => f64::from(whole as u16),
        5 => f64::from(whole as i32),
        6 => f64::from(whole as u32),
        7 => f64::from(f32::from_bits(whole as u32)),
        _ => f64::from_bits(whole),
    })
}
