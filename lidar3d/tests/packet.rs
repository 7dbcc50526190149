//! Packets: literal bytes, there and back, and bytes that are none.

use agv_lidar3d::calibration::{Calibration, Full, Laser, calibration_from_stream};
use agv_lidar3d::geometry::{Offsets, point_with_two_points};
use agv_lidar3d::packet::{
    BLOCKS, Decoder, Filter, LENGTH, Model, OtherSensor, Packet, PacketError, Point, RETURNS, Return, ReturnKind,
    ReturnMode, STATUS_CYCLE, Sensor, Tail, Tally,
};
use proptest::prelude::*;

const PLAIN: [Laser; 128] = [PLAIN_LASER; 128];
const PLAIN_LASER: Laser = Laser {
    distance: 0.0,
    elevation: 0.0,
    rotation: 0.0,
    vertical_offset: 0.0,
    horizontal_offset: 0.0,
    is_enabled: true,
    full: None,
};

/// A sensor whose beams all look ahead.
fn plain(sensor: Sensor) -> Model<'static> {
    let distance_resolution = sensor.distance_resolution();
    let lasers = &PLAIN[..sensor.lasers()];
    Model { sensor, lasers, distance_resolution, offsets: Offsets::Orthogonal, two_points: false }
}

fn decode(sensor: Sensor, bytes: &[u8]) -> (Vec<Point>, Tally) {
    let mut decoder = Decoder::new(&plain(sensor), sensor.filter());
    let mut points = Vec::new();
    decoder.packet(&Packet::new(bytes).unwrap(), |point| points.push(point)).unwrap();
    (points, decoder.tally())
}

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
        for sensor in Sensor::ALL {
            let mut decoder = Decoder::new(&plain(sensor), sensor.filter());
            if let Ok(packet) = Packet::new(&bytes) {
                let mut points = 0;
                let outcome = decoder.packet(&packet, |_| points += 1);
                let tally = decoder.tally();
                prop_assert_eq!(points, tally.points);
                let blocks = if outcome.is_ok() { packet.blocks().count() } else { 0 };
                prop_assert_eq!(tally.returns() as usize, RETURNS * blocks);
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
        sensor in prop_oneof![
            Just(Sensor::Hdl64e), Just(Sensor::Hdl32e), Just(Sensor::Vlp16), Just(Sensor::Vlp32c)
        ],
    ) {
        let blocks = std::array::from_fn::<_, BLOCKS, _>(|block| {
            let returns = std::array::from_fn::<_, RETURNS, _>(|place| Return {
                distance: counts[block * RETURNS + place],
                intensity: 0,
            });
            let is_lower = sensor == Sensor::Hdl64e && block % 2 == 1;
            // Both groups of an HDL-64E fire at once.
            let firing = if sensor == Sensor::Hdl64e { block / 2 } else { block };
            (is_lower, ((u32::from(start) + u32::from(step) * firing as u32) % 36_000) as u16, returns)
        });
        let bytes = Packet::write(&blocks, Tail([0; 6]));
        let model = Model { lasers: &lasers[..sensor.lasers()], offsets, two_points, ..plain(sensor) };
        let mut decoder = Decoder::new(&model, Filter::ALL);
        let mut points = Vec::new();
        decoder.packet(&Packet::new(&bytes).unwrap(), |point| points.push(point)).unwrap();
        prop_assert_eq!(points.len(), BLOCKS * RETURNS);
        for (index, point) in points.iter().enumerate() {
            let (block, place) = (index / RETURNS, index % RETURNS);
            // Firing times, us, from the manuals' tables.
            let (laser, time, cycle) = match sensor {
                Sensor::Hdl64e => {
                    (32 * (block % 2) + place, 7.2 * (place / 4) as f64 + [0.0, 1.3, 2.5, 3.7][place % 4], 57.6)
                }
                Sensor::Hdl32e => (place, 1.152 * place as f64, 46.08),
                Sensor::Vlp32c => (place, 2.304 * (place / 2) as f64, 55.296),
                Sensor::Vls128 => unreachable!("four banks of lasers"),
                Sensor::Vlp16 => (place % 16, 55.296 * (place / 16) as f64 + 2.304 * (place % 16) as f64, 110.592),
            };
            prop_assert_eq!(usize::from(point.laser), laser);
            let exact = f64::from(blocks[block].1) + f64::from(step) * time / cycle;
            let off = (f64::from(point.azimuth) - exact + 18_000.0).rem_euclid(36_000.0) - 18_000.0;
            prop_assert!(off.abs() <= 0.6, "{} {}", point.azimuth, exact);
            let azimuth = (0.01 * f64::from(point.azimuth)).to_radians();
            let distance = sensor.distance_resolution() * f64::from(counts[index]);
            let model = if two_points { point_with_two_points } else { agv_lidar3d::geometry::point };
            let expected = model(&lasers[laser], offsets, azimuth, distance);
            for (found, expected) in point.position.iter().zip(expected) {
                // A unit in the last place of single precision grows with the distance.
                prop_assert!((f64::from(*found) - expected).abs() < 1e-6 * distance.max(100.0), "{:?} {:?}", point, expected);
            }
        }
    }
}

#[test]
fn two_blocks_in_turn_are_of_one_firing_in_dual_return_mode() {
    let blocks = std::array::from_fn::<_, BLOCKS, _>(|block| {
        (false, 40 * (block / 2) as u16, [Return { distance: 5000 + block as u16, intensity: 1 }; RETURNS])
    });
    let bytes = Packet::write(&blocks, Tail([0, 0, 0, 0, 0x39, 0x22]));
    let azimuths: Vec<u16> = decode(Sensor::Vlp16, &bytes).0.iter().map(|point| point.azimuth).collect();
    // The second firing of a block is half way to the next pair of blocks.
    assert_eq!([azimuths[0], azimuths[16], azimuths[32], azimuths[48], azimuths[64]], [0, 20, 0, 20, 40]);
}

/// Two returns of each firing: the last and the strongest, by the place in the block.
fn dual(last: [Return; 3], strongest: [Return; 3]) -> [u8; LENGTH] {
    let blocks = std::array::from_fn::<_, BLOCKS, _>(|block| {
        let values = if block % 2 == 0 { last } else { strongest };
        (false, 40 * (block / 2) as u16, std::array::from_fn(|place| values[place % 3]))
    });
    Packet::write(&blocks, Tail([0, 0, 0, 0, 0x39, 0x28]))
}

#[test]
fn a_second_return_that_is_the_first_again_is_none() {
    let value = |distance, intensity| Return { distance, intensity };
    // One thing seen; something thin before a wall; a wall that outshines what is before it.
    let bytes =
        dual([value(3000, 9), value(3000, 9), value(3000, 90)], [value(3000, 9), value(1000, 80), value(1000, 8)]);
    let (points, tally) = decode(Sensor::Vlp32c, &bytes);
    assert_eq!((tally.points, tally.equal, tally.returns()), (12 * 32 - 66, 66, 384));
    let kinds = |place: u8| points.iter().filter(move |point| point.laser == place).map(|point| point.kind).take(2);
    assert!(kinds(0).eq([ReturnKind::Both; 2]));
    assert!(kinds(1).eq([ReturnKind::Last, ReturnKind::Strongest]));
    assert!(kinds(2).eq([ReturnKind::Last, ReturnKind::SecondStrongest]));
}

#[test]
fn packets_say_which_sensor_sends_them_and_in_which_return_mode() {
    for (bytes, sensor) in [(0x21, Sensor::Hdl32e), (0x22, Sensor::Vlp16), (0x28, Sensor::Vlp32c)] {
        let modes = [(0x37, ReturnMode::Strongest), (0x38, ReturnMode::Last), (0x39, ReturnMode::Dual)];
        for (mode, expected) in modes {
            let blocks = [(false, 0, [Return { distance: 500, intensity: 0 }; RETURNS]); BLOCKS];
            let bytes = Packet::write(&blocks, Tail([0, 0, 0, 0, mode, bytes]));
            let packet = Packet::new(&bytes).unwrap();
            assert_eq!((Sensor::of_packet(&packet), packet.tail().return_mode()), (Some(sensor), Some(expected)));
        }
    }
    // An HDL-64E puts a byte of its calibration there.
    let bytes = packet_of(|_, _| 500, Tail([0, 0, 0, 0, b'7', 0xA1]));
    assert_eq!(Sensor::of_packet(&Packet::new(&bytes).unwrap()), Some(Sensor::Hdl64e));
}

#[test]
fn packets_of_another_sensor_are_refused() {
    let blocks = [(false, 0, [Return { distance: 500, intensity: 0 }; RETURNS]); BLOCKS];
    let bytes = Packet::write(&blocks, Tail([0, 0, 0, 0, 0x37, 0x28]));
    let packet = Packet::new(&bytes).unwrap();
    let mut decoder = Decoder::new(&plain(Sensor::Hdl32e), Filter::ALL);
    let refused = OtherSensor { wanted: Sensor::Hdl32e, found: Sensor::Vlp32c };
    assert_eq!(decoder.packet(&packet, |_| panic!("a point")), Err(refused));
    assert_eq!(refused.to_string(), "the packets are of a VLP-32C, not of a HDL-32E");
}

#[test]
fn what_a_sensor_states_from_near_is_kept() {
    // 0.5 m: nearer than an HDL-64E can see.
    let blocks = [(false, 0, [Return { distance: 250, intensity: 0 }; RETURNS]); BLOCKS];
    let small = Packet::write(&blocks, Tail([0, 0, 0, 0, 0x37, 0x22]));
    assert_eq!(decode(Sensor::Vlp16, &small).1.points, 384);
    assert_eq!(decode(Sensor::Hdl64e, &packet_of(|_, _| 250, Tail([0; 6]))).1.near, 384);
}

#[test]
fn a_blind_side_does_not_count_as_speed() {
    // Between the sixth and the seventh block the sensor looks away.
    let blocks = std::array::from_fn::<_, BLOCKS, _>(|block| {
        let azimuth = if block < 6 { 20 * block } else { 18_000 + 20 * block };
        (false, azimuth as u16, [Return { distance: 5000, intensity: 1 }; RETURNS])
    });
    let bytes = Packet::write(&blocks, Tail([0, 0, 0, 0, 0x37, 0x28]));
    let points = decode(Sensor::Vlp32c, &bytes).0;
    let farthest = points.iter().take(RETURNS).map(|point| point.azimuth).max();
    // The last pair fires 34.56 of 55.296 us after the first.
    assert_eq!(farthest, Some(13));
}

#[test]
fn packets_made_of_range_images_are_of_the_angle_that_they_state() {
    let made = decode(Sensor::Hdl64e, &packet_of(|_, _| 5000, Tail::AT_ONCE)).0;
    assert!(made.iter().all(|point| point.azimuth % 100 == 0));
}

#[test]
fn four_banks_are_a_vls128() {
    let blocks = [(false, 0, [Return { distance: 2500, intensity: 0 }; RETURNS]); BLOCKS];
    let mut bytes = Packet::write(&blocks, Tail([0, 0, 0, 0, 0x37, 0xA1]));
    for (block, bytes) in bytes.as_chunks_mut::<100>().0.iter_mut().enumerate() {
        bytes[..2].copy_from_slice(&[[0xFF, 0xEE], [0xFF, 0xDD], [0xFF, 0xCC], [0xFF, 0xBB]][block % 4]);
        bytes[2..4].copy_from_slice(&(20 * (block / 4) as u16).to_le_bytes());
    }
    let (points, _) = decode(Sensor::Vls128, &bytes);
    assert_eq!(points.iter().map(|point| point.laser).max(), Some(127));
    assert!((points[0].position[0] - 10.0).abs() < 1e-6);
    // The ninth group, after a pause, is nine slots of 2.665 us after the first; the packet's time is that of the fourth.
    assert_eq!((points[64].azimuth, points[64].time), (9, 9 * 2665 - 8700));
    // With two returns the last four blocks are empty.
    bytes[1204] = 0x39;
    for block in 8..BLOCKS {
        bytes[100 * block..100 * block + 2].fill(0);
    }
    assert_eq!(Packet::new(&bytes).unwrap().blocks().count(), 8);
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
    let (seen, tally) = decode(Sensor::Hdl64e, &bytes);
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
