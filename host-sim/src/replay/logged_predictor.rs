//! The predictor of the controller that publishes, told what a log tells.

use agv_controller::MOTIONS;
use agv_core::localizer::{Event, OutputPredictor, Parameters, PredictionState, StateError};
use agv_core::state::PoseOutput;

/// What the localiser has answered to an event.
pub type Answer = (PoseOutput, PredictionState);

/// A predictor that hears events when the bus did, and answers when the bus had them. Events are counted from the beginning of the
/// log on.
pub struct LoggedPredictor {
    predictor: OutputPredictor<MOTIONS>,
    /// How many events had been answered for it; below zero if the last answer was one to an event before the log.
    answered: i64,
}

impl LoggedPredictor {
    /// One that has heard nothing.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Self {
        Self { predictor: OutputPredictor::new(parameters), answered: 0 }
    }

    /// One that goes on behind its stored state.
    ///
    /// # Errors
    /// If it cannot.
    pub fn restored(parameters: &Parameters, state: &[u8]) -> Result<Self, StateError> {
        let mut predictor = OutputPredictor::new(parameters);
        predictor.restore_state(state)?;
        // It is stored when all but the last event had been answered.
        Ok(Self { predictor, answered: -1 })
    }

    /// Takes an event with so many before it, of which so many had not been answered. `answer` gives the answer to the last of so
    /// many events; that of none is what was said before.
    pub fn hear(&mut self, event: &Event, before: i64, behind: u32, answer: impl Fn(i64) -> Option<Answer>) {
        if !Self::hears(event) {
            return;
        }
        self.take_answer(before, behind, answer);
        match event {
            Event::Encoders(sample) => self.predictor.encoders(sample),
            Event::Wheels(sample) => self.predictor.wheels(sample),
            Event::Speed(sample) => self.predictor.speed(sample),
            Event::Increment(increment) => self.predictor.increment(increment),
            Event::Gyro(sample) => self.predictor.gyro(sample),
            Event::EncoderFaults(faults) => self.predictor.doubt_encoders(faults),
            Event::Reflectors(_) | Event::Scan(_) | Event::SetPose(_) => {}
        }
    }

    /// Whether an event of the bus moves it.
    #[must_use]
    pub const fn hears(event: &Event) -> bool {
        !matches!(event, Event::Reflectors(_) | Event::Scan(_) | Event::SetPose(_))
    }

    /// The pose behind so many events, of which so many had not been answered.
    pub fn publish(&mut self, events: i64, behind: u32, answer: impl Fn(i64) -> Option<Answer>) -> Option<PoseOutput> {
        self.take_answer(events, behind, answer);
        self.predictor.output()
    }

    /// The predictor.
    #[must_use]
    pub fn predictor(&self) -> &OutputPredictor<MOTIONS> {
        &self.predictor
    }

    fn take_answer(&mut self, events: i64, behind: u32, answer: impl Fn(i64) -> Option<Answer>) {
        let answered = events - i64::from(behind);
        if self.predictor.has_output() && answered == self.answered {
            return;
        }
        self.answered = answered;
        if let Some((pose, prediction)) = answer(answered) {
            self.predictor.update(&pose, &prediction);
        }
    }
}
