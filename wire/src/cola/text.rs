//! Arguments that are kept as they came.

use core::fmt::{self, Write};

use super::{Dialect, ReadError, Reader, WriteError, Writer};

/// A text with its length before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Text<'a>(pub &'a [u8]);

impl<'a> Text<'a> {
    /// Reads a text.
    ///
    /// # Errors
    /// If the bytes end before the text does.
    pub fn read(reader: &mut Reader<'a>) -> Result<Self, ReadError> {
        reader.text().map(Self)
    }
}

impl fmt::Display for Text<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0
            .iter()
            .try_for_each(|byte| formatter.write_char(if byte.is_ascii_control() { '.' } else { (*byte).into() }))
    }
}

/// Arguments whose types are not known. They can be written in the dialect in which they were read, and in no other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Raw<'a> {
    /// How they are written.
    pub dialect: Dialect,
    /// The bytes behind the space that follows the name.
    pub bytes: &'a [u8],
}

impl<'a> Raw<'a> {
    /// No arguments.
    #[must_use]
    pub const fn none(dialect: Dialect) -> Self {
        Self { dialect, bytes: &[] }
    }

    /// Takes all that is left.
    #[must_use]
    pub fn read(reader: &mut Reader<'a>) -> Self {
        Self { dialect: reader.dialect(), bytes: reader.take_rest() }
    }

    /// Writes the arguments as they came.
    ///
    /// # Errors
    /// If the dialect is another, or the buffer is full.
    pub fn write(&self, writer: &mut Writer) -> Result<(), WriteError> {
        if self.bytes.is_empty() { Ok(()) } else { writer.raw(self.dialect, self.bytes) }
    }
}
