//! Points of upright surfaces in a levelled revolution, with the directions in which the surfaces face.

use nalgebra::{Point2, Vector2};

/// Neighbours on the ring up to this distance are of the same surface, m, and so many of them on each side at the most.
const REACH: f64 = 0.4;
const NEIGHBOURS: usize = 16;
/// A surface has at least so many points, and reaches this far along itself, m.
const LEAST_POINTS: usize = 5;
const LEAST_LENGTH: f64 = 0.12;
/// The scatter across a surface is at most this share of that along it.
const FLAT: f64 = 0.25;
/// Surfaces whose scatter is more than so many times the median are edges.
const EDGE: f64 = 2.5;

/// A point of an upright surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WallPoint {
    /// Seen from above, m.
    pub position: Point2<f64>,
    /// Height, m.
    pub height: f64,
    /// Unit vector across the surface, towards the sensor.
    pub normal: Vector2<f64>,
}

/// Finds them in rings of levelled points, each in the order in which it was measured; about `count` points are looked at. Where
/// `is_wanted` is not so, there is no surface.
#[must_use]
pub fn wall_points(rings: &[Vec<[f64; 3]>], count: usize, is_wanted: impl Fn(&[f64; 3]) -> bool) -> Vec<WallPoint> {
    let all: usize = rings.iter().map(Vec::len).sum();
    let step = all.div_ceil(count.max(1)).max(1);
    let mut found = Vec::new();
    for ring in rings {
        let indices = (0..ring.len()).step_by(step).filter(|index| is_wanted(&ring[*index]));
        found.extend(indices.filter_map(|index| surface(ring, index)));
    }
    let mut scatters: Vec<f64> = found.iter().map(|(_, scatter)| *scatter).collect();
    scatters.sort_by(f64::total_cmp);
    let limit = scatters.get(scatters.len() / 2).map_or(0.0, |median| EDGE * median) + 1e-5;
    found.into_iter().filter(|(_, scatter)| *scatter <= limit).map(|(point, _)| point).collect()
}

/// The surface about a point, and its scatter, m.
fn surface(ring: &[[f64; 3]], index: usize) -> Option<(WallPoint, f64)> {
    let [x, y, height] = ring[index];
    let is_near = |point: &&[f64; 3]| (point[0] - x).hypot(point[1] - y) < REACH;
    // Dense rings are thinned, so that the neighbours reach as far as they may.
    let before = ring[..index].iter().rev().take_while(is_near).count();
    let after = ring[index + 1..].iter().take_while(is_near).count();
    let stride = before.max(after).div_ceil(NEIGHBOURS).max(1);
    let near = ring[index - before..=index + after].iter().step_by(stride);
    let (mut sum, mut squares, mut points) = (Vector2::zeros(), nalgebra::Matrix2::zeros(), 0_usize);
    for [a, b, _] in near {
        let off = Vector2::new(a - x, b - y);
        sum += off;
        squares += off * off.transpose();
        points += 1;
    }
    if points < LEAST_POINTS {
        return None;
    }
    let mean = sum / points as f64;
    let parts = (squares / points as f64 - mean * mean.transpose()).symmetric_eigen();
    let least = usize::from(parts.eigenvalues[1] < parts.eigenvalues[0]);
    let [across, along] = [parts.eigenvalues[least], parts.eigenvalues[1 - least]].map(|value| value.max(0.0).sqrt());
    let normal: Vector2<f64> = parts.eigenvectors.column(least).into_owned();
    let normal = if normal.dot(&Vector2::new(x, y)) > 0.0 { -normal } else { normal };
    // A deviation of length / sqrt(12) is that of an even spread.
    let is_surface = along * 12.0_f64.sqrt() > LEAST_LENGTH && across < FLAT * along;
    let onto = normal * normal.dot(&mean);
    is_surface.then(|| (WallPoint { position: Point2::new(x + onto.x, y + onto.y), height, normal }, across))
}
