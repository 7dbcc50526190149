//! The report of a calibration.

use agv_core::geometry::Pose;

use super::drive::Drive;
use super::found::{Found, Grade, PARAMETER_NAMES};
use super::model::{PARAMETERS, VehicleModel};
use super::odometry_path::OdometryPath;
use crate::report::{Figure, FigureError, Map, Page, PointSet, Series, Table, scatter_chart, trajectory_plot};

/// Name, value before, value, standard deviation and unit of each parameter, as people read them.
#[must_use]
pub fn parameter_rows(drive: &Drive, found: &Found) -> Vec<[String; 5]> {
    let degrees = 180.0 / std::f64::consts::PI;
    let units: [(f64, &str, usize); PARAMETERS] = [
        (degrees, "deg", 4),
        (degrees, "deg", 4),
        (1e3, "mm/tick", 7),
        (1e3, "mm", 2),
        (1.0, "", 5),
        (1e3, "mm", 2),
        (1e3, "mm", 2),
        (degrees, "deg", 4),
    ];
    let (before, after) = (drive.nominal.vector(), found.model.vector());
    (0..PARAMETERS)
        .map(|index| {
            let (factor, unit, digits) = units[index];
            let number = |value: f64| format!("{:.digits$}", factor * value);
            let deviation = found.deviations[index];
            let deviation = if deviation > 0.0 { number(deviation) } else { "held".to_owned() };
            [PARAMETER_NAMES[index].to_owned(), number(before[index]), number(after[index]), deviation, unit.to_owned()]
        })
        .collect()
}

/// What there is to say beside the parameters.
#[must_use]
pub fn remark_rows(drive: &Drive, found: &Found) -> Vec<[String; 2]> {
    let row = |name: &str, value: String| [name.to_owned(), value];
    let [wheelbase, deviation] = found.suggested_wheelbase;
    let verdict = match found.grade() {
        Grade::Good => "good enough",
        Grade::Fair => "usable, but more or longer segments with more steering angles are advised",
    };
    let mut rows = vec![
        row("the drive is", verdict.to_owned()),
        row("laser's motion from", drive.source.name().to_owned()),
        row("segments", drive.windows.len().to_string()),
        row("wheelbase as seen", format!("{:.2} mm, standard deviation {:.2} mm", 1e3 * wheelbase, 1e3 * deviation)),
        row(
            "conditioning",
            format!(
                "{:.2} of the equations, {:.2} of the normal equations",
                found.conditioning.equations, found.conditioning.normal_equations
            ),
        ),
        row(
            "noise",
            format!(
                "slip {:.3} % at a metre, steering {:.4} deg, laser {:.2} of what is stated",
                100.0 * found.noise.slip,
                found.noise.steering.to_degrees(),
                found.noise.laser
            ),
        ),
    ];
    for outlier in found.outliers() {
        let [x, y, turn] = [1e3 * outlier.motion.x, 1e3 * outlier.motion.y, outlier.motion.z.to_degrees()];
        let (start, end) = (outlier.start.seconds(), outlier.end.seconds());
        rows.push(row("left out", format!("{start:.1} to {end:.1} s: off by {x:.1} mm, {y:.1} mm, {turn:.3} deg")));
    }
    for fault in drive.faults.iter().take(LISTED_FAULTS) {
        rows.push(row("fault", format!("{fault}{}", if drive.is_mended { ", mended" } else { "" })));
    }
    if drive.faults.len() > LISTED_FAULTS {
        rows.push(row("fault", format!("and {} more", drive.faults.len() - LISTED_FAULTS)));
    }
    rows.extend(drive.remarks.iter().map(|remark| row("remark", remark.clone())));
    rows
}

/// Faults that are listed at the most.
const LISTED_FAULTS: usize = 12;

/// Adds everything about a calibration to a page.
///
/// # Errors
/// If a picture cannot be drawn.
pub fn add_calibration(page: &mut Page, drive: &Drive, found: &Found) -> Result<(), FigureError> {
    let heading = ["parameter", "before", "after", "std", "unit"].map(str::to_owned).to_vec();
    let rows = parameter_rows(drive, found).into_iter().map(Vec::from).collect();
    page.section("Parameters").table(&Table { heading, rows });
    let rows = remark_rows(drive, found).into_iter().map(Vec::from).collect();
    page.section("The drive").table(&Table { heading: Vec::new(), rows });
    page.section("Residuals").figure(&residual_figure(found, false)?, "Position of the laser after each segment");
    page.figure(&residual_figure(found, true)?, "Rotation of the laser in each segment");
    page.section("Trajectories").figure(
        &trajectories(drive, found)?,
        "The laser by the encoders, with the parameters before and after, and as it was seen. All begin at one pose",
    );
    Ok(())
}

fn residual_figure(found: &Found, is_rotation: bool) -> Result<Figure, FigureError> {
    let points = |coordinate: usize, factor: f64, is_kept: bool| -> Vec<(f64, f64)> {
        let residuals = found.residuals.iter().filter(|residual| (residual.weight > 0.0) == is_kept);
        residuals.map(|residual| (residual.start.seconds(), factor * residual.motion[coordinate])).collect()
    };
    if is_rotation {
        let (kept, left) = (points(2, 1f64.to_degrees(), true), points(2, 1f64.to_degrees(), false));
        let sets = [PointSet { name: "rotation", points: &kept }, PointSet { name: "left out", points: &left }];
        return scatter_chart(["begin of the segment, s", "measured minus modelled, deg"], &sets, None);
    }
    let (x, y) = (points(0, 1e3, true), points(1, 1e3, true));
    let left: Vec<_> = points(0, 1e3, false).into_iter().chain(points(1, 1e3, false)).collect();
    let sets = [
        PointSet { name: "x", points: &x },
        PointSet { name: "y", points: &y },
        PointSet { name: "left out", points: &left },
    ];
    scatter_chart(["begin of the segment, s", "measured minus modelled, mm"], &sets, None)
}

fn trajectories(drive: &Drive, found: &Found) -> Result<Figure, FigureError> {
    let seen: Vec<(f64, f64)> = {
        let first = drive.poses.first().map(|first| first.pose).unwrap_or_default();
        drive.poses.iter().map(|pose| first.between(&pose.pose)).map(|pose| (pose.x, pose.y)).collect()
    };
    let reckoned = |model: &VehicleModel| -> Vec<(f64, f64)> {
        let path = OdometryPath::new(&drive.counted, model);
        let first = drive.poses.first().map_or_else(Pose::default, |first| path.laser_at(first.time));
        drive.poses.iter().map(|pose| first.between(&path.laser_at(pose.time))).map(|pose| (pose.x, pose.y)).collect()
    };
    let (before, after) = (reckoned(&drive.nominal), reckoned(&found.model));
    trajectory_plot(
        &Map::default(),
        &[
            Series { name: "as seen", points: &seen },
            Series { name: "before", points: &before },
            Series { name: "after", points: &after },
        ],
    )
}
