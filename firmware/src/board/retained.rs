//! What the last panic said: memory that a reset does not clear.
#![allow(unsafe_code, reason = "this memory is set by an earlier run of the program")]

use core::cell::UnsafeCell;
use core::fmt::{self, Write};
use core::mem::MaybeUninit;
use core::panic::PanicInfo;

/// Longest message, bytes.
const LONGEST: usize = 400;
const MAGIC: u32 = 0x5041_4E43;

#[repr(C)]
struct Message {
    magic: u32,
    length: u32,
    checksum: u32,
    text: [u8; LONGEST],
}

struct Retained(UnsafeCell<MaybeUninit<Message>>);

// SAFETY: it is read before tasks run and written when nothing else does, or in a critical section.
unsafe impl Sync for Retained {}

#[unsafe(link_section = ".uninit.panic")]
static RETAINED: Retained = Retained(UnsafeCell::new(MaybeUninit::uninit()));

fn message() -> *mut Message {
    RETAINED.0.get().cast()
}

/// A sum that random memory is not likely to have.
fn checksum(text: &[u8]) -> u32 {
    text.iter().fold(MAGIC, |sum, byte| sum.rotate_left(5) ^ u32::from(*byte))
}

struct Text<'a> {
    text: &'a mut [u8; LONGEST],
    length: usize,
}

impl Write for Text<'_> {
    fn write_str(&mut self, part: &str) -> fmt::Result {
        for byte in part.bytes() {
            if let Some(place) = self.text.get_mut(self.length) {
                *place = if byte.is_ascii() { byte } else { b'?' };
                self.length += 1;
            }
        }
        Ok(())
    }
}

/// Keeps what a panic says over the reset that follows.
pub fn keep(info: &PanicInfo) {
    let mut text = [0; LONGEST];
    let mut writer = Text { text: &mut text, length: 0 };
    let _ = write!(writer, "{info}");
    let length = writer.length;
    let checksum = checksum(text.get(..length).unwrap_or_default());
    // SAFETY: after a panic nothing else runs; any bytes are a message.
    unsafe { message().write_volatile(Message { magic: MAGIC, length: length as u32, checksum, text }) };
}

/// What the last panic said; empty if there was none. Call once, before tasks run.
#[must_use]
pub fn read() -> &'static str {
    // SAFETY: any bytes are a message, and nobody writes to it but `keep`, after which nothing is read, and `forget`,
    // which leaves the text.
    let message = unsafe { &*message() };
    let text = message.text.get(..message.length as usize).unwrap_or_default();
    if message.magic == MAGIC && message.checksum == checksum(text) {
        core::str::from_utf8(text).unwrap_or_default()
    } else {
        ""
    }
}

/// Forgets it, from the next start on.
pub fn forget() {
    // SAFETY: the text, which may be referred to, is not touched.
    unsafe { (&raw mut (*message()).magic).write_volatile(0) };
}
