//! The CAN bus: frames, CANopen as a master of encoders sees it, serial line adapters, and the controller's own messages.
//!
//! | concept | module |
//! |---|---|
//! | classic and FD frames | [`frame`] |
//! | frames as text on a serial line | [`slcan`] |
//! | CANopen: identifiers and the messages behind them | [`canopen`], [`nmt`], [`sync`], [`sdo`], [`emcy`], [`pdo`] |
//! | how a bit is timed, and how much of a bus is taken | [`bit_timing`], [`bus_load`] |
//! | one CiA 406 encoder and its states | [`encoder`] |
//! | drives of CiA 402 as encoders | [`drive_402`] |
//! | is the encoder to be believed | [`plausibility`] |
//! | the encoders of a vehicle as one measurement | [`encoder_group`] |
//! | numbers in frames of unknown makers | [`signal`], [`drive_unit`], [`motion_frames`], [`gyro`] |
//! | what the controller says and hears | [`controller`] |
//! | the controller as a node, with its objects | [`controller_node`] |
//!
//! Times are passed in. State machines have `handle` for what arrives and `poll` for what is due; `poll` gives one frame
//! a call and none when nothing is left to send.

pub mod bit_timing;
pub mod bus_load;
pub mod canopen;
pub mod controller;
pub mod controller_node;
pub mod drive_402;
pub mod drive_unit;
pub mod emcy;
pub mod encoder;
pub mod encoder_group;
pub mod frame;
pub mod gyro;
pub mod motion_frames;
pub mod nmt;
pub mod pdo;
pub mod plausibility;
pub mod report_clock;
pub mod sdo;
pub mod signal;
pub mod slcan;
pub mod sync;
