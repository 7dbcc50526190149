//! What goes wrong in a run, when, and how.

mod believed;
mod counting;
mod direction;
mod hall;
mod laser_state;
mod measured;
mod ranging;
mod tilt;
mod view;
mod wire;

pub use counting::{CountError, Encoder};
pub use direction::BearingError;
pub use hall::simulate_with;
pub use ranging::RangeError;
pub use view::ViewError;
pub use wire::{Line, Message};

use agv_core::odometry::{Counted, Vehicle, WheelVehicle};
use serde::{Deserialize, Serialize};

/// One thing that goes wrong.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// What it is called in the table.
    pub name: String,
    /// When it begins, s since the vehicle drives off. What is wrong from the beginning has no beginning.
    #[serde(default)]
    pub from: f64,
    /// When it ends, s since the vehicle drives off; never if absent.
    pub until: Option<f64>,
    /// What it is.
    pub what: FaultKind,
    /// Whether the vehicle can localise again before the run ends: what is wrong ends or can be lived with.
    #[serde(default = "yes")]
    pub can_recover: bool,
}

fn yes() -> bool {
    true
}

impl Fault {
    /// Whether it is there, `time` s since the vehicle drove off.
    #[must_use]
    pub fn is_active(&self, time: f64) -> bool {
        time >= self.from && self.until.is_none_or(|until| time < until)
    }

    /// How much of `share` s after its beginning has come, 0 to 1.
    fn grown(&self, time: f64, seconds: f64) -> f64 {
        ((time - self.from) / seconds.max(1e-9)).clamp(0.0, 1.0)
    }
}

impl FaultKind {
    /// Whether a vehicle can have it: what steers can steer wrongly, and what counts can count wrongly.
    #[must_use]
    pub fn is_possible(&self, vehicle: &Vehicle) -> bool {
        let counters = vehicle.counters();
        let has = |counted| counters.iter().any(|counter| counter.counted == counted);
        match self {
            Self::SteeringFrozen
            | Self::SteeringReversed
            | Self::SteeringJumps { .. }
            | Self::SteeringBent { .. }
            | Self::SteeringOffsetWrong { .. }
            | Self::SlipInBends { .. } => has(Counted::Steering),
            Self::WheelbaseWrong { .. } => matches!(
                vehicle,
                Vehicle::Tricycle(_) | Vehicle::Wheels(WheelVehicle::Ackermann(_) | WheelVehicle::Mecanum(_))
            ),
            Self::DriveFrozen
            | Self::DriveJumps { .. }
            | Self::DriveReversed
            | Self::WheelSpins { .. }
            | Self::WheelSlides { .. }
            | Self::DriveScaleWrong { .. } => has(Counted::Turn),
            Self::CountsOff { of: Encoder::Drive, .. } => has(Counted::Turn),
            Self::CountsOff { of: Encoder::Steering, .. } => has(Counted::Steering),
            _ => true,
        }
    }
}

/// The kinds of faults. Shares are between 0 and 1, angles in degrees, lengths in m, times in s.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum FaultKind {
    /// Nothing is wrong.
    Nothing,

    // The laser's telegrams.
    /// Telegrams of the laser are lost.
    TelegramsDropped {
        /// Of how many.
        share: f64,
    },
    /// Nothing comes from the laser, and nothing reaches it; its connection stands.
    LaserSilent,
    /// The laser cannot be reached; its connection is closed.
    LaserUnreachable,
    /// Telegrams of the laser come late.
    TelegramsDelayed {
        /// By how much.
        seconds: f64,
        /// How much more at most, each by its own.
        jitter: f64,
    },
    /// Telegrams of the laser come twice.
    TelegramsDoubled {
        /// How many.
        share: f64,
    },
    /// Telegrams of the laser change places with the next one.
    TelegramsReordered {
        /// How many.
        share: f64,
    },
    /// Telegrams of the laser have a wrong byte.
    TelegramsCorrupted {
        /// How many.
        share: f64,
    },
    /// Telegrams of the laser end too early.
    TelegramsTruncated {
        /// How many.
        share: f64,
    },
    /// The laser's clock jumps.
    LaserClockJumps {
        /// By how much.
        milliseconds: i64,
    },
    /// The laser's clock is too fast, from the beginning.
    LaserClockDrifts {
        /// By which share.
        share: f64,
    },
    /// The laser's counter of milliseconds begins anew while the vehicle drives.
    LaserClockWraps,

    // The bus.
    /// Frames of the encoders are lost.
    FramesDropped {
        /// Of how many.
        share: f64,
    },
    /// Frames of the encoders come late.
    FramesDelayed {
        /// By how much.
        seconds: f64,
        /// How much more at most, each by its own.
        jitter: f64,
    },
    /// Frames of the encoders come twice.
    FramesDoubled {
        /// How many.
        share: f64,
    },
    /// Frames of the encoders change places with the next one.
    FramesReordered {
        /// How many.
        share: f64,
    },
    /// Frames of the encoders have a wrong bit that no checksum has found.
    FramesCorrupted {
        /// How many.
        share: f64,
    },
    /// Nothing comes over the bus.
    BusSilent,

    // The encoders.
    /// The counter of the driving wheel stands still.
    DriveFrozen,
    /// The counter of the steering stands still.
    SteeringFrozen,
    /// The counter of the driving wheel jumps.
    DriveJumps {
        /// By how many ticks.
        ticks: i64,
    },
    /// The counter of the steering jumps and stays there.
    SteeringJumps {
        /// By which angle.
        deg: f64,
    },
    /// The driving wheel's counter counts the other way.
    DriveReversed,
    /// The steering's counter counts the other way.
    SteeringReversed,
    /// The driving wheel spins: it turns more than the vehicle moves.
    WheelSpins {
        /// By which share.
        share: f64,
    },
    /// The driving wheel is locked while the vehicle slides on.
    WheelSlides {
        /// Which share of the way is not counted.
        share: f64,
    },
    /// The vehicle slips in bends: it turns less than its wheel says.
    SlipInBends {
        /// By which share the tangent of the steering angle is too large.
        share: f64,
    },
    /// The steering has an offset that nobody knows of.
    SteeringBent {
        /// The offset.
        deg: f64,
    },
    /// A counter counts wrongly by a rule.
    CountsOff {
        /// Which.
        of: Encoder,
        /// How.
        how: CountError,
        /// By how much, in the unit of the rule.
        size: f64,
    },

    // The laser.
    /// Distances are wrong by a rule.
    RangesOff {
        /// Which.
        how: RangeError,
        /// By how much, in the unit of the rule.
        size: f64,
    },
    /// Bearings are wrong by a rule.
    BearingsOff {
        /// Which.
        how: BearingError,
        /// By how much.
        deg: f64,
    },
    /// The laser sees what is not there, or does not see what is.
    ViewOff {
        /// How.
        how: ViewError,
        /// By how much, in the unit of the rule.
        size: f64,
    },
    /// The laser is knocked and stays turned.
    LaserTurned {
        /// By how much.
        deg: f64,
    },
    /// The laser turns slowly.
    LaserTurns {
        /// How far.
        deg: f64,
        /// In which time.
        seconds: f64,
    },
    /// The laser is knocked and stays shifted.
    LaserShifted {
        /// Forward, in S.
        x: f64,
        /// To the left, in S.
        y: f64,
    },
    /// The laser's bracket is loose: each revolution has another direction.
    LaserShaken {
        /// Standard deviation.
        deg: f64,
    },
    /// A part of the window is dirty.
    WindowDirty {
        /// Where it begins in S, counter-clockwise.
        from_deg: f64,
        /// Where it ends.
        to_deg: f64,
        /// Share of the reflectors behind it that are not seen.
        share: f64,
    },
    /// Reflectors are seen where none are.
    FalseReflectors {
        /// How many each revolution.
        count: u32,
    },
    /// A shining wall shows reflectors again behind it, from the laser's view in this direction.
    Mirror {
        /// Direction of the wall's foot in S.
        deg: f64,
        /// Its distance.
        distance: f64,
    },
    /// Every distance is wrong.
    RangesLong {
        /// By how much.
        metres: f64,
    },
    /// Distances are noisy.
    RangesNoisy {
        /// Standard deviation.
        metres: f64,
    },
    /// People in clothes with reflectors walk about.
    PeopleShine {
        /// How many.
        count: u32,
    },
    /// People stand before the reflectors.
    PeopleAround {
        /// Share of the reflectors that are hidden in a revolution.
        share: f64,
    },
    /// Distances have an error that all of a revolution share and that stays for seconds.
    RangesWander {
        /// Standard deviation.
        metres: f64,
        /// Time in which it decays to the e-th part.
        seconds: f64,
    },
    /// Bearings have such an error.
    BearingsWander {
        /// Standard deviation.
        deg: f64,
        /// Time in which it decays to the e-th part.
        seconds: f64,
    },
    /// A low sun shines from one direction of the hall: the laser is blind there, and sees a reflector where none is.
    SunShines {
        /// Direction in W.
        towards_deg: f64,
        /// Half of the width in which the laser is blinded.
        half_width_deg: f64,
    },
    /// The laser's plane is tilted: distances are those along the plane, and bearings those in it.
    LaserTilted {
        /// By how much.
        deg: f64,
        /// Direction of S in which it looks down.
        towards_deg: f64,
        /// Height above the point about which it tilts: 0 for a laser out of level, its height above the floor for a
        /// vehicle on a tilted floor.
        height: f64,
    },

    // What is believed, from the beginning.
    /// Reflectors have been moved since the survey.
    ReflectorsMoved {
        /// How many.
        share: f64,
        /// How far, each in its own direction.
        metres: f64,
    },
    /// Reflectors have been moved since the survey, all of them alike.
    ReflectorsMovedAlike {
        /// How many.
        share: f64,
        /// How far.
        metres: f64,
    },
    /// Reflectors on one side have been moved together since the survey.
    WallMoved {
        /// How far.
        metres: f64,
    },
    /// A reflector in sight on the way has been moved since the survey.
    ReflectorMoved {
        /// How far.
        metres: f64,
    },
    /// Reflectors have gone since the survey: these are never seen again.
    ReflectorsGone {
        /// How many.
        share: f64,
    },
    /// Reflectors stand in the hall that are not in the layout.
    ReflectorsStand {
        /// How many.
        count: u32,
    },
    /// The layout was loaded in part.
    LayoutCutOff {
        /// How much of it is missing at its end.
        share: f64,
    },
    /// The layout that is loaded is a mirror image.
    LayoutMirrored,
    /// The layout that is loaded is that of another hall.
    LayoutOfAnotherHall,
    /// The layout is sheared: its second axis leans.
    LayoutSheared {
        /// By which share.
        share: f64,
    },
    /// The layout is stretched along its first axis, as one that was measured with a wrong scale.
    LayoutStretched {
        /// By which share.
        share: f64,
    },
    /// Half of the layout was surveyed in a second session, which was set up turned about where it began.
    SessionTurned {
        /// By how much.
        deg: f64,
        /// Whether the layout was laid onto the true one as well as it fits.
        #[serde(default)]
        is_laid: bool,
    },
    /// The same, set up elsewhere.
    SessionShifted {
        /// How far, in a direction that is drawn.
        metres: f64,
        /// Whether the layout was laid onto the true one as well as it fits.
        #[serde(default)]
        is_laid: bool,
    },
    /// The layout is bent: its middle is beside the line between its ends.
    LayoutBent {
        /// By how much.
        metres: f64,
        /// Whether the layout was laid onto the true one as well as it fits.
        #[serde(default)]
        is_laid: bool,
    },
    /// The laser is mounted otherwise than is believed.
    MountingWrong {
        /// Direction.
        deg: f64,
        /// Forward.
        x: f64,
        /// To the left.
        #[serde(default)]
        y: f64,
    },
    /// The steering has another offset than is believed.
    SteeringOffsetWrong {
        /// By how much.
        deg: f64,
    },
    /// The wheelbase is otherwise than is believed.
    WheelbaseWrong {
        /// By how much.
        metres: f64,
    },
    /// The way of a tick is otherwise than is believed.
    DriveScaleWrong {
        /// By which share.
        share: f64,
    },
    /// The pose that the vehicle is told at the start is wrong.
    StartWrong {
        /// Forward.
        x: f64,
        /// To the left.
        y: f64,
        /// Direction.
        deg: f64,
    },

    // The vehicle.
    /// The vehicle is lifted and set down where its way would have led it later.
    Kidnapped {
        /// So much later.
        seconds: f64,
    },
    /// The controller has no power, and starts again while the vehicle drives.
    PowerCut,
}

/// What the controller's answer is measured by when several faults are there: the first beginning and the last end.
#[must_use]
pub fn window(faults: &[&Fault]) -> (f64, Option<f64>) {
    let from = faults.iter().map(|fault| fault.from).fold(f64::INFINITY, f64::min);
    let until = faults.iter().map(|fault| fault.until.unwrap_or(fault.from)).fold(0.0, f64::max);
    (from, faults.iter().any(|fault| fault.until.is_some()).then_some(until))
}
