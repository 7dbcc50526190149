//! What the tests of several crates need: recordings of others, programs of others, the images of the boards, and a word
//! about every test for which one of them is missing.

pub mod busy_board;
mod programs;
mod skip;
#[cfg(target_os = "linux")]
pub mod user_mode_linux;

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

/// A machine that keeps the encoders waiting and the emulator from a core, within a fiftieth of a second, for longer than this in all is too
/// busy for a fair drive, s: encoders are nearly late by then.
const LONGEST_WAIT: f64 = 0.012;
/// So is one that keeps the emulated board waiting for longer, which is silent meanwhile, s.
const LONGEST_GAP: f64 = 0.04;

/// So is one that sends what the laser saw later than this, s: it is silent 75 ms after a revolution should have come.
const LONGEST_LASER_DELAY: f64 = 0.05;

/// Whether neither the encoders, nor the laser, nor the board was kept waiting by the machine: the board hears them late otherwise, and
/// says so.
#[must_use]
pub fn is_fair(driven: &Driven) -> bool {
    let mut heard = driven.poses.iter().map(|pose| pose.heard).filter(|heard| *heard > driven.begin).peekable();
    let mut gap = 0.0_f64;
    while let (Some(one), Some(next)) = (heard.next(), heard.peek()) {
        gap = gap.max((*next - one).as_secs_f64());
    }
    let Driven { longest_stall: stall, longest_delay: delay, longest_laser_delay: laser, .. } = *driven;
    println!(
        "longest stall {stall:.3} s, longest delay {delay:.3} s, longest gap {gap:.3} s, laser late by {laser:.3} s"
    );
    stall + delay < LONGEST_WAIT && gap < LONGEST_GAP && laser < LONGEST_LASER_DELAY
}

/// Emergencies that tell of a fault. Late encoders (7305h, 7306h) and a late laser (7300h) are none on a drive that was not fair, nor are
/// encoders while they are set up, when the drive begins.
#[must_use]
pub fn faults(driven: &Driven) -> Vec<&HeardEmergency> {
    let until = driven.begin + SETTING_UP;
    let is_fair = is_fair(driven);
    let is_machine = |heard: &HeardEmergency| match heard.emergency.code {
        0x7305 | 0x7306 => !is_fair || heard.heard < until,
        0x7300 => !is_fair,
        _ => false,
    };
    driven.emergencies.iter().filter(|heard| heard.emergency.code != 0 && !is_machine(heard)).collect()
}
