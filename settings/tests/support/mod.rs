//! Flash that loses its power.
#![allow(dead_code, reason = "each test uses its part")]

use agv_core::maps::{Landmark, LandmarkKind};
use agv_settings::store::{LANDMARKS, Loaded, Store};
use agv_settings::{LEAVES, Settings, VehicleKind, block_on};
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

/// Bytes of a word, which can be written once after each erasure, as the STM32H743 has it.
pub const WORD: usize = 32;

/// What a word reads as in whose middle the power went.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Torn {
    /// As half of it.
    Half,
    /// As zeros, as the boards read a word with a double error.
    Zeros,
}

/// Two pages of flash.
#[derive(Clone)]
pub struct Flash<const PAGE: usize> {
    pub bytes: Vec<u8>,
    is_written: Vec<bool>,
    /// Words and erasures until the power goes, in the middle of one.
    pub power: Option<usize>,
    pub torn: Torn,
    pub work: usize,
    /// How often it was read.
    pub reads: usize,
    /// It held what no storage has written.
    was_rubbish: bool,
}

#[derive(Debug, PartialEq)]
pub struct Refused(NorFlashErrorKind);

impl NorFlashError for Refused {
    fn kind(&self) -> NorFlashErrorKind {
        self.0
    }
}

impl<const PAGE: usize> Flash<PAGE> {
    pub fn new() -> Self {
        Self {
            bytes: vec![0xFF; 2 * PAGE],
            is_written: vec![false; 2 * PAGE / WORD],
            power: None,
            torn: Torn::Half,
            work: 0,
            reads: 0,
            was_rubbish: false,
        }
    }

    pub fn filled(bytes: Vec<u8>) -> Self {
        assert_eq!(bytes.len(), 2 * PAGE);
        let is_written = bytes.chunks(WORD).map(|word| word.iter().any(|byte| *byte != 0xFF)).collect();
        Self { is_written, bytes, power: None, torn: Torn::Half, work: 0, reads: 0, was_rubbish: true }
    }

    /// Whether the power lasts for a piece of work. The one in which it goes is half done.
    fn has_power(&mut self) -> Result<bool, Refused> {
        self.work += 1;
        match &mut self.power {
            None => Ok(true),
            Some(0) => Err(Refused(NorFlashErrorKind::Other)),
            Some(rest) => {
                *rest -= 1;
                Ok(*rest > 0)
            }
        }
    }
}

impl<const PAGE: usize> ErrorType for Flash<PAGE> {
    type Error = Refused;
}

impl<const PAGE: usize> ReadNorFlash for Flash<PAGE> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Refused> {
        check_read(self, offset, bytes.len()).map_err(Refused)?;
        self.reads += 1;
        bytes.copy_from_slice(&self.bytes[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl<const PAGE: usize> NorFlash for Flash<PAGE> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Refused> {
        check_erase(self, from, to).map_err(Refused)?;
        for page in from as usize / PAGE..to as usize / PAGE {
            let whole = self.has_power()?;
            let end = if whole { PAGE } else { PAGE / 2 / WORD * WORD };
            self.bytes[page * PAGE..][..end].fill(0xFF);
            self.is_written[page * PAGE / WORD..][..end / WORD].fill(false);
            if !whole {
                return Err(Refused(NorFlashErrorKind::Other));
            }
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refused> {
        check_write(self, offset, bytes.len()).map_err(Refused)?;
        for (number, word) in bytes.chunks(WORD).enumerate() {
            let whole = self.has_power()?;
            let place = offset as usize / WORD + number;
            // A word over one that was written has wrong check bits on that flash.
            if std::mem::replace(&mut self.is_written[place], true) {
                assert!(self.was_rubbish, "word {place} is written twice");
                return Err(Refused(NorFlashErrorKind::Other));
            }
            let count = if whole { WORD } else { WORD / 2 };
            let stored = &mut self.bytes[place * WORD..][..WORD];
            stored[..count].copy_from_slice(&word[..count]);
            if !whole && self.torn == Torn::Zeros {
                stored.fill(0);
            }
            if !whole {
                return Err(Refused(NorFlashErrorKind::Other));
            }
        }
        Ok(())
    }
}

/// What a controller finds at its start.
pub fn load<const PAGE: usize>(store: &mut Store<Flash<PAGE>>) -> (Settings, Vec<Landmark>, Loaded) {
    let mut settings = Settings::default();
    let mut landmarks = heapless::Vec::<Landmark, LANDMARKS>::new();
    let loaded = store.load(&mut settings, &mut landmarks).unwrap();
    (settings, landmarks.to_vec(), loaded)
}

/// Settings of which every number is another than by default.
pub fn changed(share: f64) -> Settings {
    use agv_settings::leaf::Value;
    let mut settings = Settings::default();
    for leaf in &LEAVES {
        let (least, most) = leaf.bounds;
        // Settings of any two shares go together.
        let share = if leaf.name == "features.nearest" { 0.1 * share } else { share };
        let near = |first: f64| Value::Whole((first + 8.0 * share) as u64);
        let value = match leaf.value(&settings) {
            Value::Whole(_) if leaf.name == "vehicle.kind" => {
                Value::Whole(if share < 0.5 { VehicleKind::Differential } else { VehicleKind::Mecanum } as u64)
            }
            // No two nodes are the same.
            Value::Whole(_) if leaf.name == "can.controller_node" => near(30.0),
            Value::Whole(_) if leaf.name == "can.drive_node" => near(40.0),
            Value::Whole(_) if leaf.name == "can.steering_node" => near(50.0),
            Value::Whole(_) if leaf.name == "can.third_node" => near(60.0),
            Value::Whole(_) if leaf.name == "can.fourth_node" => near(70.0),
            // There are five bit rates, and on the lower ones there is no room for everything.
            Value::Whole(_) if leaf.name == "can.bit_rate" => Value::Whole(if share < 0.5 { 800 } else { 1000 }),
            Value::Whole(_) if leaf.name.ends_with("_profile") => Value::Whole(402),
            // Another one than by default, which is the first.
            Value::Whole(0) if !leaf.choices.is_empty() => Value::Whole(1 + (share * (most - 1.0)) as u64),
            Value::Number(_) => Value::Number(least + share * (most - least)),
            Value::Whole(_) => Value::Whole((least + share * (most - least)) as u64),
            Value::Switch(is_on) => Value::Switch(is_on == (share < 0.5)),
            Value::Address(_) => Value::Address([10, 0, 0, (255.0 * share) as u8]),
        };
        leaf.set(&mut settings, value).unwrap();
    }
    settings
}

pub fn map(count: u16, shift: f64) -> Vec<Landmark> {
    let landmark = |id: u16| Landmark {
        id,
        kind: LandmarkKind::Reflector,
        x: f64::from(id) + shift,
        y: -0.1 * f64::from(id),
        deviation: 0.005,
    };
    (0..count).map(landmark).collect()
}

pub fn write_map<const PAGE: usize>(
    store: &mut Store<Flash<PAGE>>,
    map: &[Landmark],
) -> Result<(), agv_settings::store::StoreError> {
    let mut writer = block_on(store.begin_map(map.len() as u16))?;
    for piece in map.chunks(agv_settings::store::PIECE) {
        block_on(store.write_piece(&mut writer, piece))?;
    }
    block_on(store.finish_map(&writer))
}
