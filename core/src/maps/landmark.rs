//! One point of the map.

use serde::{Deserialize, Serialize};

use crate::geometry::Point;

/// What a landmark is; an observation is only compared with landmarks of its own kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LandmarkKind {
    /// An artificial reflector.
    Reflector,
    /// A natural corner.
    Corner,
    /// The end of a face that stands in front of something.
    EndPoint,
}

/// One point of the map, in W.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Landmark {
    /// Name of the landmark, unique in its map.
    pub id: u16,
    /// What it is.
    pub kind: LandmarkKind,
    /// Position, m.
    pub x: f64,
    /// Position, m.
    pub y: f64,
    /// Standard deviation of the position along each axis, m.
    pub deviation: f32,
}

impl Landmark {
    /// A reflector at `position` (W, m), surveyed with that deviation, m.
    #[must_use]
    pub fn reflector(id: u16, position: Point, deviation: f32) -> Self {
        Self { id, kind: LandmarkKind::Reflector, x: position.x, y: position.y, deviation }
    }

    /// Whether the position is finite, and its deviation finite and not negative.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.deviation >= 0.0 && self.deviation.is_finite()
    }

    /// Position in W, m.
    #[must_use]
    pub fn position(&self) -> Point {
        Point::new(self.x, self.y)
    }
}

/// Moves reflectors before features; those of a kind keep their order.
pub fn put_reflectors_first(landmarks: &mut [Landmark]) {
    let mut reflectors = 0;
    for index in 0..landmarks.len() {
        let is_reflector = |landmark: &Landmark| landmark.kind == LandmarkKind::Reflector;
        if !landmarks.get(index).is_some_and(is_reflector) {
            continue;
        }
        if let Some(stretch) = landmarks.get_mut(reflectors..=index) {
            stretch.rotate_right(1);
        }
        reflectors += 1;
    }
}
