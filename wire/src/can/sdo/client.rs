//! The master's end of a transfer.

use agv_core::measurement::Time;

use super::abort_code::AbortCode;
use super::exchange::{Request, Response};
use super::object::Value;
use crate::can::canopen::{Message, NodeId};
use crate::can::frame::Frame;

/// Why a transfer failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransferError {
    /// The node gave up.
    Aborted(AbortCode),
    /// The node did not answer in time, not even when asked again.
    NoAnswer,
    /// The value is longer than four bytes.
    Segmented,
}

/// What a transfer gave: the value that was read, or none after writing.
pub type TransferResult = Result<Option<Value>, TransferError>;

/// How often a request is sent before the node counts as silent.
const ATTEMPTS: u8 = 3;

#[derive(Clone, Copy, Debug)]
struct Transfer {
    request: Request,
    attempts: u8,
    sent: Option<Time>,
}

/// The master's end of one node's SDO channel: one transfer at a time, repeated if the node does not answer.
#[derive(Clone, Copy, Debug)]
pub struct SdoClient {
    node: NodeId,
    timeout: f64,
    transfer: Option<Transfer>,
}

impl SdoClient {
    /// An idle client that waits `timeout` seconds for each answer.
    #[must_use]
    pub const fn new(node: NodeId, timeout: f64) -> Self {
        Self { node, timeout, transfer: None }
    }

    /// Whether no transfer is under way.
    #[must_use]
    pub const fn is_idle(&self) -> bool {
        self.transfer.is_none()
    }

    /// Begins to read or write; a transfer under way is forgotten.
    pub fn begin(&mut self, request: Request) {
        self.transfer = Some(Transfer { request, attempts: 0, sent: None });
    }

    /// Forgets the transfer under way.
    pub fn cancel(&mut self) {
        self.transfer = None;
    }

    /// The frame to send now, if one is due; or how the transfer ended because no answer came.
    pub fn poll(&mut self, now: Time) -> Result<Option<Frame>, TransferError> {
        let Some(transfer) = &mut self.transfer else { return Ok(None) };
        if transfer.sent.is_some_and(|sent| now.since(sent) < self.timeout) {
            return Ok(None);
        }
        if transfer.attempts >= ATTEMPTS {
            self.transfer = None;
            return Err(TransferError::NoAnswer);
        }
        transfer.attempts += 1;
        transfer.sent = Some(now);
        Ok(Some(Message::SdoRequest { node: self.node, bytes: transfer.request.encode() }.encode()))
    }

    /// When the request that waits for an answer was sent.
    #[must_use]
    pub fn sent(&self) -> Option<Time> {
        self.transfer.and_then(|transfer| transfer.sent)
    }

    /// Takes a response of the node; gives the result if it ends the transfer. What answers no open question is left
    /// alone: it may belong to an earlier attempt or to another master.
    pub fn handle(&mut self, response: &Response) -> Option<TransferResult> {
        let transfer = self.transfer.filter(|transfer| transfer.sent.is_some())?;
        let result = match (transfer.request, *response) {
            (Request::Read(asked), Response::Read(object, value)) if asked == object => Ok(Some(value)),
            (Request::Read(asked), Response::Segmented(object)) if asked == object => Err(TransferError::Segmented),
            (Request::Write(asked, _), Response::Written(object)) if asked == object => Ok(None),
            (Request::Read(asked) | Request::Write(asked, _), Response::Abort(object, reason)) if asked == object => {
                Err(TransferError::Aborted(reason))
            }
            _ => return None,
        };
        self.transfer = None;
        Some(result)
    }
}
