//! The content of each frame.

use agv_core::integrity::{Alarm, AlertLimit, ProtectionLevel};
use agv_core::measurement::EncoderFault;
use agv_core::state::{LaserHealth, Mode, Reason, Relocalization};

use super::error::ControllerError;
use super::field::*;
use super::numbers::*;
use crate::can::canopen::{NodeId, fifth_transmit_pdo_id, receive_pdo_id, transmit_pdo_id};
use crate::can::frame::{Frame, Id};

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
        /// Distance travelled since a landmark last corrected the pose, m.
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
        /// Whether the pose is good enough to leave the reflectors: [`agv_core::state::PoseOutput::is_good`].
        is_good: bool,
        /// Whether landmarks have moved the position notably: [`agv_core::state::PoseOutput::has_jumped`].
        has_jumped: bool,
        /// How often the position was reset: [`agv_core::state::PoseOutput::resets`].
        resets: u8,
        /// By how far the last time, m.
        last_reset: f64,
        /// How often there was not room for all that was seen, modulo 4: [`agv_core::state::PoseOutput::overflows`].
        overflows: u8,
    },
    /// How wrong the pose may be.
    Integrity {
        /// What the errors do not exceed; infinite if it is not known or too large to be told.
        level: ProtectionLevel,
        /// What travelling can live with.
        limit: AlertLimit,
        /// What the pose must not be used for.
        alarm: Alarm,
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

impl Content {
    pub(super) fn id(&self, node: NodeId) -> Id {
        match self {
            Self::Position { .. } => transmit_pdo_id(node, 1),
            Self::Heading { .. } => transmit_pdo_id(node, 2),
            Self::Covariance { .. } => transmit_pdo_id(node, 3),
            Self::Status { .. } => transmit_pdo_id(node, 4),
            Self::Integrity { .. } => fifth_transmit_pdo_id(node),
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
            Self::Status { .. } => self.encode_status(payload),
            Self::Integrity { level, limit, alarm } => {
                let payload = PROTECTION_POSITION.put_bound(payload, level.position);
                let payload = PROTECTION_HEADING.put_bound(payload, level.heading);
                let payload = LIMIT_POSITION.put(payload, limit.position);
                let payload = LIMIT_HEADING.put(payload, limit.heading);
                ALARM.put_raw(payload, number_of(&ALARMS, &alarm, ALARM))
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

    fn encode_status(&self, payload: u64) -> u64 {
        let Self::Status {
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
        } = *self
        else {
            return payload;
        };
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

    /// Content and counter of a frame of, or for, the controller at `node`.
    ///
    /// # Errors
    /// See [`ControllerError`].
    pub fn decode(frame: &Frame, node: NodeId) -> Result<(Self, u8), ControllerError> {
        let fifth = (fifth_transmit_pdo_id(node) == frame.id()).then_some(5);
        let transmitted = (1..=4).find(|number| transmit_pdo_id(node, *number) == frame.id()).or(fifth);
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
            (Some(5), _) => Self::Integrity {
                level: ProtectionLevel {
                    position: PROTECTION_POSITION.take_bound(payload),
                    heading: PROTECTION_HEADING.take_bound(payload),
                },
                limit: AlertLimit { position: LIMIT_POSITION.take(payload), heading: LIMIT_HEADING.take(payload) },
                alarm: value_of(&ALARMS, ALARM.take_raw(payload))?,
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
