//! What a controller's flash holds when it is delivered: settings, key and maps.

use agv_core::maps::Landmark;
use agv_settings::contour_store::{CONTOUR_PIECE, ContourStore, MOST, checksum};
use agv_settings::store::{KEY, PIECE, Store, StoreError};
use agv_settings::{Settings, block_on, map_identity};
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

use crate::contour_map::ContourMap;

/// Bytes of a page of the STM32H743's flash.
pub(crate) const PAGE: usize = 128 * 1024;
/// Bytes of its words.
pub(crate) const WORD: usize = 32;

/// Why there is no image.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum ProvisionError {
    /// There is no room.
    #[error("the map and the settings do not fit the flash")]
    Full,
    /// The map is too large.
    #[error("the map has {count} landmarks; {most} can be kept", most = agv_settings::store::LANDMARKS)]
    Map {
        /// Landmarks of the map.
        count: usize,
    },
    /// The map of contours is too large.
    #[error("the map of contours has {bytes} bytes; {MOST} can be kept; fewer points, as by agv map --cell, take less")]
    Contours {
        /// Bytes of the map.
        bytes: usize,
    },
    /// The map is another one than it must be.
    #[error("maps.identity is {set}, and the map is {found}")]
    OtherMap {
        /// What the settings say.
        set: u32,
        /// What the map is.
        found: u32,
    },
}

impl From<StoreError> for ProvisionError {
    fn from(_: StoreError) -> Self {
        Self::Full
    }
}

/// Two pages of flash.
struct Image(Vec<u8>);

impl ErrorType for Image {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Image {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, bytes.len())?;
        bytes.copy_from_slice(&self.0[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.len()
    }
}

impl NorFlash for Image {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        self.0[from as usize..to as usize].fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        self.0[offset as usize..][..bytes.len()].copy_from_slice(bytes);
        Ok(())
    }
}

/// The bytes of the settings' flash.
///
/// # Errors
/// If they are too many, or the map is not that of the settings.
pub fn flash_image(
    settings: &Settings,
    landmarks: &[Landmark],
    key: Option<&[u8; KEY]>,
) -> Result<Vec<u8>, ProvisionError> {
    let too_many = || ProvisionError::Map { count: landmarks.len() };
    if !settings.accepts_map(landmarks) {
        return Err(ProvisionError::OtherMap { set: settings.map_identity, found: map_identity(landmarks) });
    }
    let mut store = Store::new(Image(vec![0xFF; 2 * PAGE])).ok_or(ProvisionError::Full)?;
    if let Some(key) = key {
        block_on(store.provision_key(key))?;
    }
    block_on(store.store_leaves(settings))?;
    let count = u16::try_from(landmarks.len()).map_err(|_| too_many())?;
    let mut writer = block_on(store.begin_map(count)).map_err(|_| too_many())?;
    for piece in landmarks.chunks(PIECE) {
        block_on(store.write_piece(&mut writer, piece))?;
    }
    block_on(store.finish_map(&writer))?;
    Ok(store.into_flash().0)
}

/// The bytes of the flash of the map of contours.
///
/// # Errors
/// If they are too many.
pub fn contour_image(map: &ContourMap) -> Result<Vec<u8>, ProvisionError> {
    let bytes = map.bytes();
    let too_many = |_| ProvisionError::Contours { bytes: bytes.len() };
    let mut store = ContourStore::open(Image(vec![0xFF; 2 * PAGE])).ok_or(ProvisionError::Full)?;
    block_on(store.begin(u32::try_from(bytes.len()).unwrap_or(u32::MAX), checksum(bytes))).map_err(too_many)?;
    bytes.chunks(CONTOUR_PIECE).try_for_each(|piece| block_on(store.write(piece)))?;
    block_on(store.finish())?;
    Ok(store.into_flash().0)
}
