//! Elements that follow one another.

use core::fmt;

use super::{Dialect, ReadError, Reader, WriteError, Writer};

/// Something that a telegram can hold several of.
pub trait Element: Clone + PartialEq {
    /// Length of every element in CoLa-B, bytes, if all have the same.
    const BINARY_LENGTH: Option<usize> = None;

    /// Reads one.
    ///
    /// # Errors
    /// If the arguments are not what an element demands.
    fn read(reader: &mut Reader) -> Result<Self, ReadError>;

    /// Writes one.
    ///
    /// # Errors
    /// If it does not fit.
    fn write(&self, writer: &mut Writer) -> Result<(), WriteError>;
}

impl Element for u16 {
    const BINARY_LENGTH: Option<usize> = Some(2);

    fn read(reader: &mut Reader) -> Result<Self, ReadError> {
        reader.u16()
    }

    fn write(&self, writer: &mut Writer) -> Result<(), WriteError> {
        writer.u16(*self)
    }
}

impl Element for u32 {
    const BINARY_LENGTH: Option<usize> = Some(4);

    fn read(reader: &mut Reader) -> Result<Self, ReadError> {
        reader.u32()
    }

    fn write(&self, writer: &mut Writer) -> Result<(), WriteError> {
        writer.u32(*self)
    }
}

/// Elements to be written, or a checked view of elements that were received. Both compare by their elements.
pub enum Sequence<'a, T> {
    /// Values in memory.
    Values(&'a [T]),
    /// A view of received bytes.
    Received(Received<'a>),
}

impl<T> Clone for Sequence<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Sequence<'_, T> {}

/// A checked view of received elements.
#[derive(Clone, Copy)]
pub struct Received<'a> {
    first: Reader<'a>,
    count: usize,
}

impl<'a, T: Element> Sequence<'a, T> {
    /// No elements.
    #[must_use]
    pub const fn empty() -> Self {
        Self::Values(&[])
    }

    /// Checks `count` elements and goes behind them.
    ///
    /// # Errors
    /// If one of them is not what an element demands.
    pub fn read(reader: &mut Reader<'a>, count: usize) -> Result<Self, ReadError> {
        let first = *reader;
        match (reader.dialect(), T::BINARY_LENGTH) {
            (Dialect::Binary, Some(length)) => {
                let bytes = reader.bytes(count * length)?;
                return Ok(Self::Received(Received { first: Reader::new(Dialect::Binary, bytes), count }));
            }
            _ => {
                for _ in 0..count {
                    T::read(reader)?;
                }
            }
        }
        Ok(Self::Received(Received { first, count }))
    }

    /// Writes all elements, without their number.
    ///
    /// # Errors
    /// If they do not fit.
    pub fn write(&self, writer: &mut Writer) -> Result<(), WriteError> {
        self.iter().try_for_each(|element| element.write(writer))
    }

    /// Number of elements.
    #[must_use]
    pub const fn len(&self) -> usize {
        match self {
            Self::Values(values) => values.len(),
            Self::Received(received) => received.count,
        }
    }

    /// Whether there is no element.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The elements.
    pub fn iter(&self) -> impl Iterator<Item = T> + use<'a, T> {
        let (values, mut received): (&'a [T], _) = match self {
            Self::Values(values) => (values, None),
            Self::Received(received) => (&[], Some((received.first, received.count))),
        };
        let mut values = values.iter();
        core::iter::from_fn(move || match &mut received {
            None => values.next().cloned(),
            Some((_, 0)) => None,
            Some((reader, count)) => {
                *count -= 1;
                T::read(reader).ok()
            }
        })
    }

    /// The bytes of received CoLa-B elements that all have the same length.
    pub(crate) fn binary_bytes(&self) -> Option<&'a [u8]> {
        match (self, T::BINARY_LENGTH) {
            (Self::Received(received), Some(_)) if received.first.dialect() == Dialect::Binary => {
                Some(received.first.rest())
            }
            _ => None,
        }
    }
}

impl<T: Element> PartialEq for Sequence<'_, T> {
    fn eq(&self, other: &Self) -> bool {
        self.len() == other.len() && self.iter().eq(other.iter())
    }
}

impl<T: Element + fmt::Debug> fmt::Debug for Sequence<'_, T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_list().entries(self.iter()).finish()
    }
}
