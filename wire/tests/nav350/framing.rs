//! Telegrams are found in any stream, however it is cut.

use agv_wire::cola::{CommandWord, Deframed, Deframer, Dialect, Writer};
use proptest::collection::vec;
use proptest::prelude::*;

use super::values;

/// A telegram, and what must be found of it.
#[derive(Clone, Debug)]
enum Piece {
    Telegram(Dialect, Vec<u8>),
    Rubbish(Vec<u8>),
}

fn telegram(dialect: Dialect, letters: &[u8], numbers: &[u8]) -> Vec<u8> {
    let mut buffer = [0; 600];
    let name = String::from_utf8(letters.to_vec()).unwrap();
    let mut writer = Writer::new(dialect, CommandWord::MethodAnswer, &name, &mut buffer).unwrap();
    for number in numbers {
        writer.u8(*number).unwrap();
    }
    let length = writer.finish().unwrap();
    buffer[..length].to_vec()
}

fn piece() -> impl Strategy<Value = Piece> {
    prop_oneof![
        4 => (values::dialect(), vec(b'a'..=b'z', 1..20), vec(any::<u8>(), 0..60))
            .prop_map(|(dialect, letters, numbers)| Piece::Telegram(dialect, telegram(dialect, &letters, &numbers))),
        // Without the start of a telegram, which may swallow what follows it.
        1 => vec(any::<u8>().prop_filter("no start", |byte| *byte != 2), 1..30).prop_map(Piece::Rubbish),
    ]
}

fn found<const N: usize>(deframer: &mut Deframer<N>, frames: &mut Vec<(Dialect, Vec<u8>)>) -> usize {
    let mut rubbish = 0;
    while let Some(found) = deframer.next() {
        match found {
            Deframed::Telegram { dialect, frame, .. } => frames.push((dialect, frame.to_vec())),
            Deframed::Rubbish(count) => rubbish += count,
        }
    }
    rubbish
}

proptest! {
    #[test]
    fn telegrams_survive_rubbish_and_cuts(pieces in vec(piece(), 0..12), cuts in vec(1_usize..40, 1..20)) {
        let mut stream = Vec::new();
        let mut expected = Vec::new();
        let mut expected_rubbish = 0;
        for piece in pieces {
            match piece {
                Piece::Telegram(dialect, bytes) => {
                    stream.extend(&bytes);
                    expected.push((dialect, bytes));
                }
                Piece::Rubbish(bytes) => {
                    stream.extend(&bytes);
                    expected_rubbish += bytes.len();
                }
            }
        }
        let mut deframer = Deframer::<1024>::new();
        let (mut frames, mut rubbish) = (Vec::new(), 0);
        let mut rest = &stream[..];
        for cut in cuts.iter().cycle() {
            if rest.is_empty() {
                break;
            }
            let (now, later) = rest.split_at((*cut).min(rest.len()));
            prop_assert_eq!(deframer.extend(now), now.len());
            rest = later;
            rubbish += found(&mut deframer, &mut frames);
        }
        prop_assert_eq!(frames, expected);
        prop_assert_eq!(rubbish, expected_rubbish);
        prop_assert_eq!(deframer.waiting(), 0);
    }

    /// Every byte is either part of a telegram, told as rubbish, or still waiting; and the buffer never stays full.
    #[test]
    fn any_bytes_are_accounted_for(
        bytes in vec(prop_oneof![Just(2_u8), Just(3), Just(b's'), Just(0), any::<u8>()], 0..2000),
    ) {
        let mut deframer = Deframer::<64>::new();
        let mut frames = Vec::new();
        let mut accounted = 0;
        let mut rest = &bytes[..];
        while !rest.is_empty() {
            let count = deframer.extend(rest);
            prop_assert!(count > 0);
            rest = &rest[count..];
            accounted += found(&mut deframer, &mut frames);
        }
        accounted += frames.iter().map(|(_, frame)| frame.len()).sum::<usize>();
        prop_assert_eq!(accounted + deframer.waiting(), bytes.len());
    }

    /// The length itself is not covered by the check byte.
    #[test]
    fn a_wrong_bit_never_passes(bit in 0_usize..8 * 22, numbers in vec(any::<u8>(), 8)) {
        let good = telegram(Dialect::Binary, b"name", &numbers);
        prop_assert_eq!(good.len(), 26);
        let mut bad = good.clone();
        let byte = bit / 8;
        bad[if byte < 4 { byte } else { byte + 4 }] ^= 1 << (bit % 8);
        let mut deframer = Deframer::<1024>::new();
        deframer.extend(&bad);
        let mut frames = Vec::new();
        found(&mut deframer, &mut frames);
        prop_assert!(frames.is_empty());
    }
}

/// A telegram that was cut off does not take the next one with it.
#[test]
fn a_cut_telegram_is_rubbish() {
    for dialect in [Dialect::Ascii, Dialect::Binary] {
        let whole = telegram(dialect, b"name", &[1, 2, 3]);
        for cut in 1..whole.len() {
            let mut deframer = Deframer::<1024>::new();
            deframer.extend(&whole[..cut]);
            // Enough telegrams to reach the length that the cut one claims.
            for _ in 0..3 {
                deframer.extend(&whole);
            }
            let mut frames = Vec::new();
            assert_eq!(found(&mut deframer, &mut frames), cut, "{dialect:?} {cut}");
            assert_eq!(frames, vec![(dialect, whole.clone()); 3], "{dialect:?} {cut}");
        }
    }
}
