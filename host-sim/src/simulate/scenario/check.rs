//! Whether a scenario makes sense.

use super::{PathKind, Scenario, ScenarioError, WorldOptions};

impl Scenario {
    /// Whether every value makes sense.
    ///
    /// # Errors
    /// The first value that does not.
    pub fn check(&self) -> Result<(), ScenarioError> {
        let (drive, vehicle, laser) = (&self.drive, &self.vehicle.believed, &self.laser);
        let positive = [
            ("drive.speed", drive.speed),
            ("drive.acceleration", drive.acceleration),
            ("drive.braking", drive.braking),
            ("drive.steering_rate_deg", drive.steering_rate_deg),
            ("vehicle.believed.wheelbase", vehicle.wheelbase),
            ("vehicle.believed.wheelbase with its error", vehicle.wheelbase + self.vehicle.truth.wheelbase_error),
            ("vehicle.believed.drive_scale", vehicle.drive_scale),
            ("odometry.rate", self.odometry.rate),
            ("laser.frequency", laser.frequency),
            ("laser.farthest", laser.farthest),
        ];
        for (key, value) in positive {
            demand(key, value.is_finite() && value > 0.0, "a positive number")?;
        }
        let not_negative = [
            ("drive.start_standstill", drive.start_standstill),
            ("drive.end_standstill", drive.end_standstill),
            ("drive.stop_between_legs", drive.stop_between_legs),
            ("odometry.slip", self.odometry.slip),
            ("odometry.steering_noise_deg", self.odometry.steering_noise_deg),
            ("odometry.leg_steering_error_deg", self.odometry.leg_steering_error_deg),
            ("odometry.leg_slip", self.odometry.leg_slip),
            ("odometry.yaw_walk_deg", self.odometry.yaw_walk_deg),
            ("odometry.side_slip", self.odometry.side_slip),
            ("laser.range_noise", laser.range_noise),
            ("laser.far_range_noise", laser.far_range_noise),
            ("laser.bearing_noise_deg", laser.bearing_noise_deg),
            ("laser.nearest", laser.nearest),
            ("laser.latency", laser.latency),
            ("laser.divergence_deg", laser.divergence_deg),
            ("reflectors.range_noise", self.reflectors.range_noise),
            ("reflectors.bearing_noise_deg", self.reflectors.bearing_noise_deg),
            ("reflectors.farthest", self.reflectors.farthest),
            ("reflectors.survey_deviation", self.reflectors.survey_deviation),
            ("reflectors.latency", self.reflectors.latency),
            ("start.position_deviation", self.start.position_deviation),
            ("start.heading_deviation_deg", self.start.heading_deviation_deg),
        ];
        for (key, value) in not_negative {
            demand(key, value.is_finite() && value >= 0.0, "zero or a positive number")?;
        }
        let shares = [
            ("laser.mixed_share", laser.mixed_share),
            ("laser.lost_share", laser.lost_share),
            ("reflectors.missing_share", self.reflectors.missing_share),
            ("reflectors.false_share", self.reflectors.false_share),
        ];
        let dirty = laser.dirty_sectors.iter().map(|sector| ("laser.dirty_sectors.lost_share", sector.lost_share));
        let phases = self.people.iter().filter_map(|person| person.phase).map(|phase| ("people.phase", phase));
        for (key, value) in shares.into_iter().chain(dirty).chain(phases) {
            demand(key, (0.0..=1.0).contains(&value), "between 0 and 1")?;
        }
        demand("laser.beams", (1..=100_000).contains(&laser.beams), "from 1 to 100000")?;
        for (key, values) in [
            ("vehicle.believed.drive_counter", vehicle.drive_counter),
            ("vehicle.believed.steering_counter", vehicle.steering_counter),
        ] {
            demand(key, (2..=1 << 32).contains(&values), "from 2 to 2^32")?;
        }
        demand("vehicle.true.drive_scale_error", self.vehicle.truth.drive_scale_error.abs() < 1.0, "less than 1")?;
        demand("people.way", self.people.iter().all(|person| !person.way.is_empty()), "a list of at least one point")?;
        self.check_path()?;
        self.check_world()
    }

    fn check_path(&self) -> Result<(), ScenarioError> {
        let has_legs = !self.path.legs.is_empty();
        if self.path.kind != PathKind::Legs {
            return demand("path.legs", !has_legs, "left out unless path.kind is \"legs\"");
        }
        demand("path.legs", has_legs, "a list of at least one leg")?;
        let segments = || self.path.legs.iter().flat_map(|leg| &leg.segments);
        let lengths = segments().all(|segment| segment.length.is_finite() && segment.length > 0.0);
        demand("path.legs.segments.length", lengths, "a positive number")?;
        let curvatures = segments().all(|segment| segment.curvature.is_finite());
        demand("path.legs.segments.curvature", curvatures, "finite")?;
        demand("path.legs.segments", self.path.legs.iter().all(|leg| !leg.segments.is_empty()), "at least one segment")
    }

    fn check_world(&self) -> Result<(), ScenarioError> {
        match &self.world {
            WorldOptions::BlockStorage(storage) => {
                demand("world.moved_share", (0.0..=1.0).contains(&storage.moved_share), "between 0 and 1")?;
                demand("world.moved_by", storage.moved_by.is_finite(), "finite")
            }
            WorldOptions::WarehouseHall(hall) => {
                demand("world.filled_share", (0.0..=1.0).contains(&hall.filled_share), "between 0 and 1")
            }
            WorldOptions::Shapes(shapes) => {
                let numbers = shapes.walls.iter().flatten().copied();
                let rectangles = shapes
                    .rectangles
                    .iter()
                    .flat_map(|shape| [shape.x, shape.y, shape.heading_deg, shape.length, shape.width]);
                let circles = shapes.circles.iter().flat_map(|shape| [shape.x, shape.y, shape.radius]);
                let reflectors = shapes.reflectors.iter().flat_map(|shape| [shape.x, shape.y, shape.radius]);
                let near = numbers.chain(rectangles).chain(circles).chain(reflectors).all(|value| value.abs() < 1000.0);
                demand("world", near, "made of numbers within 1000 m of the origin")?;
                demand("world.reflectors", shapes.reflectors.len() <= usize::from(u16::MAX), "65535 reflectors at most")
            }
        }
    }
}

fn demand(key: &'static str, is_met: bool, demand: &'static str) -> Result<(), ScenarioError> {
    if is_met { Ok(()) } else { Err(ScenarioError::Value { key, demand }) }
}
