//! Whether a replay says what was said when the recording was made.

use agv_core::record::{MAX_FRAME, Output, Record, encode};
use serde::Serialize;

use super::{Replay, compare_published};
use crate::recording::{Publishing, RecordedOutput, Recording};

/// How recorded outputs compare with those of a replay.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Comparison {
    /// Number of recorded outputs, or of published poses.
    pub compared: usize,
    /// Index of the first event whose output is not the recorded one, bit for bit; None if all are.
    pub first_difference: Option<usize>,
}

impl Comparison {
    /// The comparison as a sentence.
    fn verdict(&self) -> String {
        match self.first_difference {
            None => format!("equal to the {} recorded ones, bit for bit", self.compared),
            Some(event) => format!("differ from the recorded ones, first at event {event}"),
        }
    }

    /// Whether something was compared, and all of it is equal.
    #[must_use]
    pub fn is_equal(&self) -> bool {
        self.compared > 0 && self.first_difference.is_none()
    }
}

/// How all that a log says the controller has said compares with a replay. None of what the log holds nothing of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Comparisons {
    /// What the localiser answered.
    pub outputs: Option<Comparison>,
    /// What the vehicle was given.
    pub published: Option<Comparison>,
}

impl Comparisons {
    /// Compares all of it.
    #[must_use]
    pub fn of(outputs: &[RecordedOutput], publishing: &Publishing, recording: &Recording, replay: &Replay) -> Self {
        let some = |comparison: Comparison| (comparison.compared > 0).then_some(comparison);
        Self {
            outputs: some(compare(outputs, replay)),
            published: some(compare_published(recording, publishing, replay)),
        }
    }

    /// What there is to say of it: what was compared, and how.
    #[must_use]
    pub fn remarks(&self) -> Vec<[String; 2]> {
        let named = [("outputs", self.outputs), ("published", self.published)];
        named.into_iter().filter_map(|(what, comparison)| Some([what.to_owned(), comparison?.verdict()])).collect()
    }
}

/// Compares recorded outputs with those of a replay of the same events.
#[must_use]
pub fn compare(recorded: &[RecordedOutput], replay: &Replay) -> Comparison {
    let mut frames = [vec![0; MAX_FRAME], vec![0; MAX_FRAME]];
    let differs = |output: &&RecordedOutput| {
        let [first, second] = &mut frames;
        replay.output(output.event).is_none_or(|again| bytes(output.view(), first) != bytes(again, second))
    };
    Comparison { compared: recorded.len(), first_difference: recorded.iter().find(differs).map(|output| output.event) }
}

/// The output as a log holds it: unlike a comparison of numbers, bytes tell the zeros apart and know one NaN from no NaN.
fn bytes<'a>(output: Output, frame: &'a mut [u8]) -> &'a [u8] {
    // Outputs fit, because a localiser's observations are bounded.
    let length = encode(&Record::Output(output), 0, frame).unwrap_or_default();
    &frame[..length]
}
