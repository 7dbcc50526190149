//! What a gyro says of the motion.

use super::{Capacities, Localizer, Misuse};
use crate::filter::KnownPose;
use crate::geometry::Pose;
use crate::integrity::{GyroFault, LastingErrors};
use crate::maps::Verdict;
use crate::measurement::GyroSample;
use crate::odometry::{GyroErrors, GyroRefusal, Motion};
use crate::sources::{AtRest, GyroMotion, NoTurn};

/// What is learnt from landmarks may be wrong with them by so many deviations before other solutions doubt it.
const TRUSTED: f64 = 3.0;
/// Arm that makes a turn of the way that a wheel without steering has slipped, m.
const SLIP_ARM: f64 = 0.5;

/// The pose before an event, and where the odometry alone had it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Before {
    known: KnownPose,
    odometry_pose: Pose,
}

impl<C: Capacities> Localizer<C> {
    /// The pose of now.
    #[inline(never)]
    pub(super) fn known_pose(&mut self) -> Option<Before> {
        let timeline = self.timeline.begun_mut()?;
        let state = timeline.state();
        let known = KnownPose { pose: state.pose, covariance: state.covariance() };
        Some(Before { known, odometry_pose: *timeline.odometry_pose() })
    }

    /// Takes a reading of the gyro.
    #[inline(never)]
    pub(super) fn turn_rate(&mut self, sample: &GyroSample) {
        let Some(gyro) = &mut self.gyro else {
            if !self.parameters.gyro.is_fitted {
                self.outputs.misuse = Some(Misuse::WrongVehicle);
            }
            return;
        };
        let is_moving = self.integrity.turns.sample(sample);
        let before = *gyro.state().errors();
        let is_jump = match gyro.sample(sample) {
            Ok(at_rest) => at_rest == AtRest::Jumped,
            Err(GyroRefusal::Clipped) => {
                self.integrity.turns.raise(GyroFault::Clipped, sample.time);
                false
            }
            Err(GyroRefusal::OutOfOrder) => {
                self.outputs.misuse = Some(Misuse::OutOfOrder);
                false
            }
        };
        if !is_moving {
            gyro.forget();
        }
        if is_jump {
            self.integrity.turns.raise(GyroFault::Jumped, sample.time);
        }
        if gyro.is_after_gap() {
            self.integrity.turns.raise(GyroFault::Missing, sample.time);
        }
        if self.parameters.protection {
            let now = *gyro.state().errors();
            let change = GyroErrors { bias: now.bias - before.bias, scale: now.scale - before.scale };
            let prior = self.parameters.gyro.bias;
            self.separation.rebase_gyro(&change, TRUSTED * gyro.state().deviations().0, prior);
            if is_jump {
                self.separation.free_gyro_bias(prior);
            }
        }
    }

    /// Goes on by a motion of the wheels, whose turn the gyro tells better.
    #[inline(never)]
    pub(super) fn go_on_by_gyro(&mut self, wheels: &Motion) {
        let heading = self.timeline.state().pose.theta;
        let Some(gyro) = &mut self.gyro else { return };
        let turns = &mut self.integrity.turns;
        let is_believed = turns.fault(wheels.end) != Some(GyroFault::Frozen);
        let told = gyro.travel(wheels);
        let Some(GyroMotion { mut motion, turn }) = told.ok().filter(|_| is_believed) else {
            turns.travel_alone(wheels, told.is_err_and(|why| why == NoTurn::Standing));
            let motion = gyro.go_on(heading, wheels, None);
            self.advance(&motion, wheels, None);
            return;
        };
        let assumed = &self.parameters.assumed;
        let lever = self.parameters.vehicle.steering_lever();
        let (bias, scale) = gyro.state().deviations();
        let lasting = LastingErrors {
            steering: assumed.steering / lever.unwrap_or(1.0),
            turn: libm::hypot(assumed.turn, scale),
            bias,
            step: self.odometer.resolution() / lever.unwrap_or(SLIP_ARM),
        };
        let ratio = turns.travel(wheels, &motion, gyro.rate(), &lasting);
        if turns.slips(wheels.end) {
            // The way is off by what makes the turn that did not happen, all of it together.
            let arm = lever.unwrap_or(SLIP_ARM);
            let last = libm::fabs(wheels.displacement.theta - motion.displacement.theta);
            motion.covariance.m11 += arm * arm * last * (2.0 * turns.slipped() - last).max(last);
        }
        let verdict = if ratio > 1.0 { Verdict::Gated } else { Verdict::Accepted };
        let status = &mut self.outputs.sources.gyro;
        status.begin(wheels.end);
        status.add(wheels.end, verdict, true, Some(ratio));
        let known = gyro.go_on(heading, &motion, Some(&turn));
        self.advance(&known, &motion, Some(wheels));
    }

    /// Goes on by a motion that the wheels have not told, whose turn the gyro has. False, and nothing is done, if it has not.
    #[inline(never)]
    pub(super) fn coast_by_gyro(&mut self, motion: &Motion) -> bool {
        let Some(gyro) = &mut self.gyro else { return false };
        let is_believed = self.integrity.turns.fault(motion.end).is_none();
        let Some(GyroMotion { motion, turn }) = gyro.coast(motion).filter(|_| is_believed) else { return false };
        let heading = self.timeline.state().pose.theta;
        let known = gyro.go_on(heading, &motion, Some(&turn));
        self.advance(&known, &motion, None);
        true
    }

    /// Goes on by a motion; what the gyro's errors add to it is none of `noise`, and the wheels have told `wheels` instead.
    fn advance(&mut self, motion: &Motion, noise: &Motion, wheels: Option<&Motion>) {
        self.distance.advance(motion.distance);
        self.timeline.advance(motion);
        if self.parameters.protection {
            self.separation.travel_by_gyro(noise, wheels, self.timeline.odometry_pose());
        }
    }

    /// Lets what an event has made of the pose, if it has corrected it, teach the gyro's errors.
    #[inline(never)]
    pub(super) fn teach_gyro(&mut self, before: &Before, is_corrected: bool) {
        let Some(now) = self.known_pose() else { return };
        let Some(gyro) = &mut self.gyro else { return };
        let mut change = GyroErrors::default();
        if is_corrected && self.lost.is_none() {
            // What was extrapolated behind the last motion is in both.
            let moved = before.odometry_pose.between(&now.odometry_pose);
            let expected = if before.odometry_pose == now.odometry_pose {
                before.known
            } else {
                KnownPose { pose: before.known.pose.compose(&moved), ..before.known }
            };
            change = gyro.correct(&expected, &now.known);
        }
        let rest = gyro.take_rest();
        if self.parameters.protection {
            let errors = *gyro.state().errors();
            let deviation = TRUSTED * gyro.state().deviations().0;
            self.separation.rebase_gyro(&change, deviation, self.parameters.gyro.bias);
            if let Some((bias, variance)) = rest.mean() {
                self.separation.see_rest(bias - errors.bias, variance);
            }
        }
    }
}
