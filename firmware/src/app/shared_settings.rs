//! Settings that masters of the bus read and change, and their way to the flash.

use agv_controller::{ChangeableSettings, SettingObjects};
use agv_settings::service::Controller;
use agv_wire::can::sdo::{AbortCode, Object, ObjectDictionary, ValueBytes};
use embedded_storage::nor_flash::NorFlash;

use super::exchange;
use super::service::SharedController;

/// The settings of the service port. While that is busy with them, as when it writes flash, they are not served.
pub struct SharedSettings<'a, F: NorFlash> {
    /// What both ports speak of.
    pub controller: &'a SharedController<F>,
}

impl<F: NorFlash> ObjectDictionary for SharedSettings<'_, F> {
    fn read(&self, object: Object) -> Result<ValueBytes, AbortCode> {
        let controller = self.controller.try_lock().map_err(|_| AbortCode::DeviceState)?;
        SettingObjects::new(&controller.settings).read(object)
    }

    fn writable(&self, object: Object) -> Result<usize, AbortCode> {
        let mut controller = self.controller.try_lock().map_err(|_| AbortCode::DeviceState)?;
        ChangeableSettings::new(&mut controller.settings).writable(object)
    }

    fn write(&mut self, object: Object, bytes: &[u8]) -> Result<(), AbortCode> {
        let mut controller = self.controller.try_lock().map_err(|_| AbortCode::DeviceState)?;
        ChangeableSettings::new(&mut controller.settings).write(object, bytes)
    }
}

/// Stores the settings whenever somebody on the bus wants it.
pub async fn keep<F: NorFlash>(controller: &SharedController<F>) -> ! {
    loop {
        exchange::save_wanted().await;
        let mut controller = controller.lock().await;
        let Controller { settings, store, .. } = &mut *controller;
        let is_kept = store.as_mut().is_some_and(|store| store.store_leaves(settings).is_ok());
        if !is_kept {
            defmt::error!("settings: they cannot be stored");
            exchange::saving_has_failed();
        }
    }
}
