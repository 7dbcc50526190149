//! What is wrong with where reflectors stand to each other: too close to be told apart, or mirror images.

use std::collections::BTreeMap;

use agv_core::geometry::Point;
use serde::Serialize;

/// Two reflectors that a sensor may take for one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ClosePair {
    /// Numbers of both, from 0 in the order of the layout.
    pub reflectors: [usize; 2],
    /// Distance between them, m.
    pub distance_m: f64,
}

/// A line about which much of the layout is its own mirror image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Mirror {
    /// The point of the line that is nearest to the origin of W, m.
    pub point_m: [f64; 2],
    /// Direction of the line, deg, 0 to 180.
    pub direction_deg: f64,
    /// Reflectors whose mirror image is a reflector, those on the line not counted.
    pub reflectors: usize,
}

/// All pairs that are closer than `least`, m, the closest first.
#[must_use]
pub fn close_pairs(positions: &[Point], least: f64) -> Vec<ClosePair> {
    let mut pairs = Vec::new();
    for (first, position) in positions.iter().enumerate() {
        for (second, other) in positions.iter().enumerate().skip(first + 1) {
            let distance_m = (other - position).norm();
            if distance_m < least {
                pairs.push(ClosePair { reflectors: [first, second], distance_m });
            }
        }
    }
    pairs.sort_by(|a, b| a.distance_m.total_cmp(&b.distance_m));
    pairs
}

/// Mirror images are this good, m.
const TOLERANCE: f64 = 0.1;

/// Share of the reflectors that makes a layout its own mirror image, and the fewest of them.
const SHARE: f64 = 0.5;
const FEWEST: usize = 6;

/// Lines that are looked at.
const CANDIDATES: usize = 64;

/// Lines about which at least half of the reflectors are mirror images of each other, the best first.
#[must_use]
pub fn mirrors(positions: &[Point]) -> Vec<Mirror> {
    // The bisector of each pair is a vote for its line: its normal's direction to 2 degrees, its distance to 20 cm.
    let mut votes: BTreeMap<(i64, i64), (usize, f64, f64)> = BTreeMap::new();
    for (index, position) in positions.iter().enumerate() {
        for other in &positions[index + 1..] {
            let offset = other - position;
            if offset.norm() < 2.0 * TOLERANCE {
                continue;
            }
            let mut angle = offset.y.atan2(offset.x).rem_euclid(std::f64::consts::PI);
            if std::f64::consts::PI - angle < 1f64.to_radians() {
                angle -= std::f64::consts::PI;
            }
            let distance = 0.5 * (position + other).dot(&Point::new(angle.cos(), angle.sin()));
            let cell = ((angle.to_degrees() / 2.0).round() as i64, (distance / 0.2).round() as i64);
            let (count, angles, distances) = votes.entry(cell).or_default();
            *count += 1;
            *angles += angle;
            *distances += distance;
        }
    }
    let mut lines: Vec<(usize, f64, f64)> = votes
        .into_values()
        .map(|(count, angles, distances)| (count, angles / count as f64, distances / count as f64))
        .collect();
    lines.sort_by_key(|(count, ..)| std::cmp::Reverse(*count));
    let mut found: Vec<Mirror> = Vec::new();
    for (_, angle, distance) in lines.into_iter().take(CANDIDATES) {
        let normal = Point::new(angle.cos(), angle.sin());
        let reflectors = images(positions, &normal, distance);
        let is_enough = reflectors >= FEWEST && reflectors as f64 >= SHARE * positions.len() as f64;
        let point = normal * distance;
        let direction_deg = (angle.to_degrees() + 90.0).rem_euclid(180.0);
        let is_known = |known: &Mirror| {
            let turn = (known.direction_deg - direction_deg).abs();
            turn.min(180.0 - turn) < 3.0 && (Point::from(known.point_m) - point).norm() < 0.5
        };
        if is_enough && !found.iter().any(is_known) {
            found.push(Mirror { point_m: [point.x, point.y], direction_deg, reflectors });
        }
    }
    found.sort_by_key(|mirror| std::cmp::Reverse(mirror.reflectors));
    found
}

/// How many reflectors have a reflector as their image about a line, not counting those on it.
fn images(positions: &[Point], normal: &Point, distance: f64) -> usize {
    let has_image = |position: &&Point| {
        let height = position.dot(normal) - distance;
        let image = *position - normal * (2.0 * height);
        height.abs() > TOLERANCE && positions.iter().any(|other| (other - image).norm() < TOLERANCE)
    };
    positions.iter().filter(has_image).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Places without any symmetry.
    fn scattered() -> Vec<Point> {
        (0..12_u32)
            .map(|number| {
                Point::new(f64::from(number * 37 % 41) + 0.13 * f64::from(number), f64::from(number * number * 13 % 23))
            })
            .collect()
    }

    #[test]
    fn a_layout_and_its_image_are_found_with_their_line() {
        assert_eq!(mirrors(&scattered()), []);
        // About the line through (0, 60) at 30 degrees.
        let (sine, cosine) = 30f64.to_radians().sin_cos();
        let normal = Point::new(-sine, cosine);
        let distance = normal.dot(&Point::new(0.0, 60.0));
        let mut positions = scattered();
        positions
            .extend(scattered().iter().map(|position| position - normal * (2.0 * (position.dot(&normal) - distance))));
        let found = mirrors(&positions);
        assert_eq!(found[0].reflectors, 24, "{found:?}");
        assert!((found[0].direction_deg - 30.0).abs() < 0.5, "{found:?}");
        assert!((Point::from(found[0].point_m) - normal * distance).norm() < 0.1, "{found:?}");
    }

    #[test]
    fn close_ones_are_named() {
        let mut positions = scattered();
        positions.push(positions[4] + Point::new(0.0, 0.2));
        let pairs = close_pairs(&positions, 0.5);
        assert_eq!((pairs.len(), pairs[0].reflectors), (1, [4, 12]));
        assert!((pairs[0].distance_m - 0.2).abs() < 1e-12);
    }
}
