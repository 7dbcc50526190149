//! What the targets have in common.

use std::path::Path;

use agv_core::measurement::Time;
use agv_wire::cola::{Deframed, Deframer, Dialect};
use agv_wire::nav350::{Answer, DeviceTime, MethodResult, Request, Revolution, SensorClock, SensorFrame};

/// Everything that a payload goes through. What was read must be written and read again as the same.
pub fn decode(dialect: Dialect, payload: &[u8]) {
    let mut buffer = vec![0; 1 << 18];
    if let Ok(request) = Request::decode(dialect, payload) {
        let length = request.encode(dialect, &mut buffer);
        // An ASCII payload may hold letters that are read but never written.
        if let Ok(length) = length {
            again(dialect, &buffer[..length], |payload| Request::decode(dialect, payload).is_ok());
        }
    }
    let Ok(answer) = Answer::decode(dialect, payload) else { return };
    if let Ok(length) = answer.encode(dialect, &mut buffer) {
        again(dialect, &buffer[..length], |payload| Answer::decode(dialect, payload).is_ok());
    }
    if let Answer::Result(MethodResult::Data(data)) = answer {
        let mut clock = SensorClock::new();
        let _ = clock.record(Time::default(), Time::default(), DeviceTime(0));
        let _ = Revolution::<1440, 128>::new().take(&data, &clock, &SensorFrame::default());
    }
}

fn again(dialect: Dialect, telegram: &[u8], check: impl Fn(&[u8]) -> bool) {
    let mut deframer = Box::new(Deframer::<{ 1 << 18 }>::new());
    assert_eq!(deframer.extend(telegram), telegram.len());
    match deframer.next() {
        Some(Deframed::Telegram { dialect: found, payload, .. }) => assert!(found == dialect && check(payload)),
        other => panic!("{other:?}"),
    }
}

/// A stream of bytes: all are accounted for, and every telegram is decoded.
pub fn stream(bytes: &[u8]) {
    let mut deframer = Box::new(Deframer::<4096>::new());
    let (mut rest, mut accounted) = (bytes, 0);
    while !rest.is_empty() {
        let taken = deframer.extend(rest);
        assert!(taken > 0);
        rest = &rest[taken..];
        while let Some(found) = deframer.next() {
            match found {
                Deframed::Rubbish(count) => accounted += count,
                Deframed::Telegram { dialect, payload, frame } => {
                    accounted += frame.len();
                    decode(dialect, payload);
                }
            }
        }
    }
    assert_eq!(accounted + deframer.waiting(), bytes.len());
}

/// Has `read` read a file of these contents, whose name ends so.
pub fn in_file(name: &str, contents: &[u8], read: impl FnOnce(&Path)) {
    let path = std::env::temp_dir().join(format!("agv-fuzz-{}-{name}", std::process::id()));
    std::fs::write(&path, contents).expect("the folder of temporary files takes them");
    read(&path);
}

/// Between the files of one input.
pub const BETWEEN_FILES: char = '\u{c}';

/// Has `read` read a folder with files of these names; the text has their contents in turn. What the text has no more is absent.
pub fn in_folder(names: &[&str], text: &str, read: impl FnOnce(&Path)) {
    let folder = std::env::temp_dir().join(format!("agv-fuzz-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("the folder of temporary files takes them");
    for (name, contents) in names.iter().zip(text.split(BETWEEN_FILES)) {
        std::fs::write(folder.join(name), contents).expect("the folder of temporary files takes them");
    }
    read(&folder);
}
