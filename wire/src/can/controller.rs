//! What the controller says on the bus and what it hears there.
//!
//! Seven classic frames of eight bytes. Their identifiers are those of the PDOs of a CANopen node, so that the controller
//! can live on a CANopen bus; `docs/agv.dbc` and `docs/agv.eds` describe them for node 16. All numbers are fixed-point and
//! begin at the lowest bit; the four highest bits are a counter. The frames of one pose carry the same counter.
//!
//! | frame | identifier | content |
//! |---|---|---|
//! | position | 180h + node | x, y: 30 bits, 0.1 mm |
//! | heading | 280h + node | heading: 24 bits, 1 urad; time: 16 bits, ms; dead-reckoning distance: 16 bits, 1 cm |
//! | covariance | 380h + node | deviations: 13 bits, 0.25 mm and 0.1 mrad; correlations: 7 bits, 0.02 |
//! | status | 480h + node | mode, reason, acceptance, innovations, faults, resets, search |
//! | initial position | 200h + node | x, y as above |
//! | initial heading | 300h + node | heading as above; deviations: 16 bits, 1 mm and 0.1 mrad |
//! | command | 400h + node | standstill |
//!
//! A number that is unknown, not finite or too large is sent as the lowest value of a signed field and the highest of an
//! unsigned one. Deviations are rounded up and end at the second highest value.

use super::canopen::{NodeId, receive_pdo_id, transmit_pdo_id};
use super::frame::{Frame, Id};
use agv_core::geometry::{Pose, wrap};
use agv_core::measurement::{EncoderFault, PoseFix, Time};
use agv_core::state::{LaserHealth, Mode, PoseOutput, Reason, Relocalization};

/// Time between two poses on the bus, s.
pub const PERIOD: f64 = 0.010;

/// Highest value of the counter.
const LAST_COUNT: u8 = 15;

/// A number in a frame.
#[derive(Clone, Copy)]
struct Field {
    first_bit: u32,
    bits: u32,
    is_signed: bool,
    scale: f64,
}

impl Field {
    const fn signed(first_bit: u32, bits: u32, scale: f64) -> Self {
        Self { first_bit, bits, is_signed: true, scale }
    }

    const fn unsigned(first_bit: u32, bits: u32, scale: f64) -> Self {
        Self { first_bit, bits, is_signed: false, scale }
    }

    const fn mask(self) -> u64 {
        u64::MAX >> (64 - self.bits)
    }

    /// What stands for a number that is not known.
    const fn unknown(self) -> u64 {
        if self.is_signed { 1 << (self.bits - 1) } else { self.mask() }
    }

    /// The largest number that can be told, steps.
    const fn largest(self) -> f64 {
        if self.is_signed { ((1u64 << (self.bits - 1)) - 1) as f64 } else { (self.mask() - 1) as f64 }
    }

    const fn put_raw(self, payload: u64, raw: u64) -> u64 {
        payload | (raw & self.mask()) << self.first_bit
    }

    const fn take_raw(self, payload: u64) -> u64 {
        payload >> self.first_bit & self.mask()
    }

    fn put(self, payload: u64, value: f64) -> u64 {
        let steps = libm::round(value / self.scale);
        let smallest = if self.is_signed { -self.largest() } else { 0.0 };
        let is_known = (smallest..=self.largest()).contains(&steps);
        self.put_raw(payload, if is_known { steps as i64 as u64 } else { self.unknown() })
    }

    /// A deviation: never smaller than it is.
    fn put_deviation(self, payload: u64, value: f64) -> u64 {
        // A whole number of steps is not to become one more by rounding.
        let steps = libm::ceil(value / self.scale - 1e-6);
        let steps = if steps >= 0.0 { steps.min(self.largest()) } else { self.largest() };
        self.put_raw(payload, steps as u64)
    }

    /// The number, or NaN if it is not known.
    fn take(self, payload: u64) -> f64 {
        let raw = self.take_raw(payload);
        if raw == self.unknown() {
            return f64::NAN;
        }
        let unused = 64 - self.bits;
        let steps = if self.is_signed { ((raw << unused) as i64) >> unused } else { raw as i64 };
        steps as f64 * self.scale
    }
}

const COUNTER: Field = Field::unsigned(60, 4, 1.0);
const X: Field = Field::signed(0, 30, 1e-4);
const Y: Field = Field::signed(30, 30, 1e-4);
const HEADING: Field = Field::signed(0, 24, 1e-6);
const TIME: Field = Field::unsigned(24, 16, 1e-3);
const DEAD_RECKONING: Field = Field::unsigned(40, 16, 0.01);
const DEVIATION_X: Field = Field::unsigned(0, 13, 0.00025);
const DEVIATION_Y: Field = Field::unsigned(13, 13, 0.00025);
const DEVIATION_HEADING: Field = Field::unsigned(26, 13, 1e-4);
const CORRELATION_XY: Field = Field::signed(39, 7, 0.02);
const CORRELATION_X_HEADING: Field = Field::signed(46, 7, 0.02);
const CORRELATION_Y_HEADING: Field = Field::signed(53, 7, 0.02);
const MODE: Field = Field::unsigned(0, 4, 1.0);
const REASON: Field = Field::unsigned(4, 6, 1.0);
const ACCEPTANCE: Field = Field::unsigned(10, 7, 0.01);
const NORMALISED_SQUARE: Field = Field::unsigned(17, 10, 0.05);
const DRIVE_FAULT: Field = Field::unsigned(27, 4, 1.0);
const STEERING_FAULT: Field = Field::unsigned(31, 4, 1.0);
const LASER: Field = Field::unsigned(35, 2, 1.0);
const RESETS: Field = Field::unsigned(37, 8, 1.0);
const LAST_RESET: Field = Field::unsigned(45, 8, 0.02);
const START_SEARCH: Field = Field::unsigned(53, 3, 1.0);
const POSE_IS_GOOD: Field = Field::unsigned(56, 1, 1.0);
const CORRECTED: Field = Field::unsigned(57, 1, 1.0);
const OVERFLOWS: Field = Field::unsigned(58, 2, 1.0);
const INITIAL_POSITION_DEVIATION: Field = Field::unsigned(24, 16, 1e-3);
const INITIAL_HEADING_DEVIATION: Field = Field::unsigned(40, 16, 1e-4);
const STANDSTILL: Field = Field::unsigned(20, 1, 1.0);

/// Numbers of the modes on the bus.
const MODES: [(u64, Mode); 8] = [
    (0, Mode::NotLocalised),
    (1, Mode::Reflectors),
    (2, Mode::Features),
    (3, Mode::Mixed),
    (4, Mode::DeadReckoning),
    (5, Mode::Lost),
    (6, Mode::WithoutOdometry),
    (7, Mode::Degraded),
];

/// Numbers of the reasons on the bus.
const REASONS: [(u64, Reason); 13] = [
    (0, Reason::None),
    (1, Reason::NoPose),
    (2, Reason::NoLandmarks),
    (3, Reason::LandmarksRejected),
    (4, Reason::InnovationsTooLarge),
    (5, Reason::Uncertain),
    (6, Reason::OdometryImplausible),
    (7, Reason::DriveEncoder),
    (8, Reason::SteeringEncoder),
    (9, Reason::MotionDisagrees),
    (10, Reason::LaserMoved),
    (11, Reason::OdometryDisagrees),
    (12, Reason::OdometrySilent),
];

/// Numbers of the encoder faults on the bus; 0 is none.
const FAULTS: [(u64, EncoderFault); 8] = [
    (1, EncoderFault::Late),
    (2, EncoderFault::Missing),
    (3, EncoderFault::Frozen),
    (4, EncoderFault::Jumped),
    (5, EncoderFault::OutOfRange),
    (6, EncoderFault::Reported),
    (7, EncoderFault::HeartbeatLost),
    (8, EncoderFault::WrongRange),
];

const LASERS: [(u64, LaserHealth); 4] =
    [(0, LaserHealth::Unknown), (1, LaserHealth::Sound), (2, LaserHealth::Silent), (3, LaserHealth::Faulty)];

const RELOCALIZATIONS: [(u64, Relocalization); 5] = [
    (0, Relocalization::Idle),
    (1, Relocalization::Searching),
    (2, Relocalization::Ambiguous),
    (3, Relocalization::TooFew),
    (4, Relocalization::Unknown),
];

/// The number of a value; the unknown one of the field if it has none.
fn number_of<T: PartialEq>(table: &[(u64, T)], value: &T, field: Field) -> u64 {
    table.iter().find(|(_, known)| known == value).map_or(field.unknown(), |(number, _)| *number)
}

fn value_of<T: Copy>(table: &[(u64, T)], number: u64) -> Result<T, ControllerError> {
    table.iter().find(|(known, _)| *known == number).map(|(_, value)| *value).ok_or(ControllerError::Value)
}

fn fault_of(number: u64) -> Result<Option<EncoderFault>, ControllerError> {
    if number == 0 { Ok(None) } else { value_of(&FAULTS, number).map(Some) }
}

/// State of what the pose rests on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Health {
    /// Fault of the driving wheel's encoder.
    pub drive: Option<EncoderFault>,
    /// Fault of the steering's encoder.
    pub steering: Option<EncoderFault>,
    /// The laser.
    pub laser: LaserHealth,
    /// The search for a pose.
    pub start_search: Relocalization,
}

/// The content of one frame. Numbers that the sender does not know are NaN.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Content {
    /// Position of R in W.
    Position {
        /// Along the first axis, m.
        x: f64,
        /// Along the second axis, m.
        y: f64,
    },
    /// Heading, and when the pose is true.
    Heading {
        /// Heading of R in W, rad.
        heading: f64,
        /// Low 16 bits of the controller's clock, ms.
        time: u16,
        /// Way since a landmark last corrected the pose, m.
        dead_reckoning_distance: f64,
    },
    /// Standard deviations in W and their correlations.
    Covariance {
        /// Of x, m; of y, m; of the heading, rad.
        deviations: [f64; 3],
        /// Of x and y, x and heading, y and heading, -1 to 1.
        correlations: [f64; 3],
    },
    /// What the pose rests on.
    Status {
        /// Mode.
        mode: Mode,
        /// Why.
        reason: Reason,
        /// Share of the observations that were accepted lately, 0 to 1.
        acceptance: f64,
        /// Mean normalised squared innovation of late.
        normalised_square: f64,
        /// State of encoders, laser and search.
        health: Health,
        /// Whether the pose is good enough to leave the reflectors: [`PoseOutput::is_good`].
        is_good: bool,
        /// Whether landmarks have moved the position notably: [`PoseOutput::has_jumped`].
        has_jumped: bool,
        /// How often the position was reset: [`PoseOutput::resets`].
        resets: u8,
        /// By how far the last time, m.
        last_reset: f64,
        /// How often there was not room for all that was seen, modulo 4: [`PoseOutput::overflows`].
        overflows: u8,
    },
    /// Position where the vehicle shall believe to be.
    InitialPosition {
        /// Along the first axis of W, m.
        x: f64,
        /// Along the second axis of W, m.
        y: f64,
    },
    /// Heading that the vehicle shall believe, and how sure that is.
    InitialHeading {
        /// Heading of R in W, rad.
        heading: f64,
        /// Standard deviation of the position along each axis, m.
        position_deviation: f64,
        /// Standard deviation of the heading, rad.
        heading_deviation: f64,
    },
    /// What the vehicle's other controller knows.
    Command {
        /// Whether the vehicle stands still, by the brakes or by order.
        is_standstill: bool,
    },
}

/// Why a frame is none of the controller's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ControllerError {
    /// Another identifier.
    Foreign,
    /// The frame has not eight bytes.
    Length,
    /// A mode, reason or fault has no meaning.
    Value,
}

impl Content {
    fn id(&self, node: NodeId) -> Id {
        match self {
            Self::Position { .. } => transmit_pdo_id(node, 1),
            Self::Heading { .. } => transmit_pdo_id(node, 2),
            Self::Covariance { .. } => transmit_pdo_id(node, 3),
            Self::Status { .. } => transmit_pdo_id(node, 4),
            Self::InitialPosition { .. } => receive_pdo_id(node, 1),
            Self::InitialHeading { .. } => receive_pdo_id(node, 2),
            Self::Command { .. } => receive_pdo_id(node, 3),
        }
    }

    /// The frame of the controller at `node`, with the low four bits of `counter`.
    #[must_use]
    pub fn encode(&self, node: NodeId, counter: u8) -> Frame {
        let payload = COUNTER.put_raw(0, u64::from(counter));
        let payload = match *self {
            Self::Position { x, y } | Self::InitialPosition { x, y } => Y.put(X.put(payload, x), y),
            Self::Heading { heading, time, dead_reckoning_distance } => {
                let payload = HEADING.put(payload, heading);
                let payload = TIME.put_raw(payload, u64::from(time));
                DEAD_RECKONING.put_deviation(payload, dead_reckoning_distance)
            }
            Self::Covariance { deviations: [x, y, heading], correlations: [xy, x_heading, y_heading] } => {
                let payload = DEVIATION_X.put_deviation(payload, x);
                let payload = DEVIATION_Y.put_deviation(payload, y);
                let payload = DEVIATION_HEADING.put_deviation(payload, heading);
                let payload = CORRELATION_XY.put(payload, xy);
                let payload = CORRELATION_X_HEADING.put(payload, x_heading);
                CORRELATION_Y_HEADING.put(payload, y_heading)
            }
            Self::Status {
                mode,
                reason,
                acceptance,
                normalised_square,
                health,
                is_good,
                has_jumped,
                resets,
                last_reset,
                overflows,
            } => {
                let payload = MODE.put_raw(payload, number_of(&MODES, &mode, MODE));
                let payload = REASON.put_raw(payload, number_of(&REASONS, &reason, REASON));
                let payload = ACCEPTANCE.put(payload, acceptance);
                let payload = NORMALISED_SQUARE.put_deviation(payload, normalised_square);
                let fault = |fault: Option<EncoderFault>, field| match fault {
                    Some(fault) => number_of(&FAULTS, &fault, field),
                    None => 0,
                };
                let payload = DRIVE_FAULT.put_raw(payload, fault(health.drive, DRIVE_FAULT));
                let payload = STEERING_FAULT.put_raw(payload, fault(health.steering, STEERING_FAULT));
                let payload = LASER.put_raw(payload, number_of(&LASERS, &health.laser, LASER));
                let payload = RESETS.put_raw(payload, u64::from(resets));
                let payload = LAST_RESET.put_deviation(payload, last_reset);
                let search = number_of(&RELOCALIZATIONS, &health.start_search, START_SEARCH);
                let payload = START_SEARCH.put_raw(payload, search);
                let payload = POSE_IS_GOOD.put_raw(payload, u64::from(is_good));
                let payload = OVERFLOWS.put_raw(payload, u64::from(overflows));
                CORRECTED.put_raw(payload, u64::from(has_jumped))
            }
            Self::InitialHeading { heading, position_deviation, heading_deviation } => {
                let payload = HEADING.put(payload, heading);
                let payload = INITIAL_POSITION_DEVIATION.put_deviation(payload, position_deviation);
                INITIAL_HEADING_DEVIATION.put_deviation(payload, heading_deviation)
            }
            Self::Command { is_standstill } => STANDSTILL.put_raw(payload, u64::from(is_standstill)),
        };
        Frame::of(self.id(node), payload.to_le_bytes())
    }

    /// Content and counter of a frame of, or for, the controller at `node`.
    ///
    /// # Errors
    /// See [`ControllerError`].
    pub fn decode(frame: &Frame, node: NodeId) -> Result<(Self, u8), ControllerError> {
        let transmitted = (1..=4).find(|number| transmit_pdo_id(node, *number) == frame.id());
        let received = (1..=3).find(|number| receive_pdo_id(node, *number) == frame.id());
        if (transmitted, received) == (None, None) || frame.is_remote() {
            return Err(ControllerError::Foreign);
        }
        let bytes = <[u8; 8]>::try_from(frame.data()).map_err(|_| ControllerError::Length)?;
        let payload = u64::from_le_bytes(bytes);
        let content = match (transmitted, received) {
            (Some(1), _) => Self::Position { x: X.take(payload), y: Y.take(payload) },
            (Some(2), _) => Self::Heading {
                heading: HEADING.take(payload),
                time: TIME.take_raw(payload) as u16,
                dead_reckoning_distance: DEAD_RECKONING.take(payload),
            },
            (Some(3), _) => Self::Covariance {
                deviations: [DEVIATION_X, DEVIATION_Y, DEVIATION_HEADING].map(|field| field.take(payload)),
                correlations: [CORRELATION_XY, CORRELATION_X_HEADING, CORRELATION_Y_HEADING]
                    .map(|field| field.take(payload)),
            },
            (Some(_), _) => Self::Status {
                mode: value_of(&MODES, MODE.take_raw(payload))?,
                reason: value_of(&REASONS, REASON.take_raw(payload))?,
                acceptance: ACCEPTANCE.take(payload),
                normalised_square: NORMALISED_SQUARE.take(payload),
                health: Health {
                    drive: fault_of(DRIVE_FAULT.take_raw(payload))?,
                    steering: fault_of(STEERING_FAULT.take_raw(payload))?,
                    laser: value_of(&LASERS, LASER.take_raw(payload))?,
                    start_search: value_of(&RELOCALIZATIONS, START_SEARCH.take_raw(payload))?,
                },
                is_good: POSE_IS_GOOD.take_raw(payload) == 1,
                has_jumped: CORRECTED.take_raw(payload) == 1,
                resets: RESETS.take_raw(payload) as u8,
                last_reset: LAST_RESET.take(payload),
                overflows: OVERFLOWS.take_raw(payload) as u8,
            },
            (None, Some(1)) => Self::InitialPosition { x: X.take(payload), y: Y.take(payload) },
            (None, Some(2)) => Self::InitialHeading {
                heading: HEADING.take(payload),
                position_deviation: INITIAL_POSITION_DEVIATION.take(payload),
                heading_deviation: INITIAL_HEADING_DEVIATION.take(payload),
            },
            (None, _) => Self::Command { is_standstill: STANDSTILL.take_raw(payload) == 1 },
        };
        Ok((content, COUNTER.take_raw(payload) as u8))
    }
}

/// Says the pose every 10 ms.
#[derive(Clone, Copy, Debug)]
pub struct PosePublisher {
    node: NodeId,
    counter: u8,
    next: Time,
}

impl PosePublisher {
    /// A publisher at `node` that begins at `start`.
    #[must_use]
    pub const fn new(node: NodeId, start: Time) -> Self {
        Self { node, counter: 0, next: start }
    }

    /// When the next pose is due.
    #[must_use]
    pub const fn next(&self) -> Time {
        self.next
    }

    /// The frames of a pose, if one is due: position, heading, covariance, status. Poses that were missed are left out.
    pub fn poll(&mut self, now: Time, pose: &PoseOutput, health: &Health) -> Option<[Frame; 4]> {
        if now < self.next {
            return None;
        }
        let following = self.next.offset(PERIOD);
        self.next = if following <= now { now.offset(PERIOD) } else { following };
        let contents = contents(pose, health);
        let frames = contents.map(|content| content.encode(self.node, self.counter));
        self.counter = if self.counter >= LAST_COUNT { 0 } else { self.counter + 1 };
        Some(frames)
    }
}

/// What is said of a pose: position, heading, covariance, status.
#[must_use]
pub fn contents(pose: &PoseOutput, health: &Health) -> [Content; 4] {
    let [xx, xy, yy, x_heading, y_heading, heading] = pose.covariance;
    let deviations = [xx, yy, heading].map(libm::sqrt);
    let [x, y, turn] = deviations;
    // Without a deviation there is nothing to correlate.
    let correlation = |covariance: f64, product: f64| {
        if product > 0.0 { (covariance / product).clamp(-1.0, 1.0) } else { 0.0 }
    };
    [
        Content::Position { x: pose.pose.x, y: pose.pose.y },
        Content::Heading {
            heading: pose.pose.theta,
            time: (pose.time.micros() / 1000) as u16,
            dead_reckoning_distance: pose.dead_reckoning_distance,
        },
        Content::Covariance {
            deviations,
            correlations: [correlation(xy, x * y), correlation(x_heading, x * turn), correlation(y_heading, y * turn)],
        },
        Content::Status {
            mode: pose.mode,
            reason: pose.reason,
            acceptance: pose.acceptance,
            normalised_square: pose.normalised_square,
            health: *health,
            is_good: pose.is_good(),
            has_jumped: pose.has_jumped(),
            resets: pose.resets,
            last_reset: f64::from(pose.last_reset),
            overflows: pose.overflows,
        },
    ]
}

/// A pose as it was received from the bus. Numbers that the controller does not know are NaN.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PublishedPose {
    /// Counter of its frames, 0 to 15.
    pub counter: u8,
    /// Pose of R in W.
    pub pose: Pose,
    /// Low 16 bits of the controller's clock, ms.
    pub time: u16,
    /// Way since a landmark last corrected the pose, m.
    pub dead_reckoning_distance: f64,
    /// Standard deviations of x (m), y (m), heading (rad).
    pub deviations: [f64; 3],
    /// Correlations of x and y, x and heading, y and heading.
    pub correlations: [f64; 3],
    /// Mode.
    pub mode: Mode,
    /// Why.
    pub reason: Reason,
    /// State of encoders and laser.
    pub health: Health,
    /// Whether the pose is good enough to leave the reflectors.
    pub is_good: bool,
    /// Whether landmarks have moved the position notably.
    pub has_jumped: bool,
    /// How often the position was reset, wrapping.
    pub resets: u8,
    /// By how far the last time, m.
    pub last_reset: f64,
    /// How often there was not room for all that was seen, modulo 4.
    pub overflows: u8,
}

/// Puts the four frames of a pose together.
#[derive(Clone, Copy, Debug)]
pub struct PoseReceiver {
    node: NodeId,
    counter: u8,
    contents: [Option<Content>; 4],
}

impl PoseReceiver {
    /// A receiver for the controller at `node` that has heard nothing.
    #[must_use]
    pub const fn new(node: NodeId) -> Self {
        Self { node, counter: 0, contents: [None; 4] }
    }

    /// Takes a frame; gives the pose if the frame completes it. Of poses that miss a frame nothing is given.
    pub fn handle(&mut self, frame: &Frame) -> Option<PublishedPose> {
        let (content, counter) = Content::decode(frame, self.node).ok()?;
        if counter != self.counter {
            self.contents = [None; 4];
            self.counter = counter;
        }
        let slot = match content {
            Content::Position { .. } => 0,
            Content::Heading { .. } => 1,
            Content::Covariance { .. } => 2,
            Content::Status { .. } => 3,
            _ => return None,
        };
        *self.contents.get_mut(slot)? = Some(content);
        let [
            Some(Content::Position { x, y }),
            Some(Content::Heading { heading, time, dead_reckoning_distance }),
            Some(Content::Covariance { deviations, correlations }),
            Some(Content::Status { mode, reason, health, is_good, has_jumped, resets, last_reset, overflows, .. }),
        ] = self.contents
        else {
            return None;
        };
        self.contents = [None; 4];
        let pose = Pose { x, y, theta: heading };
        Some(PublishedPose {
            counter,
            pose,
            time,
            dead_reckoning_distance,
            deviations,
            correlations,
            mode,
            reason,
            health,
            is_good,
            has_jumped,
            resets,
            last_reset,
            overflows,
        })
    }
}

/// The two frames of an initial pose must come within this time, s.
const PAIR_TIME: f64 = 0.1;
/// An initial pose with the counter of the one before is a repetition for so long, s.
const REPETITION_TIME: f64 = 1.0;
/// A report of standstill holds so long, s.
const STANDSTILL_TIME: f64 = 0.2;

/// Hears what the controller is told.
#[derive(Clone, Copy, Debug)]
pub struct OrderReceiver {
    node: NodeId,
    position: Option<(Time, u8, f64, f64)>,
    heading: Option<(Time, u8, [f64; 3])>,
    last_pose: Option<(Time, u8)>,
    standstill: Option<Time>,
}

impl OrderReceiver {
    /// A receiver at `node` that has heard nothing.
    #[must_use]
    pub const fn new(node: NodeId) -> Self {
        Self { node, position: None, heading: None, last_pose: None, standstill: None }
    }

    /// Whether the vehicle has been said to stand still, and lately.
    #[must_use]
    pub fn is_standstill(&self, now: Time) -> bool {
        self.standstill.is_some_and(|since| now.since(since) <= STANDSTILL_TIME)
    }

    /// Takes a frame that was received at `time`; gives the pose to believe that it completes.
    pub fn handle(&mut self, frame: &Frame, time: Time) -> Option<PoseFix> {
        match Content::decode(frame, self.node).ok()? {
            (Content::InitialPosition { x, y }, counter) => self.position = Some((time, counter, x, y)),
            (Content::InitialHeading { heading, position_deviation, heading_deviation }, counter) => {
                self.heading = Some((time, counter, [heading, position_deviation, heading_deviation]));
            }
            (Content::Command { is_standstill }, _) => {
                self.standstill = is_standstill.then_some(time);
                return None;
            }
            _ => return None,
        }
        self.initial_pose(time)
    }

    fn initial_pose(&mut self, time: Time) -> Option<PoseFix> {
        let (position_time, counter, x, y) = self.position?;
        let (heading_time, heading_counter, [heading, position_deviation, heading_deviation]) = self.heading?;
        if counter != heading_counter || libm::fabs(position_time.since(heading_time)) > PAIR_TIME {
            return None;
        }
        let is_repetition =
            self.last_pose.is_some_and(|(last, known)| known == counter && time.since(last) < REPETITION_TIME);
        (self.position, self.heading, self.last_pose) = (None, None, Some((time, counter)));
        let pose = Pose { x, y, theta: wrap(heading) };
        let fix = PoseFix { time, pose, position_deviation, heading_deviation };
        (!is_repetition && fix.is_sound()).then_some(fix)
    }
}
