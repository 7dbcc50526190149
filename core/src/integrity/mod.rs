//! Whether the pose is to be believed: one check a file. What they find is turned into mode and reason by the localiser's
//! supervisor alone.
//!
//! | check | what it is told | what it finds |
//! |---|---|---|
//! | [`InnovationMonitor`] | how many observations fit, and how well | a wrong pose, or a map that looks alike |
//! | [`SlipCheck`] | where landmarks are in the frame of the odometry | a vehicle that slides or is carried |
//! | [`SurfaceCheck`] | where surfaces are in the frame of the odometry | a vehicle that is carried where no landmark is |
//! | [`MotionDoubt`] | what a revolution has lost sight of, and what it sees instead | a vehicle that may have been carried |
//! | [`JumpCheck`] | the pose before and after a correction | a laser that was knocked |
//! | [`RedundancyCheck`] | what redundant wheels say differently | a wheel that slips |
//! | [`TractionCheck`] | the estimate before and after each correction | a wheel that slips |
//! | [`TurnCheck`] | turns by wheels and by a gyro | a wheel that slips, a gyro that is wrong |
//! | [`MountingCheck`] | corrections with the motion since the last one | a laser mounted elsewhere, an odometry of another scale |
//!
//! [`separation`] finds no fault but bounds the error that one can make: the [`ProtectionLevel`].

mod alert_limits;
mod innovation_monitor;
mod jump_check;
mod motion_doubt;
mod mounting_check;
mod redundancy_check;
pub mod separation;
mod slip_check;
mod surface_check;
mod traction_check;
mod turn_check;

use serde::{Deserialize, Serialize};

pub use alert_limits::{Alarm, AlertLimit, AlertLimits};
pub use innovation_monitor::{InnovationMonitor, InnovationMonitorParameters};
pub use jump_check::{Estimate, Jump, JumpCheck, is_sure};
pub use motion_doubt::MotionDoubt;
pub use mounting_check::{MountingCheck, Suspect};
pub use redundancy_check::{RedundancyCheck, WheelErrors};
pub use slip_check::SlipCheck;
pub use surface_check::SurfaceCheck;
pub use traction_check::TractionCheck;
pub use turn_check::{GyroFault, LastingErrors, TurnCheck};

use crate::geometry::{Point, Pose};
use crate::maps::{LandmarkKind, Verdict};
use crate::measurement::{LASERS, LaserId, Scan, Time};
pub use crate::state::ProtectionLevel;
use crate::state::{LandmarkSource, LandmarkUse};

/// All checks of one vehicle.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Integrity {
    /// What observations say of the pose.
    pub innovations: InnovationMonitor,
    /// One for each laser: they see the same landmarks at other times.
    slip: [SlipCheck; LASERS],
    surfaces: [SurfaceCheck; LASERS],
    doubts: [MotionDoubt; LASERS],
    jumps: JumpCheck,
    mounting: MountingCheck,
    /// Of a vehicle with a gyro.
    pub turns: TurnCheck,
    /// Of a vehicle with more wheels than it needs.
    pub redundancy: RedundancyCheck,
    /// What landmarks say of the wheels.
    pub traction: TractionCheck,
}

/// A pose that replaces one which was contradicted.
#[derive(Clone, Copy, Debug)]
pub struct Replacement {
    /// From the pose that was contradicted to the given one, in R.
    pub jump: Pose,
    /// Distance since a landmark last corrected the pose, m.
    pub distance: f64,
    /// Standard deviations of the given position, m, and heading, rad.
    pub deviations: (f64, f64),
}

impl Integrity {
    /// Checks that have seen nothing.
    #[must_use]
    pub fn new(parameters: InnovationMonitorParameters) -> Self {
        Self {
            innovations: InnovationMonitor::new(parameters),
            slip: [const { SlipCheck::new() }; LASERS],
            surfaces: [const { SurfaceCheck::new() }; LASERS],
            doubts: [MotionDoubt::default(); LASERS],
            jumps: JumpCheck::new(),
            mounting: MountingCheck::new(),
            turns: TurnCheck::new(),
            redundancy: RedundancyCheck::new(),
            traction: TractionCheck::new(),
        }
    }

    /// Begins anew for a pose that is given. A suspicion of the laser remains.
    pub fn restart(&mut self, parameters: InnovationMonitorParameters, replacement: Option<&Replacement>) {
        if replacement.is_some_and(|given| self.jumps.is_knock(&given.jump, given.distance, given.deviations)) {
            self.mounting.suspect_laser();
        }
        self.innovations = InnovationMonitor::new(parameters);
        self.forget_motion();
        self.mounting.restart();
        self.jumps.forget();
        self.traction.clear();
    }

    /// The odometry is not believed, so nobody knows how the vehicle moves.
    pub fn doubt_odometry(&mut self) {
        self.jumps.forget();
        self.traction.clear();
        self.forget_motion();
    }

    /// Takes the reflectors of a revolution of a laser that ended at `now`, be it none; `to_odometry` is the pose of W in the frame of the
    /// odometry. True if the laser has moved otherwise than the odometry says.
    pub fn see_reflectors(&mut self, laser: LaserId, now: Time, to_odometry: &Pose, uses: &[LandmarkUse]) -> bool {
        let reflectors = uses.iter().filter(|seen| seen.kind == LandmarkKind::Reflector);
        let places = reflectors.map(|seen| {
            let [x, y] = seen.position.map(f64::from);
            (to_odometry.transform(&Point::from(seen.located)), libm::hypot(x, y))
        });
        self.see_places(laser, now, places)
    }

    /// The same of reflectors that were located already: each in the frame of the odometry, m, and how far from the laser, m.
    pub fn see_places(&mut self, laser: LaserId, now: Time, places: impl Iterator<Item = (Point, f64)>) -> bool {
        let Some(slip) = self.slip.get_mut(laser.index()) else { return false };
        slip.begin(now);
        for (place, range) in places {
            slip.see(&place, range);
        }
        slip.disagrees()
    }

    /// Takes what the map of landmarks says of a revolution of a laser that was taken just before.
    pub fn compare_with_map(&mut self, laser: LaserId, uses: &[LandmarkUse]) {
        let Some((slip, doubt)) = self.slip.get(laser.index()).zip(self.doubts.get_mut(laser.index())) else { return };
        let reflectors = uses.iter().filter(|seen| seen.kind == LandmarkKind::Reflector);
        let fitting = reflectors.clone().filter(|seen| seen.verdict == Verdict::Accepted).count();
        doubt.take_landmarks(slip.has_lost_sight(), reflectors.count(), fitting);
    }

    /// Whether it is doubtful that a laser has moved as the odometry says.
    #[must_use]
    pub fn is_motion_doubtful(&self) -> bool {
        self.doubts.iter().any(MotionDoubt::is_raised)
    }

    /// Nobody knows how the vehicle has moved: what is seen is not compared with what was seen before.
    pub fn forget_motion(&mut self) {
        for slip in &mut self.slip {
            slip.clear();
        }
        for surfaces in &mut self.surfaces {
            surfaces.clear();
        }
        self.doubts = [MotionDoubt::default(); LASERS];
    }

    /// Takes a scan of a laser whose reflectors of that revolution were taken just before; `sensor` is where the laser was so many seconds
    /// after the first beam, in the frame of the odometry. True if the laser has moved otherwise than the odometry says.
    pub fn see_scan(&mut self, scan: &Scan, sensor: impl Fn(f64) -> Pose) -> bool {
        let laser = scan.laser.index();
        let middle = sensor(0.5 * scan.end().since(scan.start));
        let Some((slip, surfaces)) = self.slip.get_mut(laser).zip(self.surfaces.get_mut(laser)) else { return false };
        let Some(doubt) = self.doubts.get_mut(laser) else { return false };
        let are_elsewhere = surfaces.disagrees(scan, sensor);
        doubt.take_surfaces(surfaces.agrees());
        let misses = slip.misses(scan, &middle, surfaces.agrees(), doubt.do_all_fit());
        misses || are_elsewhere || (slip.is_doubted() && surfaces.is_doubtful())
    }

    /// Takes what the landmarks of a fixed map have made of the estimate, up to `now`, if there are enough of them.
    pub fn judge_traction(&mut self, before: &Estimate, after: &Estimate, uses: &[LandmarkUse], now: Time) {
        let is_fixed = |seen: &&LandmarkUse| {
            let fixed = seen.landmark.is_some_and(|(source, _)| source == LandmarkSource::Fixed);
            seen.verdict == Verdict::Accepted && seen.kind == LandmarkKind::Reflector && fixed
        };
        if uses.iter().filter(is_fixed).count() >= traction_check::LEAST {
            self.traction.correct(before, after, now);
        }
    }

    /// Takes what an event has made of the estimate; see [`JumpCheck::correct`]. What corrects nothing tells nothing.
    pub fn correct(&mut self, before: &Estimate, after: &Estimate, uses: &[LandmarkUse], is_right: bool) {
        if !uses.iter().any(|seen| seen.verdict == Verdict::Accepted) {
            return;
        }
        let Some(jump) = self.jumps.correct(before, after, is_right) else { return };
        if let Some(motion) = &jump.motion {
            self.mounting.add(motion, &jump.correction);
        }
        if jump.is_knock {
            self.mounting.suspect_laser();
        }
    }

    /// Which of laser and odometry is wrong, if one is.
    #[must_use]
    pub fn suspect(&self) -> Option<Suspect> {
        self.mounting.suspect()
    }
}
