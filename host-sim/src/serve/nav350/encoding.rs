//! Answers as bytes.

use agv_wire::cola::{CommandWord, Dialect, Fault, Raw, Telegram};
use agv_wire::nav350::{Answer, MethodName, Value, Variable};

/// The value of a variable that nobody knows more of.
pub(super) fn zero(dialect: Dialect, name: &str) -> Vec<u8> {
    let zero: &[u8] = if dialect == Dialect::Ascii { b"0" } else { b"\0" };
    encode(dialect, &Answer::Value(Value::Other(name, Raw { dialect, bytes: zero })))
}

/// Bytes of most answers, and of any: zeros cost time.
const ROOM: [usize; 2] = [1 << 14, 1 << 17];

pub(super) fn encode(dialect: Dialect, answer: &Answer) -> Vec<u8> {
    for room in ROOM {
        let mut buffer = vec![0; room];
        if let Ok(length) = answer.encode(dialect, &mut buffer) {
            buffer.truncate(length);
            return buffer;
        }
    }
    refuse(dialect, Fault(0x07))
}

pub(super) fn refuse(dialect: Dialect, fault: Fault) -> Vec<u8> {
    let mut buffer = vec![0; 32];
    let length = agv_wire::cola::Writer::fault(dialect, fault, &mut buffer).unwrap_or(0);
    buffer.truncate(length);
    buffer
}

/// Why a request could not be read.
pub(super) fn why(dialect: Dialect, payload: &[u8]) -> Fault {
    match Telegram::parse(dialect, payload) {
        Ok(Telegram { command: CommandWord::Method, name, .. }) if MethodName::find(name).is_none() => {
            Fault::UNKNOWN_METHOD
        }
        Ok(Telegram { command: CommandWord::Write, name, .. }) if Variable::find(name).is_none() => {
            Fault::UNKNOWN_VARIABLE
        }
        Ok(Telegram { command, .. }) if command.is_request() => Fault::INVALID_DATA,
        _ => Fault::UNKNOWN_COMMAND,
    }
}
