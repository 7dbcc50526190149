//! A layout or a map that another command takes: what is doubtful in its file is said on standard error.

use std::path::Path;

use agv_core::maps::Landmark;
use agv_host_sim::layout_file::{self, LoadedLayout, Reading};
use agv_host_sim::mapping::map_file;
use agv_host_sim::text_file::TextFileError;
use agv_wire::nav350::IdentifiedLandmark;
use anyhow::ensure;

use super::import_summary;

/// The landmarks of a layout.
pub fn load(path: &Path) -> Result<Vec<IdentifiedLandmark>, TextFileError> {
    load_whole(path).map(|loaded| loaded.landmarks)
}

/// A layout with what is drawn beside its landmarks.
pub fn load_whole(path: &Path) -> Result<LoadedLayout, TextFileError> {
    let loaded = layout_file::load_as(path, &Reading::default())?;
    import_summary::complain(path, &loaded.account.warnings());
    Ok(loaded)
}

/// The landmarks of a controller's map: of a map of this program all kinds, else the reflectors of a layout.
pub fn load_map(path: &Path) -> anyhow::Result<Vec<Landmark>> {
    let landmarks = if map_file::is_map(path) { map_file::read(path)? } else { layout_file::landmarks(&load(path)?) };
    ensure!(!landmarks.is_empty(), "{}: there are no landmarks in the map", path.display());
    Ok(landmarks)
}
