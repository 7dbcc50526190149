//! What is stored survives.

mod support;

use agv_core::maps::Landmark;
use agv_settings::leaf::{Leaf, Value};
use agv_settings::store::{LANDMARKS, Store};
use agv_settings::{LEAVES, Settings, block_on};
use proptest::prelude::*;
use support::{Flash, Torn, WORD, changed, load, map, write_map};

/// The size of the STM32H743's pages.
const LARGE: usize = 128 * 1024;
/// Pages that are full now and then.
const SMALL: usize = 12 * 1024;

#[test]
fn keys_and_names_are_unique_and_defaults_within_bounds() {
    let mut settings = Settings::default();
    for (place, leaf) in LEAVES.iter().enumerate() {
        assert!((100..1000).contains(&leaf.key), "{}", leaf.name);
        for other in &LEAVES[..place] {
            assert!(other.key != leaf.key && other.name != leaf.name, "{}", leaf.name);
        }
        let value = leaf.value(&settings);
        let before = settings.clone();
        leaf.set(&mut settings, value).unwrap();
        assert_eq!(settings, before, "{}", leaf.name);
        assert_eq!(Leaf::keyed(leaf.key).unwrap().name, leaf.name);
        assert_eq!(Leaf::named(leaf.name).unwrap().key, leaf.key);
    }
    // Each leaf is a place of its own.
    for leaf in &LEAVES {
        let mut one = Settings::default();
        leaf.set(&mut one, leaf.value(&changed(0.71))).unwrap();
        let different = LEAVES.iter().filter(|other| other.value(&one) != other.value(&Settings::default()));
        assert_eq!(different.map(|leaf| leaf.name).collect::<Vec<_>>(), [leaf.name]);
    }
}

#[test]
fn what_is_stored_is_read() {
    let mut store = Store::new(Flash::<LARGE>::new()).unwrap();
    assert_eq!(load(&mut store).0, Settings::default());
    let (settings, landmarks) = (changed(0.3), map(LANDMARKS as u16, 0.0));
    block_on(store.store_leaves(&settings)).unwrap();
    write_map(&mut store, &landmarks).unwrap();
    block_on(store.provision_key(&[7; 32])).unwrap();
    assert_eq!([block_on(store.count_start()), block_on(store.count_start())], [Ok(1), Ok(2)]);
    let mut store = Store::new(Flash::<LARGE>::clone(&store.into_flash())).unwrap();
    let (found, found_map, loaded) = load(&mut store);
    assert_eq!((found, found_map), (settings, landmarks));
    assert_eq!((usize::from(loaded.leaves), loaded.bad, loaded.was_formatted), (LEAVES.len(), 0, false));
    assert_eq!(store.key(), Some([7; 32]));
    assert_eq!(block_on(store.count_start()), Ok(3));
    assert!(block_on(store.begin_map(LANDMARKS as u16 + 1)).is_err());
}

#[test]
fn a_stored_setting_that_does_not_go_with_the_others_is_named_and_not_taken() {
    let set = |settings: &mut Settings, name: &str, value: f64| {
        Leaf::named(name).unwrap().set(settings, Value::Number(value)).unwrap();
    };
    for (nearest, is_default_enough) in [(40.0, true), (0.4, false)] {
        let mut settings = changed(0.3);
        set(&mut settings, "features.nearest", nearest);
        set(&mut settings, "features.farthest", if is_default_enough { 20.0 } else { 0.3 });
        let mut store = Store::new(Flash::<LARGE>::new()).unwrap();
        block_on(store.store_leaves(&settings)).unwrap();
        let (found, _, loaded) = load(&mut store);
        assert_eq!(loaded.contradiction, Some("features.nearest"));
        assert_eq!(found.parameters.check(), Ok(()));
        let parameters = Settings::default().parameters;
        if is_default_enough {
            settings.parameters.features.nearest = parameters.features.nearest;
        } else {
            settings.parameters = parameters;
            settings.vehicle = Settings::default().vehicle;
        }
        assert_eq!(found, settings);
    }
}

#[test]
fn a_stored_bus_that_is_loaded_too_much_is_named_and_not_taken() {
    let mut settings = Settings::default();
    // 71.8 % of 125 kbit/s, by hand: see `service.rs`.
    Leaf::named("can.bit_rate").unwrap().set(&mut settings, Value::Whole(125)).unwrap();
    let mut store = Store::new(Flash::<LARGE>::new()).unwrap();
    block_on(store.store_leaves(&settings)).unwrap();
    let (found, _, loaded) = load(&mut store);
    assert_eq!((loaded.contradiction, found), (Some("can.publishing_period"), Settings::default()));
}

#[test]
fn the_largest_map_can_be_replaced_for_ever() {
    let mut store = Store::new(Flash::<LARGE>::new()).unwrap();
    for turn in 0..6 {
        block_on(store.store_leaves(&changed(0.1 * f64::from(turn)))).unwrap();
        let landmarks = map(LANDMARKS as u16 - turn, f64::from(turn));
        write_map(&mut store, &landmarks).unwrap();
        assert_eq!(load(&mut store).1, landmarks);
    }
}

#[test]
fn the_same_settings_wear_nothing_out() {
    let mut store = Store::new(Flash::<SMALL>::new()).unwrap();
    block_on(store.store_leaves(&changed(0.3))).unwrap();
    let flash = store.into_flash();
    let work = flash.work;
    let mut store = Store::new(flash).unwrap();
    block_on(store.store_leaves(&changed(0.3))).unwrap();
    assert_eq!(store.into_flash().work, work);
}

#[test]
fn a_full_page_is_read_a_few_times_and_not_once_for_each_setting() {
    let mut store = Store::new(Flash::<LARGE>::new()).unwrap();
    block_on(store.store_leaves(&changed(0.3))).unwrap();
    let items = LARGE / (2 * WORD);
    for _ in LEAVES.len()..items - 2 {
        block_on(store.count_start()).unwrap();
    }
    let mut flash = store.into_flash();
    flash.reads = 0;
    let mut store = Store::new(flash).unwrap();
    assert_eq!(load(&mut store).0, changed(0.3));
    let flash = store.into_flash();
    // A header and its data for each item: once for all leaves, and once each for the map and whatever is looked for.
    assert!(flash.reads > items && flash.reads < 8 * items, "{} reads for {items} items", flash.reads);
}

#[test]
fn a_loss_of_power_at_any_point_leaves_each_setting_old_or_new() {
    // So that pages are full, and erased, at other points of the work.
    for starts in [0, 20, 40, 60, 80] {
        lose_power_after(starts, Torn::Half);
    }
    lose_power_after(90, Torn::Zeros);
}

#[test]
fn so_does_a_second_loss_while_the_first_one_is_made_good() {
    let (starts, torn) = (80, Torn::Zeros);
    let (old, new) = (changed(0.3), changed(0.6));
    let flash = with_starts(&old, starts);
    for first in (1..).step_by(13) {
        let (cut, is_whole) = cut_after(&flash, first, torn, &new);
        for second in [1, 2, 3, 8, 60] {
            let (twice, _) = cut_after(&cut, second, torn, &new);
            let mut store = Store::new(twice).unwrap();
            let (found, _, loaded) = load(&mut store);
            let at = format!("cut at {first} and {second}");
            assert_eq!(
                (usize::from(loaded.leaves), loaded.bad, loaded.was_formatted),
                (LEAVES.len(), 0, false),
                "{at}"
            );
            assert_eq!(store.key(), Some([9; 32]), "{at}");
            for leaf in &LEAVES {
                let value = leaf.value(&found);
                assert!(value == leaf.value(&new) || value == leaf.value(&old), "{at}: {}", leaf.name);
            }
            block_on(store.store_leaves(&new)).unwrap();
            assert_eq!(load(&mut store).0, new, "{at}");
        }
        if is_whole {
            break;
        }
    }
}

/// Flash with these settings, which were kept behind others, and so many starts.
fn with_starts(settings: &Settings, starts: usize) -> Flash<SMALL> {
    let mut store = Store::new(Flash::<SMALL>::new()).unwrap();
    block_on(store.provision_key(&[9; 32])).unwrap();
    block_on(store.store_leaves(&Settings::default())).unwrap();
    block_on(store.store_leaves(settings)).unwrap();
    for _ in 0..starts {
        block_on(store.count_start()).unwrap();
    }
    store.into_flash()
}

/// What is left when a controller starts, keeps settings, and the power goes with a piece of its work; and whether that was all of it.
fn cut_after(flash: &Flash<SMALL>, work: usize, torn: Torn, settings: &Settings) -> (Flash<SMALL>, bool) {
    let mut cut = flash.clone();
    (cut.power, cut.torn) = (Some(work), torn);
    let mut store = Store::new(cut).unwrap();
    let mut landmarks = heapless::Vec::<Landmark, LANDMARKS>::new();
    let has_loaded = store.load(&mut Settings::default(), &mut landmarks).is_ok();
    let has_finished = has_loaded && block_on(store.store_leaves(settings)).is_ok();
    let mut flash = store.into_flash();
    flash.power = None;
    (flash, has_finished)
}

fn lose_power_after(starts: usize, torn: Torn) {
    let (old, new) = (changed(0.3), changed(0.6));
    let flash = with_starts(&old, starts);
    let mut has_finished = false;
    let mut met = [0; 2];
    for power in 1.. {
        let mut cut = flash.clone();
        (cut.power, cut.torn) = (Some(power), torn);
        let mut store = Store::new(cut).unwrap();
        has_finished = block_on(store.store_leaves(&new)).is_ok();
        let mut flash = store.into_flash();
        flash.power = None;
        let mut store = Store::new(flash).unwrap();
        let (found, _, loaded) = load(&mut store);
        assert_eq!((usize::from(loaded.leaves), loaded.bad, loaded.was_formatted), (LEAVES.len(), 0, false), "{power}");
        assert_eq!(store.key(), Some([9; 32]), "{power}");
        for leaf in &LEAVES {
            let value = leaf.value(&found);
            let is_new = value == leaf.value(&new);
            assert!(is_new || value == leaf.value(&old), "{power}: {}", leaf.name);
            met[usize::from(is_new)] += 1;
        }
        // It can be done again.
        block_on(store.store_leaves(&new)).unwrap();
        assert_eq!(load(&mut store).0, new, "{power}");
        if has_finished {
            break;
        }
    }
    assert!(has_finished && met[0] > 100 && met[1] > 100, "{met:?}");
}

#[test]
fn a_loss_of_power_leaves_the_old_map_or_the_new_one() {
    const PAGE: usize = 24 * 1024;
    let (old, new) = (map(180, 0.0), map(170, 0.5));
    let mut store = Store::new(Flash::<PAGE>::new()).unwrap();
    block_on(store.store_leaves(&changed(0.3))).unwrap();
    write_map(&mut store, &old).unwrap();
    let flash = store.into_flash();
    let mut kept = [0; 2];
    for power in 1.. {
        let mut cut = flash.clone();
        cut.power = Some(power);
        let mut store = Store::new(cut).unwrap();
        let has_finished = write_map(&mut store, &new).is_ok();
        let mut flash = store.into_flash();
        flash.power = None;
        let mut store = Store::new(flash).unwrap();
        let (settings, found, loaded) = load(&mut store);
        assert_eq!(settings, changed(0.3), "{power}");
        assert!(!loaded.is_map_damaged && loaded.bad == 0, "{power}: {loaded:?}");
        assert!(found == old || found == new, "{power}: {}", found.len());
        kept[usize::from(found == new)] += 1;
        write_map(&mut store, &new).unwrap();
        assert_eq!(load(&mut store).1, new, "{power}");
        if has_finished {
            break;
        }
    }
    assert!(kept[0] > 10 && kept[1] > 0, "{kept:?}");
}

#[test]
fn a_bad_item_costs_one_setting() {
    let mut store = Store::new(Flash::<SMALL>::new()).unwrap();
    let settings = changed(0.4);
    block_on(store.store_leaves(&settings)).unwrap();
    let flash = store.into_flash();
    let mut worst = 0;
    for word in 0..2 * SMALL / WORD {
        let mut flash = flash.clone();
        if flash.bytes[word * WORD..][..WORD].iter().all(|byte| *byte == 0xFF) {
            continue;
        }
        flash.bytes[word * WORD + 9] ^= 0x10;
        let mut store = Store::new(flash).unwrap();
        let (found, _, loaded) = load(&mut store);
        let lost = LEAVES.iter().filter(|leaf| leaf.value(&found) != leaf.value(&settings));
        if !loaded.was_formatted {
            worst = worst.max(lost.count());
        }
        block_on(store.store_leaves(&settings)).unwrap();
        assert_eq!(load(&mut store).0, settings);
    }
    assert!(worst <= 1, "{worst}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn rubbish_is_survived_and_replaced(seed in any::<u64>(), share in 0.0f64..1.0) {
        let mut state = seed | 1;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as u8
        };
        let end = (share * 2.0 * SMALL as f64) as usize;
        let bytes = (0..2 * SMALL).map(|place| if place < end { random() } else { 0xFF }).collect();
        let mut store = Store::new(Flash::<SMALL>::filled(bytes)).unwrap();
        let (found, landmarks, loaded) = load(&mut store);
        prop_assert_eq!((found, landmarks.len()), (Settings::default(), 0));
        prop_assert_eq!(loaded.was_formatted, end > 0);
        let settings = changed(0.4);
        block_on(store.store_leaves(&settings)).unwrap();
        prop_assert_eq!(load(&mut store).0, settings);
    }
}
