//! Where recordings of others are kept.

use std::path::PathBuf;

/// The folder of real recordings: the environment variable `AGV_DATA`, else `../shared/data` beside the repository.
/// None if neither exists.
#[must_use]
pub fn folder() -> Option<PathBuf> {
    let candidates = std::env::var_os("AGV_DATA").map(PathBuf::from).into_iter().chain([
        PathBuf::from("../shared/data"),
        PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data")),
    ]);
    candidates.into_iter().find(|folder| folder.is_dir())
}
