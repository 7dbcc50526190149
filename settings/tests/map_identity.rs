//! Which map it is.

use agv_core::geometry::Point;
use agv_core::maps::Landmark;
use agv_settings::{Settings, map_identity};
use proptest::prelude::*;

fn map(seed: u16) -> Vec<Landmark> {
    let place = |id: u16| Point::new(f64::from(id) * 1.25, f64::from((id * 7 + seed) % 11) * 0.5);
    (1..=40).map(|id| Landmark::reflector(id, place(id), 0.002)).collect()
}

proptest! {
    #[test]
    fn a_map_keeps_its_identity_in_any_order(seed in 0_u16..1000, order in Just((0..40_usize).collect::<Vec<_>>()).prop_shuffle()) {
        let map = map(seed);
        let shuffled: Vec<Landmark> = order.iter().filter_map(|place| map.get(*place)).copied().collect();
        prop_assert_eq!(map_identity(&shuffled), map_identity(&map));
    }

    #[test]
    fn whatever_differs_is_another_map(seed in 0_u16..1000, place in 0..40_usize, change in 0..5) {
        let before = map(seed);
        let mut after = before.clone();
        if let Some(landmark) = after.get_mut(place) {
            match change {
                0 => landmark.id += 1000,
                1 => landmark.x += 1e-9,
                2 => landmark.y = -landmark.y - 1e-9,
                3 => landmark.deviation += 1e-3,
                _ => {}
            }
        }
        if change == 4 {
            after.remove(place);
        }
        prop_assert_ne!(map_identity(&after), map_identity(&before));
    }
}

#[test]
fn the_checksum_is_that_of_the_bytes_in_flash() {
    let landmark = Landmark::reflector(7, Point::new(1.5, -2.0), 0.002);
    // CRC-32 of ISO-HDLC, bit by bit.
    let bytes = postcard::to_slice(&landmark, &mut [0; 32]).map(|bytes| bytes.to_vec()).unwrap_or_default();
    assert!(!bytes.is_empty());
    let crc = bytes.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 })
    });
    assert_eq!(map_identity(&[landmark]), !crc);
}

#[test]
fn the_map_that_is_set_is_accepted_alone() {
    let mut settings = Settings::default();
    assert!(settings.accepts_map(&map(1)) && settings.accepts_map(&[]));
    settings.map_identity = map_identity(&map(1));
    assert!(settings.accepts_map(&map(1)));
    assert!(!settings.accepts_map(&map(2)) && !settings.accepts_map(&[]));
    assert_eq!(map_identity(&[]), 0);
}
