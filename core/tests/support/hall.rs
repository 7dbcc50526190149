//! A hall with pillars whose corners are known.

use agv_core::geometry::{Point, Pose};

/// Corners of a hall and of four pillars in it, each a rectangle: lowest and highest x and y.
const WALLS: [[f64; 4]; 5] = [
    [-7.0, 9.0, -5.0, 6.0],
    [2.0, 2.8, 2.0, 2.8],
    [4.5, 5.3, -3.1, -2.3],
    [-3.6, -2.8, 2.6, 3.4],
    [-2.4, -1.6, -2.9, -2.1],
];

pub fn corners() -> impl Iterator<Item = Point> {
    let of = |[left, right, low, high]: [f64; 4]| [(left, low), (left, high), (right, low), (right, high)];
    WALLS.into_iter().flat_map(of).map(|(x, y)| Point::new(x, y))
}

/// The walls from one point to another.
pub fn walls() -> Vec<[f64; 4]> {
    let of = |[left, right, low, high]: [f64; 4]| {
        [[left, low, right, low], [right, low, right, high], [right, high, left, high], [left, high, left, low]]
    };
    WALLS.into_iter().flat_map(of).collect()
}

/// Distance to the nearest wall.
pub fn cast(origin: &Pose, bearing: f64) -> f64 {
    let (sine, cosine) = (origin.theta + bearing).sin_cos();
    let mut nearest = f64::INFINITY;
    for [left, right, low, high] in WALLS {
        for x in [left, right] {
            let range = (x - origin.x) / cosine;
            if range > 0.0 && (low..=high).contains(&(origin.y + range * sine)) {
                nearest = nearest.min(range);
            }
        }
        for y in [low, high] {
            let range = (y - origin.y) / sine;
            if range > 0.0 && (left..=right).contains(&(origin.x + range * cosine)) {
                nearest = nearest.min(range);
            }
        }
    }
    nearest
}
