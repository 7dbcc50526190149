//! The service port: how commands of a desktop speak with a controller over TCP.
//!
//! A message is its length (16 bits, little endian), a [`Request`] or [`Response`] in postcard, and behind requests that
//! change something a tag of 32 bytes ([`authentication`]). Every request has one response; a message that means nothing
//! ends the connection.

pub mod authentication;
mod frame;
mod message;
mod server;

pub use frame::{Frames, LONGEST_MESSAGE, MessageError, encode};
pub use message::{Change, INCIDENT_PIECE, PROTOCOL, Refusal, Request, Response};
pub use server::{Action, Answer, Controller, Kept, Session, answer_kept, keep};
