//! One solution: the pose and what lasts, by those measurements and under those assumptions that are its own.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use serde::{Deserialize, Serialize};

use super::assumed::{AssumedDeviations, Factors};
use super::envelope::{Bound, SolutionBound};
use super::sensor_information::{SensorInformation, Told, not_negative};
use crate::geometry::{Pose, difference, larger_axis, length};
use crate::odometry::BiasJacobian;

/// The pose, the place and yaw of the laser beside those believed, its clock, and scale, steering and turn of the odometry.
pub const STATES: usize = 10;

type Covariance = SMatrix<f64, STATES, STATES>;
type States = SVector<f64, STATES>;

/// A motion since the last step, and what lasting errors of the odometry make of it: the same for all solutions.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// Displacement in R at its start.
    pub displacement: Pose,
    /// Covariance of the displacement.
    pub covariance: Matrix3<f64>,
    /// How the displacement changes with scale and steering.
    pub by_bias: BiasJacobian,
}

/// How the laser is mounted and moves: the same for all solutions.
#[derive(Clone, Copy, Debug)]
pub struct Laser {
    /// Pose of S in R, as it is believed.
    pub mount: Pose,
    /// Pose of S in W at which the information is linearised.
    pub sensor: Pose,
    /// Velocity of S in W, m/s, m/s and rad/s.
    pub velocity: Vector3<f64>,
}

/// Pose and what lasts, with their covariance.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Solution {
    pose: Pose,
    /// The states behind the pose.
    lasting: Lasting,
    covariance: Covariance,
}

/// What lasts: as it is believed to be, or beside that.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Lasting {
    /// Place of the laser in R beside that believed, m.
    lever: [f64; 2],
    yaw: f64,
    clock: f64,
    scale: f64,
    steering: f64,
    turn: f64,
}

/// Errors of the odometry that last: scale, steering, rad, and turn.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct OdometryErrors {
    errors: Vector3<f64>,
    covariance: Matrix3<f64>,
    /// Their covariance with the heading.
    with_heading: Vector3<f64>,
}

impl OdometryErrors {
    /// The same beside a heading that something else has told.
    #[must_use]
    pub fn beside_another_heading(&self) -> Self {
        Self { with_heading: Vector3::zeros(), ..self.clone() }
    }

    /// What they do to a pose that the odometry leads on, `turned` by so many rad; `by_bias` is how that displacement in R changes with them.
    #[must_use]
    pub fn drift(&self, by_bias: &BiasJacobian, turned: f64) -> Drift {
        let ([scale_along, scale_aside, scale_heading], [steering_along, steering_aside, steering_heading]) =
            (by_bias.scale, by_bias.steering);
        let along = Vector3::new(scale_along, steering_along, 0.0);
        let aside = Vector3::new(scale_aside, steering_aside, 0.0);
        let heading = Vector3::new(scale_heading, steering_heading, turned);
        let variance = |by: &Vector3<f64>| not_negative(by.dot(&(self.covariance * by)));
        let expected = length(along.dot(&self.errors), aside.dot(&self.errors));
        Drift {
            expected: (expected, libm::fabs(heading.dot(&self.errors))),
            deviation: libm::sqrt(variance(&along) + variance(&aside)),
            heading_variance: heading.dot(&(self.covariance * heading)) + 2.0 * heading.dot(&self.with_heading),
        }
    }
}

/// What lasting errors of the odometry do to a pose that it leads on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// As they are known: of the position, m, and the heading, rad, at most.
    pub expected: (f64, f64),
    /// Deviation of the position, m.
    pub deviation: f64,
    /// What the variance of the heading grows by, rad^2: less than nothing where the errors make up for that of the heading.
    pub heading_variance: f64,
}

/// The first state of what lasts: of the mounting, its yaw, the clock and the odometry.
const MOUNTING: usize = 3;
const YAW: usize = 5;
const CLOCK: usize = 6;
const ODOMETRY: usize = 7;
const STEERING: usize = 8;
const HEADING: usize = 2;

/// Deviations of what is free: position of R, m; place, m, yaw, rad, and clock of the laser, s; scale, steering, rad, and turn of the odometry.
pub const FREE_POSITION: f64 = 1.0;
const FREE_PLACE: f64 = 0.6;
pub const FREE_YAW: f64 = 0.175;
const FREE_CLOCK: f64 = 0.2;
const FREE_ODOMETRY: [f64; 3] = [0.2, 0.1, 0.2];

/// How the information changes the states if the model is linearised at `from` beside them; `covariance` is theirs, and
/// becomes that behind the change.
fn change_by(
    states: (&Pose, &Lasting),
    told: &[Option<Told>; 3],
    laser: &Laser,
    from: &States,
    covariance: &mut Covariance,
) -> (States, f64) {
    let Laser { mount, sensor, velocity } = laser;
    let (pose, lasting) = shifted(states, from);
    let (sine, cosine) = libm::sincos(pose.theta);
    let [lever_x, lever_y] = lasting.lever;
    let (arm_x, arm_y) = (mount.x + lever_x, mount.y + lever_y);
    let (arm_x, arm_y) = (cosine * arm_x - sine * arm_y, sine * arm_x + cosine * arm_y);
    let clock = lasting.clock;
    // Since then the laser went on an arc: it is linearised where it was seen, and its velocity has turned meanwhile.
    let turned = velocity.z * clock;
    let beside = Vector3::new(
        pose.x + arm_x - (velocity.x - 0.5 * turned * velocity.y) * clock - sensor.x,
        pose.y + arm_y - (velocity.y + 0.5 * turned * velocity.x) * clock - sensor.y,
        difference(pose.theta + mount.theta + lasting.yaw, sensor.theta) - velocity.z * clock,
    );
    let mut change = States::zeros();
    let mut normalised_square = 0.0;
    for (row, value, variance) in told.iter().flatten().copied() {
        let (x, y, heading) = (row.x, row.y, row.z);
        let by_heading = heading - x * arm_y + y * arm_x;
        let (along, across) = (cosine * x + sine * y, cosine * y - sine * x);
        let by_clock = turned * (x * velocity.y - y * velocity.x) - row.dot(velocity);
        let expected = [x, y, by_heading, along, across, heading, by_clock];
        let shares = shares(covariance, &expected);
        let sum = |states: &States| {
            expected.iter().zip(states.iter()).fold(0.0, |sum, (derivative, state)| sum + derivative * state)
        };
        let innovation_variance = sum(&shares) + variance;
        if innovation_variance <= 0.0 {
            continue;
        }
        let weight = 1.0 / innovation_variance;
        let innovation = value - row.dot(&beside) - sum(&(change - from));
        normalised_square += innovation * innovation * weight;
        change += shares * (innovation * weight);
        subtract(covariance, &shares, weight);
    }
    (change, normalised_square)
}

/// Pose and what lasts, changed by so much.
fn shifted((pose, before): (&Pose, &Lasting), change: &States) -> (Pose, Lasting) {
    let [[x, y, heading, lever_x, lever_y, yaw, clock, scale, steering, turn]] = change.data.0;
    let [before_x, before_y] = before.lever;
    let lasting = Lasting {
        lever: [before_x + lever_x, before_y + lever_y],
        yaw: before.yaw + yaw,
        clock: before.clock + clock,
        scale: before.scale + scale,
        steering: before.steering + steering,
        turn: before.turn + turn,
    };
    (Pose::new(pose.x + x, pose.y + y, pose.theta + heading), lasting)
}

/// Covariance of all states with what is expected, which the first seven of them change: `P H'`.
fn shares(covariance: &Covariance, expected: &[f64; 7]) -> States {
    let columns = covariance.data.0.iter().zip(expected);
    columns.fold(States::zeros(), |mut sum, (column, derivative)| {
        for (sum, entry) in sum.iter_mut().zip(column) {
            *sum += derivative * entry;
        }
        sum
    })
}

/// Subtracts `w s s'`, without a matrix in between.
fn subtract(covariance: &mut Covariance, shares: &States, weight: f64) {
    for (column, share) in covariance.data.0.iter_mut().zip(shares.iter()) {
        let factor = weight * share;
        for (entry, other) in column.iter_mut().zip(shares.iter()) {
            *entry -= factor * other;
        }
    }
}

/// The model is linear within this change of the heading, rad, and if that moves a laser whose place is not known by no more than
/// this, m: what moves it by more looks like a turn, and tells a place that nothing has shown. How often it is linearised at most.
const LINEAR_WITHIN: f64 = 0.01;
const LINEAR_PLACE: f64 = 2.5e-4;
/// A heading with this variance, rad^2, is not changed by more: it is three deviations.
const SURE_HEADING: f64 = LINEAR_WITHIN * LINEAR_WITHIN / 9.0;
const MOST_LINEARISATIONS: usize = 4;

impl Solution {
    /// A solution at a pose with that covariance, which assumes what lasts to be as it is believed.
    #[must_use]
    pub fn new(pose: Pose, entries: &[f64; 6], assumed: &AssumedDeviations) -> Self {
        let mut solution = Self { pose, lasting: Lasting::default(), covariance: Covariance::zeros() };
        let [xx, xy, yy, x_heading, y_heading, heading] = *entries;
        for (row, column, entry) in
            [(0, 0, xx), (0, 1, xy), (1, 1, yy), (0, 2, x_heading), (1, 2, y_heading), (2, 2, heading)]
        {
            solution.set(row, column, entry);
        }
        let AssumedDeviations { mounting, mounting_yaw, clock, scale, steering, turn } = *assumed;
        for (state, deviation) in (MOUNTING..).zip([mounting, mounting, mounting_yaw, clock, scale, steering, turn]) {
            solution.set(state, state, deviation * deviation);
        }
        solution
    }

    fn set(&mut self, row: usize, column: usize, value: f64) {
        for place in [(row, column), (column, row)] {
            if let Some(entry) = self.covariance.get_mut(place) {
                *entry = value;
            }
        }
    }

    /// Pose of R in W.
    #[must_use]
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// Where the laser is beside where it is believed to be, m and rad.
    #[must_use]
    pub fn mounting_error(&self) -> (f64, f64) {
        let [x, y] = self.lasting.lever;
        (length(x, y), libm::fabs(self.lasting.yaw))
    }

    /// Forgets some states: they are independent of all others from now on, with these deviations.
    fn forget<const COUNT: usize>(&mut self, first: usize, deviations: &[f64; COUNT]) {
        for (state, deviation) in (first..).zip(deviations) {
            for other in 0..STATES {
                self.set(state, other, 0.0);
            }
            self.set(state, state, deviation * deviation);
        }
    }

    /// The laser may be anywhere within what a knock can do.
    pub fn free_mounting(&mut self) {
        self.forget(MOUNTING, &[FREE_PLACE, FREE_PLACE, FREE_YAW]);
    }

    /// Nothing is known of the places of R and of the laser.
    pub fn forget_places(&mut self) {
        self.forget(0, &[FREE_POSITION, FREE_POSITION]);
        self.forget(MOUNTING, &[FREE_PLACE, FREE_PLACE]);
    }

    /// Whether the heading is known so well that the model is linear.
    #[must_use]
    pub fn is_heading_sure(&self) -> bool {
        self.variances().1 <= SURE_HEADING
    }

    /// The clock of the laser may be off.
    pub fn free_clock(&mut self) {
        self.forget(CLOCK, &[FREE_CLOCK]);
    }

    /// The laser may be turned.
    pub fn free_yaw(&mut self) {
        self.forget(YAW, &[FREE_YAW]);
    }

    /// Scale, steering and turn may be anything.
    pub fn free_odometry(&mut self) {
        self.forget(ODOMETRY, &FREE_ODOMETRY);
    }

    /// The scale may be anything.
    pub fn free_scale(&mut self) {
        let [scale, ..] = FREE_ODOMETRY;
        self.forget(ODOMETRY, &[scale]);
    }

    /// The direction of travel has changed by an angle of that cosine: of the scale so much is still known, and of the steering if it has
    /// a direction; the rest is about what is believed, with these variances.
    pub fn turn_direction(&mut self, cosine: f64, (scale, steering): (f64, Option<f64>)) {
        self.lasting.scale *= cosine;
        self.fade(ODOMETRY, cosine, scale);
        if let Some(steering) = steering {
            self.lasting.steering *= cosine;
            self.fade(STEERING, cosine, steering);
        }
    }

    /// The same of a solution whose scale may be anything, and whose steering, if it has a direction: what that adds.
    pub fn free_direction(&mut self, cosine: f64, has_steering: bool) {
        let rest = 1.0 - cosine * cosine;
        let [scale, steering, _] = FREE_ODOMETRY;
        let steering = if has_steering { rest * steering * steering } else { 0.0 };
        self.loosen_odometry(&[rest * scale * scale, steering, 0.0]);
    }

    /// So much of a state is still known; the rest has that variance, and nothing in common with others.
    fn fade(&mut self, state: usize, share: f64, variance: f64) {
        for other in 0..STATES {
            let entry = self.covariance.get((state, other)).copied().unwrap_or_default();
            self.set(state, other, if other == state { share * share * entry } else { share * entry });
        }
        self.loosen(state, &[(1.0 - share * share) * variance]);
    }

    /// Nothing is known of the second error of the odometry but that it is about what is believed, with that deviation.
    pub fn free_steering(&mut self, deviation: f64) {
        self.forget(STEERING, &[deviation]);
        self.lasting.steering = 0.0;
    }

    /// What is believed of the second and third error of the odometry has changed by so much: they are beside that.
    pub fn rebase_odometry(&mut self, steering: f64, turn: f64) {
        self.lasting.steering -= steering;
        self.lasting.turn -= turn;
    }

    /// Something says what the second error of the odometry is, with that variance.
    pub fn see_steering(&mut self, value: f64, variance: f64) {
        let shares = self.covariance.data.0.get(STEERING).map_or_else(States::zeros, |column| States::from(*column));
        let innovation_variance = shares.get(STEERING).copied().unwrap_or_default() + variance;
        if innovation_variance <= 0.0 {
            return;
        }
        let weight = 1.0 / innovation_variance;
        let change = shares * ((value - self.lasting.steering) * weight);
        subtract(&mut self.covariance, &shares, weight);
        (self.pose, self.lasting) = shifted((&self.pose, &self.lasting), &change);
    }

    /// The laser may have moved by so much, m^2 and rad^2.
    pub fn loosen_mounting(&mut self, place: f64, yaw: f64) {
        self.loosen(MOUNTING, &[place, place, yaw]);
    }

    /// Scale, steering and turn may have changed by so much; variances.
    pub fn loosen_odometry(&mut self, variances: &[f64; 3]) {
        self.loosen(ODOMETRY, variances);
    }

    fn loosen<const COUNT: usize>(&mut self, first: usize, variances: &[f64; COUNT]) {
        for (state, variance) in (first..).zip(variances) {
            if let Some(entry) = self.covariance.get_mut((state, state)) {
                *entry += variance;
            }
        }
    }

    /// Goes on by a motion.
    pub fn predict(&mut self, step: &Step) {
        let Lasting { scale, steering, turn, .. } = self.lasting;
        let d = &step.displacement;
        let by_scale = Vector3::from(step.by_bias.scale);
        let by_steering = Vector3::from(step.by_bias.steering);
        let by_turn = Vector3::new(0.0, 0.5 * d.x * d.theta, d.theta);
        let error = by_scale * scale + by_steering * steering + by_turn * turn;
        let displacement = Pose { x: d.x + error.x, y: d.y + error.y, theta: d.theta + error.z };
        // One sine and cosine serve the pose and all derivatives.
        let (sine, cosine) = libm::sincos(self.pose.theta);
        let rotation = Matrix3::new(cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0);
        let by_odometry = [by_scale, by_steering, by_turn].map(|by| rotation * by);
        let noise = rotation * step.covariance * rotation.transpose();
        let Pose { x, y, theta } = displacement;
        let moved = (cosine * x - sine * y, sine * x + cosine * y);
        self.pose = Pose::new(self.pose.x + moved.0, self.pose.y + moved.1, self.pose.theta + theta);
        self.propagate((-moved.1, moved.0), &by_odometry, &noise);
    }

    /// Propagates the covariance: the position changes with the heading and the pose with the odometry's errors.
    fn propagate(&mut self, by_heading: (f64, f64), by_odometry: &[Vector3<f64>; 3], noise: &Matrix3<f64>) {
        let columns = &mut self.covariance.data.0;
        let [x, y, heading, _, _, _, _, scale, steering, turn] = &*columns;
        let [by_scale, by_steering, by_turn] = by_odometry;
        // The pose's rows of F P, then its own block of F P F'.
        let row = |pose: &[f64; STATES], by_heading: f64, by: [f64; 3]| {
            let [by_scale, by_steering, by_turn] = by;
            let mut row = *pose;
            let others = heading.iter().zip(scale).zip(steering.iter().zip(turn));
            for (entry, ((heading, scale), (steering, turn))) in row.iter_mut().zip(others) {
                *entry += heading * by_heading + scale * by_scale + steering * by_steering + turn * by_turn;
            }
            row
        };
        let x = row(x, by_heading.0, [by_scale.x, by_steering.x, by_turn.x]);
        let y = row(y, by_heading.1, [by_scale.y, by_steering.y, by_turn.y]);
        let heading = row(heading, 0.0, [by_scale.z, by_steering.z, by_turn.z]);
        let block = |row: &[f64; STATES]| {
            let [x, y, heading, _, _, _, _, scale, steering, turn] = *row;
            let errors = by_scale * scale + by_steering * steering + by_turn * turn;
            Vector3::new(x + heading * by_heading.0, y + heading * by_heading.1, heading) + errors
        };
        let [of_x, of_y, of_heading] = [block(&x), block(&y), block(&heading)];
        for (column, ((x, y), heading)) in columns.iter_mut().zip(x.iter().zip(&y).zip(&heading)).skip(3) {
            let [of_x, of_y, of_heading, ..] = column;
            (*of_x, *of_y, *of_heading) = (*x, *y, *heading);
        }
        let [first, second, third, ..] = columns;
        (*first, *second, *third) = (x, y, heading);
        let [xx, xy, xh, ..] = first;
        (*xx, *xy, *xh) = (of_x.x + noise.m11, of_x.y + noise.m12, of_x.z + noise.m13);
        let [xy, yy, yh, ..] = second;
        (*xy, *yy, *yh) = (of_x.y + noise.m12, of_y.y + noise.m22, of_y.z + noise.m23);
        let [xh, yh, hh, ..] = third;
        (*xh, *yh, *hh) = (of_x.z + noise.m13, of_y.z + noise.m23, of_heading.z + noise.m33);
    }

    /// Takes what landmarks say of the pose of the laser. Returns the normalised squared innovation, of up to three degrees of
    /// freedom. Where the heading is changed by much, the model is linearised again behind the change (Gauss-Newton).
    pub fn correct(&mut self, information: &SensorInformation, laser: &Laser) -> f64 {
        let (pose, lasting) = (self.pose, self.lasting);
        let told = information.told();
        let mut change = States::zeros();
        let mut normalised_square = 0.0;
        let (_, heading) = self.variances();
        let within = self.linear_within();
        if 9.0 * heading <= within * within {
            (change, normalised_square) = change_by((&pose, &lasting), &told, laser, &change, &mut self.covariance);
        } else {
            let before = self.covariance;
            for _ in 0..MOST_LINEARISATIONS {
                let from = change;
                self.covariance = before;
                (change, normalised_square) = change_by((&pose, &lasting), &told, laser, &from, &mut self.covariance);
                let [[_, _, turned, ..]] = (change - from).data.0;
                if libm::fabs(turned) < within {
                    break;
                }
            }
        }
        (self.pose, self.lasting) = shifted((&pose, &lasting), &change);
        normalised_square
    }

    /// The change of the heading within which the model is linear, rad.
    fn linear_within(&self) -> f64 {
        let variance = |state: usize| self.covariance.get((state, state)).copied().unwrap_or_default();
        let place = libm::sqrt(not_negative(libm::fmax(variance(MOUNTING), variance(MOUNTING + 1))));
        if LINEAR_WITHIN * place > LINEAR_PLACE { LINEAR_PLACE / place } else { LINEAR_WITHIN }
    }

    /// Variances of the position's larger axis, m^2, and of the heading, rad^2.
    #[must_use]
    pub fn variances(&self) -> (f64, f64) {
        let at = |row: usize, column: usize| self.covariance.get((row, column)).map_or(0.0, |entry: &f64| *entry);
        (not_negative(larger_axis(at(0, 0), at(0, 1), at(1, 1))), not_negative(at(2, 2)))
    }

    /// Covariance of the pose in W: xx, xy, yy, x heading, y heading, heading; m and rad.
    #[must_use]
    pub fn entries(&self) -> [f64; 6] {
        let of = self.pose_covariance();
        [of.m11, of.m12, of.m22, of.m13, of.m23, of.m33]
    }

    fn pose_covariance(&self) -> Matrix3<f64> {
        Matrix3::from_fn(|row, column| self.covariance.get((row, column)).copied().unwrap_or_default())
    }

    /// How many deviations of what lies between them this solution is away from a surer one, in position and heading together; the
    /// deviation is at least half of this solution's own.
    #[must_use]
    pub fn separation(&self, surer: &Self) -> f64 {
        let (pose, other) = (&self.pose, &surer.pose);
        let apart = Vector3::new(pose.x - other.x, pose.y - other.y, difference(pose.theta, other.theta));
        let own = self.pose_covariance();
        let square = |covariance: Matrix3<f64>| covariance.try_inverse().map(|inverse| apart.dot(&(inverse * apart)));
        let between = square(own - surer.pose_covariance()).filter(|square| *square >= 0.0);
        let at_most = 4.0 * square(own).unwrap_or_default();
        libm::sqrt(between.unwrap_or(at_most).min(at_most).max(0.0))
    }

    /// The errors of the odometry that last, as this solution knows them.
    #[must_use]
    pub fn odometry_errors(&self) -> OdometryErrors {
        let Lasting { scale, steering, turn, .. } = self.lasting;
        let at = |row: usize, column: usize| self.covariance.get((row, column)).copied().unwrap_or(0.0);
        OdometryErrors {
            errors: Vector3::new(scale, steering, turn),
            covariance: Matrix3::from_fn(|row, column| at(ODOMETRY + row, ODOMETRY + column)),
            with_heading: Vector3::from_fn(|row, _| at(ODOMETRY + row, HEADING)),
        }
    }

    /// How far a pose may be off if this solution is right: by what lies between them, and by the solution's own bound.
    /// `map_variances` are what the errors of the map add.
    #[must_use]
    pub fn bound(&self, pose: &Pose, factors: &Factors, map_variances: (f64, f64)) -> SolutionBound {
        let (position, heading) = self.variances();
        let (by_map, heading_by_map) = map_variances;
        let bound = SolutionBound {
            position: Bound {
                apart: length(pose.x - self.pose.x, pose.y - self.pose.y),
                variance: position + by_map,
                factor: factors.position,
            },
            heading: Bound {
                apart: libm::fabs(difference(pose.theta, self.pose.theta)),
                variance: heading + heading_by_map,
                factor: factors.heading,
            },
        };
        // What is not a number bounds nothing.
        if bound.position.is_finite() && bound.heading.is_finite() { bound } else { SolutionBound::UNBOUNDED }
    }
}
