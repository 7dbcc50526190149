//! Points of a ring laid onto the surfaces that they are of: the beams of a multi-beam lidar are less exact than those of a planar laser,
//! but they are dense.

use nalgebra::{Matrix2, Vector2};

/// Neighbours on the ring up to this distance are looked at, m, and so many of them on each side at the most.
const REACH: f64 = 0.25;
const NEIGHBOURS: usize = 12;
/// Fewest points of a surface.
const LEAST_POINTS: usize = 5;
/// The scatter across a surface is at most this share of that along it.
const FLAT: f64 = 0.5;
/// What scatters more than so many times the median is no single surface.
const ROUGH: f64 = 1.4;

/// A line through neighbours of a point.
#[derive(Clone, Copy)]
struct Line {
    /// From the point to the line.
    shift: Vector2<f64>,
    /// Standard deviation across it, m.
    scatter: f64,
}

/// Of a point, the lines through the neighbours on both sides, on the side before and on the side behind.
type Lines = [Option<Line>; 3];

/// Moves points, each ring in the order in which it was measured, onto the line through their neighbours; near an edge or a corner onto
/// that through the neighbours on one side, and not at all where there is none. What may not be moved stays.
pub fn lay_onto_surfaces(rings: &mut [Vec<[f64; 2]>], may_move: impl Fn(usize, usize) -> bool) {
    let lines: Vec<Vec<Lines>> =
        rings.iter().map(|ring| (0..ring.len()).map(|index| lines(ring, index)).collect()).collect();
    let mut scatters: Vec<f64> = lines.iter().flatten().filter_map(|[both, ..]| Some((*both)?.scatter)).collect();
    if scatters.is_empty() {
        return;
    }
    let middle = scatters.len() / 2;
    let limit = ROUGH * *scatters.select_nth_unstable_by(middle, f64::total_cmp).1;
    for (number, (ring, lines)) in rings.iter_mut().zip(&lines).enumerate() {
        for (index, (point, [both, before, behind])) in ring.iter_mut().zip(lines).enumerate() {
            let is_smooth = |line: &Line| line.scatter <= limit;
            let sides = before.iter().chain(behind).min_by(|a, b| a.scatter.total_cmp(&b.scatter));
            let line = both.as_ref().filter(|line| is_smooth(line)).or(sides.filter(|line| is_smooth(line)));
            if let Some(Line { shift, .. }) = line.filter(|_| may_move(number, index)) {
                *point = [point[0] + shift.x, point[1] + shift.y];
            }
        }
    }
}

fn lines(ring: &[[f64; 2]], index: usize) -> Lines {
    let centre = ring[index];
    let is_near = |point: &&[f64; 2]| libm::hypot(point[0] - centre[0], point[1] - centre[1]) < REACH;
    let before = ring[..index].iter().rev().take_while(is_near).count();
    let behind = ring[index + 1..].iter().take_while(is_near).count();
    // Dense rings are thinned, so that the neighbours reach as far as they may.
    let stride = before.max(behind).div_ceil(NEIGHBOURS).max(1);
    let line = |first: usize, last: usize| line(ring[first..=last].iter().step_by(stride), centre);
    [line(index - before, index + behind), line(index - before, index), line(index, index + behind)]
}

/// None if the points are too few or make no line.
fn line<'a>(points: impl Iterator<Item = &'a [f64; 2]>, centre: [f64; 2]) -> Option<Line> {
    let (mut sum, mut squares, mut count) = (Vector2::zeros(), Matrix2::zeros(), 0_usize);
    for [x, y] in points {
        let off = Vector2::new(x - centre[0], y - centre[1]);
        sum += off;
        squares += off * off.transpose();
        count += 1;
    }
    if count < LEAST_POINTS {
        return None;
    }
    let mean = sum / count as f64;
    let parts = (squares / count as f64 - mean * mean.transpose()).symmetric_eigen();
    let least = usize::from(parts.eigenvalues[1] < parts.eigenvalues[0]);
    let [across, along] = [parts.eigenvalues[least], parts.eigenvalues[1 - least]].map(|value| value.max(0.0));
    let normal: Vector2<f64> = parts.eigenvectors.column(least).into_owned();
    // Two parameters were found by the points themselves.
    let scatter = (across * count as f64 / (count - 2) as f64).sqrt();
    (across < FLAT * FLAT * along).then(|| Line { shift: normal * normal.dot(&mean), scatter })
}
