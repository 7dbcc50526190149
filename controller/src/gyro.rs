//! The gyro on the bus, of a vehicle that has one.

use agv_core::measurement::{GyroSample, Time};
use agv_settings::{GyroConnection, Settings};
use agv_wire::can::frame::{Frame, Id};
use agv_wire::can::gyro;

/// The gyro of the settings, if there is one.
#[derive(Clone, Copy, Debug)]
pub struct Gyro {
    /// Whether there is one, wherever it is.
    pub is_there: bool,
    on_bus: Option<(Id, gyro::Gyro)>,
}

impl Gyro {
    /// That of a vehicle that is set up.
    #[must_use]
    pub fn of(settings: &Settings) -> Self {
        let is_there = settings.parameters.gyro.is_fitted && settings.parameters.sources.gyro;
        let is_on_bus = is_there && settings.gyro_connection == GyroConnection::Can;
        let frame = &settings.gyro_frame;
        Self { is_there, on_bus: is_on_bus.then(|| (frame.id(), gyro::Gyro::new(frame))) }
    }

    /// Identifier of its frames, if it is on the bus.
    #[must_use]
    pub fn id(&self) -> Option<Id> {
        self.on_bus.map(|(id, _)| id)
    }

    /// Takes a frame that came at `heard`.
    #[must_use]
    pub fn hear(&self, frame: &Frame, heard: Time) -> Option<GyroSample> {
        let (_, gyro) = &self.on_bus?;
        gyro.handle(frame, heard)
    }
}
