//! What a log that begins in the middle of a drive must know: the state of the localiser, and of the bus's predictor, which is followed
//! beside the log as a replay follows it.

use agv_controller::Estimate;
use agv_core::localizer::{Localize, Parameters};
use agv_core::record::Record;

use crate::replay::{Answer, LoggedPredictor};
use crate::sync::queue::{Receiver, Sender, queue};

/// Answers that are remembered: the bus is behind by no more events than may wait for the localiser, and some more.
const ANSWERS: usize = 512;

/// States on their way: one that is written to the disk, and one that waits.
const STATES: usize = 2;

/// The states behind the same event.
pub(super) struct States {
    localizer: Box<[u8]>,
    predictor: Box<[u8]>,
    lengths: [usize; 2],
}

impl States {
    fn new(size: usize) -> Self {
        // No number takes twice as many bytes there as in memory.
        let of = |size: usize| vec![0; 2 * size].into_boxed_slice();
        Self { localizer: of(size), predictor: of(size_of::<LoggedPredictor>()), lengths: [0; 2] }
    }

    /// That of the localiser, and that of the predictor.
    pub fn bytes(&self) -> [&[u8]; 2] {
        let [localizer, predictor] = self.lengths;
        [&self.localizer[..localizer], &self.predictor[..predictor]]
    }
}

/// Follows the log, and stores the states behind an event.
pub(super) struct StateKeeper {
    predictor: LoggedPredictor,
    answers: Box<[Option<Answer>]>,
    /// Events of the log so far.
    events: i64,
    /// What the log has said of the next event.
    behind: u32,
    /// Whether the last event was one of the bus that had heard the answers to all others.
    is_level: bool,
    free: Receiver<Box<States>>,
}

impl StateKeeper {
    /// A keeper of a localiser of so many bytes, and where states go back to.
    pub fn new(parameters: &Parameters, size: usize) -> (Self, Sender<Box<States>>) {
        let (give_back, free) = queue(STATES);
        for _ in 0..STATES {
            // There is room for all.
            let _ = give_back.send(Box::new(States::new(size)));
        }
        let keeper = Self {
            predictor: LoggedPredictor::new(parameters),
            answers: vec![None; ANSWERS].into(),
            events: 0,
            behind: 0,
            is_level: false,
            free,
        };
        (keeper, give_back)
    }

    /// Takes a record of the log.
    pub fn take(&mut self, record: &Record) {
        let Self { predictor, answers, events, .. } = self;
        let answer = |number: i64| answers[number.rem_euclid(ANSWERS as i64) as usize];
        match record {
            Record::Behind(behind) => self.behind = *behind,
            Record::Event(event) => {
                predictor.hear(event, *events, self.behind, answer);
                self.is_level = self.behind == 0 && LoggedPredictor::hears(event);
                *events += 1;
                self.behind = 0;
            }
            Record::Published(published) => _ = predictor.publish(*events, published.behind, answer),
            _ => {}
        }
    }

    /// Takes what the bus will be told of the events so far.
    pub fn answer(&mut self, estimate: &Estimate) {
        self.answers[self.events.rem_euclid(ANSWERS as i64) as usize] = Some((estimate.pose, estimate.prediction));
    }

    /// The states behind the last event; none where the log cannot begin, or nothing is free to take them.
    pub fn states(&mut self, localizer: &impl Localize) -> Option<Box<States>> {
        if !self.is_level {
            return None;
        }
        let mut states = self.free.receive()?;
        let States { localizer: of_localizer, predictor, lengths } = &mut *states;
        // There is room: see `States::new`.
        let localizer = localizer.save_state(of_localizer).unwrap_or_default();
        *lengths = [localizer, self.predictor.predictor().save_state(predictor).unwrap_or_default()];
        Some(states)
    }
}
