//! Access to a node's objects: expedited SDO transfers of up to four bytes (CiA 301, 7.2.4).

mod abort_code;
mod client;
mod exchange;
mod object;

pub use abort_code::AbortCode;
pub use client::{SdoClient, TransferError, TransferResult};
pub use exchange::{Request, Response, SdoError};
pub use object::{Object, Value};
