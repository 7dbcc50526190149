//! How much thinner the ground and facades of real scans become by calibrating on them.
//!
//! The scans of the Moosmann route come without a calibration of their own: each row has the elevation that its text
//! states, and no corrections. Patches of ground (cells of 4 m) and of facades (cells of 6 m) are cut out of every tenth
//! scan, and D_corr, theta and alpha of all rows are found with every patch as a plane of its own. The thickness, the root
//! mean square distance of the points of a patch from its plane of best fit, is measured on other scans, half way between.
//! Which points belong to a patch is decided with the values of the start, before and after alike.

use std::collections::BTreeMap;
use std::path::Path;

use agv_lidar3d::calibration::Laser;
use agv_lidar3d::geometry::Offsets;
use agv_lidar3d::intrinsic::{Deviation, Plane, Residual, Return, Target, calibrate_near, flatness};
use anyhow::Context;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rayon::prelude::*;
use serde::Serialize;

use agv_host_sim::import::range_image::RangeImages;
use agv_host_sim::lidar3d::signatures::sensor_height;

/// The route begins to move at this scan; all before are of one place.
const FIRST_MOVING: usize = 190;
/// Scans from one that is used to the next.
const STEP: usize = 10;
/// Distances of points that are used, m.
const RANGES: [f64; 2] = [3.0, 45.0];
/// Points this high above the ground are of facades, and so near to it of the ground, m.
const FOOT: f64 = 0.5;
/// Widths of the cells, m.
const GROUND_CELL: f64 = 4.0;
const FACADE_CELL: f64 = 6.0;
/// A patch has so many points, of so many rows, which are so large a part of its cell.
const FEWEST_POINTS: usize = 60;
const FEWEST_ROWS: usize = 5;
const LEAST_SHARE: f64 = 0.5;
/// Half the thickness of what votes for a plane, m; what is cut out reaches so many times as far as its points scatter, which
/// is no more than this, m: kerbs, cars and bushes are no planes.
const REACH: f64 = 0.15;
const CUT: f64 = 3.0;
const ROUGHEST: f64 = 0.05;
/// The median of an absolute normal deviate.
const MEDIAN_DEVIATE: f64 = 0.6745;
/// Planes that are tried in a cell.
const PROPOSALS: usize = 60;
/// Sines of the rise of a normal: of a facade at most, of the ground at least.
const LEVEL: f64 = 0.25;
const UPRIGHT: f64 = 0.95;
/// How well the start is known: what a factory calibration is off (m, deg, deg).
const PRIOR: [f64; 3] = [0.02, 0.1, 0.3];

/// Thickness of one kind of surface.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Thickness {
    /// Patches.
    pub patches: usize,
    /// Points.
    pub points: usize,
    /// Before, m.
    pub before_m: f64,
    /// After, m.
    pub after_m: f64,
}

/// What came out.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Outcome {
    /// Ground in the scans that the calibration used.
    pub ground_used: Thickness,
    /// Facades there.
    pub facades_used: Thickness,
    /// Ground in other scans.
    pub ground_held_out: Thickness,
    /// Facades there.
    pub facades_held_out: Thickness,
    /// Rows that were observed.
    pub rows: usize,
    /// Greatest change of D_corr, theta and alpha: m, deg, deg.
    pub greatest_change: [f64; 3],
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Ground,
    Facade,
}

/// Measures it on the route in `folder`, which holds `velodyne_dist`.
///
/// # Errors
/// If the scans cannot be read or do not determine the rows.
pub fn moosmann(folder: &Path) -> anyhow::Result<Outcome> {
    let images = RangeImages::open(&folder.join("velodyne_dist"))?;
    let lasers = images.calibration().lasers;
    let scans = |first: usize| -> anyhow::Result<Vec<(Kind, Target)>> {
        let moving = (FIRST_MOVING + first..images.files.len()).step_by(STEP);
        let chosen: Vec<usize> = std::iter::once(first).chain(moving).collect();
        let found: Result<Vec<_>, _> = chosen.into_par_iter().map(|scan| patches(&images, &lasers, scan)).collect();
        Ok(found?.into_iter().flatten().collect())
    };
    let (used, held_out) = (scans(0)?, scans(STEP / 2)?);
    let targets: Vec<Target> = used.iter().map(|(_, target)| target.clone()).collect();
    let prior = Deviation {
        distance: PRIOR[0],
        elevation: PRIOR[1].to_radians(),
        rotation: PRIOR[2].to_radians(),
        ..Deviation::FACTORY
    };
    let found = calibrate_near(&lasers, Offsets::Orthogonal, Residual::AlongBeam, &prior, &targets)
        .context("the patches of ground and facades")?;
    let thickness = |patches: &[(Kind, Target)], kind| thickness(patches, kind, &lasers, &found.lasers);
    let greatest = |value: fn(&Laser) -> f64| {
        found.lasers.iter().zip(&lasers).map(|(new, old)| (value(new) - value(old)).abs()).fold(0.0, f64::max)
    };
    Ok(Outcome {
        ground_used: thickness(&used, Kind::Ground),
        facades_used: thickness(&used, Kind::Facade),
        ground_held_out: thickness(&held_out, Kind::Ground),
        facades_held_out: thickness(&held_out, Kind::Facade),
        rows: found.deviations.iter().flatten().count(),
        greatest_change: [
            greatest(|laser| laser.distance),
            greatest(|laser| laser.elevation).to_degrees(),
            greatest(|laser| laser.rotation).to_degrees(),
        ],
    })
}

fn thickness(patches: &[(Kind, Target)], kind: Kind, before: &[Laser], after: &[Laser]) -> Thickness {
    let of_kind = patches.iter().filter(|(found, _)| *found == kind);
    let mut sums = [0.0; 2];
    let (mut count, mut points) = (0, 0);
    for (_, target) in of_kind {
        let flat = [before, after].map(|lasers| flatness(lasers, Offsets::Orthogonal, &target.returns));
        let [Some(before), Some(after)] = flat else { continue };
        sums = [sums[0] + before.sum_of_squares, sums[1] + after.sum_of_squares];
        count += 1;
        points += before.points;
    }
    let [before_m, after_m] = sums.map(|sum| (sum / points.max(1) as f64).sqrt());
    Thickness { patches: count, points, before_m, after_m }
}

/// Whether it is above the ground, and where it is, in widths of a cell.
type Cell = (bool, i32, i32);

/// A return, and where it lies.
type Seen = (Return, [f64; 3]);

/// The patches of a scan.
fn patches(images: &RangeImages, lasers: &[Laser], scan: usize) -> anyhow::Result<Vec<(Kind, Target)>> {
    let counts = images.counts(scan)?;
    let height = f64::from(sensor_height(&images.points(scan)?));
    let columns = images.rotations.len();
    let mut cells: BTreeMap<Cell, Vec<Seen>> = BTreeMap::new();
    for (place, count) in counts.iter().enumerate() {
        let distance = f64::from(*count) * images.resolution;
        let seen = Return { laser: place / columns, azimuth: -images.rotations[place % columns], distance };
        let Some(point) = seen.point(lasers, Offsets::Orthogonal) else { continue };
        let above = point[2] + height;
        if !(RANGES[0]..RANGES[1]).contains(&distance) || above < -FOOT {
            continue;
        }
        let (is_facade, cell) = if above > FOOT { (true, FACADE_CELL) } else { (false, GROUND_CELL) };
        let index = |value: f64| (value / cell).floor() as i32;
        cells.entry((is_facade, index(point[0]), index(point[1]))).or_default().push((seen, point));
    }
    let mut random = ChaCha8Rng::seed_from_u64(scan as u64);
    let patch = |((is_facade, ..), seen): (Cell, Vec<Seen>)| {
        let kind = if is_facade { Kind::Facade } else { Kind::Ground };
        Some((kind, patch(kind, &seen, &mut random)?))
    };
    Ok(cells.into_iter().filter_map(patch).collect())
}

/// The plane of a cell, if there is one.
fn patch(kind: Kind, seen: &[Seen], random: &mut ChaCha8Rng) -> Option<Target> {
    if seen.len() < FEWEST_POINTS {
        return None;
    }
    let is_allowed = |plane: &Plane| match kind {
        Kind::Ground => plane.normal[2].abs() > UPRIGHT,
        Kind::Facade => plane.normal[2].abs() < LEVEL,
    };
    let near = |plane: &Plane| seen.iter().filter(|(_, point)| plane.distance_of(*point).abs() < REACH).count();
    let mut best: Option<(usize, Plane)> = None;
    for _ in 0..PROPOSALS {
        let three: [[f64; 3]; 3] = std::array::from_fn(|_| seen[random.random_range(0..seen.len())].1);
        let Some(plane) = Plane::fit(three.into_iter()).filter(is_allowed) else { continue };
        let votes = near(&plane);
        if best.is_none_or(|(most, _)| votes > most) {
            best = Some((votes, plane));
        }
    }
    let (_, first) = best?;
    let fit = |plane: &Plane, reach: f64| {
        Plane::fit(seen.iter().map(|(_, point)| *point).filter(|point| plane.distance_of(*point).abs() < reach))
    };
    let plane = fit(&first, REACH)?;
    let mut off: Vec<f64> = seen.iter().map(|(_, point)| plane.distance_of(*point).abs()).collect();
    off.retain(|distance| *distance < REACH);
    off.sort_by(f64::total_cmp);
    let scatter = off.get(off.len() / 2)? / MEDIAN_DEVIATE;
    if scatter > ROUGHEST {
        return None;
    }
    let reach = CUT * scatter;
    let plane = fit(&plane, reach)?;
    let returns: Vec<Return> =
        seen.iter().filter(|(_, point)| plane.distance_of(*point).abs() < reach).map(|(seen, _)| *seen).collect();
    let mut rows: Vec<usize> = returns.iter().map(|seen| seen.laser).collect();
    rows.dedup();
    let is_patch = is_allowed(&plane)
        && returns.len() >= FEWEST_POINTS
        && returns.len() as f64 >= LEAST_SHARE * seen.len() as f64
        && rows.len() >= FEWEST_ROWS;
    is_patch.then_some(Target { returns, plane })
}
