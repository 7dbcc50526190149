//! Contours of the way behind: where a scan was taken relative to a past pose, by the surfaces of the key scans since.
//!
//! The submap of the key scans has a frame of its own, in which nothing moves when the pose in W is corrected. A slot of the filter
//! holds where the vehicle was at the newest key scan; a match observes where it is relative to that. So neither the error of
//! that pose nor, in a corridor, what the odometry has lost along it is ever taken for known, and many matches to one
//! submap do not make its place certain.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::contours::{FREE, GATE, INFLATION, LEAST_SHARE};
use super::{FindContours, SourceStatus};
use crate::contours::{ContourMatch, Prediction};
use crate::filter::{Ekf, Linearisation, RelativePose, Slots};
use crate::geometry::{Pose, larger_axis};
use crate::maps::Verdict;
use crate::measurement::Time;
use crate::sensing::PointView;

/// The slot for the pose at the newest key scan.
const SLOT: usize = 0;

/// How far a key scan lies off those before it: standard deviation along each axis, m,
const KEY_POSITION: f64 = 0.1e-3;

/// and of the heading, rad. All later matches have that in common.
const KEY_HEADING: f64 = 0.03e-3;

/// What is not less however many points agree: standard deviation along each axis, m,
const LEAST_POSITION: f64 = 0.5e-3;

/// and of the heading, rad.
const LEAST_HEADING: f64 = 0.9e-4;

/// Points are not taken to be nearer their surfaces than this share of the variance that a match takes them to have.
const LEAST_SCATTER: f64 = 0.03;

/// By what the covariance of a match is multiplied besides if there is a line alone: what bends or turns it is common to its points, as where
/// a leaning laser meets the floor.
const LINE: f64 = 16.0;

/// A line is alone if an axis is free and the mean of the normals is longer than this: in a corridor they cancel out.
const ONE_SIDED: f32 = 0.3;

/// Where the submap of the way behind is.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct ContoursBehind {
    /// Where the first laser was in the submap at the pose that the slot holds.
    anchor: Pose,
    /// Covariance of the match that the present scan has corrected the pose by, in W; none along a free axis of which it told nothing.
    matched: Option<Matrix3<f64>>,
    /// Whether the present scan contradicts what lies behind.
    is_contradicted: bool,
}

/// Where the laser was when the filter's time was.
#[derive(Clone, Copy)]
pub(crate) struct LaserPlace {
    /// In the frame of the scan's points.
    pub in_points: Pose,
    /// In R: its mount.
    pub mount: Pose,
}

/// A scan as it is compared with the way behind.
pub(crate) struct ScanBehind<'a> {
    /// Its points.
    pub points: PointView<'a>,
    /// The laser that took it.
    pub laser: LaserPlace,
    /// The motion since the scan before.
    pub step: Pose,
    /// Whether reflectors lead the vehicle.
    pub is_led: bool,
}

/// A match beside what the filter expects.
struct Compared {
    observation: Linearisation<3>,
    /// Squared Mahalanobis distance.
    square: f64,
}

impl Compared {
    fn is_expected(&self) -> bool {
        self.square <= GATE
    }
}

impl ContoursBehind {
    pub(crate) const fn new() -> Self {
        Self { anchor: Pose { x: 0.0, y: 0.0, theta: 0.0 }, matched: None, is_contradicted: false }
    }

    /// Corrects the filter, which stands at `time`. Returns whether the scan has told the whole pose.
    pub(crate) fn see<S: Slots>(
        &mut self,
        contours: &mut impl FindContours,
        filter: &mut Ekf<S>,
        scan: &ScanBehind,
        (time, status): (Time, &mut SourceStatus),
    ) -> bool {
        status.begin(time);
        (self.matched, self.is_contradicted) = (None, false);
        contours.see(scan.points);
        let Some(predicted) = self.predict(filter, scan) else { return false };
        let Some(found) = contours.locate_behind(&predicted).filter(|found| found.share >= LEAST_SHARE) else {
            status.add(time, Verdict::Unknown, false, None);
            return false;
        };
        let Some(compared) = self.compare(filter, &scan.laser, &found) else { return false };
        // Reflectors would have shown what is wrong with the odometry. A line alone, such as where a leaning laser meets the floor, may turn by
        // itself.
        let is_doubtful = scan.is_led || found.free_axis.is_some();
        self.is_contradicted = is_doubtful && !compared.is_expected();
        let is_used = !self.is_contradicted && correct(filter, &compared);
        let verdict = match (is_used, self.is_contradicted) {
            (true, _) => Verdict::Accepted,
            (false, true) => Verdict::Gated,
            (false, false) => Verdict::Unknown,
        };
        status.add(time, verdict, is_used, Some(compared.square / GATE));
        let past = filter.past_pose(SLOT).filter(|_| is_used && found.free_axis.is_none());
        self.matched = past.map(|past| {
            let turn = turn_back(-past.theta - scan.laser.mount.theta);
            turn * compared.observation.covariance * turn.transpose()
        });
        self.matched.is_some()
    }

    /// Where the frame of the scan's points should be in the submap.
    fn predict<S: Slots>(&self, filter: &Ekf<S>, scan: &ScanBehind) -> Option<Prediction> {
        let pose = filter.expected_relative_pose(SLOT, &scan.laser.mount)?;
        let known = RelativePose { pose, covariance: Matrix3::zeros() };
        let covariance = filter.residual_covariance(&filter.observe_relative_pose(SLOT, &known, &scan.laser.mount)?);
        let deviation = |variance: f64| libm::sqrt(variance.max(0.0));
        Some(Prediction::of_filter(
            self.anchor.compose(&pose).compose(&scan.laser.in_points.inverse()),
            deviation(larger_axis(covariance.m11, covariance.m12, covariance.m22)),
            deviation(covariance.m33),
            &scan.step,
        ))
    }

    /// What a match says of the way since the pose in the slot.
    fn compare<S: Slots>(&self, filter: &Ekf<S>, laser: &LaserPlace, found: &ContourMatch) -> Option<Compared> {
        let free = Matrix3::from_diagonal_element(1.0 / (FREE * FREE));
        let is_line = found.free_axis.is_some() && found.facing > ONE_SIDED;
        let inflation =
            if is_line { LINE * INFLATION } else { INFLATION } * f64::from(found.scatter).max(LEAST_SCATTER);
        let own = (found.information / inflation + free).try_inverse()?;
        // From the frame of the points to the laser, and from the submap to where the laser was.
        let jacobian = turn_back(self.anchor.theta) * found.pose.compose_jacobian_first(&laser.in_points);
        let least = Vector3::new(LEAST_POSITION, LEAST_POSITION, LEAST_HEADING);
        let seen = RelativePose {
            pose: self.anchor.between(&found.pose.compose(&laser.in_points)),
            covariance: jacobian * own * jacobian.transpose() + Matrix3::from_diagonal(&least.component_mul(&least)),
        };
        let observation = filter.observe_relative_pose(SLOT, &seen, &laser.mount)?;
        let root = filter.residual_covariance(&observation).cholesky()?;
        let square = observation.residual.dot(&root.solve(&observation.residual));
        square.is_finite().then_some(Compared { observation, square })
    }

    /// Makes the scan a key scan if it is time for one; to be called when all that it tells has been used.
    ///
    /// It is one of so many in the submap, and moves it by that share of its own error. If it told nothing along an axis, what it adds is as
    /// wrong there as the pose is: then the submap is where the vehicle is.
    pub(crate) fn keep<S: Slots, C: FindContours>(
        &mut self,
        contours: &mut C,
        filter: &mut Ekf<S>,
        laser: &LaserPlace,
    ) {
        // It would lie askew among those before it.
        if self.is_contradicted {
            return;
        }
        let known = filter.expected_relative_pose(SLOT, &laser.mount);
        if known.is_none() {
            contours.forget_keys();
        }
        let in_submap = known.map_or(Pose::default(), |since| self.anchor.compose(&since));
        if contours.keep(&in_submap.compose(&laser.in_points.inverse())) {
            let key = Vector3::new(KEY_POSITION, KEY_POSITION, KEY_HEADING);
            let mut doubt = Matrix3::from_diagonal(&key.component_mul(&key));
            match self.matched {
                Some(covariance) => {
                    filter.carry_past_pose(SLOT, &laser.mount);
                    doubt += covariance / C::KEYS.max(1) as f64;
                }
                None => filter.remember_pose(SLOT),
            }
            filter.doubt_past_pose(SLOT, &doubt);
            self.anchor = in_submap;
        }
    }
}

/// Corrects a filter. If the match surprises, the odometry since the scan before was wrong by as much: steps of some are, now and then, by far
/// more than their deviation says.
fn correct<S: Slots>(filter: &mut Ekf<S>, compared: &Compared) -> bool {
    if !compared.is_expected() {
        let residual = &compared.observation.residual;
        let shift = residual.x * residual.x + residual.y * residual.y;
        filter.doubt_pose(shift, residual.z * residual.z);
    }
    filter.correct(&compared.observation)
}

/// Turns x, y and heading into a frame that is turned by `angle`, rad.
fn turn_back(angle: f64) -> Matrix3<f64> {
    Pose { x: 0.0, y: 0.0, theta: -angle }.compose_jacobian_second()
}
