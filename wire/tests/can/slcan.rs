//! Frames on a serial line.

use agv_wire::can::frame::{FdFrame, Frame, extended_id, standard_id};
use agv_wire::can::slcan::{BitRate, Command, Decoder, MAX_LINE, Message, SlcanError};
use proptest::prelude::*;

use super::frames::any_frame;

fn any_message() -> impl Strategy<Value = Message> {
    let rate = prop::sample::select(vec![BitRate::Kbit10, BitRate::Kbit125, BitRate::Kbit500, BitRate::Mbit1]);
    let command = prop_oneof![
        Just(Command::Open),
        Just(Command::ListenOnly),
        Just(Command::Close),
        rate.prop_map(Command::BitRate),
        (0..=9u8).prop_map(Command::DataBitRate),
        any::<bool>().prop_map(Command::TimeStamps),
        Just(Command::ReadStatus),
        Just(Command::ReadVersion),
        Just(Command::ReadSerial),
    ];
    prop_oneof![
        8 => (any_frame(), any::<Option<u16>>()).prop_map(|(frame, time_stamp)| Message::Frame { frame, time_stamp }),
        1 => command.prop_map(Message::Command),
        1 => prop_oneof![
            Just(Message::Acknowledged),
            Just(Message::Refused),
            any::<bool>().prop_map(|is_extended| Message::Accepted { is_extended }),
            any::<u8>().prop_map(Message::Status),
            any::<u16>().prop_map(Message::Version),
            prop::array::uniform4(b'0'..=b'z').prop_map(Message::Serial),
        ],
    ]
}

fn decode_all(bytes: &[u8]) -> Vec<Result<Message, SlcanError>> {
    let mut decoder = Decoder::new();
    bytes.iter().filter_map(|byte| decoder.push(*byte)).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn what_is_encoded_is_decoded(messages in prop::collection::vec(any_message(), 1..8)) {
        let bytes: Vec<u8> = messages.iter().flat_map(|message| message.encode()).collect();
        let expected: Vec<_> = messages.into_iter().map(Ok).collect();
        prop_assert_eq!(decode_all(&bytes), expected);
    }

    #[test]
    fn the_next_line_works_after_any_rubbish(rubbish in prop::collection::vec(any::<u8>(), 0..400), frame in any_frame()) {
        let mut bytes = rubbish;
        bytes.push(b'\r');
        bytes.extend(Message::from(frame).encode());
        prop_assert_eq!(decode_all(&bytes).last().copied(), Some(Ok(Message::from(frame))));
    }

    #[test]
    fn a_line_that_is_cut_is_no_frame(frame in any_frame(), cut in 0..140usize) {
        let line = Message::from(frame).encode();
        // Without its end, and at least one byte short. What is left of data by four digits would be a time stamp.
        let cut = cut % (line.len() - 1);
        if let Ok(Message::Frame { frame: found, .. }) = Message::decode(&line[..cut]) {
            prop_assert!(false, "{found:?}");
        }
    }
}

#[test]
fn lines_of_the_manual_and_of_canable() {
    let classic = Frame::of(standard_id(0x100), [0x11, 0x33]);
    let pairs: [(&[u8], Message); 16] = [
        // Examples of the CANUSB manual.
        (b"t10021133\r", classic.into()),
        (b"T0000010021133\r", Frame::of(extended_id(0x100), [0x11, 0x33]).into()),
        (b"r1002\r", Frame::remote(standard_id(0x100), 2).unwrap().into()),
        (b"R000001002\r", Frame::remote(extended_id(0x100), 2).unwrap().into()),
        (b"t100211333D2A\r", Message::Frame { frame: classic.into(), time_stamp: Some(0x3D2A) }),
        (b"S6\r", Command::BitRate(BitRate::Kbit500).into()),
        (b"O\r", Command::Open.into()),
        (b"C\r", Command::Close.into()),
        (b"Z1\r", Command::TimeStamps(true).into()),
        (b"z\r", Message::Accepted { is_extended: false }),
        (b"F08\r", Message::Status(8)),
        (b"V1013\r", Message::Version(0x1013)),
        (b"NA123\r", Message::Serial(*b"A123")),
        // A position of the encoder notes, and an FD frame of twelve bytes.
        (b"t1814EFCDAB00\r", Frame::of(standard_id(0x181), [0xEF, 0xCD, 0xAB, 0x00]).into()),
        (
            b"d1239000102030405060708090A0B\r",
            FdFrame::new(standard_id(0x123), &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11], false).unwrap().into(),
        ),
        (b"B1ABCDEF01FF\r", FdFrame::new(extended_id(0x1ABC_DEF0), &[0xFF], true).unwrap().into()),
    ];
    for (line, message) in pairs {
        let text = String::from_utf8_lossy(line);
        assert_eq!(decode_all(line), [Ok(message)], "{text}");
        assert_eq!(message.encode(), *line, "{text}");
    }
}

#[test]
fn wrong_lines_say_what_is_wrong() {
    for (line, error) in [
        (&b"x\r"[..], SlcanError::Unknown),
        (b"t10\r", SlcanError::Length),
        (b"t1002113\r", SlcanError::Length),
        (b"t100211334\r", SlcanError::Length),
        (b"t1009\r", SlcanError::Digit),
        (b"t8000\r", SlcanError::Digit),
        (b"T200000000\r", SlcanError::Digit),
        (b"t10G0\r", SlcanError::Digit),
        (b"S9\r", SlcanError::Digit),
        (b"OO\r", SlcanError::Length),
    ] {
        assert_eq!(decode_all(line), [Err(error)], "{}", String::from_utf8_lossy(line));
    }
    let mut long = vec![b't'; MAX_LINE + 1];
    long.push(b'\r');
    assert_eq!(decode_all(&long), [Err(SlcanError::TooLong)]);
}

#[test]
fn the_longest_line_fits() {
    let frame = FdFrame::new(extended_id(0x1FFF_FFFF), &[0xAA; 64], true).unwrap();
    let line = Message::Frame { frame: frame.into(), time_stamp: Some(59_999) }.encode();
    assert_eq!(line.len(), MAX_LINE);
    assert_eq!(line.last(), Some(&b'\r'));
}
