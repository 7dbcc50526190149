//! Points of a ring laid onto the surfaces that they are of: the beams of a multi-beam lidar are less exact than those of a planar laser,
//! but they are dense.

/// Neighbours on the ring up to this distance are looked at, m, and so many of them on each side at the most.
const REACH: f64 = 0.25;
const NEIGHBOURS: usize = 12;
/// Fewest points of a surface.
const LEAST_POINTS: f64 = 5.0;
/// The scatter across a surface is at most this share of that along it.
const FLAT: f64 = 0.5;
/// What scatters more than so many times the median is no single surface.
const ROUGH: f64 = 1.4;

/// A line through neighbours of a point.
#[derive(Clone, Copy)]
struct Line {
    /// From the point to the middle of the neighbours, m.
    mean: [f64; 2],
    /// Their second moments about that: xx, xy, yy, m^2.
    moments: [f64; 3],
    /// Standard deviation across the line, m.
    scatter: f64,
}

impl Line {
    /// The way from the point straight onto the line, m.
    fn shift(&self) -> [f64; 2] {
        let [xx, xy, yy] = self.moments;
        let (sin, cos) = libm::sincos(0.5 * libm::atan2(2.0 * xy, xx - yy));
        let across = self.mean[1] * cos - self.mean[0] * sin;
        [-sin * across, cos * across]
    }
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
            if let Some(line) = line.filter(|_| may_move(number, index)) {
                let [x, y] = line.shift();
                *point = [point[0] + x, point[1] + y];
            }
        }
    }
}

fn lines(ring: &[[f64; 2]], index: usize) -> Lines {
    let centre = ring[index];
    let is_near = |point: &&[f64; 2]| (point[0] - centre[0]).powi(2) + (point[1] - centre[1]).powi(2) < REACH * REACH;
    let before = ring[..index].iter().rev().take_while(is_near).count();
    let behind = ring[index + 1..].iter().take_while(is_near).count();
    // Dense rings are thinned, so that the neighbours reach as far as they may.
    let stride = before.max(behind).div_ceil(NEIGHBOURS).max(1);
    let line = |first: usize, last: usize| line(ring[first..=last].iter().step_by(stride), centre);
    [line(index - before, index + behind), line(index - before, index), line(index, index + behind)]
}

/// None if the points are too few or make no line.
fn line<'a>(points: impl Iterator<Item = &'a [f64; 2]>, centre: [f64; 2]) -> Option<Line> {
    let (mut sum, mut squares, mut count) = ([0.0; 2], [0.0; 3], 0.0);
    for [x, y] in points {
        let (x, y) = (x - centre[0], y - centre[1]);
        sum = [sum[0] + x, sum[1] + y];
        squares = [squares[0] + x * x, squares[1] + x * y, squares[2] + y * y];
        count += 1.0;
    }
    if count < LEAST_POINTS {
        return None;
    }
    let mean = sum.map(|sum| sum / count);
    let [xx, xy, yy] = squares.map(|square| square / count);
    let [xx, xy, yy] = [xx - mean[0] * mean[0], xy - mean[0] * mean[1], yy - mean[1] * mean[1]];
    // The eigenvalues of the moments.
    let half = (0.25 * (xx - yy).powi(2) + xy * xy).sqrt();
    let [across, along] = [0.5 * (xx + yy) - half, 0.5 * (xx + yy) + half].map(|value| value.max(0.0));
    // Two parameters were found by the points themselves.
    let scatter = (across * count / (count - 2.0)).sqrt();
    (across < FLAT * FLAT * along).then_some(Line { mean, moments: [xx, xy, yy], scatter })
}
