//! A telegram, written argument by argument.

use super::checksum::exclusive_or;
use super::{CommandWord, Dialect, Fault};

/// Why a telegram cannot be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WriteError {
    /// The buffer is too short.
    Buffer,
    /// A text holds what a text cannot, or is too long.
    Text,
    /// More elements than their counter can count, or than one telegram may carry.
    TooMany,
    /// Unparsed arguments of the other dialect.
    Dialect,
}

/// Writes one telegram with its frame to the beginning of a buffer.
///
/// In CoLa-A, requests write signed numbers as signed decimals, and answers as hexadecimal two's complement, as hosts and
/// sensors were recorded to do.
#[derive(Debug)]
pub struct Writer<'a> {
    dialect: Dialect,
    command: CommandWord,
    buffer: &'a mut [u8],
    length: usize,
    has_arguments: bool,
}

const BINARY_HEADER: usize = 8;

impl<'a> Writer<'a> {
    /// Begins a telegram.
    ///
    /// # Errors
    /// If the buffer is too short.
    pub fn new(dialect: Dialect, command: CommandWord, name: &str, buffer: &'a mut [u8]) -> Result<Self, WriteError> {
        let mut writer = Self { dialect, command, buffer, length: 0, has_arguments: false };
        match dialect {
            Dialect::Ascii => writer.put(&[2])?,
            Dialect::Binary => writer.put(&[2, 2, 2, 2, 0, 0, 0, 0])?,
        }
        writer.put(command.letters())?;
        if command != CommandWord::Fault {
            if name.is_empty() || !name.bytes().all(|byte| byte.is_ascii_graphic()) {
                return Err(WriteError::Text);
            }
            writer.put(b" ")?;
            writer.put(name.as_bytes())?;
        }
        Ok(writer)
    }

    /// Writes a whole refusal; returns its length, bytes.
    ///
    /// # Errors
    /// If the buffer is too short.
    pub fn fault(dialect: Dialect, fault: Fault, buffer: &'a mut [u8]) -> Result<usize, WriteError> {
        let mut writer = Self::new(dialect, CommandWord::Fault, "", buffer)?;
        writer.u16(fault.0)?;
        writer.finish()
    }

    /// How the telegram is written.
    #[must_use]
    pub const fn dialect(&self) -> Dialect {
        self.dialect
    }

    fn put(&mut self, bytes: &[u8]) -> Result<(), WriteError> {
        let end = self.length + bytes.len();
        self.buffer.get_mut(self.length..end).ok_or(WriteError::Buffer)?.copy_from_slice(bytes);
        self.length = end;
        Ok(())
    }

    /// What stands between the name or the argument before, and the next argument.
    fn separate(&mut self) -> Result<(), WriteError> {
        let is_first = !core::mem::replace(&mut self.has_arguments, true);
        match self.dialect {
            Dialect::Ascii => self.put(b" "),
            Dialect::Binary if is_first && self.command != CommandWord::Fault => self.put(b" "),
            Dialect::Binary => Ok(()),
        }
    }

    fn binary(&mut self, bytes: &[u8]) -> Result<(), WriteError> {
        self.separate()?;
        self.put(bytes)
    }

    fn hexadecimal(&mut self, value: u32) -> Result<(), WriteError> {
        let digits = (u32::BITS - value.leading_zeros()).div_ceil(4).max(1);
        self.hexadecimal_digits(value, digits)
    }

    fn hexadecimal_digits(&mut self, value: u32, digits: u32) -> Result<(), WriteError> {
        self.separate()?;
        for digit in (0..digits).rev() {
            let nibble = value >> (4 * digit) & 0xF;
            let letter = char::from_digit(nibble, 16).unwrap_or('0').to_ascii_uppercase();
            self.put(&[letter as u8])?;
        }
        Ok(())
    }

    fn decimal(&mut self, value: i64) -> Result<(), WriteError> {
        self.separate()?;
        let mut digits = [0_u8; 10];
        let mut rest = value.unsigned_abs();
        let mut count = 0;
        for digit in digits.iter_mut().rev() {
            *digit = b'0' + (rest % 10) as u8;
            rest /= 10;
            count += 1;
            if rest == 0 {
                break;
            }
        }
        self.put(if value < 0 { b"-" } else { b"+" })?;
        let first = digits.len() - count;
        self.put(digits.get(first..).unwrap_or_default())
    }

    /// An unsigned number of one byte.
    ///
    /// # Errors
    /// If the buffer is full.
    pub fn u8(&mut self, value: u8) -> Result<(), WriteError> {
        match self.dialect {
            Dialect::Binary => self.binary(&value.to_be_bytes()),
            Dialect::Ascii => self.hexadecimal(value.into()),
        }
    }

    /// An unsigned number of two bytes.
    ///
    /// # Errors
    /// If the buffer is full.
    pub fn u16(&mut self, value: u16) -> Result<(), WriteError> {
        match self.dialect {
            Dialect::Binary => self.binary(&value.to_be_bytes()),
            Dialect::Ascii => self.hexadecimal(value.into()),
        }
    }

    /// An unsigned number of four bytes.
    ///
    /// # Errors
    /// If the buffer is full.
    pub fn u32(&mut self, value: u32) -> Result<(), WriteError> {
        match self.dialect {
            Dialect::Binary => self.binary(&value.to_be_bytes()),
            Dialect::Ascii => self.hexadecimal(value),
        }
    }

    /// An unsigned number of four bytes, as a signed decimal in CoLa-A.
    ///
    /// # Errors
    /// If the buffer is full.
    pub fn u32_decimal(&mut self, value: u32) -> Result<(), WriteError> {
        match self.dialect {
            Dialect::Binary => self.binary(&value.to_be_bytes()),
            Dialect::Ascii => self.decimal(value.into()),
        }
    }

    /// A signed number of two bytes.
    ///
    /// # Errors
    /// If the buffer is full.
    pub fn i16(&mut self, value: i16) -> Result<(), WriteError> {
        match self.dialect {
            Dialect::Binary => self.binary(&value.to_be_bytes()),
            Dialect::Ascii => self.i32(value.into()),
        }
    }

    /// A signed number of four bytes.
    ///
    /// # Errors
    /// If the buffer is full.
    pub fn i32(&mut self, value: i32) -> Result<(), WriteError> {
        match self.dialect {
            Dialect::Binary => self.binary(&value.to_be_bytes()),
            Dialect::Ascii if self.command.is_request() => self.decimal(value.into()),
            Dialect::Ascii => self.hexadecimal(value.cast_unsigned()),
        }
    }

    /// A number in single precision.
    ///
    /// # Errors
    /// If the buffer is full.
    pub fn f32(&mut self, value: f32) -> Result<(), WriteError> {
        match self.dialect {
            Dialect::Binary => self.binary(&value.to_be_bytes()),
            Dialect::Ascii => self.hexadecimal_digits(value.to_bits(), 8),
        }
    }

    /// A word without a length before it.
    ///
    /// # Errors
    /// If the buffer is full, or the word has other than printable letters.
    pub fn word(&mut self, word: &[u8]) -> Result<(), WriteError> {
        if !word.iter().all(u8::is_ascii_graphic) {
            return Err(WriteError::Text);
        }
        self.binary(word)
    }

    /// A text with its length before it.
    ///
    /// # Errors
    /// If the buffer is full, or the text is too long or holds control characters.
    pub fn text(&mut self, text: &[u8]) -> Result<(), WriteError> {
        let length = u16::try_from(text.len()).map_err(|_| WriteError::Text)?;
        self.u16(length)?;
        if self.dialect == Dialect::Ascii {
            if text.iter().any(u8::is_ascii_control) {
                return Err(WriteError::Text);
            }
            self.put(b" ")?;
        }
        self.put(text)
    }

    /// The number of elements that follow.
    ///
    /// # Errors
    /// If the buffer is full, or there are too many elements.
    pub fn count(&mut self, count: usize) -> Result<(), WriteError> {
        self.u16(count.try_into().map_err(|_| WriteError::TooMany)?)
    }

    /// Arguments that are written already.
    ///
    /// # Errors
    /// If they are of the other dialect, or the buffer is full.
    pub fn raw(&mut self, dialect: Dialect, arguments: &[u8]) -> Result<(), WriteError> {
        if dialect != self.dialect {
            return Err(WriteError::Dialect);
        }
        if dialect == Dialect::Ascii && arguments.iter().any(u8::is_ascii_control) {
            return Err(WriteError::Text);
        }
        self.binary(arguments)
    }

    /// Completes the frame and returns its length, bytes.
    ///
    /// # Errors
    /// If the buffer is too short.
    pub fn finish(mut self) -> Result<usize, WriteError> {
        match self.dialect {
            Dialect::Ascii => self.put(&[3])?,
            Dialect::Binary => {
                // Sensors keep the space behind the name even if nothing follows it.
                if !self.command.is_request() && !self.has_arguments {
                    self.put(b" ")?;
                }
                let payload = self.buffer.get(BINARY_HEADER..self.length).ok_or(WriteError::Buffer)?;
                let check = exclusive_or(payload);
                let length = u32::try_from(payload.len()).map_err(|_| WriteError::Buffer)?;
                self.buffer.get_mut(4..BINARY_HEADER).ok_or(WriteError::Buffer)?.copy_from_slice(&length.to_be_bytes());
                self.put(&[check])?;
            }
        }
        Ok(self.length)
    }
}
