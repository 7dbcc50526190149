//! Counters that count wrongly by a rule.

use agv_core::odometry::{Counted, Counter};
use agv_host_sim::simulate::random::Random;
use serde::{Deserialize, Serialize};

use super::measured::shifted;

/// Which counter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Encoder {
    /// That of the driving wheel.
    Drive,
    /// That of the steering.
    Steering,
}

/// How it counts wrongly.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CountError {
    /// Steps are too large by that share after two minutes, and in proportion before: a driving wheel that wears.
    Wears,
    /// The steering is off by so many degrees after two minutes, and in proportion before.
    Creeps,
    /// Steps forward lose that share.
    Forward,
    /// Steps backward lose that share.
    Backward,
    /// That share of the steps backward counts forward: a single track.
    BackwardsForward,
    /// The driving wheel counts so many metres a second while it stands: an edge that trembles.
    AtRest,
    /// It shows a new value each so many seconds.
    Holds,
    /// That share of its values is nought.
    Zero,
    /// The steering's follows only where the shaft has turned by more than so many degrees: play.
    Play,
    /// The steering is off by so many degrees times the sine of the angle: a magnet beside the axis.
    Eccentric,
    /// All steps lose that share: a coupling that slips.
    Slips,
}

/// How long wear and creep take, s.
pub(super) const SLOWLY: f64 = 120.0;
/// Phase of an encoder beside its axis, rad.
const PHASE: f64 = 0.7;

/// What such a fault remembers of one counter.
#[derive(Default)]
pub(super) struct CountState {
    before: Option<(f64, u32)>,
    /// What it has too much, ticks.
    extra: f64,
    shown: Option<(f64, u32)>,
    /// Where the play has it, ticks beside the shaft.
    play: f64,
}

impl CountState {
    /// The fault is over, or has not begun: what was counted too much stays, but where a steering is, which tells an angle.
    pub(super) fn go_on(&self, count: &mut u32, counter: &Counter) {
        if counter.counted == Counted::Turn {
            *count = shifted(*count, libm::round(self.extra) as i64, counter.range);
        }
    }
}

impl CountError {
    /// Makes a count wrong, `time` s after the vehicle drove off; `grown` is how much of what comes slowly is there. `angle` is that of the steering, rad.
    pub(super) fn spoil(
        self,
        size: f64,
        count: &mut u32,
        (time, grown): (f64, f64),
        (counter, angle): (&Counter, f64),
        state: &mut CountState,
        random: &mut Random,
    ) {
        let (moved, passed) =
            state.before.map_or((0.0, 0.0), |(at, before)| (counter.range.step(before, *count) as f64, time - at));
        state.before = Some((time, *count));
        let in_ticks = |degrees: f64| degrees.to_radians() / counter.scale;
        let shaft = *count;
        let with = |ticks: f64| shifted(shaft, libm::round(ticks) as i64, counter.range);
        state.extra += match self {
            Self::Wears => size * grown * moved,
            Self::Forward => -size * moved.max(0.0),
            Self::Backward => -size * moved.min(0.0),
            Self::BackwardsForward => -2.0 * size * moved.min(0.0),
            Self::AtRest if moved == 0.0 => size * passed / counter.scale,
            Self::Slips => -size * moved,
            _ => 0.0,
        };
        *count = match self {
            Self::Creeps => with(in_ticks(size * grown)),
            Self::Eccentric => with(in_ticks(size * libm::sin(angle + PHASE))),
            Self::Play => {
                let half = 0.5 * libm::fabs(in_ticks(size));
                state.play = (state.play - moved).clamp(-half, half);
                with(state.play)
            }
            Self::Holds => {
                let is_new = state.shown.is_none_or(|(at, _)| time - at >= size);
                let shown = if is_new { (time, *count) } else { state.shown.unwrap_or((time, *count)) };
                state.shown = Some(shown);
                shown.1
            }
            Self::Zero if random.happens(size) => 0,
            _ => with(state.extra),
        };
    }
}
