//! The last part of an alignment: points against the lines between neighbouring directions of a panorama.

use super::panorama::Panorama;
use super::pose::Pose;
use super::solved::solved;

/// How far from its line a point counts, round after round, m.
const GATES: [f32; 6] = [0.8, 0.8, 0.5, 0.35, 0.35, 0.35];
/// Neighbouring directions are of one surface if their ranges differ by less than this part.
const SMOOTH: f32 = 0.1;
/// Fewer points determine nothing.
const POINTS: usize = 60;
/// Weight with which a pose stays where it is along what no line shows, in points of a metre.
const HELD: f64 = 30.0;

/// A pose of points in a panorama, by least squares of their distances from its lines; as it was where they determine none.
pub(super) fn refined(panorama: &Panorama, points: &[[f32; 3]], start: Pose) -> Pose {
    let mut pose = start;
    for gate in GATES {
        let mut rows = [[0.0_f64; 4]; 3];
        let mut count = 0;
        let out = pose.out();
        for point in points {
            let seen = out(*point);
            let Some((normal, off)) = line(panorama, seen, gate) else { continue };
            count += 1;
            let arm = normal[1] * (seen[0] - pose.place[0]) - normal[0] * (seen[1] - pose.place[1]);
            let factors = [normal[0], normal[1], arm].map(f64::from);
            for (row, factor) in rows.iter_mut().zip(factors) {
                for (sum, other) in row.iter_mut().zip(factors.into_iter().chain([f64::from(-off)])) {
                    *sum += factor * other;
                }
            }
        }
        for (at, row) in rows.iter_mut().enumerate() {
            row[at] += HELD;
        }
        let Some(step) = solved(rows).filter(|_| count >= POINTS) else { return start };
        let [x, y, turn] = step.map(|step| step as f32);
        pose = Pose { place: [pose.place[0] + x, pose.place[1] + y], heading: pose.heading + turn };
    }
    pose
}

/// The normal of the line that a point lies near to, and how far off it is, m.
fn line(panorama: &Panorama, point: [f32; 3], gate: f32) -> Option<([f32; 2], f32)> {
    let (column, level) = panorama.column(point);
    let (row, range) = panorama.row(point, level)?;
    let ends = [column + panorama.columns() - 1, column + 1];
    let middle = panorama.range(row, column)?;
    let [a, b] = ends.map(|column| panorama.range(row, column));
    let is_smooth = |end: f32| libm::fabsf(end - middle) < SMOOTH * middle;
    let (a, b) = (a.filter(|a| is_smooth(*a))?, b.filter(|b| is_smooth(*b))?);
    // Ranges are along the beam; on the level they are shorter by the same share as the point's.
    let share = level / range;
    let [a, b] = [(ends[0], a), (ends[1], b)].map(|(column, range)| panorama.on_level(column, range * share));
    let along = [b[0] - a[0], b[1] - a[1]];
    let length = libm::hypotf(along[0], along[1]);
    if length < 1e-3 {
        return None;
    }
    let normal = [-along[1] / length, along[0] / length];
    let off = normal[0] * (point[0] - a[0]) + normal[1] * (point[1] - a[1]);
    (libm::fabsf(off) < gate).then_some((normal, off))
}
