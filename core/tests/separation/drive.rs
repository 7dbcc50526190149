//! A drive whose truth is known, and what the level says in it.

use agv_core::geometry::{Point, Pose};
use agv_core::integrity::separation::{AssumedDeviations, LandmarkKey, Seen, SolutionSeparation};
use agv_core::measurement::Time;
use agv_core::odometry::Motion;
use nalgebra::{Matrix2, Matrix3, Vector3};

use super::sensor_information::normal_equations;
use crate::falko::scene::Random;

/// A vehicle among reflectors, whose monitor is told what is seen from a laser that may be elsewhere.
pub struct Drive {
    pub monitor: SolutionSeparation,
    pub reflectors: Vec<Point>,
    pub truth: Pose,
    pub odometry: Pose,
    pub time: Time,
    pub random: Random,
    pub mount: Pose,
    pub true_mount: Pose,
    /// The pose that is published, here that of the laser as it is believed to be mounted.
    pub published: Pose,
    /// By which share the map is sheared.
    pub shear: f64,
    /// How far beside the first reflector something else is seen instead, m; the first one is near then, and seen to 2 mm. None if it is
    /// seen as the others are.
    pub beside: Option<f64>,
    /// Reports of the odometry in a revolution.
    pub samples: usize,
    /// Deviation of what each but the last of them rounds the way to, m, and what the last one has.
    pub rounding: f64,
    rounded: f64,
}

impl Drive {
    pub fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let reflectors =
            (0..14).map(|_| Point::new(random.uniform(-12.0, 12.0), random.uniform(-12.0, 12.0))).collect();
        let truth = Pose::new(-4.0, 0.0, 0.0);
        let mount = Pose::new(0.8, 0.0, 0.0);
        let time = Time::from_seconds(1.0);
        let mut drive = Self {
            monitor: SolutionSeparation::new(AssumedDeviations::default(), Some(1.4)),
            reflectors,
            truth,
            odometry: truth,
            time,
            random,
            mount,
            true_mount: mount,
            published: truth,
            shear: 0.0,
            beside: None,
            samples: 1,
            rounding: 0.0,
            rounded: 0.0,
        };
        drive.begin();
        // It has its pose while it stands, so its clock is not in doubt.
        drive.revolve(&Pose::default());
        drive
    }

    /// Switches the monitor on, with the pose that is published.
    pub fn begin(&mut self) {
        self.monitor = SolutionSeparation::new(AssumedDeviations::default(), Some(1.4));
        self.monitor.begin(self.time, &self.published, &[1e-4, 0.0, 1e-4, 0.0, 0.0, 1e-5], &self.odometry);
    }

    /// The pose of least squares in the map, with the weights of the monitor, near the published one.
    pub fn fit(&self, seen: &[Seen]) -> Pose {
        let mut sensor = self.published.compose(&self.mount);
        for _ in 0..3 {
            let (matrix, vector) = normal_equations(seen, &sensor);
            let beside = matrix.try_inverse().unwrap() * vector;
            sensor = Pose::new(sensor.x + beside[0], sensor.y + beside[1], sensor.theta + beside[2]);
        }
        sensor.compose(&self.mount.inverse())
    }

    /// One revolution later.
    pub fn revolve(&mut self, step: &Pose) {
        self.go(step);
        self.look();
    }

    /// One revolution later, of which nothing was used.
    pub fn go(&mut self, step: &Pose) {
        let end = self.time.offset(0.125);
        let slip = 1e-3 * self.random.normal();
        let told = Pose::new(step.x + slip, step.y, step.theta + 1e-4 * self.random.normal());
        let motion = Motion {
            start: self.time,
            end,
            displacement: told,
            covariance: Matrix3::from_diagonal(&Vector3::new(1e-6, 1e-8, 4e-8)),
            distance: told.x.abs(),
        };
        self.truth = self.truth.compose(step);
        let samples = self.samples;
        for sample in 1..=samples {
            let is_last = sample == samples;
            let rounded = if is_last { 0.0 } else { self.rounding * self.random.normal() };
            let share = 1.0 / samples as f64;
            let displacement = Pose::new(share * told.x + rounded - self.rounded, share * told.y, share * told.theta);
            self.rounded = rounded;
            self.odometry = self.odometry.compose(&displacement);
            let part = Motion {
                start: self.time,
                end: if is_last { end } else { self.time.offset(share * 0.125) },
                displacement,
                covariance: motion.covariance * share,
                distance: share * motion.distance,
            };
            self.time = part.end;
            self.monitor.travel(&part, &self.odometry);
        }
        self.monitor.step(end, &self.odometry);
    }

    pub fn look(&mut self) {
        let sensor = self.truth.compose(&self.true_mount);
        self.published = sensor.compose(&self.mount.inverse());
        let mut all = Vec::new();
        for (number, standing) in self.reflectors.iter().take(6).enumerate() {
            let seen = sensor.inverse_transform(standing);
            let near = self.beside.filter(|_| number == 0);
            let (deviation, variance) = if near.is_some() { (0.002, 4e-6) } else { (0.008, 1e-4) };
            let mut noise = || deviation * self.random.normal();
            let position = Point::new(seen.x + noise() + near.unwrap_or_default(), seen.y + noise());
            let covariance = Matrix2::identity() * variance;
            let landmark = Point::new(standing.x + self.shear * standing.y, standing.y);
            all.push(Seen { position, covariance, landmark, landmark_variance: 4e-6 });
        }
        if self.shear != 0.0 {
            self.published = self.fit(&all);
        }
        let laser = self.monitor.laser(&self.mount, &self.published);
        self.monitor.begin_event();
        for (id, seen) in (0..).zip(&all) {
            self.monitor.see(LandmarkKey::Reflector(id), seen, &laser);
        }
        self.monitor.end_event(&self.published, &laser, 1.0);
    }

    /// The same vehicle, whose laser was moved while it was off: it has found itself by that laser.
    pub fn with_mounting_off(seed: u64, off: &Pose) -> Self {
        let mut drive = Self::new(seed);
        drive.true_mount = drive.mount.compose(off);
        let found = drive.truth.compose(&drive.true_mount).compose(&drive.mount.inverse());
        let (now, covariance) = (drive.time, [1e-4, 0.0, 1e-4, 0.0, 0.0, 1e-5]);
        drive.monitor = SolutionSeparation::new(AssumedDeviations::default(), Some(1.4));
        drive.monitor.begin(now, &found, &covariance, &drive.odometry);
        drive
    }

    /// Finds itself by the laser where it stands now, after landmarks have contradicted the pose.
    pub fn begin_doubting(&mut self) {
        self.published = self.truth.compose(&self.true_mount).compose(&self.mount.inverse());
        self.monitor.begin(self.time, &self.published, &[1e-4, 0.0, 1e-4, 0.0, 0.0, 1e-5], &self.odometry);
        self.monitor.doubt_mounting();
    }

    pub fn error(&self) -> (f64, f64) {
        let off = self.truth.between(&self.published);
        (off.x.hypot(off.y), off.theta.abs())
    }

    pub fn is_held(&self) -> bool {
        let ((position, heading), level) = (self.error(), self.monitor.level());
        position <= level.position && heading <= level.heading
    }

    #[track_caller]
    pub fn assert_held(&self, case: std::fmt::Arguments) {
        assert!(self.is_held(), "{case}: {:?}, {:?} at {:?}", self.error(), self.monitor.level(), self.time);
    }
}
