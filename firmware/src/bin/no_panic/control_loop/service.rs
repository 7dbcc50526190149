//! The service port: frames, requests, authentication and settings, up to the flash.

use core::hint::black_box;

use agv_core::measurement::Time;
use agv_settings::Settings;
use agv_settings::service::{Answer, Controller, Frames, LONGEST_MESSAGE, Session, answer_kept};
use agv_settings::store::StoreError;
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};

use super::any;

/// No flash: only a vehicle that stands writes to it.
enum NoFlash {}

impl ErrorType for NoFlash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for NoFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, _: u32, _: &mut [u8]) -> Result<(), Self::Error> {
        match *self {}
    }

    fn capacity(&self) -> usize {
        match *self {}
    }
}

impl NorFlash for NoFlash {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = 1;

    fn erase(&mut self, _: u32, _: u32) -> Result<(), Self::Error> {
        match *self {}
    }

    fn write(&mut self, _: u32, _: &[u8]) -> Result<(), Self::Error> {
        match *self {}
    }
}

/// One connection.
pub struct Service {
    frames: Frames,
    session: Session,
    controller: Controller<NoFlash>,
    room: [u8; LONGEST_MESSAGE],
}

impl Service {
    pub fn new() -> Self {
        let controller = Controller {
            software: any(""),
            settings: any(Settings::default()),
            store: None,
            landmarks: any(&[]),
            key: any(Some([0; 32])),
            starts: any(0),
            nonces: any(0),
            panic: any(""),
            contours: None,
            map: None,
        };
        Self { frames: Frames::new(), session: Session::new(), controller, room: [0; LONGEST_MESSAGE] }
    }

    /// Some bytes, and the answer to what they complete.
    pub fn step(&mut self) {
        let Self { frames, session, controller, room } = self;
        let bytes = any([0; 64]);
        let Ok((taken, is_whole)) = frames.push(bytes.get(..any(64)).unwrap_or_default()) else { return };
        black_box(taken);
        if is_whole {
            let (is_standing, time) = (any(true), any(Time::default()));
            let answer = session.decide(frames.message(), controller, is_standing, time, room);
            if black_box(matches!(answer, Ok(Answer::ToKeep(_)))) {
                let _ = black_box(answer_kept(any(Err(StoreError::Flash)), room));
            }
            frames.clear();
        }
    }
}
