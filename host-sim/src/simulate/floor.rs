//! A floor of waves under the vehicle.

use agv_core::geometry::{Point, Pose};

use super::random::Random;
use super::random_field::RandomField;
use super::scenario::FloorOptions;

/// A floor that was drawn.
pub struct Floor {
    height: RandomField,
    laser_height: f64,
}

impl Floor {
    /// The floor of a scenario.
    #[must_use]
    pub fn new(options: &FloorOptions, random: &mut Random) -> Self {
        Self { height: RandomField::new(options.deviation, options.length, random), laser_height: options.laser_height }
    }

    /// Where a laser that is mounted at `mounting` (S in R) is above the logical point of a vehicle at `pose` (W), seen from above: the
    /// vehicle leans away from where the floor rises. To first order in the slope; the scan's own tilt is left out.
    #[must_use]
    pub fn tilted(&self, pose: &Pose, mounting: &Pose) -> Pose {
        let slope = self.height.gradient(&pose.transform(&mounting.position()));
        let lean = -self.laser_height * slope;
        let (sine, cosine) = libm::sincos(pose.theta);
        let in_vehicle = Point::new(cosine * lean.x + sine * lean.y, cosine * lean.y - sine * lean.x);
        Pose::new(mounting.x + in_vehicle.x, mounting.y + in_vehicle.y, mounting.theta)
    }
}

#[cfg(test)]
mod tests {
    use agv_core::geometry::{Point, Pose};

    use super::Floor;
    use crate::simulate::random::{Random, Stream};
    use crate::simulate::random_field::RandomField;
    use crate::simulate::scenario::FloorOptions;

    /// The lean in W does not depend on where the vehicle looks, and is the height of the laser times the slope, downhill.
    #[test]
    fn a_laser_leans_downhill() {
        let options = FloorOptions { deviation: 0.003, length: 3.0, laser_height: 2.0 };
        let floor = Floor::new(&options, &mut Random::new(5, Stream::Floor));
        let height = RandomField::new(options.deviation, options.length, &mut Random::new(5, Stream::Floor));
        let place = Point::new(4.0, 7.0);
        let step = 1e-5;
        let slope = |offset: Point| (height.at(&(place + offset)) - height.at(&(place - offset))) / (2.0 * step);
        let expected = -2.0 * Point::new(slope(Point::new(step, 0.0)), slope(Point::new(0.0, step)));
        assert!(expected.norm() > 1e-4);
        for heading in [0.0, 1.0, 2.5, -2.0] {
            let pose = Pose::new(place.x, place.y, heading);
            let laser = pose.compose(&floor.tilted(&pose, &Pose::default()));
            assert!((laser.position() - place - expected).norm() < 1e-8, "{heading}");
        }
        let flat = Floor::new(&FloorOptions::default(), &mut Random::new(5, Stream::Floor));
        let mounting = Pose::new(0.9, -0.1, 0.3);
        assert_eq!(flat.tilted(&Pose::new(1.0, 2.0, 0.5), &mounting), mounting);
    }
}
