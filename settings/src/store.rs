//! Settings, map and key in flash, through `sequential-storage`.
//!
//! One item a leaf, so that a bad one costs one setting. A new map is written beside the old one and counts from the
//! moment its index is written, so that a loss of power leaves the old map or the new one. Flash whose words can be
//! written once only will do.

use agv_core::maps::Landmark;
use agv_core::record::LANDMARKS_A_RECORD;
use agv_wire::can::controller_node::CommunicationParameters;
use embassy_futures::block_on;
use embedded_storage::nor_flash::{ErrorType, ReadNorFlash};
use heapless::Vec;
use sequential_storage::Error;
use sequential_storage::cache::key_pointers::ArrayKeyPointers;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage};
use serde::{Deserialize, Serialize};

use crate::checksum::continued;
use crate::leaf::{Leaf, Value};
use crate::patient_flash::PatientFlash;
use crate::{LEAVES, Settings};

/// Most landmarks of a stored map.
pub const LANDMARKS: usize = 1500;
/// Landmarks of an item.
pub const PIECE: usize = LANDMARKS_A_RECORD;
/// Bytes of a key.
pub const KEY: usize = 32;

/// Items that are no leaf. Those of leaves are from 100 to 999.
const KEY_ITEM: u16 = 1;
const STARTS_ITEM: u16 = 2;
const MAP_ITEM: u16 = 3;
const COMMUNICATION_ITEM: u16 = 4;
/// First pieces of both generations of the map.
const PIECES: [u16; 2] = [2000, 3000];

/// Longest item with its key, rounded up to the words of any flash.
const BUFFER: usize = 1280;

/// What does not fit, is not there or cannot be kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum StoreError {
    /// The flash refuses.
    Flash,
    /// There is no room.
    Full,
    /// The map is larger than can be kept, or its pieces do not follow each other, or are not those that were told.
    Map,
    /// The board has no flash for a map of contours.
    NoContours,
}

/// What the flash held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Loaded {
    /// Settings that were taken.
    pub leaves: u16,
    /// Items that mean nothing or are out of bounds; their settings are the default ones.
    pub bad: u16,
    /// The first setting that does not go with the others, though it is within its own bounds. If its default does not
    /// either, all that the localiser believes is as by default.
    pub contradiction: Option<&'static str>,
    /// Whether what was there is no storage at all. It was erased.
    pub was_formatted: bool,
    /// Whether there is a map that is not whole. None was loaded.
    pub is_map_damaged: bool,
}

/// Index of the map: what makes its pieces a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct MapIndex {
    generation: u8,
    count: u16,
    checksum: u32,
}

/// A map that is being written.
#[derive(Clone, Debug)]
pub struct MapWriter {
    generation: u8,
    count: u16,
    written: u16,
    digest: u32,
}

/// Flash as the storage wants it.
///
/// The first and the last word of a page are marks of the storage: they are erased, or written with [`MARK`]. One whose writing
/// was cut off is read as written, as it could not be written again.
struct Marked<F>(F);

/// What the storage marks a page with.
const MARK: u8 = 0;

/// Longest word, bytes.
const LONGEST_WORD: usize = 32;

impl<F: PatientFlash> Marked<F> {
    /// Whether a mark lies at `offset`, and anything of it was written.
    fn is_marked(&mut self, offset: u32) -> Result<bool, F::Error> {
        let place = offset as usize % F::ERASE_SIZE;
        let word = place - place % F::WRITE_SIZE;
        if word != 0 && word != F::ERASE_SIZE - F::WRITE_SIZE {
            return Ok(false);
        }
        let mut bytes = [0xFF; LONGEST_WORD];
        let Some(whole) = bytes.get_mut(..F::WRITE_SIZE) else { return Ok(false) };
        self.0.read(offset - (place - word) as u32, whole)?;
        Ok(whole.iter().any(|byte| *byte != 0xFF))
    }
}

impl<F: ErrorType> embedded_storage_async::nor_flash::ErrorType for Marked<F> {
    type Error = F::Error;
}

impl<F: PatientFlash> embedded_storage_async::nor_flash::ReadNorFlash for Marked<F> {
    const READ_SIZE: usize = F::READ_SIZE;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        self.0.rest().await;
        // The storage reads marks apart from items.
        if bytes.len() <= F::WRITE_SIZE && self.is_marked(offset)? {
            bytes.fill(MARK);
            return Ok(());
        }
        self.0.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl<F: PatientFlash> embedded_storage_async::nor_flash::NorFlash for Marked<F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        self.0.erase(from, to).await
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        self.0.write(offset, bytes).await
    }
}

/// Where the items of that many keys are, those of all leaves among them: a page that is full is moved in one pass over its
/// items, not in one for each of them.
const KNOWN_KEYS: usize = 168;
const _: () = assert!(KNOWN_KEYS >= LEAVES.len() + 4, "all leaves are known, and the items that are none");

type KnownKeys = Cache<Uncached, Uncached, ArrayKeyPointers<u16, KNOWN_KEYS>, u16>;

/// Takes the former value of a setting that does not go with the others, and of all that the localiser believes if that is
/// not enough. Gives the first such setting.
fn make_sound(settings: &mut Settings, former: &Settings) -> Option<&'static str> {
    let error = settings.check().err()?;
    if let Some(leaf) = Leaf::named(error.leaf) {
        let _ = leaf.set(settings, leaf.value(former));
    }
    if settings.check_believed().is_err() {
        (settings.parameters, settings.vehicle) = (former.parameters, former.vehicle);
    }
    if settings.check().is_err() {
        (settings.bit_rate, settings.publishing_period) = (former.bit_rate, former.publishing_period);
        settings.encoder_period = former.encoder_period;
        (settings.nodes.controller, settings.nodes.encoders) = (former.nodes.controller, former.nodes.encoders);
        settings.motion_frames = former.motion_frames;
    }
    Some(error.leaf)
}

/// The storage in a flash of two or more pages, all of it.
pub struct Store<F: PatientFlash> {
    storage: MapStorage<u16, Marked<F>, KnownKeys>,
    buffer: [u8; BUFFER],
    /// What is written: more than whoever waits for it should have to hold.
    item: [u8; BUFFER],
}

impl<F: PatientFlash> Store<F> {
    /// The storage in `flash`. None if it has fewer than two pages, or words of more than 32 bytes.
    #[must_use]
    pub fn new(flash: F) -> Option<Self> {
        let end = u32::try_from(flash.capacity()).ok()?;
        let config = MapConfig::try_new(0..end).ok()?;
        let cache = Cache::new(Uncached, Uncached, ArrayKeyPointers::new());
        let storage = MapStorage::new(Marked(flash), config, cache);
        Some(Self { storage, buffer: [0; BUFFER], item: [0; BUFFER] })
    }

    /// Reads everything: settings into `settings`, the map to `landmarks`, which is empty if there is none.
    ///
    /// What cannot be read is left at what it was before, and counted. Rubbish that is no storage is erased.
    ///
    /// # Errors
    /// If the flash cannot be read or erased.
    pub fn load(
        &mut self,
        settings: &mut Settings,
        landmarks: &mut Vec<Landmark, LANDMARKS>,
    ) -> Result<Loaded, StoreError> {
        let mut loaded = Loaded::default();
        // Of all that the storage does, only looking for one item mends a page whose erasure was cut off.
        let first = self.load_leaves(settings, &mut loaded);
        let outcome = match first {
            Err(FetchError::Rubbish) if self.fetch_now(KEY_ITEM).is_ok() => self.load_leaves(settings, &mut loaded),
            outcome => outcome,
        };
        let has_items = match outcome {
            Ok(has_items) => has_items,
            Err(FetchError::Flash) => return Err(StoreError::Flash),
            Err(_) => {
                self.format()?;
                loaded.was_formatted = true;
                true
            }
        };
        // Rubbish may look like a storage in which nothing was stored, until it is written to.
        if loaded.leaves == 0 && !has_items && !self.is_erased()? {
            self.format()?;
            loaded.was_formatted = true;
        }
        landmarks.clear();
        if let Some(index) = block_on(self.map_index())
            && self.load_map(index, landmarks).is_none()
        {
            landmarks.clear();
            loaded.is_map_damaged = true;
        }
        Ok(loaded)
    }

    /// Reads all items once, as they follow each other: a page holds thousands, and to look for each leaf takes seconds.
    /// Returns whether there are items that are no leaf.
    // One copy: what it works with takes kilobytes of stack.
    #[inline(never)]
    fn load_leaves(&mut self, settings: &mut Settings, loaded: &mut Loaded) -> Result<bool, FetchError> {
        let before = settings.clone();
        let mut are_good = [None; LEAVES.len()];
        let mut has_items = false;
        let mut items = block_on(self.storage.fetch_all_items(&mut self.buffer)).map_err(FetchError::from)?;
        loop {
            let (key, bytes) = match block_on(items.next::<&[u8]>(&mut self.buffer)).map_err(FetchError::from) {
                Ok(Some(item)) => item,
                Ok(None) => break,
                // It has no key.
                Err(FetchError::Item) => continue,
                Err(error) => return Err(error),
            };
            has_items |= [KEY_ITEM, STARTS_ITEM, MAP_ITEM, COMMUNICATION_ITEM].contains(&key);
            let found = LEAVES.iter().zip(&mut are_good).find(|(leaf, _)| leaf.key == key);
            let Some((leaf, is_good)) = found else { continue };
            let value = postcard::from_bytes::<Value>(bytes).ok();
            let is_set = value.is_some_and(|value| leaf.set(settings, value).is_ok());
            if !is_set {
                let _ = leaf.set(settings, leaf.value(&before));
            }
            *is_good = Some(is_set);
        }
        loaded.leaves = are_good.iter().filter(|is_good| **is_good == Some(true)).count() as u16;
        loaded.bad = are_good.iter().filter(|is_good| **is_good == Some(false)).count() as u16;
        loaded.contradiction = make_sound(settings, &before);
        Ok(has_items)
    }

    fn load_map(&mut self, index: MapIndex, landmarks: &mut Vec<Landmark, LANDMARKS>) -> Option<()> {
        let first = *PIECES.get(usize::from(index.generation))?;
        let mut digest = 0;
        for number in 0..index.count.div_ceil(PIECE as u16) {
            let bytes = self.fetch_now(first + number).ok()??;
            digest = continued(digest, bytes);
            let piece: Vec<Landmark, PIECE> = postcard::from_bytes(bytes).ok()?;
            landmarks.extend_from_slice(&piece).ok()?;
        }
        (landmarks.len() == usize::from(index.count) && digest == index.checksum).then_some(())
    }

    async fn map_index(&mut self) -> Option<MapIndex> {
        let bytes = self.fetch(MAP_ITEM).await.ok()??;
        postcard::from_bytes(bytes).ok()
    }

    /// Keeps a leaf, unless the flash has it already.
    ///
    /// # Errors
    /// If the flash refuses or is full.
    pub async fn store_leaf(&mut self, leaf: &Leaf, settings: &Settings) -> Result<(), StoreError> {
        let value = leaf.value(settings);
        let mut room = [0; 16];
        let bytes = postcard::to_slice(&value, &mut room).map_err(|_| StoreError::Full)?;
        self.put_new(leaf.key, bytes).await
    }

    /// Keeps all leaves.
    ///
    /// # Errors
    /// If the flash refuses or is full.
    pub async fn store_leaves(&mut self, settings: &Settings) -> Result<(), StoreError> {
        for leaf in &LEAVES {
            self.store_leaf(leaf, settings).await?;
        }
        Ok(())
    }

    /// Keeps how the controller speaks on the bus, unless the flash has it already.
    ///
    /// # Errors
    /// If the flash refuses or is full.
    pub async fn store_communication(&mut self, parameters: &CommunicationParameters) -> Result<(), StoreError> {
        self.put_new(COMMUNICATION_ITEM, &parameters.encode()).await
    }

    /// How the controller shall speak on the bus. None if nobody has had that stored.
    ///
    /// # Errors
    /// If what is there cannot be read, or means nothing.
    pub fn communication(&mut self) -> Result<Option<CommunicationParameters>, StoreError> {
        let bytes = self.fetch_now(COMMUNICATION_ITEM).map_err(|_| StoreError::Flash)?;
        bytes.map(|bytes| CommunicationParameters::decode(bytes).ok_or(StoreError::Flash)).transpose()
    }

    /// Begins to write a map of `count` landmarks beside the one that is kept.
    ///
    /// # Errors
    /// If that is more than can be kept.
    pub async fn begin_map(&mut self, count: u16) -> Result<MapWriter, StoreError> {
        if usize::from(count) > LANDMARKS {
            return Err(StoreError::Map);
        }
        let generation = self.map_index().await.map_or(0, |index| 1 - index.generation.min(1));
        Ok(MapWriter { generation, count, written: 0, digest: 0 })
    }

    /// Writes the next piece: [`PIECE`] landmarks, or the last ones.
    ///
    /// # Errors
    /// If it is no such piece, or the flash refuses or is full.
    pub async fn write_piece(&mut self, writer: &mut MapWriter, piece: &[Landmark]) -> Result<(), StoreError> {
        let rest = usize::from(writer.count - writer.written);
        if piece.len() != rest.min(PIECE) || piece.is_empty() {
            return Err(StoreError::Map);
        }
        let first = PIECES.get(usize::from(writer.generation)).copied().ok_or(StoreError::Map)?;
        let (length, digest) = {
            let piece = Vec::<Landmark, PIECE>::from_slice(piece).map_err(|_| StoreError::Map)?;
            let bytes = postcard::to_slice(&piece, &mut self.item).map_err(|_| StoreError::Full)?;
            (bytes.len(), continued(writer.digest, bytes))
        };
        self.put_item(first + writer.written / PIECE as u16, length).await?;
        writer.digest = digest;
        writer.written += piece.len() as u16;
        Ok(())
    }

    /// Makes the written map the one that is kept.
    ///
    /// # Errors
    /// If it is not whole, or the flash refuses or is full.
    pub async fn finish_map(&mut self, writer: &MapWriter) -> Result<(), StoreError> {
        if writer.written != writer.count {
            return Err(StoreError::Map);
        }
        let before = self.map_index().await;
        let index = MapIndex { generation: writer.generation, count: writer.count, checksum: writer.digest };
        let mut room = [0; 16];
        let bytes = postcard::to_slice(&index, &mut room).map_err(|_| StoreError::Full)?;
        self.put(MAP_ITEM, bytes).await?;
        let Some(before) = before else { return Ok(()) };
        let first = PIECES.get(usize::from(before.generation)).copied().ok_or(StoreError::Map)?;
        // The old pieces shrink to nothing, as not every flash can take them away.
        for number in 0..before.count.div_ceil(PIECE as u16) {
            self.put(first + number, &[]).await?;
        }
        Ok(())
    }

    /// The key that writers of settings must know. None if none was provisioned.
    pub fn key(&mut self) -> Option<[u8; KEY]> {
        self.fetch_now(KEY_ITEM).ok()??.try_into().ok()
    }

    /// Provisions the key.
    ///
    /// # Errors
    /// If the flash refuses or is full.
    pub async fn provision_key(&mut self, key: &[u8; KEY]) -> Result<(), StoreError> {
        self.put(KEY_ITEM, key).await
    }

    /// Counts this start, and says how many there were: a number that never comes again.
    ///
    /// # Errors
    /// If the flash refuses or is full.
    pub async fn count_start(&mut self) -> Result<u32, StoreError> {
        let before = self.fetch(STARTS_ITEM).await.ok().flatten().and_then(|bytes| bytes.try_into().ok());
        let starts = before.map_or(0, u32::from_le_bytes).wrapping_add(1);
        self.put(STARTS_ITEM, &starts.to_le_bytes()).await?;
        Ok(starts)
    }

    /// Erases everything.
    ///
    /// # Errors
    /// If the flash refuses.
    // One copy: what it works with takes kilobytes of stack.
    #[inline(never)]
    pub fn format(&mut self) -> Result<(), StoreError> {
        block_on(self.storage.erase_all()).map_err(|_| StoreError::Flash)
    }

    /// The flash.
    #[must_use]
    pub fn into_flash(self) -> F {
        self.storage.destroy().0.0
    }

    fn is_erased(&mut self) -> Result<bool, StoreError> {
        let flash = &mut self.storage.flash().0;
        let end = flash.capacity() as u32;
        let mut offset = 0;
        while offset < end {
            let bytes = self.buffer.get_mut(..256).unwrap_or_default();
            flash.read(offset, bytes).map_err(|_| StoreError::Flash)?;
            if bytes.iter().any(|byte| *byte != 0xFF) {
                return Ok(false);
            }
            offset += 256;
        }
        Ok(true)
    }

    async fn fetch(&mut self, key: u16) -> Result<Option<&[u8]>, FetchError> {
        self.storage.fetch_item::<&[u8]>(&mut self.buffer, &key).await.map_err(FetchError::from)
    }

    /// The same at the start, when nobody else goes on. One copy: what it works with takes kilobytes of stack.
    #[inline(never)]
    fn fetch_now(&mut self, key: u16) -> Result<Option<&[u8]>, FetchError> {
        block_on(self.fetch(key))
    }

    /// Keeps an item, unless the flash has it already.
    async fn put_new(&mut self, key: u16, bytes: &[u8]) -> Result<(), StoreError> {
        if matches!(self.fetch(key).await, Ok(Some(kept)) if kept == bytes) {
            return Ok(());
        }
        self.put(key, bytes).await
    }

    async fn put(&mut self, key: u16, bytes: &[u8]) -> Result<(), StoreError> {
        let room = self.item.get_mut(..bytes.len()).ok_or(StoreError::Full)?;
        room.iter_mut().zip(bytes).for_each(|(place, byte)| *place = *byte);
        self.put_item(key, bytes.len()).await
    }

    /// Keeps the first bytes of `item`.
    async fn put_item(&mut self, key: u16, length: usize) -> Result<(), StoreError> {
        let Self { storage, buffer, item } = self;
        let bytes = item.get(..length).ok_or(StoreError::Full)?;
        storage.store_item(buffer, &key, &bytes).await.map_err(|error| match error {
            Error::FullStorage | Error::ItemTooBig => StoreError::Full,
            _ => StoreError::Flash,
        })
    }
}

enum FetchError {
    Flash,
    Rubbish,
    Item,
}

impl<E> From<Error<E>> for FetchError {
    fn from(error: Error<E>) -> Self {
        match error {
            Error::Storage { .. } => Self::Flash,
            Error::Corrupted { .. } => Self::Rubbish,
            _ => Self::Item,
        }
    }
}
