//! What the flash tells at the start.

use agv_core::maps::{Landmark, put_reflectors_first};
use agv_settings::Settings;
use agv_settings::contour_store::ContourStore;
use agv_settings::patient_flash::PatientFlash;
use agv_settings::service::Controller;
use agv_settings::store::{LANDMARKS, Store};
use agv_wire::can::controller_node::CommunicationParameters;
use heapless::Vec;

use super::exchange;
use super::log_stream::SOFTWARE;

/// The map as the flash keeps it.
pub type KeptMap = Vec<Landmark, LANDMARKS>;

/// Reads settings and maps, and makes what the service port speaks of. What is wrong is logged; the settings that cannot
/// be read are the default ones. `has_slots` says whether there is room for `maps.slam`.
#[must_use]
#[inline(never)]
pub fn read<F: PatientFlash>(
    flash: F,
    contour_flash: Option<F>,
    map: &'static mut KeptMap,
    panic: &'static str,
    has_slots: bool,
) -> Controller<F> {
    let mut settings = Settings::default();
    let mut store = Store::new(flash);
    let mut key = None;
    if let Some(store) = &mut store {
        match store.load(&mut settings, map) {
            Ok(loaded) => {
                let is_sound = loaded.bad == 0
                    && loaded.contradiction.is_none()
                    && !loaded.was_formatted
                    && !loaded.is_map_damaged;
                exchange::set_settings_sound(is_sound);
                defmt::info!("settings: {} read, {} landmarks", loaded.leaves, map.len());
                if loaded.bad > 0 {
                    defmt::error!("settings: {} are bad and left at their defaults", loaded.bad);
                }
                if let Some(leaf) = loaded.contradiction {
                    defmt::error!("settings: {} does not go with the others and is left at its default", leaf);
                }
                if loaded.was_formatted {
                    defmt::error!("settings: the flash held rubbish and was erased");
                }
                if loaded.is_map_damaged {
                    defmt::error!("settings: the map is damaged and was left out");
                }
            }
            Err(_) => {
                exchange::set_settings_sound(false);
                defmt::error!("settings: the flash cannot be read");
            }
        }
        key = store.key();
    }
    put_reflectors_first(map);
    if !settings.accepts_map(map) {
        exchange::set_settings_sound(false);
        defmt::error!("settings: the map is not that of maps.identity and was left out");
        map.clear();
    }
    if settings.parameters.maps.slam && !has_slots {
        exchange::set_settings_sound(false);
        defmt::error!("settings: maps.slam is switched off, because this image has no room for it");
        settings.parameters.maps.slam = false;
    }
    let contours = contour_flash.and_then(ContourStore::open);
    if let Some(found) = contours.as_ref().and_then(ContourStore::found) {
        defmt::info!("settings: a map of contours of {} bytes", found.length);
    }
    if contours.as_ref().is_some_and(ContourStore::is_damaged) {
        exchange::set_settings_sound(false);
        defmt::error!("settings: the map of contours is damaged and was left out");
    }
    if !panic.is_empty() {
        defmt::error!("before this start: {}", panic);
    }
    Controller {
        software: SOFTWARE,
        settings,
        store,
        landmarks: map,
        key,
        starts: 0,
        nonces: 0,
        panic,
        map: None,
        contours,
    }
}

/// How the controller shall speak on the bus, if somebody has had that stored. What is wrong is logged.
#[must_use]
pub fn communication<F: PatientFlash>(controller: &mut Controller<F>) -> Option<CommunicationParameters> {
    let stored = controller.store.as_mut()?.communication();
    if stored.is_err() {
        exchange::set_settings_sound(false);
        defmt::error!("settings: how to speak on the bus is damaged and left at its default");
    }
    stored.ok().flatten()
}

/// Counts this start. When the page is full, this takes as long as a page of flash takes to erase.
pub async fn count_start<F: PatientFlash>(controller: &mut Controller<F>) {
    if let Some(store) = &mut controller.store {
        controller.starts = store.count_start().await.unwrap_or(0);
    }
}
