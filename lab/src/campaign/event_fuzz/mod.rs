//! The localiser under any sequence of events: what it says must hold, whatever it is told.
//!
//! An episode is a vehicle with drawn parameters and maps in a small hall, and some hundred events: of a plausible drive,
//! and of what sensors, clocks and wires make of one. After each event the outputs are held against what must always hold.
//! The same seed gives the same events everywhere.

mod check;
mod dice;
mod drive;
mod setup;

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Once;

use agv_core::filter::{PoseAndSlots, packed_entries, slot_states};
use agv_core::localizer::{self, CapacitiesOf};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

pub use check::violation;

use dice::{Dice, Source};
use drive::{Drive, Lists};

const KEYS: usize = 2;
const LANDMARKS: usize = 8;
const STATES: usize = slot_states(KEYS, LANDMARKS);
type Slots = PoseAndSlots<KEYS, LANDMARKS, STATES, { packed_entries(STATES) }>;

/// A localiser with so little room that all of it is filled.
pub type SmallLocalizer = localizer::Localizer<CapacitiesOf<512, 40, 40, 16, Slots>>;

/// Events of an episode at the most.
const EPISODE: u64 = 500;

/// Something that does not hold.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// Seed of the run.
    pub seed: u64,
    /// Episode of the run, from 0.
    pub episode: u64,
    /// Event of the episode, from 0.
    pub event: u64,
    /// What does not hold, and after which event.
    pub what: String,
}

/// What a run has shown.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Verdict {
    /// Events that the localiser was told.
    pub events: u64,
    /// After how many events the localiser knew a pose, so that it had something to get wrong.
    pub localised: u64,
    /// Episodes that ended with something that does not hold.
    pub violations: Vec<Finding>,
    /// Episodes that ended with a panic.
    pub panics: Vec<Finding>,
}

/// What becomes of an episode.
struct Episode {
    events: u64,
    localised: u64,
    end: End,
}

enum End {
    Well,
    Violation(String),
    Panic(String),
}

/// Holds the outputs of a localiser that is told `events` events of that seed against what must always hold. Episodes end
/// at the first finding; the next one begins anew. Runs of different seeds can be made side by side.
#[must_use]
pub fn run(seed: u64, events: u64) -> Verdict {
    run_with(seed, events, violation)
}

/// The same with another check, to see whether it finds something.
pub fn run_with(
    seed: u64,
    events: u64,
    check: impl Fn(&localizer::Outputs, &localizer::Limits) -> Option<String>,
) -> Verdict {
    let mut verdict = Verdict::default();
    let mut number = 0;
    while verdict.events < events {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(number);
        let episode = episode(&mut Dice::new(random), EPISODE.min(events - verdict.events), &check);
        verdict.events += episode.events;
        verdict.localised += episode.localised;
        let finding = |what| Finding { seed, episode: number, event: episode.events - 1, what };
        match episode.end {
            End::Well => {}
            End::Violation(what) => verdict.violations.push(finding(what)),
            End::Panic(what) => verdict.panics.push(finding(what)),
        }
        number += 1;
    }
    verdict
}

/// One episode of a fuzzer's bytes.
///
/// # Errors
/// What does not hold, or the message of a panic.
pub fn run_bytes(bytes: &[u8]) -> Result<u64, String> {
    let episode = episode(&mut Dice::new(bytes), EPISODE, &violation);
    match episode.end {
        End::Well => Ok(episode.events),
        End::Violation(what) | End::Panic(what) => Err(what),
    }
}

fn episode<S: Source>(
    dice: &mut Dice<S>,
    events: u64,
    check: &impl Fn(&localizer::Outputs, &localizer::Limits) -> Option<String>,
) -> Episode {
    let parameters = setup::parameters(dice);
    let mut localizer = Box::new(SmallLocalizer::new(parameters));
    let mut outcome = Episode { events: 0, localised: 0, end: End::Well };
    let mut drive = Drive::new(parameters, dice);
    let mut lists = Lists::default();
    let landmarks = setup::landmarks(dice);
    if let Err(message) = quietly(|| localizer.add_landmarks(&landmarks)) {
        outcome = Episode { events: 1, end: End::Panic(format!("{message}: {landmarks:?}")), ..outcome };
        return outcome;
    }
    // A vehicle that nobody tells its pose has nothing to say.
    let mut is_given = false;
    while outcome.events < events && !dice.has_ended() {
        let event = if is_given { drive.event(dice, &mut lists) } else { drive.start(dice) };
        is_given = true;
        outcome.events += 1;
        let before = localizer.outputs().pose;
        let told = || {
            let event = shortened(&format!("{event:?}"));
            format!("after {event} on {before:?}, with {parameters:?}")
        };
        match quietly(|| check(localizer.handle(&event), &parameters.limits).or_else(|| lists_violation(&localizer))) {
            Ok(None) => outcome.localised += u64::from(localizer.outputs().pose.mode != localizer::Mode::NotLocalised),
            Ok(Some(what)) => {
                outcome.end = End::Violation(format!("{what} {}", told()));
                break;
            }
            Err(message) => {
                outcome.end = End::Panic(format!("{message} {}", told()));
                break;
            }
        }
    }
    outcome
}

/// What does not hold of the maps that the localiser makes.
fn lists_violation(localizer: &SmallLocalizer) -> Option<String> {
    let mut dynamic = localizer.dynamic_landmarks().iter().map(|landmark| landmark.position);
    let mut in_state = localizer.state_landmarks().map(|(_, position)| position);
    let is_wrong = |position: agv_core::geometry::Point| !(position.x.is_finite() && position.y.is_finite());
    if let Some(wrong) =
        dynamic.find(|position| is_wrong(*position)).or_else(|| in_state.find(|position| is_wrong(*position)))
    {
        return Some(format!("a landmark is at {wrong:?}"));
    }
    (localizer.state_landmarks().count() > LANDMARKS).then(|| "too many landmarks in the state".to_owned())
}

/// The beginning of a long text.
fn shortened(text: &str) -> String {
    text.chars().take(600).collect()
}

thread_local! {
    /// The message of a panic that is caught, if this thread catches one.
    static CAUGHT: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Does `work`; the message of its panic if it has one, which is not printed.
fn quietly<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            let is_caught = CAUGHT.with_borrow_mut(|caught| caught.as_mut().map(|caught| *caught = panic.to_string()));
            if is_caught.is_none() {
                before(panic);
            }
        }));
    });
    CAUGHT.set(Some(String::new()));
    let outcome = catch_unwind(AssertUnwindSafe(work));
    let message = CAUGHT.take().unwrap_or_default();
    outcome.map_err(|_| message)
}
