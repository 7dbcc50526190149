//! A map of contours that is stored survives.

mod support;

use agv_settings::block_on;
use agv_settings::contour_store::{CONTOUR_PIECE, ContourStore, HEADER, checksum};
use agv_settings::store::StoreError;
use proptest::prelude::*;
use support::{Flash, WORD};

/// Bytes of a copy.
const PAGE: usize = 12 * 1024;

type Contours = ContourStore<Flash<PAGE>>;

fn open(flash: Flash<PAGE>) -> Contours {
    ContourStore::open(flash).unwrap()
}

/// Bytes that no other seed gives.
fn map(length: usize, seed: u8) -> Vec<u8> {
    (0..length).map(|place| (place as u8).wrapping_mul(31).wrapping_add(seed)).collect()
}

fn write(store: &mut Contours, map: &[u8]) -> Result<(), StoreError> {
    block_on(store.begin(map.len() as u32, checksum(map)))?;
    map.chunks(CONTOUR_PIECE).try_for_each(|piece| block_on(store.write(piece)))?;
    block_on(store.finish())
}

/// What is found at the start, read in pieces of so many bytes.
fn read(store: &mut Contours, count: usize) -> Vec<u8> {
    let mut found = Vec::new();
    let mut room = vec![0; count];
    loop {
        let piece = store.read(found.len() as u32, &mut room).unwrap();
        if piece.is_empty() {
            return found;
        }
        found.extend_from_slice(piece);
    }
}

/// Switched off and on.
fn again(store: Contours) -> Contours {
    open(store.into_flash())
}

#[test]
fn a_map_of_any_length_is_found_at_the_next_start_and_where_it_lies() {
    let room = open(Flash::new()).room();
    assert_eq!(room, PAGE - HEADER);
    for length in [1, WORD - 1, WORD, CONTOUR_PIECE, CONTOUR_PIECE + 1, 5000, room] {
        let mut store = open(Flash::new());
        assert_eq!((store.found(), read(&mut store, 100)), (None, Vec::new()));
        write(&mut store, &map(length, 1)).unwrap();
        assert_eq!(store.found(), None, "it counts from the next start on");
        let mut store = again(store);
        let found = store.found().unwrap();
        assert_eq!((found.length as usize, found.checksum), (length, checksum(&map(length, 1))));
        for count in [1000, 77] {
            assert_eq!(read(&mut store, count), map(length, 1));
        }
        let place = store.offset(found.copy) as usize;
        assert_eq!(store.into_flash().bytes[place..place + length], map(length, 1));
    }
    let mut store = open(Flash::new());
    assert_eq!(block_on(store.begin(room as u32 + 1, 0)), Err(StoreError::Map));
}

#[test]
fn it_can_be_replaced_for_ever_and_taken_away() {
    let mut store = open(Flash::new());
    for number in 0..300_u32 {
        // Twice without a start in between: the second one counts.
        write(&mut store, &map(3000, number as u8)).unwrap();
        write(&mut store, &map(2000, number as u8)).unwrap();
        let found = store.found();
        store = again(store);
        assert_ne!(store.found(), found);
        assert_eq!(read(&mut store, 512), map(2000, number as u8), "{number}");
    }
    write(&mut store, &[]).unwrap();
    store = again(store);
    assert_eq!((store.found(), read(&mut store, 512)), (None, Vec::new()));
    write(&mut store, &map(100, 3)).unwrap();
    assert_eq!(read(&mut again(store), 512), map(100, 3));
}

#[test]
fn the_map_that_is_used_stays_where_it_is_until_the_next_start() {
    let mut store = open(Flash::new());
    write(&mut store, &map(3000, 1)).unwrap();
    store = again(store);
    let found = store.found().unwrap();
    for seed in 2..5 {
        write(&mut store, &map(4000, seed)).unwrap();
        assert_eq!((store.found(), read(&mut store, 512)), (Some(found), map(3000, 1)));
    }
}

#[test]
fn what_is_not_whole_or_not_what_was_told_is_given_up() {
    let whole = map(3000, 1);
    let pieces: Vec<&[u8]> = whole.chunks(CONTOUR_PIECE).collect();
    let mut store = open(Flash::new());
    assert_eq!(
        (block_on(store.write(pieces[0])), block_on(store.finish())),
        (Err(StoreError::Map), Err(StoreError::Map))
    );
    for wrong in [&[][..], &whole[..1000], &whole[..1025], &whole] {
        block_on(store.begin(3000, checksum(&whole))).unwrap();
        block_on(store.write(pieces[0])).unwrap();
        assert_eq!(block_on(store.write(wrong)), Err(StoreError::Map));
        assert_eq!(block_on(store.write(pieces[1])), Err(StoreError::Map), "it was given up");
    }
    block_on(store.begin(3000, checksum(&whole))).unwrap();
    block_on(store.write(pieces[0])).unwrap();
    assert_eq!(block_on(store.finish()), Err(StoreError::Map));
    block_on(store.begin(3000, checksum(&whole) ^ 1)).unwrap();
    pieces.iter().for_each(|piece| block_on(store.write(piece)).unwrap());
    assert_eq!(block_on(store.finish()), Err(StoreError::Map));
    assert_eq!(again(store).found(), None);
}

#[test]
fn a_loss_of_power_at_any_point_leaves_the_old_map_or_the_new_one() {
    let (old, new) = (map(2500, 1), map(3100, 2));
    let mut first = open(Flash::new());
    write(&mut first, &old).unwrap();
    let before = again(first).into_flash();
    let mut was_new = false;
    for power in 1.. {
        let mut cut = before.clone();
        cut.power = Some(power);
        let mut store = open(cut);
        let is_done = write(&mut store, &new).is_ok();
        let mut flash = store.into_flash();
        flash.power = None;
        let mut store = open(flash);
        let found = read(&mut store, 512);
        assert!(found == old || found == new, "{power}: {}", found.len());
        assert!(!is_done || found == new, "{power}");
        // It goes on from there.
        write(&mut store, &new).unwrap();
        assert_eq!(read(&mut again(store), 512), new, "{power}");
        was_new |= found == new;
        if is_done {
            break;
        }
        assert!(power < 1000);
    }
    assert!(was_new);
}

#[test]
fn a_changed_byte_costs_the_copy_and_the_other_one_is_found() {
    let mut store = open(Flash::new());
    write(&mut store, &map(2500, 1)).unwrap();
    store = again(store);
    write(&mut store, &map(2500, 2)).unwrap();
    store = again(store);
    let place = store.offset(store.found().unwrap().copy) as usize;
    let sound = store.into_flash();
    for changed in (place - HEADER..place - HEADER + 20).chain([place, place + 1234, place + 2499]) {
        let mut flash = sound.clone();
        flash.bytes[changed] ^= 0x40;
        assert_eq!(read(&mut open(flash), 512), map(2500, 1), "{}", changed - place + HEADER);
    }
}

#[test]
fn a_map_of_which_no_copy_is_whole_is_damaged_and_one_that_never_was_is_not() {
    let mut store = open(Flash::new());
    assert!(!store.is_damaged());
    block_on(store.begin(2500, checksum(&map(2500, 1)))).unwrap();
    block_on(store.write(&map(2500, 1)[..CONTOUR_PIECE])).unwrap();
    store = again(store);
    assert!(!store.is_damaged(), "it was never whole");
    write(&mut store, &map(2500, 1)).unwrap();
    store = again(store);
    write(&mut store, &map(2500, 2)).unwrap();
    let mut flash = again(store).into_flash();
    for (copy, is_damaged) in [(0, false), (1, true)] {
        flash.bytes[copy * PAGE + HEADER + 1000] ^= 1;
        let store = open(flash.clone());
        assert_eq!((store.is_damaged(), store.found().is_none()), (is_damaged, is_damaged), "{copy}");
    }
    // A map of no bytes takes its place.
    let mut store = open(flash);
    write(&mut store, &[]).unwrap();
    assert!(!again(store).is_damaged());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn rubbish_is_no_map_and_is_replaced(seed in any::<u64>()) {
        let mut state = seed | 1;
        let bytes = (0..2 * PAGE).map(|_| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            state as u8
        });
        let mut store = open(Flash::filled(bytes.collect()));
        prop_assert_eq!((store.found(), store.is_damaged()), (None, true));
        write(&mut store, &map(2000, 7)).unwrap();
        prop_assert_eq!(read(&mut again(store), 300), map(2000, 7));
    }
}
