//! People on their ways.

use agv_core::geometry::Point;
use serde::{Deserialize, Serialize};

use super::shape::Circle;

/// What the laser sees of a person.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PersonShape {
    /// One circle of 0.22 m radius.
    #[default]
    Torso,
    /// Two circles of 0.07 m radius that swing past each other.
    Legs,
}

/// Somebody who walks round a closed polyline for ever.
#[derive(Clone, Debug, PartialEq)]
pub struct Person {
    corners: Vec<Point>,
    /// Way from the first corner to each corner, and to the first one again, m.
    ways: Vec<f64>,
    speed: f64,
    /// Way from the first corner at time zero, m.
    phase: f64,
    shape: PersonShape,
}

const TORSO_RADIUS: f64 = 0.22;
const LEG_RADIUS: f64 = 0.07;
/// Half of the distance between the legs' axes, across the direction of walking, m.
const HALF_HIP: f64 = 0.1;
/// Largest distance of a foot before or behind the body, m.
const HALF_STEP: f64 = 0.3;

impl Person {
    /// Somebody who walks along `corners` (W, m) and from the last one to the first, with `speed` (m/s), and who has
    /// walked the share `phase` (0 to 1) of the round at time zero. With one corner, somebody who stands there.
    #[must_use]
    pub fn new(corners: Vec<Point>, speed: f64, phase: f64, shape: PersonShape) -> Self {
        let mut ways = vec![0.0];
        for (index, corner) in corners.iter().enumerate() {
            let next = corners[(index + 1) % corners.len()];
            ways.push(ways[index] + (next - corner).norm());
        }
        let phase = phase * ways[corners.len()];
        Self { corners, ways, speed, phase, shape }
    }

    /// The person's solids at `time` (s since the start of the drive). The second is None for a torso.
    #[must_use]
    pub fn circles(&self, time: f64) -> [Option<Circle>; 2] {
        let Some(&first) = self.corners.first() else { return [None, None] };
        let round = self.ways[self.corners.len()];
        let walked = self.phase + self.speed * time;
        let (body, direction) = if round > 0.0 {
            let way = walked.rem_euclid(round);
            let index = self.ways.partition_point(|&start| start <= way).clamp(1, self.corners.len()) - 1;
            let (from, to) = (self.corners[index], self.corners[(index + 1) % self.corners.len()]);
            let length = self.ways[index + 1] - self.ways[index];
            let direction = if length > 0.0 { (to - from) / length } else { Point::x() };
            (from + direction * (way - self.ways[index]), direction)
        } else {
            (first, Point::x())
        };
        match self.shape {
            PersonShape::Torso => [Some(Circle { centre: body, radius: TORSO_RADIUS }), None],
            PersonShape::Legs => {
                let swing = HALF_STEP * libm::sin(walked / HALF_STEP);
                let across = Point::new(-direction.y, direction.x) * HALF_HIP;
                let leg = |centre| Some(Circle { centre, radius: LEG_RADIUS });
                [leg(body + direction * swing + across), leg(body - direction * swing - across)]
            }
        }
    }
}
