//! What the tests of several crates need: recordings of others, programs of others, the images of the boards, and a word
//! about every test for which one of them is missing.

mod programs;
mod skip;

use std::path::{Path, PathBuf};
use std::time::Duration;

use agv_host_sim::emulate::vehicle::{Driven, HeardEmergency};

pub use programs::{agv, emulator, image, is_on_path, python};
pub use skip::{skip, too_busy};

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

/// While the encoders are set up, from the beginning of the drive on.
const SETTING_UP: Duration = Duration::from_secs(2);

/// Emergencies that tell of a fault. The encoders are set up when the drive begins; a controller that has waited for them longer than
/// 2 s says so (7305h, 7306h), and takes it back.
#[must_use]
pub fn faults(driven: &Driven) -> Vec<&HeardEmergency> {
    let until = driven.begin + SETTING_UP;
    let is_early = |heard: &HeardEmergency| heard.heard < until && matches!(heard.emergency.code, 0x7305 | 0x7306);
    driven.emergencies.iter().filter(|heard| heard.emergency.code != 0 && !is_early(heard)).collect()
}
