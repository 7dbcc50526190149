//! Errors against protection levels on real drives whose truth is known, by the definitions of the campaign.
//!
//! Judged is each claim for which there is a truth; what a claim is, and what misleads, is as in [`crate::trust::judge`]. Nothing is known of the
//! heading in the car park but from a batch solution that used the same reflectors, so its claims are judged by position alone.

use std::path::Path;

use agv_core::geometry::Pose;
use agv_core::integrity::{AlertLimits, ProtectionLevel};
use agv_core::localizer::{Mode, PoseOutput};
use agv_host_sim::accuracy::{Spread, pose_at};
use agv_host_sim::mapping::contour_mapper::CELL;
use agv_host_sim::replay::ReplayError;
use serde::Serialize;

use super::carpark::{self, CarparkError, Knowledge, Noise};
use super::contour_map;
use super::slam::OfficeDrive;
use crate::trust::judge::Errors;
use crate::trust::stanford::{self, Stanford};

/// A drive in one mode, and what became of its claims.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Recorded {
    /// The drive.
    pub drive: String,
    /// How the vehicle localises.
    pub mode: &'static str,
    /// Claims that were judged.
    pub claims: usize,
    /// Outputs for which there is a truth, and no claim.
    pub silent: usize,
    /// Share of the claims with an error above the protection level.
    pub mi_share: f64,
    /// Claims that are hazardous by either alert limit.
    pub hazardous: usize,
    /// Share of the claims with a protection level within the alert limit of travelling.
    pub available_share: f64,
    /// Largest error over its protection level.
    pub error_over_pl_max: f64,
    /// Errors of the position, m.
    pub position_m: Spread,
    /// Protection levels of the position, m.
    pub pl_m: Spread,
    /// Each claim by both.
    pub stanford: Stanford,
}

/// A claim, or what is no claim, beside its errors.
#[derive(Clone, Copy, Debug)]
struct Judged {
    mode: Mode,
    errors: Errors,
    level: ProtectionLevel,
}

/// The car park in all modes.
///
/// # Errors
/// See [`CarparkError`].
pub fn car_park(folder: &Path) -> Result<Vec<Recorded>, CarparkError> {
    let modes =
        [("reflectors", Knowledge::Map), ("slam", Knowledge::Slam), ("slam and contours", Knowledge::SlamAndContours)];
    modes.into_iter().map(|(mode, knowledge)| of_car_park(folder, mode, knowledge)).collect()
}

fn of_car_park(folder: &Path, mode: &'static str, knowledge: Knowledge) -> Result<Recorded, CarparkError> {
    let (_, recording, replay) = carpark::run(folder, Noise::Nominal, knowledge)?;
    let mount = *recording.parameters.lasers.first();
    let arm = mount.position().norm();
    let judged = recording.references.iter().filter_map(|reference| {
        // The receiver stands where the laser does, which turns with the vehicle.
        let laser = pose_at(&replay.poses, reference.time)?.compose(&mount);
        let told = replay.poses.iter().rev().find(|pose| pose.time <= reference.time)?;
        let level = ProtectionLevel { position: told.level.position + arm * told.level.heading.min(1.0), ..told.level };
        let errors = Errors { position: (laser.position() - reference.position()).norm(), heading: 0.0 };
        Some(Judged { mode: told.mode, errors, level })
    });
    Ok(recorded("car park", mode, judged))
}

/// A building, in maps of contours that were made from the rest of the same drive; see [`contour_map`].
///
/// # Errors
/// See [`contour_map::localise`].
pub fn building(name: &str, drive: &OfficeDrive, length: f64) -> Result<Recorded, ReplayError> {
    let localised = contour_map::localise(drive, length, CELL)?;
    let judged = localised.outputs.iter().map(|(output, truth): &(PoseOutput, Pose)| Judged {
        mode: output.mode,
        errors: Errors::of(&output.pose, truth),
        level: output.level,
    });
    Ok(recorded(name, "contour map", judged))
}

fn recorded(drive: &str, mode: &'static str, judged: impl Iterator<Item = Judged>) -> Recorded {
    let is_claim = |one: &Judged| !matches!(one.mode, Mode::NotLocalised | Mode::Lost);
    let (claims, silent): (Vec<Judged>, Vec<Judged>) = judged.partition(is_claim);
    let AlertLimits { travel, docking } = AlertLimits::default();
    let mut counts = stanford::Counts::new();
    for Judged { errors, level, .. } in &claims {
        stanford::count(&mut counts, level.position, errors.position);
    }
    let is_hazardous =
        |one: &&Judged| [travel, docking].iter().any(|limit| one.errors.exceed(limit) && limit.holds(&one.level));
    let share = |count: usize| count as f64 / claims.len().max(1) as f64;
    Recorded {
        drive: drive.to_owned(),
        mode,
        claims: claims.len(),
        silent: silent.len(),
        mi_share: share(claims.iter().filter(|one| one.errors.over(&one.level) > 1.0).count()),
        hazardous: claims.iter().filter(is_hazardous).count(),
        available_share: share(claims.iter().filter(|one| travel.holds(&one.level)).count()),
        error_over_pl_max: claims.iter().map(|one| one.errors.over(&one.level)).fold(0.0, f64::max),
        position_m: Spread::of(claims.iter().map(|one| one.errors.position)),
        pl_m: Spread::of(claims.iter().map(|one| one.level.position)),
        stanford: Stanford::of(counts),
    }
}
