//! What the vehicle was given while the localiser was busy, published again.

use agv_controller::MOTIONS;
use agv_core::localizer::{Event, OutputPredictor};
use agv_core::record::{MAX_FRAME, Published, Record, encode};

use super::{Comparison, Replay};
use crate::recording::{Publishing, Recording};

/// Publishes again what was published when the recording was made, and compares. `first_difference` is the number of events
/// before the first pose that is not the recorded one, bit for bit.
#[must_use]
pub fn compare_published(recording: &Recording, publishing: &Publishing, replay: &Replay) -> Comparison {
    let mut publisher = Publisher::new(recording, replay);
    let mut behind = publishing.behind.iter().peekable();
    let mut frames = [vec![0; MAX_FRAME], vec![0; MAX_FRAME]];
    let mut first_difference = None;
    let mut heard = 0;
    for recorded in &publishing.poses {
        for event in heard..recorded.events {
            let behind = behind.next_if(|next| next.0 == event).map_or(0, |next| next.1);
            publisher.hear(event, behind);
        }
        heard = recorded.events;
        let again = publisher.publish(recorded.events, recorded.published.behind);
        let [first, second] = &mut frames;
        let is_equal = again.is_some_and(|again| bytes(recorded.published, first) == bytes(again, second));
        if !is_equal && first_difference.is_none() {
            first_difference = Some(recorded.events);
        }
    }
    Comparison { compared: publishing.poses.len(), first_difference }
}

/// The controller's predictor between the events of a recording and their answers.
struct Publisher<'a> {
    recording: &'a Recording,
    replay: &'a Replay,
    predictor: OutputPredictor<MOTIONS>,
    /// How many events had been answered for the predictor.
    answered: usize,
}

impl<'a> Publisher<'a> {
    fn new(recording: &'a Recording, replay: &'a Replay) -> Self {
        Self { recording, replay, predictor: OutputPredictor::new(&recording.parameters), answered: 0 }
    }

    /// Takes the event of that index, when so many before it had not been answered.
    fn hear(&mut self, event: usize, behind: u32) {
        match self.recording.events[event].view() {
            Event::Encoders(sample) => {
                self.take_answer(event, behind);
                self.predictor.encoders(&sample);
            }
            Event::Wheels(sample) => {
                self.take_answer(event, behind);
                self.predictor.wheels(&sample);
            }
            Event::Speed(sample) => {
                self.take_answer(event, behind);
                self.predictor.speed(&sample);
            }
            Event::Increment(increment) => {
                self.take_answer(event, behind);
                self.predictor.increment(&increment);
            }
            Event::Gyro(sample) => {
                self.take_answer(event, behind);
                self.predictor.gyro(&sample);
            }
            Event::EncoderFaults(faults) => {
                self.take_answer(event, behind);
                self.predictor.doubt_encoders(&faults);
            }
            _ => {}
        }
    }

    /// The pose behind so many events, when so many of them had not been answered.
    fn publish(&mut self, events: usize, behind: u32) -> Option<Published> {
        self.take_answer(events, behind);
        Some(Published { pose: self.predictor.output()?, behind })
    }

    fn take_answer(&mut self, events: usize, behind: u32) {
        let answered = events.saturating_sub(behind as usize);
        if self.predictor.output().is_some() && answered == self.answered {
            return;
        }
        self.answered = answered;
        if let Some(answer) = answered.checked_sub(1) {
            self.predictor.update(&self.replay.poses[answer], &self.replay.predictions[answer]);
        } else if let Some((pose, prediction)) = &self.replay.start {
            self.predictor.update(pose, prediction);
        }
    }
}

fn bytes(published: Published, frame: &mut [u8]) -> &[u8] {
    // A pose is shorter than a frame may be.
    let length = encode(&Record::Published(published), 0, frame).unwrap_or_default();
    &frame[..length]
}
