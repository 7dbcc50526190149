//! Runs of neighbouring returns that keep to one coordinate.

use heapless::Vec;

use super::parameters::OrthogonalCornerParameters;
use agv_core::geometry::ScanPoint;
use agv_core::sensing::PointScan;

/// Most runs of one direction.
pub(super) const RUNS: usize = 64;

/// One end of a run.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct End {
    pub beam: u16,
    /// Coordinate along the run, m.
    pub along: f32,
}

/// A piece of surface along one axis of the turned frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfaceRun {
    /// Mean coordinate across the run, m.
    pub across: f32,
    /// Number of returns.
    pub count: u16,
    /// First and last return in order of beams.
    pub ends: [End; 2],
}

impl SurfaceRun {
    /// Middle of the run along its own direction, m.
    pub(super) fn middle(&self) -> f32 {
        let [first, last] = self.ends;
        0.5 * (first.along + last.along)
    }
}

/// Replaces `runs` by the pieces of surface along the unit vector `axis`. Runs do not cross the seam. What does not fit is
/// left out.
pub(super) fn find<const BEAMS: usize>(
    scan: &PointScan<BEAMS>,
    axis: ScanPoint,
    parameters: &OrthogonalCornerParameters,
    runs: &mut Vec<SurfaceRun, RUNS>,
) {
    runs.clear();
    let mut open: Option<(SurfaceRun, ScanPoint)> = None;
    let mut close = |run: Option<(SurfaceRun, ScanPoint)>| {
        let long = run.filter(|(run, _)| {
            let [first, last] = run.ends;
            run.count >= parameters.points && libm::fabsf(last.along - first.along) >= parameters.length
        });
        if let Some((run, _)) = long {
            let _ = runs.push(run);
        }
    };
    for (beam, (point, range)) in (0_u16..).zip(scan.points.iter().zip(&scan.ranges)) {
        if *range <= 0.0 || *range > parameters.farthest {
            close(open.take());
            continue;
        }
        let along = axis.x * point.x + axis.y * point.y;
        let across = axis.x * point.y - axis.y * point.x;
        let end = End { beam, along };
        match &mut open {
            Some((run, last))
                if libm::fabsf(across - run.across) <= parameters.thickness
                    && (point - *last).norm_squared() <= parameters.gap * parameters.gap =>
            {
                run.count += 1;
                run.across += (across - run.across) / f32::from(run.count);
                run.ends[1] = end;
                *last = *point;
            }
            _ => {
                close(open.take());
                open = Some((SurfaceRun { across, count: 1, ends: [end; 2] }, *point));
            }
        }
    }
    close(open);
}
