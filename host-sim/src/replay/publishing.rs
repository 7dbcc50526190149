//! What the vehicle was given while the localiser was busy, published again.

use agv_core::record::{MAX_FRAME, Published, Record, encode};

use super::{Answer, Comparison, LoggedPredictor, Replay};
use crate::recording::{Publishing, Recording};

/// Publishes again what was published when the recording was made, and compares. `first_difference` is the number of events
/// before the first pose that is not the recorded one, bit for bit. A recording that begins in the middle of a drive and does not tell
/// what the publisher knew is not compared.
#[must_use]
pub fn compare_published(recording: &Recording, publishing: &Publishing, replay: &Replay) -> Comparison {
    let mut comparison = Comparison { compared: 0, first_difference: None };
    let Recording { parameters, .. } = recording;
    let predictor = match &recording.state {
        None => Ok(LoggedPredictor::new(parameters)),
        Some(state) => LoggedPredictor::restored(parameters, &state.predictor),
    };
    let Ok(mut predictor) = predictor else { return comparison };
    let answer = |events: i64| answer_to(replay, events);
    let mut behind = publishing.behind.iter().peekable();
    let mut frames = [vec![0; MAX_FRAME], vec![0; MAX_FRAME]];
    let mut heard = 0;
    for recorded in &publishing.poses {
        for (number, event) in recording.events.iter().enumerate().take(recorded.events).skip(heard) {
            let behind = behind.next_if(|next| next.0 == number).map_or(0, |next| next.1);
            predictor.hear(&event.view(), number as i64, behind, answer);
        }
        heard = recorded.events;
        let behind = recorded.published.behind;
        let again = predictor.publish(recorded.events as i64, behind, answer).map(|pose| Published { pose, behind });
        let [first, second] = &mut frames;
        let is_equal = again.is_some_and(|again| bytes(recorded.published, first) == bytes(again, second));
        if !is_equal && comparison.first_difference.is_none() {
            comparison.first_difference = Some(recorded.events);
        }
    }
    Comparison { compared: publishing.poses.len(), ..comparison }
}

fn answer_to(replay: &Replay, events: i64) -> Option<Answer> {
    match usize::try_from(events).ok()?.checked_sub(1) {
        Some(event) => Some((*replay.poses.get(event)?, *replay.predictions.get(event)?)),
        None => replay.start,
    }
}

fn bytes(published: Published, frame: &mut [u8]) -> &[u8] {
    // A pose is shorter than a frame may be.
    let length = encode(&Record::Published(published), 0, frame).unwrap_or_default();
    &frame[..length]
}
