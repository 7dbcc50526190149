//! All that a localiser has gathered as bytes: a log that begins in the middle of a drive carries it.

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::contours::ContourCorrection;
use super::{Capacities, Localizer, OutputPredictor, StatedCapacities};
use crate::sources::{FindContours, LandmarkMaps};

/// Version of the bytes; another one is not understood.
pub const STATE_VERSION: u32 = 1;

/// Why bytes are not the state of a localiser, or have no room for one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StateError {
    /// The room is too small.
    Room,
    /// They are of that version.
    Version(u32),
    /// They are of a localiser with that much room.
    Capacities(StatedCapacities),
    /// They are no state.
    Content,
}

impl core::fmt::Display for StateError {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Room => write!(formatter, "there is no room for the state of the localiser"),
            Self::Version(version) => write!(
                formatter,
                "the state of the localiser has version {version}, this program reads {STATE_VERSION}: use the program that wrote it"
            ),
            Self::Capacities(_) => write!(formatter, "the state is that of a localiser with other capacities"),
            Self::Content => write!(formatter, "the state of the localiser is damaged"),
        }
    }
}

impl core::error::Error for StateError {}

/// Values one behind the other.
struct Writer<'a> {
    room: &'a mut [u8],
    length: usize,
}

impl Writer<'_> {
    fn put<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), StateError> {
        let room = self.room.get_mut(self.length..).ok_or(StateError::Room)?;
        self.length += postcard::to_slice(value, room).map_err(|_| StateError::Room)?.len();
        Ok(())
    }
}

/// Values one behind the other.
struct Reader<'a> {
    bytes: &'a [u8],
}

impl Reader<'_> {
    /// The version.
    fn begin(&mut self) -> Result<(), StateError> {
        match self.take()? {
            STATE_VERSION => Ok(()),
            other => Err(StateError::Version(other)),
        }
    }

    /// There is nothing more.
    fn end(&self) -> Result<(), StateError> {
        if self.bytes.is_empty() { Ok(()) } else { Err(StateError::Content) }
    }

    /// One value: what is large is on the stack only while it is taken.
    #[inline(never)]
    fn take<T: DeserializeOwned>(&mut self) -> Result<T, StateError> {
        let (value, rest) = postcard::take_from_bytes(self.bytes).map_err(|_| StateError::Content)?;
        self.bytes = rest;
        Ok(value)
    }
}

impl<C: Capacities> Localizer<C> {
    /// Writes all that has been gathered since the beginning to `room`, and returns its length, bytes. Parameters and maps that were
    /// given are not part of it, nor is what only lasts for one event.
    ///
    /// # Errors
    /// If the room is too small.
    pub fn save_state(&self, room: &mut [u8]) -> Result<usize, StateError> {
        let mut to = Writer { room, length: 0 };
        to.put(&(STATE_VERSION, Self::CAPACITIES))?;
        to.put(&self.odometer)?;
        to.put(self.maps.found_map())?;
        to.put(&self.timeline)?;
        if self.parameters.maps.slam {
            to.put(&self.slam)?;
        }
        to.put(&self.integrity)?;
        to.put(&self.start_watch)?;
        to.put(&self.separation)?;
        to.put(&self.gyro)?;
        to.put(&(self.lost, self.outage, self.repeated, self.distance))?;
        if self.parameters.sources.contours {
            to.put(self.contours.around())?;
        }
        to.put(&(self.behind, self.laser_odometry, self.growth))?;
        to.put(&self.outputs)?;
        Ok(to.length)
    }

    /// Goes on where the localiser was that wrote `bytes`: the same parameters and maps are given already.
    ///
    /// # Errors
    /// See [`StateError`]; the localiser is useless then.
    pub fn restore_state(&mut self, bytes: &[u8]) -> Result<(), StateError> {
        let mut from = Reader { bytes };
        from.begin()?;
        let capacities = from.take()?;
        if capacities != Self::CAPACITIES {
            return Err(StateError::Capacities(capacities));
        }
        self.odometer = from.take()?;
        self.maps.set_found_map(from.take()?);
        self.timeline = from.take()?;
        if self.parameters.maps.slam {
            self.slam = from.take()?;
        }
        self.integrity = from.take()?;
        self.start_watch = from.take()?;
        self.separation = from.take()?;
        self.gyro = from.take()?;
        (self.lost, self.outage, self.repeated, self.distance) = from.take()?;
        if self.parameters.sources.contours {
            self.contours.set_around(from.take()?);
        }
        (self.behind, self.laser_odometry, self.growth) = from.take()?;
        self.outputs = from.take()?;
        self.contour_correction = ContourCorrection::None;
        from.end()
    }
}

impl<const MOTIONS: usize> OutputPredictor<MOTIONS> {
    /// Writes all that has been heard to `room`, and returns its length, bytes.
    ///
    /// # Errors
    /// If the room is too small.
    pub fn save_state(&self, room: &mut [u8]) -> Result<usize, StateError> {
        let mut to = Writer { room, length: 0 };
        to.put(&(STATE_VERSION, self))?;
        Ok(to.length)
    }

    /// Goes on where the predictor was that wrote `bytes`.
    ///
    /// # Errors
    /// See [`StateError`]; the predictor is as before then.
    pub fn restore_state(&mut self, bytes: &[u8]) -> Result<(), StateError> {
        let mut from = Reader { bytes };
        from.begin()?;
        let predictor = from.take()?;
        from.end()?;
        *self = predictor;
        Ok(())
    }
}
