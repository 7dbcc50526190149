//! Closed-form registration of two sets of associated points.

use nalgebra::Vector2;

use crate::geometry::{Point, Pose};

/// Sums over pairs of points: one and the same point seen from two poses.
#[derive(Clone, Copy, Debug, Default)]
pub struct Registration {
    count: f64,
    first: Vector2<f64>,
    second: Vector2<f64>,
    first_square: f64,
    second_square: f64,
    dot: f64,
    cross: f64,
}

/// The result of a registration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Registered {
    /// The second pose in the first.
    pub pose: Pose,
    /// Standard deviation of a coordinate of the differences, m; zero for two pairs or fewer degrees of freedom.
    pub deviation: f64,
    /// Mean squared distance of the points from their centre, m^2.
    pub extent: f64,
    /// How many pairs there were.
    pub pairs: usize,
}

impl Registration {
    /// Takes a point as it is seen from the first and from the second pose, m.
    pub fn add(&mut self, first: &Point, second: &Point) {
        self.count += 1.0;
        self.first += first;
        self.second += second;
        self.first_square += first.norm_squared();
        self.second_square += second.norm_squared();
        self.dot += second.dot(first);
        self.cross += second.x * first.y - second.y * first.x;
    }

    /// The motion that brings the points together with the least squared distance. None with fewer than two pairs, or
    /// with points that lie together.
    #[must_use]
    pub fn solve(&self) -> Option<Registered> {
        if self.count < 2.0 {
            return None;
        }
        let (first, second) = (self.first / self.count, self.second / self.count);
        let dot = self.dot - self.count * second.dot(&first);
        let cross = self.cross - self.count * (second.x * first.y - second.y * first.x);
        let first_square = self.first_square - self.count * first.norm_squared();
        let second_square = self.second_square - self.count * second.norm_squared();
        let extent = first_square / self.count;
        // Points closer together than a centimetre give no direction.
        if !(extent > 1e-4 && dot.is_finite() && cross.is_finite()) {
            return None;
        }
        let theta = libm::atan2(cross, dot);
        let turned = Pose { x: 0.0, y: 0.0, theta }.transform(&second);
        let squares = (first_square + second_square - 2.0 * libm::hypot(dot, cross)).max(0.0);
        let freedom = 2.0 * self.count - 3.0;
        Some(Registered {
            pose: Pose::new(first.x - turned.x, first.y - turned.y, theta),
            deviation: libm::sqrt(squares / freedom),
            extent,
            pairs: self.count as usize,
        })
    }
}
