#![no_main]

use agv_wire::can::slcan::{Decoder, Message};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let mut decoder = Decoder::new();
    for byte in bytes {
        let Some(Ok(message)) = decoder.push(*byte) else { continue };
        // What was read must be written and read again as the same.
        let line = message.encode();
        let (end, text) = line.split_last().unwrap();
        // A refusal is a line of its own kind: BEL without a carriage return.
        if message == Message::Refused {
            assert_eq!(line.as_slice(), [7]);
        } else {
            assert_eq!((*end, Message::decode(text)), (b'\r', Ok(message)));
        }
    }
});
