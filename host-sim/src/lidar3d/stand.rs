//! What a sensor saw of a calibration target from one stand.

use std::ops::ControlFlow;
use std::sync::atomic::AtomicBool;

use agv_lidar3d::calibration::Laser;
use agv_lidar3d::geometry::Offsets;
use agv_lidar3d::intrinsic::Return;

use super::open_source::OpenSource;
use super::revolution::Revolution;
use super::setup::Setup;
use super::source_error::SourceError;

/// The returns of the first whole revolution of a source, as they were measured: without any correction.
///
/// # Errors
/// See [`SourceError`]. A source without a whole revolution gives the longest part of one.
pub fn returns(mut source: OpenSource, stop: &AtomicBool) -> Result<Vec<Return>, SourceError> {
    let setup = source.setup()?;
    source.decode_with(Setup {
        // Only the distance correction stays, because the filter is for corrected distances. Of an Ouster, whose
        // calibration is not searched for, nothing is left out.
        lasers: setup.lasers.iter().map(level).collect(),
        offsets: Offsets::Orthogonal,
        two_points: false,
        ..setup.clone()
    });
    let mut best = Revolution::default();
    source.revolutions(stop, |revolution| {
        if revolution.is_whole || revolution.points.len() > best.points.len() {
            best = revolution;
        }
        if best.is_whole { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    let measured = best.points.iter().filter_map(|point| {
        let laser = usize::from(point.laser);
        let [x, y, _] = point.position.map(f64::from);
        Some(Return {
            laser,
            azimuth: (0.01 * f64::from(point.azimuth)).to_radians(),
            distance: x.hypot(y) - setup.lasers.get(laser)?.distance,
        })
    });
    Ok(measured.collect())
}

fn level(laser: &Laser) -> Laser {
    Laser { distance: laser.distance, is_enabled: laser.is_enabled, ..Laser::default() }
}
