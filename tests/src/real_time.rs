//! Drives in real time, on a machine that may be busy.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::time::Duration;

use agv_host_sim::emulate::vehicle::{Driven, HeardEmergency, HeardPose};
use agv_settings::Settings;

use crate::too_busy;

/// While the encoders are set up, from the beginning of the drive on.
const SETTING_UP: Duration = Duration::from_secs(2);

/// A machine that keeps encoders and board waiting for longer in all is too busy for a fair drive, s: encoders are nearly late by then.
const LONGEST_WAIT: f64 = 0.012;
/// One that keeps them waiting for longer in each of several drives is too busy for any, s.
const HOPELESS_WAIT: f64 = 0.04;
/// A laser that the machine serves later than this, s, may be silent: it is so 75 ms after a revolution should have come.
const LONGEST_LASER_DELAY: f64 = 0.05;

/// Drives before a test is given up.
const TRIES: usize = 5;

/// How long the machine kept encoders and board waiting in all, s.
///
/// The board is seen to wait by the threads of its emulator, where the system counts that, by its poses, which come as often as by default, and
/// by what its driver answers late.
fn waited(driven: &Driven) -> f64 {
    let mut heard = driven.poses.iter().map(|pose| pose.heard).filter(|heard| *heard > driven.begin).peekable();
    let mut gap = 0.0_f64;
    while let (Some(one), Some(next)) = (heard.next(), heard.peek()) {
        gap = gap.max((*next - one).as_secs_f64());
    }
    let period = 1e-3 * f64::from(Settings::default().publishing_period);
    let line = driven.line_delays.iter().map(|line| line.delay.as_secs_f64()).fold(0.0, f64::max);
    line.max(driven.longest_stall + driven.longest_delay.max(gap - period))
}

/// Whether neither the encoders, nor the laser, nor the board was kept waiting by the machine: the board hears them late otherwise, and
/// says so.
#[must_use]
pub fn is_fair(driven: &Driven) -> bool {
    let (waited, laser) = (waited(driven), driven.longest_laser_delay);
    println!("encoders and board waited for {waited:.3} s, the laser was late by {laser:.3} s");
    waited < LONGEST_WAIT && laser < LONGEST_LASER_DELAY
}

/// A line that holds samples back for longer makes encoders late at 2.5 periods of 10 ms: one period is between two samples, and half of
/// one between two trials of the line.
const LONGEST_LINE_DELAY: Duration = Duration::from_millis(10);
/// A fault lasts for 20 periods of sound readings, and is on the bus in the next pose; then the localiser has gone on for ten.
const RECOVERY: Duration = Duration::from_millis(300);

/// Poses of the drive that were heard while the emulated line was in time, and had been for as long as late encoders are remembered.
#[must_use]
pub fn heard_in_time(driven: &Driven) -> Vec<&HeardPose> {
    let late: Vec<_> = driven.line_delays.iter().filter(|line| line.delay > LONGEST_LINE_DELAY).collect();
    let longest = late.iter().map(|line| line.delay).max().unwrap_or_default();
    println!("the line was late {} times, by up to {longest:?}", late.len());
    let is_in_time = |heard: &&HeardPose| {
        heard.heard > driven.begin
            && late.iter().all(|line| heard.heard < line.due || heard.heard > line.due + line.delay + RECOVERY)
    };
    driven.poses.iter().filter(is_in_time).collect()
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

/// A drive that `judge` finds as it ought to be. One that it does not, by a panic, is a defect if the machine had time for it; if not,
/// another is tried. None, and a word about it, if the machine had no time for any; that all are wrong without that is a defect, too.
///
/// # Panics
/// With what `judge` said of the drive that is a defect.
pub fn sound_drive<T>(
    test: &str,
    mut drive: impl FnMut() -> T,
    driven: impl Fn(&T) -> &Driven,
    judge: impl Fn(&T),
) -> Option<T> {
    let mut is_hopeless = true;
    let mut last = None;
    for _ in 0..TRIES {
        let one = drive();
        let Err(said) = catch_unwind(AssertUnwindSafe(|| judge(&one))) else { return Some(one) };
        if is_fair(driven(&one)) {
            resume_unwind(said);
        }
        is_hopeless &= waited(driven(&one)) > HOPELESS_WAIT || driven(&one).longest_laser_delay > LONGEST_LASER_DELAY;
        last = Some(said);
    }
    if let Some(said) = last.filter(|_| !is_hopeless) {
        resume_unwind(said);
    }
    too_busy(test);
    None
}
