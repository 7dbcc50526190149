//! What the host sends.

use super::{Method, MethodName, Setting, Variable};
use crate::cola::{CommandWord, Dialect, ReadError, Telegram, WriteError, Writer};

/// A telegram of the host.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Request<'a> {
    /// Reads a variable.
    Read(Variable),
    /// Reads a variable of another sensor of the family, which a NAV350 may know too.
    ReadOther(&'a str),
    /// Writes a variable.
    Write(Setting<'a>),
    /// Calls a method.
    Call(Method<'a>),
}

impl<'a> Request<'a> {
    /// Writes the telegram with its frame to the beginning of `buffer`; returns its length, bytes.
    ///
    /// # Errors
    /// If it does not fit into the buffer or a telegram.
    pub fn encode(&self, dialect: Dialect, buffer: &mut [u8]) -> Result<usize, WriteError> {
        let (command, name) = match self {
            Self::Read(variable) => (CommandWord::Read, variable.name()),
            Self::ReadOther(name) => (CommandWord::Read, *name),
            Self::Write(setting) => (CommandWord::Write, setting.variable().name()),
            Self::Call(method) => (CommandWord::Method, method.name().name()),
        };
        let mut writer = Writer::new(dialect, command, name, buffer)?;
        match self {
            Self::Read(_) | Self::ReadOther(_) => {}
            Self::Write(setting) => setting.write(&mut writer)?,
            Self::Call(method) => method.write(&mut writer)?,
        }
        writer.finish()
    }

    /// Reads a payload.
    ///
    /// # Errors
    /// If it is no request of a known name with the arguments that this name demands, and nothing behind them.
    pub fn decode(dialect: Dialect, payload: &'a [u8]) -> Result<Self, ReadError> {
        let Telegram { command, name, arguments: mut reader } = Telegram::parse(dialect, payload)?;
        let request = match command {
            CommandWord::Read => Variable::find(name).map_or(Self::ReadOther(name), Self::Read),
            CommandWord::Write => {
                let variable = Variable::find(name).ok_or(ReadError::Value)?;
                Self::Write(Setting::read(variable, &mut reader)?.ok_or(ReadError::Value)?)
            }
            CommandWord::Method => {
                let method = MethodName::find(name).ok_or(ReadError::Value)?;
                Self::Call(Method::read(method, &mut reader)?)
            }
            _ => return Err(ReadError::Value),
        };
        if reader.is_empty() { Ok(request) } else { Err(ReadError::Range) }
    }
}
