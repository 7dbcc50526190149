//! A flash that is a file survives what a flash survives.

use std::fs::OpenOptions;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

use agv_core::maps::{Landmark, LandmarkKind};
use agv_host_sim::run::{FlashFile, FlashFileError, Refused};
use agv_settings::contour_store::{CONTOUR_PIECE, ContourStore, checksum};
use agv_settings::leaf::{Leaf, Value};
use agv_settings::store::{LANDMARKS, Loaded, PIECE, Store, StoreError};
use agv_settings::{Settings, block_on};
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};

/// Bytes of a page.
const PAGE: usize = 128 * 1024;

/// A folder in memory, where there is one: what is written there is on the disk at once.
fn folder() -> tempfile::TempDir {
    tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).unwrap()
}

/// A flash whose power goes when so many bytes were written: of the write in which it goes, only the first ones are on the disk.
struct Cut {
    flash: FlashFile,
    path: PathBuf,
    left: usize,
    written: usize,
}

impl Cut {
    fn new(path: &Path, left: usize) -> Self {
        Self { flash: FlashFile::open(path).unwrap(), path: path.to_owned(), left, written: 0 }
    }

    /// Writes as many of the bytes as there is power for; whether that is all.
    fn spend(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refused> {
        let count = bytes.len().min(self.left);
        self.left -= count;
        self.written += count;
        if count == bytes.len() {
            return Ok(());
        }
        let file = OpenOptions::new().write(true).open(&self.path).unwrap();
        file.write_all_at(&bytes[..count], offset.into()).unwrap();
        Err(Refused::Place(NorFlashErrorKind::Other))
    }
}

impl ErrorType for Cut {
    type Error = Refused;
}

impl ReadNorFlash for Cut {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Refused> {
        self.flash.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl NorFlash for Cut {
    const WRITE_SIZE: usize = <FlashFile as NorFlash>::WRITE_SIZE;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Refused> {
        self.spend(from, &vec![0xFF; (to - from) as usize])?;
        NorFlash::erase(&mut self.flash, from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refused> {
        self.spend(offset, bytes)?;
        NorFlash::write(&mut self.flash, offset, bytes)
    }
}

fn with(wheelbase: f64) -> Settings {
    let mut settings = Settings::default();
    Leaf::named("vehicle.wheelbase").unwrap().set(&mut settings, Value::Number(wheelbase)).unwrap();
    settings
}

fn map(count: u16, shift: f64) -> Vec<Landmark> {
    let landmark = |id: u16| Landmark {
        id,
        kind: LandmarkKind::Reflector,
        x: f64::from(id) + shift,
        y: -0.1 * f64::from(id),
        deviation: 0.005,
    };
    (0..count).map(landmark).collect()
}

fn write_map<F: NorFlash>(store: &mut Store<F>, map: &[Landmark]) -> Result<(), StoreError> {
    let mut writer = block_on(store.begin_map(map.len() as u16))?;
    for piece in map.chunks(PIECE) {
        block_on(store.write_piece(&mut writer, piece))?;
    }
    block_on(store.finish_map(&writer))
}

/// Writes one setting and a map.
fn change<F: NorFlash>(store: &mut Store<F>, settings: &Settings, map: &[Landmark]) -> Result<(), StoreError> {
    block_on(store.store_leaf(Leaf::named("vehicle.wheelbase").unwrap(), settings))?;
    write_map(store, map)
}

fn load(path: &Path) -> (Settings, Vec<Landmark>, Loaded) {
    let mut settings = Settings::default();
    let mut landmarks = heapless::Vec::<Landmark, LANDMARKS>::new();
    let mut store = Store::new(FlashFile::open(path).unwrap()).unwrap();
    let loaded = store.load(&mut settings, &mut landmarks).unwrap();
    (settings, landmarks.to_vec(), loaded)
}

#[test]
fn a_cut_at_any_byte_leaves_the_old_or_the_new() {
    let folder = folder();
    let path = folder.path().join("flash.bin");
    let (old, new) = ((with(1.2), map(3, 0.0)), (with(1.7), map(4, 0.5)));
    change(&mut Store::new(FlashFile::open(&path).unwrap()).unwrap(), &old.0, &old.1).unwrap();
    let before = std::fs::read(&path).unwrap();
    let mut store = Store::new(Cut::new(&path, usize::MAX)).unwrap();
    change(&mut store, &new.0, &new.1).unwrap();
    let work = store.into_flash().written;
    assert!((100..5_000).contains(&work), "{work}");
    let mut seen = [0; 3];
    for left in 0..work {
        std::fs::write(&path, &before).unwrap();
        let outcome = change(&mut Store::new(Cut::new(&path, left)).unwrap(), &new.0, &new.1);
        assert_eq!(outcome, Err(StoreError::Flash), "{left}");
        let (settings, landmarks, loaded) = load(&path);
        assert!(loaded.bad == 0 && !loaded.was_formatted && !loaded.is_map_damaged, "{left}: {loaded:?}");
        let is_new = [settings == new.0, landmarks == new.1];
        assert!(is_new[0] || settings == old.0, "{left}");
        assert!(is_new[1] || landmarks == old.1, "{left}: {landmarks:?}");
        // One was changed before the other.
        assert!(is_new[0] || !is_new[1], "{left}");
        seen[usize::from(is_new[0]) + usize::from(is_new[1])] += 1;
        // It goes on from there.
        change(&mut Store::new(FlashFile::open(&path).unwrap()).unwrap(), &new.0, &new.1).unwrap();
        let (settings, landmarks, _) = load(&path);
        assert!(settings == new.0 && landmarks == new.1, "{left}");
    }
    assert!(seen.iter().all(|count| *count > 0), "{seen:?}");
}

#[test]
fn a_cut_while_a_full_page_moves_loses_nothing() {
    let folder = folder();
    let path = folder.path().join("flash.bin");
    let steady = map(60, 0.0);
    change(&mut Store::new(FlashFile::open(&path).unwrap()).unwrap(), &with(1.0), &steady).unwrap();
    // Until the next setting needs another page: that erases one.
    let leaf = Leaf::named("vehicle.wheelbase").unwrap();
    let mut store = Store::new(Cut::new(&path, usize::MAX)).unwrap();
    let (mut number, mut before) = (0_u32, Vec::new());
    let work = loop {
        number += 1;
        block_on(store.store_leaf(leaf, &with(1.0 + 1e-5 * f64::from(number)))).unwrap();
        let mut flash = store.into_flash();
        let written = std::mem::take(&mut flash.written);
        if written > PAGE {
            break written;
        }
        before = std::fs::read(&path).unwrap();
        store = Store::new(flash).unwrap();
    };
    let (old, new) = (with(1.0 + 1e-5 * f64::from(number - 1)), with(1.0 + 1e-5 * f64::from(number)));
    // Bytes around the ends of the erasure, and some within it: a prime step meets every place of a word.
    let cuts = (0..work).step_by(1511).chain(work.saturating_sub(200)..work);
    for left in cuts {
        std::fs::write(&path, &before).unwrap();
        let outcome = block_on(Store::new(Cut::new(&path, left)).unwrap().store_leaf(leaf, &new));
        assert_eq!(outcome, Err(StoreError::Flash), "{left}");
        let (settings, landmarks, loaded) = load(&path);
        assert!(!loaded.was_formatted && !loaded.is_map_damaged, "{left}: {loaded:?}");
        assert!(settings == old || settings == new, "{left}");
        assert_eq!(landmarks, steady, "{left}");
    }
}

#[test]
fn a_map_of_contours_is_the_old_or_the_new() {
    let folder = folder();
    let path = folder.path().join("contours.bin");
    let write = |left: usize, bytes: &[u8]| -> Result<usize, StoreError> {
        let mut store = ContourStore::open(Cut::new(&path, left)).unwrap();
        block_on(store.begin(bytes.len() as u32, checksum(bytes)))?;
        bytes.chunks(CONTOUR_PIECE).try_for_each(|piece| block_on(store.write(piece)))?;
        block_on(store.finish())?;
        Ok(store.into_flash().written)
    };
    let (old, new) = (vec![1; 1500], vec![2; 1100]);
    write(usize::MAX, &old).unwrap();
    let before = std::fs::read(&path).unwrap();
    let work = write(usize::MAX, &new).unwrap();
    for left in (0..work).step_by(2003).chain(work - 1200..work) {
        std::fs::write(&path, &before).unwrap();
        assert!(write(left, &new).is_err(), "{left}");
        let mut store = ContourStore::open(FlashFile::open(&path).unwrap()).unwrap();
        let mut room = [0; 2000];
        let found = store.read(0, &mut room).unwrap();
        // The end of its header is that of an erased one.
        assert!(!store.is_damaged() && (found == old || work - left <= 12 && found == new), "{left}");
    }
}

#[test]
fn what_is_no_flash_is_refused() {
    let folder = folder();
    let path = folder.path().join("flash.bin");
    let flash = FlashFile::open(&path).unwrap();
    assert!(matches!(FlashFile::open(&path), Err(FlashFileError::Taken { .. })));
    drop(flash);
    assert_eq!(std::fs::read(&path).unwrap(), vec![0xFF; 2 * PAGE]);
    std::fs::write(&path, [0; 100]).unwrap();
    assert!(matches!(FlashFile::open(&path), Err(FlashFileError::Size { found: 100, .. })));
    assert!(matches!(FlashFile::open(folder.path()), Err(FlashFileError::Io { .. })));
}
