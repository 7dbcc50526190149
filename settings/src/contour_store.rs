//! The map of contours in flash, as bytes that the processor can read where they are.
//!
//! The flash holds two copies, of half of it each: a header of 32 bytes, and the map behind it. The copy that was found at the start stays as
//! it is while the vehicle is on; the other one is written. Its header comes last, so that a loss of power leaves the old map or the new one.
//! Flash whose words can be written once only will do.

use crate::checksum::{CHECKSUM, continued};
use crate::patient_flash::PatientFlash;
use crate::store::StoreError;

/// Bytes before a map: a multiple of the words of any flash.
pub const HEADER: usize = 32;

/// Most bytes of a map on the boards, which have 128 KiB for a copy.
pub const MOST: usize = 128 * 1024 - HEADER;

/// Bytes that are written at once, but for the last ones.
pub const CONTOUR_PIECE: usize = 1024;

/// What a header begins with.
const MARK: [u8; 4] = *b"AGVC";

/// Bytes of a header that are not empty.
const USED: usize = 20;

/// A map that is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KeptContours {
    /// The copy, 0 or 1.
    pub copy: u8,
    /// Its bytes.
    pub length: u32,
    /// Their CRC-32.
    pub checksum: u32,
    /// One more for each map that was written.
    generation: u32,
}

impl KeptContours {
    fn header(&self) -> [u8; HEADER] {
        let mut header = [0xFF; HEADER];
        let numbers = [self.generation, self.length, self.checksum].map(u32::to_le_bytes);
        let parts = MARK.into_iter().chain(numbers.into_iter().flatten());
        header.iter_mut().zip(parts).for_each(|(byte, part)| *byte = part);
        let sum = CHECKSUM.checksum(header.get(..USED - 4).unwrap_or_default()).to_le_bytes();
        header.iter_mut().skip(USED - 4).zip(sum).for_each(|(byte, part)| *byte = part);
        header
    }

    fn of_header(copy: u8, header: &[u8; HEADER]) -> Option<Self> {
        let ([_, generation, length, checksum, ..], _) = header.as_chunks::<4>() else { return None };
        let number = |bytes: &[u8; 4]| u32::from_le_bytes(*bytes);
        let (length, checksum, generation) = (number(length), number(checksum), number(generation));
        let kept = Self { copy, length, checksum, generation };
        (kept.header() == *header).then_some(kept)
    }
}

/// A map that is being written.
#[derive(Clone, Copy, Debug)]
struct Writing {
    /// What it will be.
    map: KeptContours,
    written: u32,
    digest: u32,
}

/// Two copies of a map of contours.
pub struct ContourStore<F: PatientFlash> {
    flash: F,
    /// What was found at the start.
    found: Option<KeptContours>,
    is_damaged: bool,
    writing: Option<Writing>,
}

impl<F: PatientFlash> ContourStore<F> {
    /// The copies in `flash`, all of it. None if it has fewer than two pages, or words of more than 32 bytes.
    #[must_use]
    pub fn open(flash: F) -> Option<Self> {
        let copy = flash.capacity() / 2;
        let is_usable = copy >= F::ERASE_SIZE && copy.is_multiple_of(F::ERASE_SIZE);
        if !is_usable || !HEADER.is_multiple_of(F::WRITE_SIZE) {
            return None;
        }
        let mut store = Self { flash, found: None, is_damaged: false, writing: None };
        let copies = [store.copy(0), store.copy(1)];
        // The numbers go on from each other.
        let newer = |one: &KeptContours, other: &KeptContours| one.generation.wrapping_sub(other.generation) == 1;
        store.found = match copies {
            [Some(one), Some(other)] => Some(if newer(&other, &one) { other } else { one }),
            [one, other] => one.or(other),
        };
        store.is_damaged = store.found.is_none() && [0, 1].into_iter().any(|copy| !store.is_blank(copy));
        Some(store)
    }

    /// The map that was found at the start, if it is one and not empty: what was written since counts from the next start on.
    #[must_use]
    pub fn found(&self) -> Option<KeptContours> {
        self.found.filter(|found| found.length > 0)
    }

    /// Whether there was a map, and no copy of it is whole any more. One whose first writing was cut off was none.
    #[must_use]
    pub const fn is_damaged(&self) -> bool {
        self.is_damaged
    }

    /// Most bytes of a map.
    #[must_use]
    pub fn room(&self) -> usize {
        self.bytes_of_copy() - HEADER
    }

    /// Where a copy's map begins, bytes from the beginning of the flash.
    #[must_use]
    pub fn offset(&self, copy: u8) -> u32 {
        (usize::from(copy) * self.bytes_of_copy() + HEADER) as u32
    }

    /// Reads bytes of the map that was found, as many as there are from a place on.
    ///
    /// # Errors
    /// If the flash cannot be read.
    pub fn read<'a>(&mut self, first: u32, bytes: &'a mut [u8]) -> Result<&'a [u8], StoreError> {
        let Some(found) = self.found() else { return Ok(&[]) };
        let count = bytes.len().min(found.length.saturating_sub(first) as usize);
        let bytes = bytes.get_mut(..count).unwrap_or_default();
        let offset = self.offset(found.copy) + first.min(found.length);
        self.flash.read(offset, bytes).map_err(|_| StoreError::Flash)?;
        Ok(bytes)
    }

    /// Begins to write a map of so many bytes, whose CRC-32 is `checksum`. That takes as long as its pages take to erase. One of no bytes
    /// takes the place of the map that is kept.
    ///
    /// # Errors
    /// If it is larger than there is room for, or the flash refuses.
    pub async fn begin(&mut self, length: u32, checksum: u32) -> Result<(), StoreError> {
        self.writing = None;
        if length as usize > self.room() {
            return Err(StoreError::Map);
        }
        let copy = self.found.map_or(0, |found| 1 - found.copy.min(1));
        let generation = self.found.map_or(0, |found| found.generation.wrapping_add(1));
        let from = u32::from(copy) * self.bytes_of_copy() as u32;
        self.flash.erase(from, from + self.bytes_of_copy() as u32).await.map_err(|_| StoreError::Flash)?;
        let map = KeptContours { copy, length, checksum, generation };
        self.writing = Some(Writing { map, written: 0, digest: 0 });
        Ok(())
    }

    /// Writes the next piece: [`CONTOUR_PIECE`] bytes, or the last ones.
    ///
    /// # Errors
    /// If it is no such piece, or the flash refuses. The map is given up then.
    pub async fn write(&mut self, piece: &[u8]) -> Result<(), StoreError> {
        let mut writing = self.writing.take().ok_or(StoreError::Map)?;
        let rest = (writing.map.length - writing.written) as usize;
        if piece.is_empty() || piece.len() != rest.min(CONTOUR_PIECE) {
            return Err(StoreError::Map);
        }
        let offset = self.offset(writing.map.copy) + writing.written;
        let mut room = [0xFF; CONTOUR_PIECE];
        let whole = piece.len().next_multiple_of(F::WRITE_SIZE);
        let words = room.get_mut(..whole).ok_or(StoreError::Map)?;
        words.iter_mut().zip(piece).for_each(|(byte, part)| *byte = *part);
        self.flash.write(offset, words).await.map_err(|_| StoreError::Flash)?;
        writing.digest = continued(writing.digest, piece);
        writing.written += piece.len() as u32;
        self.writing = Some(writing);
        Ok(())
    }

    /// Makes the written map the one that is found at the next start.
    ///
    /// # Errors
    /// If it is not whole or not the one whose checksum was told, or the flash refuses. The map is given up then.
    pub async fn finish(&mut self) -> Result<(), StoreError> {
        let Writing { map, written, digest } = self.writing.take().ok_or(StoreError::Map)?;
        if written != map.length || digest != map.checksum {
            return Err(StoreError::Map);
        }
        if self.checksum_in(map.copy, map.length)? != map.checksum {
            return Err(StoreError::Flash);
        }
        let place = self.offset(map.copy) - HEADER as u32;
        self.flash.write(place, &map.header()).await.map_err(|_| StoreError::Flash)
    }

    /// The flash.
    #[must_use]
    pub fn into_flash(self) -> F {
        self.flash
    }

    fn bytes_of_copy(&self) -> usize {
        self.flash.capacity() / 2
    }

    /// The header of a copy; none if the flash cannot be read.
    fn header(&mut self, copy: u8) -> Option<[u8; HEADER]> {
        let mut header = [0; HEADER];
        self.flash.read(self.offset(copy) - HEADER as u32, &mut header).ok()?;
        Some(header)
    }

    /// Whether the header of a copy has never been written since its pages were erased.
    fn is_blank(&mut self, copy: u8) -> bool {
        self.header(copy).is_some_and(|header| header == [0xFF; HEADER])
    }

    /// What a copy holds, if that is whole.
    fn copy(&mut self, copy: u8) -> Option<KeptContours> {
        let header = self.header(copy)?;
        let kept = KeptContours::of_header(copy, &header)?;
        let is_whole = kept.length as usize <= self.room()
            && self.checksum_in(copy, kept.length).is_ok_and(|checksum| checksum == kept.checksum);
        is_whole.then_some(kept)
    }

    /// The checksum of the first bytes of a copy's map.
    fn checksum_in(&mut self, copy: u8, length: u32) -> Result<u32, StoreError> {
        let first = self.offset(copy);
        let mut room = [0; 256];
        let mut digest = 0;
        for offset in (0..length).step_by(room.len()) {
            let count = room.len().min((length - offset) as usize);
            let bytes = room.get_mut(..count).unwrap_or_default();
            self.flash.read(first + offset, bytes).map_err(|_| StoreError::Flash)?;
            digest = continued(digest, bytes);
        }
        Ok(digest)
    }
}

/// The CRC-32 of a map's bytes.
#[must_use]
pub fn checksum(bytes: &[u8]) -> u32 {
    CHECKSUM.checksum(bytes)
}
