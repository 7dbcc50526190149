//! Access to a node's objects (CiA 301, 7.2.4): the master's end, with values of up to four bytes, and the node's.

mod abort_code;
mod client;
mod exchange;
mod object;
mod server;

pub use abort_code::AbortCode;
pub use client::{SdoClient, TransferError, TransferResult};
pub use exchange::{Request, Response, SdoError};
pub use object::{Object, Value};
pub(crate) use server::{GIVE_UP, abort};
pub use server::{LONGEST_VALUE, ObjectDictionary, SdoServer, ValueBytes};
