//! Messages of ROS 2 as their recordings hold them, to the extent that vehicles and this program exchange.

mod bag;
mod database;
mod encoding;
pub mod messages;
mod schema;

pub use bag::{Bag, BagError, BagMessage};
pub use encoding::{MessageError, decode, encode};
pub use schema::{Kind, definition};
