//! What the tests of several crates need: recordings of others, programs of others, the images of the boards, and a word
//! about every test for which one of them is missing.

pub mod busy_board;
mod covered;
mod programs;
mod real_time;
mod skip;
#[cfg(target_os = "linux")]
pub mod user_mode_linux;

use std::path::{Path, PathBuf};

pub use covered::{covered, logs, short_ring};
pub use programs::{agv, emulator, image, is_on_path, python};
pub use real_time::{faults, heard_in_time, is_fair, sound_drive};
pub use skip::{no_kernel, skip, too_busy};

/// A path in the repository.
#[must_use]
pub fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

/// A file or folder of the real recordings; an empty name is the folder of all. Where it is absent, `test` is skipped.
#[must_use]
pub fn recordings(test: &str, name: &str) -> Option<PathBuf> {
    let found = agv_host_sim::data::folder().map(|folder| folder.join(name)).filter(|path| path.exists());
    if found.is_none() {
        skip(test, &format!("there is no {name} in the folder of real data (AGV_DATA)"));
    }
    found
}
