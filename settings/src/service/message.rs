//! What is asked over the service port, and answered.

use agv_core::maps::Landmark;
use agv_core::measurement::Time;
use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::authentication::Nonce;
use crate::leaf::Value;
use crate::store::{PIECE, StoreError};

/// Version of the messages.
pub const PROTOCOL: u16 = 1;

/// What is asked.
#[allow(clippy::large_enum_variant, reason = "there is no allocator, and there is one message at a time")]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Request<'a> {
    /// What runs there.
    Version,
    /// The number that makes the tags of this connection different from all others.
    Nonce,
    /// What a setting is.
    Get(&'a str),
    /// The setting with that place in the list of all.
    Leaf(u16),
    /// The piece of the map that begins with that landmark.
    Map(u16),
    /// What the last panic said.
    Panic,
    /// What changes something.
    Change(Change<'a>),
    /// The bytes of the map of contours from that one on.
    Contours(u32),
    /// The incident at that place in the list of all, the oldest first.
    Incident(u16),
    /// The bytes of the log of an incident from that one on.
    IncidentPiece {
        /// Its name.
        name: &'a str,
        /// Where they begin.
        first: u32,
    },
}

/// What changes something: it has a tag, and the vehicle must stand.
#[allow(clippy::large_enum_variant, reason = "there is no allocator, and there is one message at a time")]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Change<'a> {
    /// Changes a setting, until the next start unless it is stored.
    Set(&'a str, Value),
    /// Keeps all settings in flash. They take effect with the next start.
    Store,
    /// Begins to write a map of so many landmarks.
    BeginMap(u16),
    /// Its next landmarks.
    MapPiece(Vec<Landmark, PIECE>),
    /// Makes the written map the map, from the next start on.
    FinishMap,
    /// Tells the vehicle where it is: x, y (m), heading (rad), and the standard deviations of position (m) and heading
    /// (rad).
    SetPose {
        /// x, y (m) and heading (rad) of R in W.
        pose: [f64; 3],
        /// Standard deviations of the position along each axis (m) and of the heading (rad).
        deviations: [f64; 2],
    },
    /// Forgets the last panic.
    ForgetPanic,
    /// Starts again.
    Reboot,
    /// Begins to write a map of contours; one of no bytes takes away the one that is kept.
    BeginContours {
        /// Its bytes.
        length: u32,
        /// Their CRC-32.
        checksum: u32,
    },
    /// Its next bytes: [`crate::contour_store::CONTOUR_PIECE`], or the last ones.
    ContourPiece(&'a [u8]),
    /// Makes the written map of contours the one that is used from the next start on.
    FinishContours,
}

/// What is answered.
#[allow(clippy::large_enum_variant, reason = "there is no allocator, and there is one message at a time")]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Response<'a> {
    /// What runs there.
    Version {
        /// Name and version of the software.
        software: &'a str,
        /// Version of the messages.
        protocol: u16,
        /// Starts so far.
        starts: u32,
        /// Time since the start.
        time: Time,
    },
    /// The number for the tags of this connection.
    Nonce(Nonce),
    /// A setting.
    Leaf {
        /// Its name.
        name: &'a str,
        /// Its unit.
        unit: &'a str,
        /// What it is set to.
        value: Value,
    },
    /// The setting does not matter for the kind of the vehicle, but the list goes on.
    NoLeaf,
    /// The list of settings, or of incidents, ends before that place.
    End,
    /// A piece of the map that the vehicle uses.
    Map {
        /// Landmarks of the whole map.
        count: u16,
        /// Those from the place that was asked for on.
        piece: Vec<Landmark, PIECE>,
    },
    /// What the last panic said; empty if there was none.
    Panic(&'a str),
    /// It is done.
    Done,
    /// It is not done.
    Refused(Refusal),
    /// A piece of the map of contours that the vehicle uses.
    Contours {
        /// Bytes of the whole map; 0 if there is none.
        length: u32,
        /// Those from the place that was asked for on.
        piece: &'a [u8],
    },
    /// An incident.
    Incident {
        /// The name of its log.
        name: &'a str,
        /// Bytes of the log.
        length: u32,
    },
    /// Bytes of the log of an incident, at most [`INCIDENT_PIECE`]; none behind its end.
    IncidentPiece(&'a [u8]),
}

/// Most bytes of a piece of an incident.
pub const INCIDENT_PIECE: usize = 1024;

/// Why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Refusal {
    /// There is no setting of that name.
    Name,
    /// The setting holds another kind of value.
    Kind,
    /// The value is out of bounds.
    Bounds,
    /// The vehicle moves.
    Moving,
    /// The tag is not that of the provisioned key.
    Tag,
    /// No key was provisioned, so nobody may change anything.
    NoKey,
    /// A pose with a number that is none, or a deviation that is not greater than zero.
    Pose,
    /// The flash does not keep it.
    Store(StoreError),
    /// The CAN bus would be loaded by more than 60 % of its bit rate.
    BusLoad,
    /// With the value the setting of that key is out of its bounds, or does not go with the others.
    Other(u16),
    /// The controller keeps no incidents, or not that one.
    NoIncidents,
}
