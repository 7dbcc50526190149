//! Why encoders are not believed.

use serde::{Deserialize, Serialize};

use super::Time;

/// Why an encoder is not to be believed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EncoderFault {
    /// A reading is overdue.
    Late,
    /// There have been no readings for so long that the encoder counts as absent.
    Missing,
    /// The counter stands still although the vehicle cannot.
    Frozen,
    /// The counter moved farther than the vehicle can.
    Jumped,
    /// The counter showed a value beyond its range.
    OutOfRange,
    /// The encoder itself reported an error.
    Reported,
    /// The encoder's heartbeat has ceased.
    HeartbeatLost,
    /// The encoder tells another number of positions than the vehicle's settings do.
    WrongRange,
    /// The encoder counts the other way than the vehicle's settings say.
    WrongDirection,
}

/// The faults that a vehicle's encoders have at one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct EncoderFaults {
    /// When.
    pub time: Time,
    /// Of the driving wheel's encoder.
    pub drive: Option<EncoderFault>,
    /// Of the steering's encoder.
    pub steering: Option<EncoderFault>,
}

impl EncoderFaults {
    /// Whether either encoder has a fault.
    #[must_use]
    pub const fn any(&self) -> bool {
        self.drive.is_some() || self.steering.is_some()
    }
}
