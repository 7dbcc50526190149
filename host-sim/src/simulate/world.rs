//! What stands in the plane of the laser.

use agv_core::geometry::Point;

use super::people::Person;
use super::shape::{Circle, POINTS_A_FACE, Pallet, Rectangle, Reflector, Segment};

/// Everything that a laser can hit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct World {
    /// Straight surfaces.
    pub segments: Vec<Segment>,
    /// Round surfaces without foil.
    pub circles: Vec<Circle>,
    /// Reflectors; the index is the reflector's name.
    pub reflectors: Vec<Reflector>,
    /// Corners of boxes and pallets, and ends and joints of walls, in W, m.
    pub corners: Vec<Point>,
    /// What moves.
    pub people: Vec<Person>,
}

impl World {
    /// Adds a wall.
    pub fn add_wall(&mut self, from: Point, to: Point) {
        self.segments.push(Segment { from, to });
        for end in [from, to] {
            if !self.corners.contains(&end) {
                self.corners.push(end);
            }
        }
    }

    /// Adds the four walls of a hall between two opposite corners (W, m).
    pub fn add_hall(&mut self, low: Point, high: Point) {
        let corners = [low, Point::new(high.x, low.y), high, Point::new(low.x, high.y)];
        for (index, &corner) in corners.iter().enumerate() {
            self.add_wall(corner, corners[(index + 1) % 4]);
        }
    }

    /// Adds a box.
    pub fn add_rectangle(&mut self, rectangle: &Rectangle) {
        let corners = rectangle.corners();
        self.add_polygon(&corners);
        self.corners.extend(corners);
    }

    /// Adds a pallet. Its corners are where the outer boards of neighbouring faces meet; joints of boards within a face
    /// are not corners.
    pub fn add_pallet(&mut self, pallet: &Pallet) {
        let polygon = pallet.polygon();
        self.add_polygon(&polygon);
        self.corners.extend(polygon.iter().step_by(POINTS_A_FACE));
    }

    fn add_polygon(&mut self, corners: &[Point]) {
        for (index, &from) in corners.iter().enumerate() {
            let to = corners[(index + 1) % corners.len()];
            self.segments.push(Segment { from, to });
        }
    }
}
