//! What is known of the vehicle by other means than its localiser. The localiser never sees it.

use serde::{Deserialize, Serialize};

use crate::geometry::{Point, Pose};
use crate::measurement::Time;

/// Where the vehicle really was, as a simulator knows it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// When.
    pub time: Time,
    /// Pose of R in W.
    pub pose: Pose,
}

/// Where the laser was, as another instrument has measured it: a satellite receiver on the laser knows no heading.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// When.
    pub time: Time,
    /// Position of the origin of S in W, along the first axis, m.
    pub x: f64,
    /// Position of the origin of S in W, along the second axis, m.
    pub y: f64,
    /// Direction of the first axis of S in W, rad, if the instrument measures it.
    pub heading: Option<f64>,
}

impl Reference {
    /// Position of the origin of S in W, m.
    #[must_use]
    pub fn position(&self) -> Point {
        Point::new(self.x, self.y)
    }
}
