//! What the controller says on the bus and what it hears there.
//!
//! Eight classic frames of eight bytes. Their identifiers are those of the PDOs of a CANopen node, so that the controller
//! can live on a CANopen bus, and one that CiA 301 leaves free for nodes up to 95; `docs/agv.dbc` and `docs/agv.eds` describe them for node 16. All numbers are fixed-point and
//! begin at the lowest bit; the four highest bits are a counter. The frames of one pose carry the same counter.
//!
//! | frame | identifier | content |
//! |---|---|---|
//! | position | 180h + node | x, y: 30 bits, 0.1 mm |
//! | heading | 280h + node | heading: 24 bits, 1 urad; time: 16 bits, ms; dead-reckoning distance: 16 bits, 1 cm |
//! | covariance | 380h + node | deviations: 13 bits, 0.25 mm and 0.1 mrad; correlations: 7 bits, 0.02 |
//! | status | 480h + node | mode, reason, acceptance, innovations, faults, resets, search |
//! | integrity | 680h + node | protection level: 14 and 13 bits, alert limit: 10 bits, 1 mm and 0.25 mrad; alarm |
//! | initial position | 200h + node | x, y as above |
//! | initial heading | 300h + node | heading as above; deviations: 16 bits, 1 mm and 0.1 mrad |
//! | command | 400h + node | standstill |
//!
//! A number that is unknown, not finite or too large is sent as the lowest value of a signed field and the highest of an
//! unsigned one. Deviations are rounded up and end at the second highest value;
//! bounds are rounded up and not known beyond it.

mod content;
mod error;
mod field;
pub(super) mod number;
mod numbers;
mod orders;
mod receiver;
mod telegrams;

pub use content::{Content, Health};
pub use error::ControllerError;
pub use orders::OrderReceiver;
pub use receiver::{PoseReceiver, PublishedPose};
pub use telegrams::contents;
