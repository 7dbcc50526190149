//! Times of the frames of a log: as written, or summed up where each is the time since the frame before, and going on where the
//! clock of the host was set.

use agv_core::measurement::Time;

use super::candump::SeenFrame;
use crate::account::Account;

/// A clock that runs since the host was started, or since the log began, shows less than this, s; one that tells the date shows more.
const LONGEST_RUN: f64 = 1e8;
/// Frames of two interfaces come out of order by less than this, s; a clock that goes back by more was set.
const OUT_OF_ORDER: f64 = 0.02;
/// In a log of differences at least this share of the frames has a smaller one than the frame before, or the same.
const FALLING: f64 = 0.1;
/// Frames that bear one time, or less than that many, prove nothing.
const FEW: usize = 4;

/// The frames in order of time. `is_relative` is what the file says of its times.
pub(super) fn settle(mut frames: Vec<(usize, SeenFrame)>, is_relative: bool, account: &mut Account) -> Vec<SeenFrame> {
    if is_relative || are_differences(&frames) {
        sum_up(&mut frames);
        account.note("times are those since the frame before: they were summed up");
    }
    go_on(&mut frames, account);
    let mut frames: Vec<SeenFrame> = frames.into_iter().map(|(_, seen)| seen).collect();
    frames.sort_by_key(|seen| seen.time);
    frames
}

fn seconds(frame: &(usize, SeenFrame)) -> f64 {
    frame.1.time.unwrap_or_default().seconds()
}

/// Whether the times cannot be those of one clock, but those of `candump -td`: they fall and rise all the time, or are all the
/// same.
fn are_differences(frames: &[(usize, SeenFrame)]) -> bool {
    if frames.len() < FEW || frames.iter().any(|frame| seconds(frame) > LONGEST_RUN) {
        return false;
    }
    let steps = frames.len() - 1;
    let falling = frames.windows(2).filter(|pair| seconds(&pair[1]) < seconds(&pair[0])).count();
    let equal = frames.windows(2).skip(1).filter(|pair| seconds(&pair[1]) == seconds(&pair[0])).count();
    let is_still =
        equal + 1 >= steps && seconds(&frames[0]) == 0.0 && frames.last().is_some_and(|last| seconds(last) > 0.0);
    falling as f64 > FALLING * steps as f64 || is_still
}

fn sum_up(frames: &mut [(usize, SeenFrame)]) {
    let mut sum = 0_u64;
    for (_, seen) in frames {
        sum = sum.saturating_add(seen.time.unwrap_or_default().micros());
        seen.time = Some(Time::from_micros(sum));
    }
}

/// Where a clock was set back, times behind it go on by the usual step.
fn go_on(frames: &mut [(usize, SeenFrame)], account: &mut Account) {
    let mut steps: Vec<f64> = frames.windows(2).map(|pair| seconds(&pair[1]) - seconds(&pair[0])).collect();
    steps.retain(|step| *step >= 0.0);
    steps.sort_by(f64::total_cmp);
    let usual = steps.get(steps.len() / 2).copied().unwrap_or_default();
    let mut shift = 0.0;
    let mut latest: Option<(f64, f64)> = None;
    for frame in frames {
        let written = seconds(frame);
        if let Some((before, shown)) = latest
            && written < before - OUT_OF_ORDER
        {
            let back = before - written;
            account.warn(format!(
                "the clock of the host was set back by {back:.3} s before line {}: the times behind it go on from there",
                frame.0
            ));
            shift = shown + usual - written;
            latest = None;
        }
        let shown = written + shift;
        frame.1.time = Some(if shift == 0.0 { frame.1.time.unwrap_or_default() } else { Time::from_seconds(shown) });
        if latest.is_none_or(|(before, _)| written > before) {
            latest = Some((written, shown));
        }
    }
}
