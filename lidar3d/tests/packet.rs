//! Packets: literal bytes, there and back, and bytes that are none.

use agv_lidar3d::calibration::{Calibration, Full, Laser};
use agv_lidar3d::geometry::{Offsets, point_with_two_points};
use agv_lidar3d::packet::{
    BLOCKS, Decoder, Filter, LENGTH, Packet, PacketError, RETURNS, Return, STATUS_CYCLE, Sensor, Tail,
    calibration_from_stream,
};
use proptest::prelude::*;

fn packet_of(seen: impl Fn(usize, usize) -> u16, tail: Tail) -> [u8; LENGTH] {
    let blocks = std::array::from_fn::<_, BLOCKS, _>(|block| {
        let returns = std::array::from_fn::<_, RETURNS, _>(|place| Return {
            distance: seen(block, place),
            intensity: place as u8,
        });
        (block % 2 == 1, 100 * block as u16, returns)
    });
    Packet::write(&blocks, tail)
}

proptest! {
    #[test]
    fn distances_come_back_to_the_count(counts in prop::collection::vec(any::<u16>(), BLOCKS * RETURNS)) {
        let bytes = packet_of(|block, place| counts[block * RETURNS + place], Tail([0; 6]));
        let found: Vec<u16> = Packet::new(&bytes).unwrap().blocks().flat_map(|block| block.returns()).map(|r| r.distance).collect();
        prop_assert_eq!(found, counts);
    }

    #[test]
    fn no_bytes_do_harm(bytes in prop::collection::vec(any::<u8>(), LENGTH), azimuths in any::<[u16; BLOCKS]>()) {
        let mut bytes = bytes;
        for (block, azimuth) in bytes.as_chunks_mut::<100>().0.iter_mut().zip(azimuths) {
            block[..2].copy_from_slice(&[0xFF, 0xEE]);
            block[2..4].copy_from_slice(&azimuth.to_le_bytes());
        }
        let lasers = [Laser { is_enabled: true, ..Laser::default() }; 64];
        for sensor in [Sensor::Hdl64e, Sensor::Hdl32e, Sensor::Vlp16] {
            let mut decoder = Decoder::new(sensor, &lasers, Offsets::Orthogonal, true, Filter::default());
            if let Ok(packet) = Packet::new(&bytes) {
                let mut points = 0;
                decoder.packet(&packet, |_| points += 1);
                let tally = decoder.tally();
                prop_assert_eq!(points, tally.points);
                prop_assert_eq!(tally.points + tally.empty + tally.near + tally.far + tally.unused, 384);
            }
        }
    }
}

fn lasers() -> impl Strategy<Value = Vec<Laser>> {
    let near = (-0.1..0.1, -0.1..0.1).prop_map(|(x, y)| (0.9 + x, 0.9 + y));
    let one = ((0.5..1.5, -0.5..0.2, -0.2..0.2), (-0.3..0.3, -0.05..0.05), prop::option::of(near)).prop_map(
        |((distance, elevation, rotation), (vertical_offset, horizontal_offset), near)| Laser {
            distance,
            elevation,
            rotation,
            vertical_offset,
            horizontal_offset,
            is_enabled: true,
            full: near.map(|(distance_x, distance_y)| Full {
                distance_x,
                distance_y,
                has_two_points: true,
                ..Full::default()
            }),
        },
    );
    prop::collection::vec(one, 64)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// The decoder's arithmetic in single precision against the geometric model in double precision.
    #[test]
    fn points_are_those_of_the_geometric_model(
        lasers in lasers(),
        counts in prop::collection::vec(200_u16..60_000, BLOCKS * RETURNS),
        start in 0_u16..36_000,
        step in 0_u16..80,
        two_points in any::<bool>(),
        offsets in prop_oneof![Just(Offsets::Orthogonal), Just(Offsets::Alternate)],
        sensor in prop_oneof![Just(Sensor::Hdl64e), Just(Sensor::Hdl32e), Just(Sensor::Vlp16)],
    ) {
        let blocks = std::array::from_fn::<_, BLOCKS, _>(|block| {
            let returns = std::array::from_fn::<_, RETURNS, _>(|place| Return {
                distance: counts[block * RETURNS + place],
                intensity: 0,
            });
            let is_lower = sensor == Sensor::Hdl64e && block % 2 == 1;
            (is_lower, ((u32::from(start) + u32::from(step) * block as u32) % 36_000) as u16, returns)
        });
        let bytes = Packet::write(&blocks, Tail([0; 6]));
        let filter = Filter { near: 0.0, far: 200.0 };
        let mut decoder = Decoder::new(sensor, &lasers[..sensor.lasers()], offsets, two_points, filter);
        let mut points = Vec::new();
        decoder.packet(&Packet::new(&bytes).unwrap(), |point| points.push(point));
        prop_assert_eq!(points.len(), BLOCKS * RETURNS);
        for (index, point) in points.iter().enumerate() {
            let (block, place) = (index / RETURNS, index % RETURNS);
            // Firing times, us, from the manuals' tables.
            let (laser, time, cycle) = match sensor {
                Sensor::Hdl64e => (32 * (block % 2) + place, 0.0, 1.0),
                Sensor::Hdl32e => (place, 1.152 * place as f64, 46.08),
                Sensor::Vlp16 => (place % 16, 55.296 * (place / 16) as f64 + 2.304 * (place % 16) as f64, 110.592),
            };
            prop_assert_eq!(usize::from(point.laser), laser);
            let exact = f64::from(blocks[block].1) + f64::from(step) * time / cycle;
            let off = (f64::from(point.azimuth) - exact + 18_000.0).rem_euclid(36_000.0) - 18_000.0;
            prop_assert!(off.abs() <= 0.6, "{} {}", point.azimuth, exact);
            let azimuth = (0.01 * f64::from(point.azimuth)).to_radians();
            let distance = 0.002 * f64::from(counts[index]);
            let model = if two_points { point_with_two_points } else { agv_lidar3d::geometry::point };
            let expected = model(&lasers[laser], offsets, azimuth, distance);
            for (found, expected) in point.position.iter().zip(expected) {
                prop_assert!((f64::from(*found) - expected).abs() < 1e-4, "{:?} {:?}", point, expected);
            }
        }
    }
}

#[test]
fn two_blocks_in_turn_are_of_one_firing_in_dual_return_mode() {
    let blocks = std::array::from_fn::<_, BLOCKS, _>(|block| {
        (false, 40 * (block / 2) as u16, [Return { distance: 5000, intensity: 1 }; RETURNS])
    });
    let bytes = Packet::write(&blocks, Tail([0, 0, 0, 0, 0x39, 0x22]));
    let lasers = [Laser { is_enabled: true, ..Laser::default() }; 16];
    let mut decoder = Decoder::new(Sensor::Vlp16, &lasers, Offsets::Orthogonal, false, Filter::default());
    let mut azimuths = Vec::new();
    decoder.packet(&Packet::new(&bytes).unwrap(), |point| azimuths.push(point.azimuth));
    // The second firing of a block is half way to the next pair of blocks.
    assert_eq!([azimuths[0], azimuths[16], azimuths[32], azimuths[48], azimuths[64]], [0, 20, 0, 20, 40]);
}

#[test]
fn foreign_bytes_are_refused_with_the_reason() {
    let bytes = packet_of(|_, _| 500, Tail([0; 6]));
    let length = LENGTH - 1;
    assert_eq!(Packet::new(&bytes[..length]).err(), Some(PacketError::Length { length }));
    let mut foreign = bytes;
    foreign[100] = 0;
    assert!(matches!(Packet::new(&foreign), Err(PacketError::Identifier { block: 1, .. })));
    let mut turned = bytes;
    turned[2..4].copy_from_slice(&36_001u16.to_le_bytes());
    assert_eq!(Packet::new(&turned).err(), Some(PacketError::Azimuth { block: 0, found: 36_001 }));
    turned[2..4].copy_from_slice(&36_000u16.to_le_bytes());
    assert_eq!(Packet::new(&turned).unwrap().blocks().next().unwrap().azimuth(), 0);
}

#[test]
fn false_returns_are_counted_by_kind() {
    let bytes = packet_of(|_, place| [0, 400, 5000, 65_000][place % 4], Tail([0; 6]));
    let lasers = [Laser { is_enabled: true, ..Laser::default() }; 64];
    let mut decoder = Decoder::new(Sensor::Hdl64e, &lasers, Offsets::Orthogonal, false, Filter::default());
    let mut seen = Vec::new();
    decoder.packet(&Packet::new(&bytes).unwrap(), |point| seen.push(point));
    let tally = decoder.tally();
    assert_eq!(
        [tally.points, tally.empty, tally.near, tally.far, tally.unused],
        [96; 4].into_iter().chain([0]).collect::<Vec<_>>()[..]
    );
    // Odd blocks are of the lower lasers.
    assert!(seen.iter().any(|point| point.laser == 34) && seen.iter().any(|point| point.laser == 2));
}

#[test]
fn the_two_dialects_of_the_tail_are_told_apart() {
    let early = Tail([9, 0, b'v', b'2', b'6', b'b']);
    assert_eq!(early.early(), Some((9, *b"v26b")));
    let later = Tail([0x10, 0x27, 0, 0, b'H', 13]);
    assert_eq!((later.early(), later.micros(), later.status()), (None, Some(10_000), (b'H', 13)));
}

/// The status bytes that an S2 sends, beginning somewhere in the cycle.
fn stream(skipped: usize) -> Vec<Tail> {
    let mut calibration = vec![0u8; STATUS_CYCLE / 16 * 7];
    calibration[..7].copy_from_slice(b"UNIT#\x18\x18");
    for (id, record) in calibration[7..].as_chunks_mut::<28>().0.iter_mut().take(64).enumerate() {
        let values = [-700 + id as i16, 450, 1238, 1281, 1251, 214, -26, 17_000, 12];
        record[0] = id as u8;
        for (target, value) in record[1..].as_chunks_mut::<2>().0.iter_mut().zip(values) {
            target.copy_from_slice(&value.to_le_bytes());
        }
        record[19..21].copy_from_slice(&[30, 235]);
    }
    let (groups, _) = calibration.as_chunks::<7>();
    let cycle: Vec<Tail> = groups
        .iter()
        .flat_map(|group| {
            let clock = b"HMSDNYGTV".map(|kind| (kind, 11));
            let bytes = (b'1'..).zip(group.iter().copied());
            clock.into_iter().chain(bytes).map(|(kind, value)| Tail([0, 0, 0, 0, kind, value])).collect::<Vec<_>>()
        })
        .collect();
    cycle.iter().chain(&cycle).skip(skipped).copied().collect()
}

#[test]
fn the_calibration_is_read_from_the_stream_wherever_it_begins() {
    for skipped in [0, 1, 777] {
        let Calibration { lasers, .. } = calibration_from_stream(stream(skipped)).unwrap();
        assert_eq!(lasers.len(), 64);
        let laser = lasers[5];
        assert!((laser.elevation.to_degrees() + 6.95).abs() < 1e-9 && (laser.rotation.to_degrees() - 4.5).abs() < 1e-9);
        assert!((laser.distance - 1.238).abs() < 1e-9 && (laser.horizontal_offset + 0.026).abs() < 1e-9);
        let full = laser.full.unwrap();
        assert!((full.focal_distance - 17.0).abs() < 1e-9 && (full.focal_slope - 1.2).abs() < 1e-9);
        assert_eq!((full.min_intensity, full.max_intensity), (30, 235));
    }
    assert_eq!(calibration_from_stream(stream(0).into_iter().take(4000)), None);
}
