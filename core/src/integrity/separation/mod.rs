//! Solution separation, as in advanced receiver autonomous integrity monitoring (ARAIM): beside the solution from all that is
//! measured there is one for each thing that may be wrong, which does not rest on it. However large the fault is, that solution
//! holds; so what lies between it and the published pose, and its own bound, bound the error.
//!
//! What one event's landmarks say is summed up as information about the pose of the laser, from which single landmarks can be
//! left out again. So each solution costs the same however many landmarks are seen.

mod assumed;
mod by_surfaces;
mod contradiction;
mod creep;
mod envelope;
mod gyro;
mod hypothesis;
mod late_clock;
mod misfit;
mod sensor_information;
mod solution;
mod travel_direction;
mod unheard;

use heapless::Vec;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

pub use assumed::{AssumedDeviations, FAULT_FREE, Factors, ONE_FAULT, ONE_KNOCK, fault_free};
use contradiction::Contradiction;
use creep::Creeps;
pub use envelope::{Bound, Envelope, Growth, SolutionBound};
use gyro::GyroSeparation;
pub use hypothesis::LandmarkKey;
use hypothesis::{FreeSince, Knock, LeftOut, is_refuted};
use late_clock::LateClock;
use misfit::Misfit;
pub use sensor_information::{Seen, SensorInformation};
use solution::FREE_POSITION;
pub use solution::{Drift, Laser, OdometryErrors, Solution, Step};
use travel_direction::TravelDirection;
use unheard::Unheard;

use crate::geometry::{Pose, larger_axis};
use crate::measurement::Time;
use crate::odometry::{BiasJacobian, GyroErrors, GyroParameters, MeanMotion, Motion, Vehicle};
use crate::sources::BySurfaces;
use crate::state::{LevelGrowth, ProtectionLevel};

/// Solutions without landmarks, and with a knock in an interval.
const LEAVE_OUTS: usize = 16;
const KNOCKS: usize = 12;
/// How long the interval of a knock is at least, s: two revolutions.
const INTERVAL: f64 = 0.1;
/// A solution without a landmark is kept for this distance after it was seen, m.
const REMEMBERED: f64 = 10.0;
/// A laser is not knocked further than this, m, or turned by more, rad: it is the vehicle that was carried.
const FURTHEST_KNOCK: (f64, f64) = (1.5, 0.6);
/// What all others allow for wear.
const WEAR: (f64, f64) = (6e-5, 1e-5);
/// The solution with an odometry that changes: scale, steering and turn for a square root of a metre. Larger
/// changes contradict the landmarks before they are out of sight for long.
const CHANGE: [f64; 3] = [0.007, 0.005, 0.02];
/// The errors of the map are found from events that tell the position this well, m; others hardly move the solutions.
const WELL_SEEN: f64 = 0.03;
/// Covariance of a pose of which it is known only about where it is, within [`FREE_POSITION`] and 20 deg.
const UNKNOWN_POSE: [f64; 6] = [FREE_POSITION * FREE_POSITION, 0.0, FREE_POSITION * FREE_POSITION, 0.0, 0.0, 0.122];
/// Solutions go on at least once in this distance, m.
const LONGEST_STEP: f64 = 0.3;

/// Motion since the solutions went on.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Pending {
    covariance: Matrix3<f64>,
    distance: f64,
    /// How far it leads in R, m and rad; what turning adds to the side is of second order.
    moved: Pose,
    /// The last motion, which tells the velocity.
    last: Option<Motion>,
}

impl Pending {
    const NONE: Self = Self {
        covariance: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        distance: 0.0,
        moved: Pose { x: 0.0, y: 0.0, theta: 0.0 },
        last: None,
    };
}

/// The solutions, and the protection level that they give.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SolutionSeparation {
    assumed: AssumedDeviations,
    steering_lever: Option<f64>,
    /// Of a vehicle that can move sideways.
    direction: Option<TravelDirection>,
    time: Time,
    odometry_pose: Pose,
    pending: Pending,
    velocity: MeanMotion,
    /// Distance and turn since landmarks were last seen, m and rad.
    unseen: (f64, f64),
    all: Solution,
    leave_outs: Vec<LeftOut, LEAVE_OUTS>,
    knocks: Vec<Knock, KNOCKS>,
    mounting: Option<FreeSince>,
    next_mounting: Option<FreeSince>,
    yaw: Option<FreeSince>,
    creeps: Creeps,
    late_clock: LateClock,
    /// Whether the corrections say that the laser has moved.
    is_laser_doubted: bool,
    odometry: Solution,
    /// Of laser odometry, where landmarks do not lead.
    by_surfaces: Option<BySurfaces>,
    /// What bounded the pose, if the odometry is wrong, when landmarks last told it.
    odometry_when_told: SolutionBound,
    unheard: Unheard,
    /// Whether it is doubtful that the laser has moved as the odometry says.
    is_motion_doubtful: bool,
    /// Whether nobody has measured the motion since the last event.
    is_motion_unknown: bool,
    /// Of a vehicle with a gyro.
    gyro: Option<GyroSeparation>,
    told: SensorInformation,
    contradiction: Contradiction,
    misfit: Misfit,
    /// Whether the landmarks of the last event contradicted each other.
    was_torn: bool,
    map_variances: (f64, f64),
    /// The pose that is bounded, how much larger innovations are than expected, and the bounds, all at the last step.
    pose: Pose,
    surprise: f64,
    bounds: Bounds,
}

/// The bounds that make up the protection level.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Bounds {
    /// Of all solutions but the next two.
    envelope: Envelope,
    /// Of the one whose odometry is wrong, which may soon lead the pose away.
    odometry: SolutionBound,
    odometry_errors: OdometryErrors,
    /// Of laser odometry, which holds in that case, too; none where the wheels have led it.
    without_wheels: Option<SolutionBound>,
    /// Of the one that rests on the wheels alone; none without a gyro.
    wheels: Option<SolutionBound>,
    /// By what contradicts.
    widening: ProtectionLevel,
    /// Whether the pose is elsewhere than laser odometry can be.
    is_elsewhere: bool,
}

impl Bounds {
    /// Nothing is bounded yet.
    fn unbounded(odometry: &Solution) -> Self {
        Self {
            envelope: Envelope::new(),
            odometry: SolutionBound::UNBOUNDED,
            odometry_errors: odometry.odometry_errors(),
            without_wheels: None,
            wheels: None,
            widening: ProtectionLevel::NONE,
            is_elsewhere: false,
        }
    }
}

impl SolutionSeparation {
    /// Solutions of a vehicle that does not know where it is; its steered wheel stands `steering_lever` before the axle, m, if it has
    /// one.
    #[must_use]
    pub fn new(assumed: AssumedDeviations, steering_lever: Option<f64>) -> Self {
        Self::made(assumed, steering_lever, false, None)
    }

    /// Solutions of a vehicle whose turns that gyro tells, if it is fitted.
    #[must_use]
    pub fn of(assumed: AssumedDeviations, vehicle: &Vehicle, gyro: Option<&GyroParameters>) -> Self {
        Self::made(assumed, vehicle.steering_lever(), vehicle.moves_sideways(), gyro)
    }

    /// It is made in one piece, as it is large.
    fn made(
        assumed: AssumedDeviations,
        steering_lever: Option<f64>,
        moves_sideways: bool,
        gyro: Option<&GyroParameters>,
    ) -> Self {
        let nowhere = Solution::new(Pose::default(), &[0.0; 6], &assumed);
        Self {
            gyro: gyro.filter(|gyro| gyro.is_fitted).map(|gyro| GyroSeparation::new(gyro, &assumed)),
            assumed,
            steering_lever,
            direction: moves_sideways.then_some(TravelDirection::FORWARD),
            time: Time::default(),
            odometry_pose: Pose::default(),
            pending: Pending::NONE,
            velocity: MeanMotion::NONE,
            unseen: (0.0, 0.0),
            all: nowhere.clone(),
            leave_outs: Vec::new(),
            knocks: Vec::new(),
            mounting: None,
            next_mounting: None,
            yaw: None,
            creeps: Creeps::new(&nowhere),
            late_clock: LateClock::new(false),
            is_laser_doubted: false,
            odometry: nowhere.clone(),
            by_surfaces: None,
            odometry_when_told: SolutionBound::UNBOUNDED,
            unheard: Unheard::new(),
            is_motion_doubtful: false,
            is_motion_unknown: false,
            told: SensorInformation::NONE,
            contradiction: Contradiction::new(),
            misfit: Misfit::NONE,
            was_torn: false,
            map_variances: (0.0, 0.0),
            pose: Pose::default(),
            surprise: 1.0,
            bounds: Bounds::unbounded(&nowhere),
        }
    }

    /// What is assumed of solutions that begin.
    fn assumed(&self) -> &AssumedDeviations {
        self.gyro.as_ref().map_or(&self.assumed, GyroSeparation::assumed)
    }

    /// What is believed of the gyro has changed by so much; its bias is known to so many rad/s, `prior` at most.
    pub fn rebase_gyro(&mut self, change: &GyroErrors, bias: f64, prior: f64) {
        let Some(gyro) = &mut self.gyro else { return };
        gyro.know(bias, prior);
        if *change == GyroErrors::default() {
            return;
        }
        for solution in self.solutions() {
            solution.rebase_odometry(change.bias, change.scale);
        }
    }

    /// The bias of the gyro is about what is believed, with that deviation, rad/s, and nothing that was learnt holds.
    pub fn free_gyro_bias(&mut self, deviation: f64) {
        if self.gyro.is_some() {
            for solution in self.solutions() {
                solution.free_steering(deviation);
            }
        }
    }

    /// The bias of the gyro was seen at rest: so much beside what is believed, rad/s, with that variance.
    pub fn see_rest(&mut self, bias: f64, variance: f64) {
        if self.gyro.is_some() {
            for solution in self.solutions() {
                solution.see_steering(bias, variance);
            }
        }
    }

    /// Begins at a pose of W that was given, with that covariance, or begins anew: who was carried is where the given pose has
    /// it, but if the laser was knocked instead, the solutions that allow for a knock still hold. `odometry_pose` is where the
    /// odometry has the vehicle now.
    pub fn begin(&mut self, time: Time, pose: &Pose, covariance: &[f64; 6], odometry_pose: &Pose) {
        if self.mounting.is_some() {
            // The laser may have been knocked since the last event.
            self.begin_knock(self.time);
        }
        self.all = Solution::new(*pose, covariance, self.assumed());
        if let Some(gyro) = &mut self.gyro {
            gyro.begin(pose, covariance, &self.assumed);
        }
        self.creeps.begin(&self.all);
        self.late_clock = LateClock::new(self.mounting.is_none());
        self.restart_odometry();
        self.by_surfaces = None;
        self.unheard.begin(time);
        self.is_motion_doubtful = false;
        self.leave_outs.clear();
        if self.mounting.is_none() {
            self.mounting = Some(self.free_mounting(time));
            self.yaw = Some(self.free_yaw(time));
            self.unseen = (0.0, 0.0);
        }
        self.time = time;
        self.odometry_pose = *odometry_pose;
        self.pending = Pending::NONE;
        self.misfit = Misfit::NONE;
        self.was_torn = false;
        self.map_variances = (0.0, 0.0);
        self.contradiction = Contradiction::new();
        self.rest_on(pose, 1.0);
    }

    /// The map has contradicted the pose before [`Self::begin`], or the laser has moved otherwise than the vehicle before there was one, and
    /// nobody knows why: mounting or clock of the laser may be others since then, so they are free again, and that counts at once, until a
    /// turn has shown them.
    pub fn doubt_mounting(&mut self) {
        self.mounting = Some(FreeSince { is_needed: true, ..self.free_mounting(self.time) });
        self.next_mounting = None;
        let pose = self.pose;
        self.rest_on(&pose, self.surprise);
    }

    /// Whether the corrections say that the laser has moved: as long as they do, the solutions count in which it has.
    pub fn doubt_laser(&mut self, is_doubted: bool) {
        self.is_laser_doubted = is_doubted;
    }

    /// Whether it is doubtful that the laser has moved as the odometry says: as long as it is, the vehicle may be elsewhere.
    pub fn doubt_motion(&mut self, is_doubtful: bool) {
        self.is_motion_doubtful = is_doubtful;
    }

    /// Nobody measures the motion until the next event. A laser that is knocked meanwhile looks like a vehicle that moves; that both happen
    /// at once are two faults, which no solution allows for.
    pub const fn lose_motion(&mut self) {
        self.is_motion_unknown = true;
    }

    /// What was wrong before may have been learnt as something else; so nothing is kept but about where the vehicle is.
    fn free_mounting(&self, since: Time) -> FreeSince {
        let mut solution = Solution::new(*self.all.pose(), &UNKNOWN_POSE, self.assumed());
        solution.free_mounting();
        solution.free_clock();
        FreeSince { awaits_heading: true, ..FreeSince::new(since, solution) }
    }

    /// A laser that was turned before has shown a wrong heading.
    fn free_yaw(&self, since: Time) -> FreeSince {
        let mut solution = Solution::new(*self.all.pose(), &UNKNOWN_POSE, self.assumed());
        solution.free_yaw();
        FreeSince::new(since, solution)
    }

    /// Begins the solution with an odometry that changes. The turns of a gyro are none of the wheels' errors.
    fn restart_odometry(&mut self) {
        self.odometry = self.all.clone();
        if self.gyro.is_some() { self.odometry.free_scale() } else { self.odometry.free_odometry() }
    }

    /// Takes a motion of the odometry; `odometry_pose` is where it has led to.
    pub fn travel(&mut self, motion: &Motion, odometry_pose: &Pose) {
        self.travel_by_gyro(motion, None, odometry_pose);
    }

    /// The same for a motion of which a gyro has told the turn; `wheels` is what the wheels have told, none if they were believed.
    pub fn travel_by_gyro(&mut self, motion: &Motion, wheels: Option<&Motion>, odometry_pose: &Pose) {
        if let Some(gyro) = &mut self.gyro {
            self.pending.covariance.m33 += gyro.travel(motion, wheels, &self.assumed);
        }
        self.pending.covariance += motion.covariance;
        self.pending.distance += motion.distance;
        let Pose { x, y, theta } = motion.displacement;
        let moved = &self.pending.moved;
        self.pending.moved = Pose { x: moved.x + x, y: moved.y + y, theta: moved.theta + theta };
        self.pending.last = Some(*motion);
        self.velocity.add(motion);
        if self.pending.distance > LONGEST_STEP {
            self.step(motion.end, odometry_pose);
            let pose = self.pose;
            self.rest_on(&pose, self.surprise);
        }
    }

    /// Takes a motion that is assumed until the odometry reports what it was: the odometry pose has it, and its error is as large.
    pub fn assume(&mut self, motion: &Motion) {
        self.pending.covariance += motion.covariance;
    }

    /// Lets all solutions go on to where the odometry is now. The level is found anew at the end of the event that follows.
    pub fn step(&mut self, now: Time, odometry_pose: &Pose) {
        let displacement = self.odometry_pose.between(odometry_pose);
        let distance = self.pending.distance;
        self.turn_direction(&displacement);
        let step = Step { displacement, covariance: self.pending.covariance, by_bias: self.by_bias(&displacement) };
        let passed = now.since(self.time);
        let lasted = distance.max(0.5 * now.since(self.time).max(0.0));
        let wear = [WEAR.0, WEAR.1].map(|deviation| deviation * deviation * lasted);
        for solution in self.solutions() {
            solution.predict(&step);
            let [place, yaw] = wear;
            solution.loosen_mounting(place, yaw);
        }
        if let Some(gyro) = &mut self.gyro {
            let length = self.direction.as_ref().map_or(displacement.x, |direction| direction.length_of(&displacement));
            let drift = gyro.step(&displacement, (self.steering_lever, length), passed);
            let [place, yaw] = wear;
            gyro.alone_mut().loosen_mounting(place, yaw);
            for solution in self.solutions() {
                solution.loosen_odometry(&[0.0, drift, 0.0]);
            }
        }
        self.creeps.creep(lasted);
        self.contradiction.travel(distance);
        for one in &mut self.leave_outs {
            one.unseen += distance;
        }
        self.leave_outs.retain(|one| one.unseen <= REMEMBERED);
        self.unseen = (self.unseen.0 + distance, self.unseen.1 + libm::fabs(displacement.theta));
        self.time = now;
        self.odometry_pose = *odometry_pose;
        self.pending = Pending { last: self.pending.last, ..Pending::NONE };
        self.pose = self.pose.compose(&displacement);
        if let Some(by_surfaces) = &mut self.by_surfaces {
            by_surfaces.pose = by_surfaces.pose.compose(&displacement);
            by_surfaces.since = by_surfaces.since.compose(&displacement);
        }
    }

    /// How a displacement since the last step changes with the errors of the odometry.
    fn by_bias(&self, displacement: &Pose) -> BiasJacobian {
        match &self.gyro {
            Some(gyro) => gyro.jacobian(displacement),
            None => BiasJacobian::of_length(displacement, self.steering_lever, self.length_of(displacement)),
        }
    }

    /// Length in the direction of travel, m.
    fn length_of(&self, displacement: &Pose) -> f64 {
        self.direction.as_ref().map_or(displacement.x, |direction| direction.length_of(displacement))
    }

    /// What was learnt of the odometry in one direction is not known of another one.
    fn turn_direction(&mut self, displacement: &Pose) {
        let Some(cosine) = self.direction.as_mut().and_then(|direction| direction.go_on(displacement)) else { return };
        let AssumedDeviations { scale, steering, .. } = self.assumed;
        // A gyro has its bias in place of the steering, which has no direction.
        let steering = if self.gyro.is_some() { None } else { Some(steering * steering) };
        let variances = (scale * scale, steering);
        for solution in self.solutions() {
            solution.turn_direction(cosine, variances);
        }
        self.odometry.free_direction(cosine, steering.is_some());
        if let Some(gyro) = &mut self.gyro {
            gyro.alone_mut()
                .turn_direction(cosine, (scale * scale, Some(self.assumed.steering * self.assumed.steering)));
        }
    }

    /// All solutions.
    fn solutions(&mut self) -> impl Iterator<Item = &mut Solution> {
        let free = [&mut self.mounting, &mut self.next_mounting, &mut self.yaw];
        [&mut self.all, &mut self.odometry]
            .into_iter()
            .chain(self.creeps.solutions())
            .chain(self.late_clock.solution_mut())
            .chain(self.leave_outs.iter_mut().map(|one| &mut one.solution))
            .chain(self.knocks.iter_mut().map(|one| &mut one.solution))
            .chain(free.into_iter().flatten().map(|one| &mut one.solution))
    }

    /// The laser, of which what follows is told, if it is at `mount` in R and R at `pose`.
    #[must_use]
    pub fn laser(&self, mount: &Pose, pose: &Pose) -> Laser {
        let velocity = self.velocity.velocity();
        let turn = velocity.z;
        let (sine, cosine) = libm::sincos(pose.theta);
        let (x, y) = (velocity.x - turn * mount.y, velocity.y + turn * mount.x);
        Laser {
            mount: *mount,
            sensor: pose.compose(mount),
            velocity: Vector3::new(cosine * x - sine * y, sine * x + cosine * y, turn),
        }
    }

    /// Begins to take what one event tells; the solutions have gone on to its time.
    pub fn begin_event(&mut self) {
        self.told = SensorInformation::NONE;
        self.contradiction.begin_event();
        for one in &mut self.leave_outs {
            one.told = SensorInformation::NONE;
        }
    }

    /// Takes a landmark that fits the pose.
    pub fn see(&mut self, key: LandmarkKey, seen: &Seen, laser: &Laser) {
        self.take(key, SensorInformation::of(seen, &laser.sensor));
    }

    /// Takes what fits the pose and is left out together with all that has the same key.
    pub fn take(&mut self, key: LandmarkKey, told: SensorInformation) {
        let Some(place) = self.place_of(key) else { return };
        self.contradiction.fit();
        self.told = self.told.with(&told);
        if let Some(one) = self.leave_outs.get_mut(place) {
            one.told = one.told.with(&told);
            one.unseen = 0.0;
        }
    }

    /// Takes one that is elsewhere by so much in W, m, and so far from the laser, m.
    pub fn displace(&mut self, by: [f64; 2], range: f64) {
        self.contradiction.displace(by, range);
    }

    /// Takes one that belongs to none of the map within so many m, and is so far from the laser, m.
    pub fn contradict(&mut self, by: f64, range: f64) {
        self.contradiction.contradict(by, range);
    }

    /// Which solution leaves the landmark out. None has used one that was not in sight: so one that comes in sight can be left
    /// out together with others. None if there is no room; it is not used then.
    fn place_of(&mut self, key: LandmarkKey) -> Option<usize> {
        let known = self.leave_outs.iter().position(|one| one.keys.contains(&key));
        if known.is_some() {
            return known;
        }
        if !self.leave_outs.is_full() {
            let mut keys = Vec::new();
            // There is room.
            let _ = keys.push(key);
            let one = LeftOut { keys, told: SensorInformation::NONE, unseen: 0.0, solution: self.all.clone() };
            let _ = self.leave_outs.push(one);
            return Some(self.leave_outs.len() - 1);
        }
        let (place, one) = self.leave_outs.iter_mut().enumerate().min_by_key(|(_, one)| one.keys.len())?;
        one.keys.push(key).ok()?;
        Some(place)
    }

    /// Takes that the first laser has told something, and where laser odometry has R now; none where landmarks lead.
    pub fn hear_laser(&mut self, by_surfaces: Option<BySurfaces>) {
        self.by_surfaces = by_surfaces;
        self.unheard.hear(self.time);
    }

    /// Whether the pose is elsewhere than laser odometry can be.
    #[must_use]
    pub const fn contradicts_surfaces(&self) -> bool {
        self.bounds.is_elsewhere
    }

    /// Ends the event: all solutions are corrected, and the protection level of `pose` is found. Innovations are `surprise` times as large
    /// as the filter expects, or as it expects them (1).
    pub fn end_event(&mut self, pose: &Pose, laser: &Laser, surprise: f64) {
        let is_contradicted = self.contradiction.end_event();
        self.misfit.add(&self.told);
        // What contradicts itself once has seen something else than landmarks; what does so twice has a wrong map.
        let is_torn = Misfit::is_torn(&self.told);
        let is_strange = is_torn && !self.was_torn;
        if self.told.is_any() {
            self.was_torn = is_torn;
        }
        if self.told.is_any() && !is_contradicted && !is_strange {
            self.correct(laser);
            self.map_variances = self.told.map_variances(WELL_SEEN * WELL_SEEN).unwrap_or(self.map_variances);
        }
        self.rest_on(pose, surprise);
    }

    fn rest_on(&mut self, pose: &Pose, surprise: f64) {
        self.pose = *pose;
        self.surprise = surprise;
        if self.by_surfaces.is_some_and(|reached| reached.distance == 0.0) {
            self.odometry_when_told = self.odometry.bound(pose, &ONE_FAULT.times(surprise), self.map_variances);
        }
        self.bounds = self.bounds_of(pose, surprise);
    }

    fn correct(&mut self, laser: &Laser) {
        let (told, now) = (self.told, self.time);
        if core::mem::take(&mut self.is_motion_unknown) {
            self.knocks.iter_mut().for_each(|knock| knock.is_over = true);
        } else {
            self.begin_knock(now);
        }
        let all_before = self.all.clone();
        self.all.correct(&told, laser);
        for one in &mut self.leave_outs {
            if is_refuted(one.solution.correct(&told.without(&one.told), laser)) {
                one.solution = all_before.clone();
            }
        }
        self.creeps.correct(&told, laser, &self.all);
        let assumed = *self.assumed();
        self.late_clock.correct(&told, laser, &self.all, &assumed);
        let [scale, steering, turn] = CHANGE.map(|deviation| deviation * deviation * self.unseen.0);
        let change = if self.gyro.is_some() { [scale, 0.0, 0.0] } else { [scale, steering, turn] };
        self.odometry.loosen_odometry(&change);
        if is_refuted(self.odometry.correct(&told, laser)) {
            self.restart_odometry();
        }
        self.correct_wheels_alone(&told, laser);
        self.knocks.retain_mut(|knock| {
            if !knock.is_over {
                knock.solution.free_mounting();
            }
            let square = knock.solution.correct(&told, laser);
            knock.is_over |= now.since(knock.from) >= INTERVAL;
            let (place, yaw) = knock.solution.mounting_error();
            !is_refuted(square) && place <= FURTHEST_KNOCK.0 && yaw <= FURTHEST_KNOCK.1
        });
        self.correct_free(&told, laser);
        self.unseen = (0.0, 0.0);
    }

    fn correct_wheels_alone(&mut self, told: &SensorInformation, laser: &Laser) {
        let Some(gyro) = &mut self.gyro else { return };
        if is_refuted(gyro.alone_mut().correct(told, laser)) {
            let pose = *self.all.pose();
            gyro.begin(&pose, &self.all.entries(), &self.assumed);
        }
    }

    /// Opens the next interval if none is open.
    fn begin_knock(&mut self, now: Time) {
        if self.knocks.iter().any(|knock| !knock.is_over) {
            return;
        }
        let knock = Knock { from: now, is_over: false, solution: self.all.clone() };
        if !self.knocks.is_full() {
            let _ = self.knocks.push(knock);
            return;
        }
        // The one that says least makes room.
        let pose = *self.all.pose();
        let position = |knock: &Knock| knock.solution.bound(&pose, &ONE_KNOCK, (0.0, 0.0)).level().position;
        if let Some(least) = self.knocks.iter_mut().min_by(|a, b| position(a).total_cmp(&position(b))) {
            *least = knock;
        }
    }

    fn correct_free(&mut self, told: &SensorInformation, laser: &Laser) {
        let now = self.time;
        let (driven, turned) = if self.unseen.0 <= 1.0 { self.unseen } else { (0.0, 0.0) };
        let go_on = |one: &mut Option<FreeSince>| {
            let Some(free) = one else { return false };
            free.driven += driven;
            free.turned += turned;
            let is_refuted = free.correct(told, laser);
            if is_refuted {
                *one = None;
            }
            is_refuted
        };
        let is_refuted = go_on(&mut self.mounting);
        go_on(&mut self.next_mounting);
        go_on(&mut self.yaw);
        if self.mounting.is_none() {
            // It may have been knocked since the next one began, too.
            self.next_mounting = None;
            self.mounting = Some(FreeSince { is_needed: is_refuted, ..self.free_mounting(now) });
        }
        if self.mounting.as_ref().is_some_and(FreeSince::has_found_mounting) && self.next_mounting.is_none() {
            self.yaw = None;
            self.next_mounting = Some(self.free_mounting(now));
        }
        if let Some(found) = self.next_mounting.take_if(|next| next.has_found_mounting() && next.is_well_known()) {
            // Whatever was knocked before is free in it.
            self.knocks.retain(|knock| !knock.is_over || knock.from >= found.since);
            self.mounting = Some(found);
            self.next_mounting = Some(self.free_mounting(now));
        }
    }

    /// The bounds of a pose by all solutions, and by what contradicts it.
    fn bounds_of(&self, pose: &Pose, surprise: f64) -> Bounds {
        let [fault_free, one_fault, one_knock] =
            [FAULT_FREE, ONE_FAULT, ONE_KNOCK].map(|factors| factors.times(surprise));
        let map_variances = self.map_variances;
        let bound = |solution: &Solution, factors: &Factors| solution.bound(pose, factors, map_variances);
        let mut envelope = Envelope::new();
        envelope.add(&bound(&self.all, &fault_free));
        self.leave_outs.iter().for_each(|one| envelope.add(&bound(&one.solution, &one_fault)));
        self.knocks.iter().for_each(|one| envelope.add(&bound(&one.solution, &one_knock)));
        self.creeps.add_to(&mut envelope, pose, surprise, map_variances, self.is_laser_doubted);
        self.late_clock.solution().into_iter().for_each(|late| envelope.add(&bound(late, &one_fault)));
        let found_mounting = self.mounting.as_ref().filter(|free| free.counts() || self.is_laser_doubted);
        let found_yaw = self.yaw.as_ref().filter(|free| free.has_found_yaw());
        let by_surfaces =
            self.by_surfaces.map(|reached| by_surfaces::bound(&reached, pose, &self.all.entries(), &one_fault));
        by_surfaces.iter().for_each(|bound| envelope.add(bound));
        let free = found_mounting.into_iter().chain(found_yaw);
        free.for_each(|one| one.add_to(&mut envelope, pose, &one_fault, map_variances));
        let [contradiction, misfit] = [self.contradiction.widening(), self.misfit.widening()];
        let [carried, turned] = if self.is_motion_doubtful { by_surfaces::TORN } else { [0.0; 2] };
        Bounds {
            envelope,
            odometry: bound(&self.odometry, &one_fault),
            odometry_errors: self.odometry.odometry_errors(),
            without_wheels: self.by_surfaces.and_then(|reached| {
                by_surfaces::bound_without_wheels(&reached, pose, &self.odometry_when_told, &one_fault)
            }),
            wheels: self.gyro.as_ref().map(|gyro| bound(gyro.alone(), &one_fault)),
            widening: ProtectionLevel {
                position: contradiction.position + misfit.position + carried,
                heading: contradiction.heading + misfit.heading + turned,
            },
            is_elsewhere: by_surfaces.is_some_and(|bound| bound.is_exceeded()),
        }
    }

    /// The protection level of the pose that the odometry has led on to since the last step.
    #[must_use]
    pub fn level(&self) -> ProtectionLevel {
        let wheels = self.gyro.as_ref().map(|gyro| *gyro.wheels_covariance());
        self.level_behind(&self.pending, wheels.as_ref())
    }

    /// How the level grows if the vehicle goes on by the motion of late.
    #[must_use]
    pub fn growth(&self, recent: &Motion) -> LevelGrowth {
        let now = self.level();
        let lasted = recent.end.since(recent.start);
        LevelGrowth::of(|seconds| {
            let share = if lasted > 0.0 { seconds / lasted } else { 0.0 };
            let Pose { x, y, theta } = recent.displacement;
            let moved = &self.pending.moved;
            let pending = Pending {
                covariance: self.pending.covariance + recent.covariance * share,
                distance: self.pending.distance + recent.distance * share,
                moved: Pose { x: moved.x + share * x, y: moved.y + share * y, theta: moved.theta + share * theta },
                last: self.pending.last,
            };
            let wheels = self.gyro.as_ref().map(|gyro| gyro.wheels_covariance_after(seconds));
            let level = self.level_behind(&pending, wheels.as_ref());
            ProtectionLevel {
                position: (level.position - now.position).max(0.0),
                heading: (level.heading - now.heading).max(0.0),
            }
        })
    }

    /// The level behind a motion since the last step, of which the wheels alone have told the covariance `by_wheels`.
    fn level_behind(&self, pending: &Pending, by_wheels: Option<&Matrix3<f64>>) -> ProtectionLevel {
        let Pending { covariance, distance, moved, .. } = pending;
        let Bounds { envelope, odometry, odometry_errors, without_wheels, wheels, widening, .. } = &self.bounds;
        if *odometry == SolutionBound::UNBOUNDED {
            return ProtectionLevel::UNBOUNDED;
        }
        let noise = self.growth_by(covariance, *distance);
        let drift = odometry_errors.drift(&self.by_bias(moved), moved.theta);
        let mut by_odometry = odometry.after_drift(&noise, &drift);
        if let Some((laser, reached)) = without_wheels.as_ref().zip(self.by_surfaces.as_ref()) {
            let Pose { x, y, theta } = reached.since;
            let unseen = Pose { x: x + moved.x, y: y + moved.y, theta: theta + moved.theta };
            let drift = odometry_errors.beside_another_heading().drift(&self.by_bias(&unseen), unseen.theta);
            by_odometry = by_odometry.and(&laser.after_drift(&noise, &drift));
        }
        let mut level = envelope.after(&noise).or(&by_odometry);
        if let Some((wheels, covariance)) = wheels.as_ref().zip(by_wheels) {
            level = level.or(&wheels.after(&self.growth_by(covariance, *distance)));
        }
        let unheard = self.unheard.widening(pending.last.map_or(self.time, |motion| motion.end));
        let heading = level.heading + widening.heading + unheard.heading;
        let position = level.position + widening.position + unheard.position;
        ProtectionLevel { position: position + heading.min(1.0) * distance, heading }
    }

    /// What a motion of so many m, with that noise, adds to the variances of a solution.
    fn growth_by(&self, noise: &Matrix3<f64>, distance: f64) -> Growth {
        let AssumedDeviations { scale, steering, turn, .. } = self.assumed;
        let along = scale * distance;
        let by_turn = steering.max(turn) * distance;
        Growth {
            position: larger_axis(noise.m11, noise.m12, noise.m22) + along * along,
            heading: noise.m33.max(0.0) + by_turn * by_turn,
        }
    }
}
