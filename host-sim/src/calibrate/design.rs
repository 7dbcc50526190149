//! How a calibration drive is driven (K 5.2.1).

use agv_core::geometry::Pose;

use crate::simulate::path::{Direction, Leg, Path, PathSegment};

/// Four phases, forward and backward, to the left and to the right, each of as many arcs of one angle, with steering
/// angles in equal steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Design {
    /// Arcs of a phase (K: n_seg).
    pub arcs: usize,
    /// Smallest and largest steering angle, rad.
    pub steering: [f64; 2],
    /// Angle of each arc, rad (K: beta).
    pub turn: f64,
}

/// One arc from standstill to standstill.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlannedSegment {
    /// Sense of travel.
    pub direction: Direction,
    /// True steering angle, rad, positive to the left.
    pub steering: f64,
    /// Way of the driving wheel, m, positive.
    pub wheel_way: f64,
}

/// In which order the arcs are driven.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Phase after phase, with increasing steering angles (K 5.2.1).
    Phases,
    /// Each arc forth and back, so that the vehicle stays where it is.
    ForthAndBack,
}

impl Design {
    /// The steering angles of a phase, rad.
    #[must_use]
    pub fn angles(&self) -> Vec<f64> {
        let [low, high] = self.steering;
        let steps = self.arcs.saturating_sub(1).max(1) as f64;
        (0..self.arcs).map(|arc| low + (high - low) * arc as f64 / steps).collect()
    }

    /// All arcs, for a wheelbase in m.
    #[must_use]
    pub fn segments(&self, wheelbase: f64, order: Order) -> Vec<PlannedSegment> {
        let segment = |direction, side: f64, angle: f64| PlannedSegment {
            direction,
            steering: side * angle,
            wheel_way: self.turn * wheelbase / angle.sin(),
        };
        let (senses, sides) = ([Direction::Forward, Direction::Backward], [1.0, -1.0]);
        let angles = self.angles();
        match order {
            Order::Phases => {
                let phases = senses.into_iter().flat_map(|sense| sides.map(|side| (sense, side)));
                phases.flat_map(|(sense, side)| angles.iter().map(move |angle| segment(sense, side, *angle))).collect()
            }
            Order::ForthAndBack => {
                let arcs = angles.iter().flat_map(|angle| sides.map(|side| (side, *angle)));
                arcs.flat_map(|(side, angle)| senses.map(|sense| segment(sense, side, angle))).collect()
            }
        }
    }
}

/// The way of R for those segments.
#[must_use]
pub fn path(segments: &[PlannedSegment], wheelbase: f64, start: Pose) -> Path {
    let leg = |segment: &PlannedSegment| Leg {
        direction: segment.direction,
        segments: vec![PathSegment {
            length: segment.wheel_way * segment.steering.cos(),
            curvature: segment.steering.tan() / wheelbase,
        }],
    };
    Path { start, legs: segments.iter().map(leg).collect() }
}
