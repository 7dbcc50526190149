//! Telegrams in a stream of bytes that arrives in pieces.

use super::Dialect;
use super::checksum::exclusive_or;

/// Room for the longest telegram of a NAV350, 35 kB as its maker states, and for the beginning of the next.
pub const BUFFER: usize = 36 * 1024;

const START: u8 = 2;
const END: u8 = 3;
const BINARY_HEADER: usize = 8;

/// What [`Deframer::next`] found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Deframed<'a> {
    /// A whole telegram.
    Telegram {
        /// How it is written.
        dialect: Dialect,
        /// What stands in the frame.
        payload: &'a [u8],
        /// The frame itself.
        frame: &'a [u8],
    },
    /// So many bytes belong to no good telegram.
    Rubbish(usize),
}

/// What stands at the beginning of some bytes.
enum Beginning {
    /// A whole telegram: length of the frame, and where its payload is.
    Telegram(Dialect, usize, core::ops::Range<usize>),
    /// No telegram begins before that many bytes.
    Rubbish(usize),
    /// A telegram may begin here, but more bytes are needed to know. None of the first so many bytes ends it.
    Incomplete(usize),
}

/// Finds telegrams of both dialects. After rubbish it goes on at the next good telegram.
#[derive(Clone, Debug)]
pub struct Deframer<const N: usize = BUFFER> {
    buffer: [u8; N],
    start: usize,
    end: usize,
    /// How many bytes from the start are known not to end the telegram that begins there.
    searched: usize,
}

impl<const N: usize> Default for Deframer<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Deframer<N> {
    /// An empty one.
    #[must_use]
    pub const fn new() -> Self {
        Self { buffer: [0; N], start: 0, end: 0, searched: 0 }
    }

    /// Forgets everything.
    pub const fn clear(&mut self) {
        (self.start, self.end, self.searched) = (0, 0, 0);
    }

    /// How many bytes wait for the rest of their telegram.
    #[must_use]
    pub const fn waiting(&self) -> usize {
        self.end - self.start
    }

    /// Room for received bytes; say with [`received`](Self::received) how many came. It is not empty if
    /// [`next`](Self::next) has been called until it found nothing.
    pub fn room(&mut self) -> &mut [u8] {
        if self.start > 0 {
            // As it always is; the compiler cannot know.
            if self.start <= self.end && self.end <= N {
                self.buffer.copy_within(self.start..self.end, 0);
            }
            (self.start, self.end) = (0, self.end.saturating_sub(self.start));
        }
        self.buffer.get_mut(self.end..).unwrap_or_default()
    }

    /// So many bytes were written to the beginning of [`room`](Self::room).
    pub fn received(&mut self, count: usize) {
        self.end = (self.end + count).min(N);
    }

    /// Copies bytes, as many as there is room for; returns how many.
    pub fn extend(&mut self, bytes: &[u8]) -> usize {
        let room = self.room();
        let count = room.len().min(bytes.len());
        for (to, from) in room.iter_mut().zip(bytes) {
            *to = *from;
        }
        self.received(count);
        count
    }

    /// The next telegram or rubbish; None if more bytes are needed.
    #[expect(clippy::should_implement_trait, reason = "what is found borrows from the buffer")]
    pub fn next(&mut self) -> Option<Deframed<'_>> {
        let mut rubbish = 0;
        // Every turn but the last goes ahead by one byte or more.
        for _ in 0..=N {
            let waiting = self.buffer.get(self.start..self.end).unwrap_or_default();
            if waiting.is_empty() {
                break;
            }
            match beginning(waiting, self.searched, N) {
                Beginning::Rubbish(count) => {
                    rubbish += count;
                    self.start += count;
                    self.searched = 0;
                }
                Beginning::Incomplete(searched) => {
                    self.searched = searched;
                    break;
                }
                // Rubbish is told first.
                Beginning::Telegram(..) if rubbish > 0 => break,
                Beginning::Telegram(dialect, length, payload) => {
                    let start = self.start;
                    self.start += length;
                    self.searched = 0;
                    let frame = self.buffer.get(start..start + length)?;
                    return Some(Deframed::Telegram { dialect, payload: frame.get(payload)?, frame });
                }
            }
        }
        (rubbish > 0).then_some(Deframed::Rubbish(rubbish))
    }
}

/// `bytes` are not empty.
fn beginning(bytes: &[u8], searched: usize, capacity: usize) -> Beginning {
    match bytes {
        [START, START, START, START, ..] => binary(bytes, capacity),
        [START, START, START] | [START, START] | [START] => Beginning::Incomplete(0),
        [START, b's', ..] => ascii(bytes, searched, capacity),
        _ => {
            let next = bytes.iter().skip(1).position(|byte| *byte == START);
            Beginning::Rubbish(next.map_or(bytes.len(), |position| position + 1))
        }
    }
}

/// A payload begins with a small `s`, so a wrong length is found early.
fn binary(bytes: &[u8], capacity: usize) -> Beginning {
    let Some((header, rest)) = bytes.split_first_chunk::<BINARY_HEADER>() else { return Beginning::Incomplete(0) };
    let [.., a, b, c, d] = *header;
    let length = u32::from_be_bytes([a, b, c, d]) as usize;
    if length < 3 || length > capacity.saturating_sub(BINARY_HEADER + 1) || rest.first().is_some_and(|s| *s != b's') {
        return Beginning::Rubbish(1);
    }
    match rest.split_at_checked(length) {
        Some((payload, [check, ..])) if exclusive_or(payload) == *check => {
            let frame = BINARY_HEADER + length + 1;
            Beginning::Telegram(Dialect::Binary, frame, BINARY_HEADER..BINARY_HEADER + length)
        }
        Some((_, [_, ..])) => Beginning::Rubbish(1),
        _ => Beginning::Incomplete(0),
    }
}

/// Control characters other than the end stand in no payload.
fn ascii(bytes: &[u8], searched: usize, capacity: usize) -> Beginning {
    let from = searched.max(1);
    match bytes.iter().skip(from).position(|byte| *byte < b' ').map(|position| position + from) {
        Some(end) if bytes.get(end) == Some(&END) => Beginning::Telegram(Dialect::Ascii, end + 1, 1..end),
        Some(end) => Beginning::Rubbish(end),
        None if bytes.len() >= capacity => Beginning::Rubbish(bytes.len()),
        None => Beginning::Incomplete(bytes.len()),
    }
}
