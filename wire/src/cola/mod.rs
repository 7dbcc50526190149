//! CoLa, the command language of SICK sensors, in both of its dialects.
//!
//! | | CoLa-A | CoLa-B |
//! |---|---|---|
//! | frame | `02` payload `03` | `02 02 02 02`, length of the payload (u32), payload, exclusive or of the payload |
//! | numbers | hexadecimal text; with a sign, decimal text | big-endian |
//! | between arguments | one space | nothing |
//!
//! A payload is a command word, a space, a name, and arguments in an order that the name fixes. Both dialects carry the
//! same arguments, so one description of a telegram serves both.
//!
//! Source: SICK telegram listings and recorded telegrams of several SICK sensors.

mod checksum;
mod deframer;
mod dialect;
mod fault;
mod reader;
mod sequence;
mod telegram;
mod text;
mod writer;

pub use deframer::{BUFFER, Deframed, Deframer};
pub use dialect::Dialect;
pub use fault::Fault;
pub use reader::{ReadError, Reader};
pub use sequence::{Element, Sequence};
pub use telegram::{CommandWord, Telegram};
pub use text::{Raw, Text};
pub use writer::{WriteError, Writer};
