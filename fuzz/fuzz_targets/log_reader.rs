#![no_main]

use agv_core::record::{Frame, Item, LogReader, MAX_FRAME, Scratch, Step, encode};
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
    // Few inputs have the right checksum: payloads are tried without one, too.
    if let Some((kind, payload)) = bytes.split_first() {
        let frame = Frame { kind: *kind, sequence: 0, payload };
        if let Ok(record) = frame.record(&mut scratch) {
            let mut buffer = vec![0; MAX_FRAME];
            let length = encode(&record, 0, &mut buffer).expect("what was read can be written");
            let mut scratch = Box::new(Scratch::<4096, 1024>::new());
            let (consumed, step) = LogReader::new().step(&buffer[..length], true, &mut scratch);
            assert!(consumed == length && matches!(step, Step::Item(Item::Record { .. })));
        }
    }
});
