//! What every payload begins with.

use super::{Dialect, ReadError, Reader};

/// What a telegram does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CommandWord {
    /// `sRN`: read a variable.
    Read,
    /// `sWN`: write a variable.
    Write,
    /// `sMN`: call a method.
    Method,
    /// `sEN`: subscribe to an event.
    Event,
    /// `sRA`: the value of a variable.
    ReadAnswer,
    /// `sWA`: a variable was written.
    WriteAnswer,
    /// `sMA`: a method was accepted; its result follows later.
    MethodAccepted,
    /// `sAN`: the result of a method.
    MethodAnswer,
    /// `sEA`: a subscription was taken.
    EventAnswer,
    /// `sSN`: an event.
    EventNotification,
    /// `sFA`: a refusal.
    Fault,
}

impl CommandWord {
    const ALL: [Self; 11] = [
        Self::Read,
        Self::Write,
        Self::Method,
        Self::Event,
        Self::ReadAnswer,
        Self::WriteAnswer,
        Self::MethodAccepted,
        Self::MethodAnswer,
        Self::EventAnswer,
        Self::EventNotification,
        Self::Fault,
    ];

    /// The word's three letters.
    #[must_use]
    pub const fn letters(self) -> &'static [u8; 3] {
        match self {
            Self::Read => b"sRN",
            Self::Write => b"sWN",
            Self::Method => b"sMN",
            Self::Event => b"sEN",
            Self::ReadAnswer => b"sRA",
            Self::WriteAnswer => b"sWA",
            Self::MethodAccepted => b"sMA",
            Self::MethodAnswer => b"sAN",
            Self::EventAnswer => b"sEA",
            Self::EventNotification => b"sSN",
            Self::Fault => b"sFA",
        }
    }

    /// Whether the host sends it.
    #[must_use]
    pub const fn is_request(self) -> bool {
        matches!(self, Self::Read | Self::Write | Self::Method | Self::Event)
    }

    fn find(letters: [u8; 3]) -> Option<Self> {
        Self::ALL.into_iter().find(|word| *word.letters() == letters)
    }
}

/// A payload whose command word and name are known; the arguments are not looked at yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Telegram<'a> {
    /// What the telegram does.
    pub command: CommandWord,
    /// Which variable, method or event; empty for a refusal.
    pub name: &'a str,
    /// The arguments.
    pub arguments: Reader<'a>,
}

impl<'a> Telegram<'a> {
    /// Looks at the beginning of a payload.
    ///
    /// # Errors
    /// If the command word is unknown, or no name follows it.
    pub fn parse(dialect: Dialect, payload: &'a [u8]) -> Result<Self, ReadError> {
        let (letters, rest) = payload.split_first_chunk::<3>().ok_or(ReadError::End)?;
        let command = CommandWord::find(*letters).ok_or(ReadError::Value)?;
        if command == CommandWord::Fault {
            // CoLa-B has no space before the number, and the number itself may look like one.
            let has_space = dialect == Dialect::Ascii || rest.len() > 2;
            let rest = if has_space { rest.strip_prefix(b" ").unwrap_or(rest) } else { rest };
            return Ok(Self { command, name: "", arguments: Reader::new(dialect, rest) });
        }
        let rest = rest.strip_prefix(b" ").ok_or(ReadError::Text)?;
        let end = rest.iter().position(|byte| *byte == b' ').unwrap_or(rest.len());
        let (name, rest) = rest.split_at_checked(end).ok_or(ReadError::End)?;
        if name.is_empty() || !name.iter().all(u8::is_ascii_graphic) {
            return Err(ReadError::Text);
        }
        let name = core::str::from_utf8(name).map_err(|_| ReadError::Text)?;
        let arguments = rest.strip_prefix(b" ").unwrap_or(rest);
        Ok(Self { command, name, arguments: Reader::new(dialect, arguments) })
    }
}
