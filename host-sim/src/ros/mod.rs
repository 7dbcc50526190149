//! Messages of ROS 2 as their recordings hold them, to the extent that vehicles and this program exchange.

mod attachment;
mod bag;
mod bag_message;
mod database;
mod encoding;
pub mod messages;
mod schema;

pub use attachment::{ATTACHED_LOG, attachment};
pub use bag::{Bag, BagError, is_recording};
pub use bag_message::BagMessage;
pub use encoding::{MessageError, decode, encode};
pub use schema::{Kind, definition};
