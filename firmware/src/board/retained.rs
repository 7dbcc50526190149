//! What was said before the last restart: memory that a reset does not clear.
//!
//! It is not cached, as a reset throws the lines of a cache away that were not written back. It is written in whole words,
//! with one behind them that means nothing: RAM with error correction keeps the last word that is not whole back, and a
//! reset loses it (RM0433, 3.3.1).
#![allow(unsafe_code, reason = "this memory is set by an earlier run of the program")]

use core::cell::UnsafeCell;
use core::fmt::{self, Display, Write};
use core::mem::MaybeUninit;

/// Longest message, bytes.
const LONGEST: usize = 400;
const MAGIC: u32 = 0x5041_4E43;

#[repr(C)]
struct Message {
    magic: u32,
    length: u32,
    checksum: u32,
    text: [u32; LONGEST / 4],
    /// Means nothing.
    behind: u32,
}

struct Retained(UnsafeCell<MaybeUninit<Message>>);

// SAFETY: it is read before tasks run and written when nothing else does, or in a critical section.
unsafe impl Sync for Retained {}

#[unsafe(link_section = ".retained")]
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

/// Keeps what a panic says, or a fault is, over the reset that follows. What is said may be made of what is kept already: it is put
/// together before anything is overwritten.
pub fn keep(said: &dyn Display) {
    let mut text = [0; LONGEST];
    let mut writer = Text { text: &mut text, length: 0 };
    let _ = write!(writer, "{said}");
    let length = writer.length;
    let checksum = checksum(text.get(..length).unwrap_or_default());
    let place = message();
    // SAFETY: nothing else runs after a panic or fault, nor before tasks do; any words are a message.
    unsafe {
        for (bytes, number) in text.as_chunks().0.iter().zip(0..) {
            (&raw mut (*place).text).cast::<u32>().add(number).write_volatile(u32::from_le_bytes(*bytes));
        }
        (&raw mut (*place).length).write_volatile(length as u32);
        (&raw mut (*place).checksum).write_volatile(checksum);
        (&raw mut (*place).magic).write_volatile(MAGIC);
        (&raw mut (*place).behind).write_volatile(0);
    }
    cortex_m::asm::dsb();
}

/// What was said before this start, or is kept by now; empty if nothing was. Only before tasks run, and not to be held over [`keep`].
#[must_use]
pub fn read() -> &'static str {
    // SAFETY: any bytes are a message, and nobody writes to it but `keep`, over which no text is held, and `forget`, which
    // leaves the text.
    let (message, text) = unsafe {
        let message = &*message();
        (message, core::slice::from_raw_parts((&raw const message.text).cast::<u8>(), LONGEST))
    };
    let text = text.get(..message.length as usize).unwrap_or_default();
    if message.magic == MAGIC && message.checksum == checksum(text) {
        core::str::from_utf8(text).unwrap_or_default()
    } else {
        ""
    }
}

/// Forgets it, from the next start on.
pub fn forget() {
    // SAFETY: the text, which may be referred to, is not touched.
    unsafe {
        (&raw mut (*message()).magic).write_volatile(0);
        (&raw mut (*message()).behind).write_volatile(0);
    }
}
