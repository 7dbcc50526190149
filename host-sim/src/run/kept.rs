//! What the store tells at the start.

use std::io;
use std::path::{Path, PathBuf};

use agv_core::maps::{Landmark, put_reflectors_first};
use agv_settings::contour_store::{CONTOUR_PIECE, ContourStore};
use agv_settings::service::Controller;
use agv_settings::store::{LANDMARKS, Loaded, Store};
use agv_settings::{Settings, block_on};
use agv_wire::can::controller_node::CommunicationParameters;

use super::flash_file::{FlashFile, FlashFileError};

/// Name and version of this program on its ports and in its logs.
pub const SOFTWARE: &str = concat!("agv-run ", env!("CARGO_PKG_VERSION"));

/// The file with settings, key and map in the folder of the store: as `agv provision --output` writes it.
pub const FLASH: &str = "flash.bin";
/// The file with the map of contours: as `agv provision --contours-output` writes it.
pub const CONTOURS: &str = "contours.bin";

/// Why a store cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StoreFolderError {
    /// A file of it.
    #[error(transparent)]
    File(#[from] FlashFileError),
    /// The folder cannot be made.
    #[error("{}: {source}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
}

/// What the store holds. Maps live for ever, as they are lent: a controller that starts again in the same process leaves those of
/// the start before behind.
pub struct Kept {
    /// What the service port speaks of.
    pub controller: Controller<FlashFile>,
    /// The settings that count until the next start.
    pub settings: Settings,
    /// The map of contours.
    pub contours: Option<&'static [u8]>,
    /// How the controller shall speak on the bus, if somebody has had that stored.
    pub communication: Option<CommunicationParameters>,
    /// Whether everything that was set was found.
    pub is_sound: bool,
    /// What there is to say of it, one line each.
    pub remarks: Vec<String>,
}

/// Reads the store in a folder, which is made if there is none, and counts the start. Settings that cannot be read are the
/// default ones.
///
/// # Errors
/// If a file cannot be used.
pub fn read(folder: &Path) -> Result<Kept, StoreFolderError> {
    std::fs::create_dir_all(folder).map_err(|source| StoreFolderError::Folder { path: folder.to_owned(), source })?;
    let flash = FlashFile::open(&folder.join(FLASH))?;
    let contour_flash = FlashFile::open(&folder.join(CONTOURS))?;
    let mut settings = Settings::default();
    let mut map = Box::new(heapless::Vec::<Landmark, LANDMARKS>::new());
    let mut remarks = Vec::new();
    let mut is_sound = true;
    // A file of that size always has room for a store.
    let mut store = Store::new(flash);
    let (mut key, mut starts, mut communication) = (None, 0, None);
    if let Some(store) = &mut store {
        match store.load(&mut settings, &mut map) {
            Ok(loaded) => is_sound = complain(&loaded, &mut remarks),
            Err(_) => {
                is_sound = false;
                remarks.push("settings: the store cannot be read".to_owned());
            }
        }
        key = store.key();
        communication = store.communication().unwrap_or_else(|_| {
            is_sound = false;
            remarks.push("settings: how to speak on the bus is damaged and left at its default".to_owned());
            None
        });
        starts = block_on(store.count_start()).unwrap_or_else(|_| {
            remarks.push("settings: the start cannot be counted; nothing can be stored".to_owned());
            0
        });
    }
    put_reflectors_first(&mut map);
    if !settings.accepts_map(&map) {
        is_sound = false;
        remarks.push("settings: the map is not that of maps.identity and was left out".to_owned());
        map.clear();
    }
    let mut contours = ContourStore::open(contour_flash);
    if contours.as_ref().is_some_and(ContourStore::is_damaged) {
        is_sound = false;
        remarks.push("settings: the map of contours is damaged and was left out".to_owned());
    }
    let contour_bytes = contours.as_mut().and_then(contour_bytes);
    let landmarks: &'static [Landmark] = Vec::leak(map.to_vec());
    let controller = Controller {
        software: SOFTWARE,
        settings: settings.clone(),
        store,
        landmarks,
        key,
        starts,
        nonces: 0,
        panic: "",
        map: None,
        contours,
    };
    Ok(Kept { controller, settings, contours: contour_bytes, communication, is_sound, remarks })
}

/// Says what is wrong with what was loaded; whether nothing is.
fn complain(loaded: &Loaded, remarks: &mut Vec<String>) -> bool {
    let Loaded { bad, contradiction, was_formatted, is_map_damaged, .. } = *loaded;
    if bad > 0 {
        remarks.push(format!("settings: {bad} are bad and left at their defaults"));
    }
    if let Some(leaf) = contradiction {
        remarks.push(format!("settings: {leaf} does not go with the others and is left at its default"));
    }
    if was_formatted {
        remarks.push("settings: the store held rubbish and was erased".to_owned());
    }
    if is_map_damaged {
        remarks.push("settings: the map is damaged and was left out".to_owned());
    }
    bad == 0 && contradiction.is_none() && !was_formatted && !is_map_damaged
}

/// The map of contours, whole.
fn contour_bytes(store: &mut ContourStore<FlashFile>) -> Option<&'static [u8]> {
    let length = store.found()?.length as usize;
    let mut bytes = Vec::with_capacity(length);
    let mut piece = [0; CONTOUR_PIECE];
    while bytes.len() < length {
        let read = store.read(bytes.len() as u32, &mut piece).ok()?;
        if read.is_empty() {
            return None;
        }
        bytes.extend_from_slice(read);
    }
    Some(Vec::leak(bytes))
}
