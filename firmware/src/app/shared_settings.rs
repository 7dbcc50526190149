//! Settings that masters of the bus read and change, and their way to the flash.

use agv_controller::{ChangeableSettings, SettingObjects};
use agv_settings::Settings;
use agv_settings::patient_flash::PatientFlash;
use agv_settings::service::Controller;
use agv_settings::store::{Store, StoreError};
use agv_wire::can::controller_node::CommunicationParameters;
use agv_wire::can::sdo::{AbortCode, Object, ObjectDictionary, ValueBytes};

use super::exchange;
use super::service::SharedController;

/// The settings of the service port. While that is busy with them, as when it writes flash, they are not served.
pub struct SharedSettings<'a, F: PatientFlash> {
    /// What both ports speak of.
    pub controller: &'a SharedController<F>,
}

impl<F: PatientFlash> ObjectDictionary for SharedSettings<'_, F> {
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

/// Stores the settings, and how the controller speaks on the bus, whenever somebody there wants it.
pub async fn keep<F: PatientFlash>(controller: &SharedController<F>) -> ! {
    loop {
        let parameters = exchange::save_wanted().await;
        let mut controller = controller.lock().await;
        let Controller { settings, store, .. } = &mut *controller;
        let is_stored = store_all(store.as_mut(), settings, &parameters).await.is_ok();
        if !is_stored {
            defmt::error!("settings: they cannot be stored");
        }
        exchange::tell_saved(is_stored);
    }
}

async fn store_all<F: PatientFlash>(
    store: Option<&mut Store<F>>,
    settings: &Settings,
    parameters: &CommunicationParameters,
) -> Result<(), StoreError> {
    let store = store.ok_or(StoreError::Flash)?;
    store.store_leaves(settings).await?;
    store.store_communication(parameters).await
}
