#![no_main]

use agv_core::record::{LogReader, Scratch, Step};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let mut reader = LogReader::new();
    let mut scratch = Box::new(Scratch::<4096, 1024>::new());
    let mut rest = bytes;
    loop {
        let (consumed, step) = reader.step(rest, true, &mut scratch);
        let is_end = matches!(step, Step::End);
        rest = &rest[consumed..];
        if is_end {
            break;
        }
    }
    assert_eq!(reader.offset(), bytes.len() as u64);
});
