//! A layout that another command takes: what is doubtful in its file is said on standard error.

use std::path::Path;

use agv_host_sim::layout_file::{self, LoadedLayout, Reading};
use agv_host_sim::text_file::TextFileError;
use agv_wire::nav350::IdentifiedLandmark;

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
