//! A localiser that is replaced again and again by a new one with its stored state, beside one that is left alone.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use agv_core::localizer::{Capacities, Event, Localizer, Outputs};
use agv_core::record::{MAX_FRAME, Output, Record, encode};

use super::walls::Noise;

/// Room for the state of any localiser here, bytes.
const ROOM: usize = 1 << 20;

/// The state as bytes.
pub fn state_of<C: Capacities>(localizer: &Localizer<C>) -> Vec<u8> {
    let mut room = vec![0; ROOM];
    let length = localizer.save_state(&mut room).unwrap();
    room.truncate(length);
    room
}

/// All that was said of an event, as bytes: they tell zeros apart, and know one NaN from another.
fn said(outputs: &Outputs) -> (Vec<u8>, String) {
    let mut frame = vec![0; MAX_FRAME];
    let length = encode(&Record::Output(Output::from(outputs)), 0, &mut frame).unwrap();
    frame.truncate(length);
    (frame, format!("{:?} {:?} {outputs:?}", outputs.sources, outputs.misuse))
}

/// The two.
pub struct Replaced<'a, C: Capacities> {
    alone: Box<Localizer<C>>,
    again: Box<Localizer<C>>,
    begin: Box<dyn Fn() -> Box<Localizer<C>> + 'a>,
    noise: Noise,
    /// One of so many events replaces it.
    every: f64,
    pub replacements: usize,
    pub events: usize,
}

impl<'a, C: Capacities> Replaced<'a, C> {
    /// `begin` makes a localiser that has its parameters and maps, and has heard nothing.
    pub fn new(begin: impl Fn() -> Box<Localizer<C>> + 'a, every: f64, seed: u64) -> Self {
        let noise = Noise(0x9e37_79b9_7f4a_7c15 ^ seed.wrapping_mul(0xd1b5_4a32_d192_ed03) | 1);
        let (alone, again) = (begin(), begin());
        Self { alone, again, begin: Box::new(begin), noise, every, replacements: 0, events: 0 }
    }

    /// Both take an event, and say the same.
    pub fn handle(&mut self, event: &Event) -> &Outputs {
        if self.noise.uniform() * self.every < 1.0 {
            self.replace();
        }
        let alone = said(self.alone.handle(event));
        assert_eq!(said(self.again.handle(event)), alone, "event {} after {}", self.events, self.replacements);
        self.events += 1;
        self.alone.outputs()
    }

    /// Another one goes on with the state.
    pub fn replace(&mut self) {
        let state = state_of(&self.again);
        self.again = (self.begin)();
        assert_eq!(self.again.restore_state(&state), Ok(()));
        assert_eq!(state_of(&self.again), state, "event {}", self.events);
        self.replacements += 1;
    }

    /// Both have come to the same.
    pub fn finish(self) {
        assert!(self.replacements > 0, "it was never replaced");
        assert_eq!(state_of(&self.again), state_of(&self.alone));
    }
}
