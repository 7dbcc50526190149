//! Arguments of a telegram, read one after the other.

use super::Dialect;

/// Why arguments cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReadError {
    /// The telegram ends too early.
    End,
    /// No number of that kind stands there.
    Number,
    /// The number does not fit its type.
    Range,
    /// A value has no meaning, or the name is another than expected.
    Value,
    /// A name or text is not well formed.
    Text,
    /// More elements than there is room for.
    Capacity,
}

/// Reads arguments in either dialect.
///
/// CoLa-A numbers: without a sign they are hexadecimal, and negative ones are the two's complement in eight digits; with
/// a sign they are decimal. A REAL is its IEEE 754 bits in eight hexadecimal digits; fewer digits are a whole number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reader<'a> {
    dialect: Dialect,
    rest: &'a [u8],
}

/// A CoLa-A number as it is written.
enum Digits {
    Hexadecimal(u32, usize),
    Decimal(i64),
}

impl<'a> Reader<'a> {
    /// A reader at the first argument.
    #[must_use]
    pub const fn new(dialect: Dialect, arguments: &'a [u8]) -> Self {
        Self { dialect, rest: arguments }
    }

    /// How the arguments are written.
    #[must_use]
    pub const fn dialect(&self) -> Dialect {
        self.dialect
    }

    /// What has not been read yet.
    #[must_use]
    pub const fn rest(&self) -> &'a [u8] {
        self.rest
    }

    /// Whether no argument is left. A space at the end of a CoLa-A telegram is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        match self.dialect {
            Dialect::Ascii => self.rest.iter().all(|byte| *byte == b' '),
            Dialect::Binary => self.rest.is_empty(),
        }
    }

    /// Takes all that is left.
    #[must_use]
    pub fn take_rest(&mut self) -> &'a [u8] {
        core::mem::take(&mut self.rest)
    }

    pub(super) fn bytes(&mut self, count: usize) -> Result<&'a [u8], ReadError> {
        let (bytes, rest) = self.rest.split_at_checked(count).ok_or(ReadError::End)?;
        self.rest = rest;
        Ok(bytes)
    }

    fn chunk<const N: usize>(&mut self) -> Result<[u8; N], ReadError> {
        let (chunk, rest) = self.rest.split_first_chunk().ok_or(ReadError::End)?;
        self.rest = rest;
        Ok(*chunk)
    }

    /// The text up to the next space, which is consumed too.
    fn token(&mut self) -> Result<&'a [u8], ReadError> {
        let end = self.rest.iter().position(|byte| *byte == b' ');
        let (token, rest) = self.rest.split_at_checked(end.unwrap_or(self.rest.len())).ok_or(ReadError::End)?;
        if token.is_empty() {
            return Err(ReadError::End);
        }
        self.rest = rest.strip_prefix(b" ").unwrap_or(rest);
        Ok(token)
    }

    fn digits(&mut self) -> Result<Digits, ReadError> {
        match self.token()? {
            [b'+', digits @ ..] => decimal(digits).map(Digits::Decimal),
            [b'-', digits @ ..] => decimal(digits).map(|value| Digits::Decimal(-value)),
            digits => hexadecimal(digits).map(|value| Digits::Hexadecimal(value, digits.len())),
        }
    }

    fn unsigned(&mut self) -> Result<u32, ReadError> {
        match self.digits()? {
            Digits::Hexadecimal(value, _) => Ok(value),
            Digits::Decimal(value) => u32::try_from(value).map_err(|_| ReadError::Range),
        }
    }

    /// An unsigned number of one byte.
    ///
    /// # Errors
    /// If there is none.
    pub fn u8(&mut self) -> Result<u8, ReadError> {
        match self.dialect {
            Dialect::Binary => self.chunk().map(u8::from_be_bytes),
            Dialect::Ascii => self.unsigned()?.try_into().map_err(|_| ReadError::Range),
        }
    }

    /// An unsigned number of two bytes.
    ///
    /// # Errors
    /// If there is none.
    pub fn u16(&mut self) -> Result<u16, ReadError> {
        match self.dialect {
            Dialect::Binary => self.chunk().map(u16::from_be_bytes),
            Dialect::Ascii => self.unsigned()?.try_into().map_err(|_| ReadError::Range),
        }
    }

    /// An unsigned number of four bytes.
    ///
    /// # Errors
    /// If there is none.
    pub fn u32(&mut self) -> Result<u32, ReadError> {
        match self.dialect {
            Dialect::Binary => self.chunk().map(u32::from_be_bytes),
            Dialect::Ascii => self.unsigned(),
        }
    }

    /// A signed number of two bytes.
    ///
    /// # Errors
    /// If there is none.
    pub fn i16(&mut self) -> Result<i16, ReadError> {
        match self.dialect {
            Dialect::Binary => self.chunk().map(i16::from_be_bytes),
            Dialect::Ascii => match self.digits()? {
                Digits::Decimal(value) => value.try_into().map_err(|_| ReadError::Range),
                Digits::Hexadecimal(value, digits) if digits > 4 => {
                    value.cast_signed().try_into().map_err(|_| ReadError::Range)
                }
                Digits::Hexadecimal(value, _) => {
                    u16::try_from(value).map(u16::cast_signed).map_err(|_| ReadError::Range)
                }
            },
        }
    }

    /// A signed number of four bytes.
    ///
    /// # Errors
    /// If there is none.
    pub fn i32(&mut self) -> Result<i32, ReadError> {
        match self.dialect {
            Dialect::Binary => self.chunk().map(i32::from_be_bytes),
            Dialect::Ascii => match self.digits()? {
                Digits::Decimal(value) => value.try_into().map_err(|_| ReadError::Range),
                Digits::Hexadecimal(value, _) => Ok(value.cast_signed()),
            },
        }
    }

    /// A number in single precision.
    ///
    /// # Errors
    /// If there is none.
    pub fn f32(&mut self) -> Result<f32, ReadError> {
        match self.dialect {
            Dialect::Binary => self.chunk().map(f32::from_be_bytes),
            Dialect::Ascii => match self.digits()? {
                Digits::Hexadecimal(bits, 8) => Ok(f32::from_bits(bits)),
                Digits::Hexadecimal(value, _) => Ok(value as f32),
                Digits::Decimal(value) => Ok(value as f32),
            },
        }
    }

    /// A word of a fixed number of letters, without a length before it.
    ///
    /// # Errors
    /// If the word is shorter or longer.
    pub fn word<const N: usize>(&mut self) -> Result<[u8; N], ReadError> {
        match self.dialect {
            Dialect::Binary => self.chunk(),
            Dialect::Ascii => self.token()?.try_into().map_err(|_| ReadError::Text),
        }
    }

    /// A text with its length before it; it may hold spaces.
    ///
    /// # Errors
    /// If the telegram ends before the text does.
    pub fn text(&mut self) -> Result<&'a [u8], ReadError> {
        let length = self.u16()?;
        let text = self.bytes(usize::from(length))?;
        if self.dialect == Dialect::Ascii {
            self.rest = match self.rest {
                [] => &[],
                [b' ', rest @ ..] => rest,
                _ => return Err(ReadError::Text),
            };
        }
        Ok(text)
    }
}

fn hexadecimal(digits: &[u8]) -> Result<u32, ReadError> {
    if digits.is_empty() {
        return Err(ReadError::Number);
    }
    digits.iter().try_fold(0_u32, |value, digit| {
        let digit = char::from(*digit).to_digit(16).ok_or(ReadError::Number)?;
        if value >> 28 == 0 { Ok(value << 4 | digit) } else { Err(ReadError::Range) }
    })
}

fn decimal(digits: &[u8]) -> Result<i64, ReadError> {
    if digits.is_empty() {
        return Err(ReadError::Number);
    }
    digits.iter().try_fold(0_i64, |value, digit| {
        let digit = char::from(*digit).to_digit(10).ok_or(ReadError::Number)?;
        let value = value * 10 + i64::from(digit);
        if value <= 1 << 32 { Ok(value) } else { Err(ReadError::Range) }
    })
}
