//! Recorded packets of Hesai's sensors against nebula's clouds of the same scans.

mod support;

use agv_lidar3d::calibration::{Calibration, CalibrationError, Laser};
use agv_lidar3d::packet::hesai::{Decoder, Packet, PacketError, Sensor};
use agv_lidar3d::packet::{Filter, Point, ReturnKind, Tally};
use proptest::prelude::*;
use support::compared::{Compared, TOLERANCE, apart_of};
use support::{file, packets_of_bag, points_of_pcd, recordings};

/// Room for a packet in a message.
const ROOM: usize = 1500;

const SENSORS: [(Sensor, &str); 3] =
    [(Sensor::Pandar40p, "40p"), (Sensor::PandarQt64, "qt64"), (Sensor::PandarXt32, "xt32")];

#[test]
fn points_are_those_of_nebula() {
    for (sensor, name) in SENSORS {
        let Some(folder) = recordings("points of Hesai's sensors", &format!("packets/{name}")) else { return };
        let packets = packets_of_bag(&file(&folder, "db3"), ROOM, true).concat();
        let calibration = Calibration::read(&std::fs::read_to_string(file(&folder, "csv")).unwrap()).unwrap();
        assert_eq!(calibration.lasers.len(), sensor.lasers());
        let mut decoder = Decoder::new(sensor, &calibration.lasers, Filter::ALL);
        let mut ours: Vec<Point> = Vec::new();
        for bytes in &packets {
            assert!(decoder.packet(&Packet::new(bytes).unwrap(), |point| ours.push(point)));
        }
        let theirs = points_of_pcd(&file(&folder, "pcd"));
        let compared = compare(&ours, &theirs);
        compared.report(sensor.name(), "nebula");
        assert!(compared.points > 30_000 && compared.worst <= TOLERANCE, "{compared:?}");
    }
}

/// They leave out what is near, and of two returns that are near each other the first, so the order is theirs with gaps.
fn compare(ours: &[Point], theirs: &[[f32; 3]]) -> Compared {
    let is_in = |point: &[f32; 3], ours: &[Point]| ours.iter().any(|our| apart_of(our.position, *point) < TOLERANCE);
    let begins = |start: &usize| {
        let window = &ours[*start..(start + 400).min(ours.len())];
        theirs[..20].iter().all(|point| is_in(point, window))
    };
    let start = (0..ours.len()).find(begins).expect("their scan is in the recording");
    let mut compared = Compared::default();
    let mut at = start;
    for other in theirs {
        let window = at.saturating_sub(400)..(at + 1500).min(ours.len());
        let apart = |index: &usize| apart_of(ours[*index].position, *other);
        let nearest = window.min_by(|a, b| apart(a).total_cmp(&apart(b))).unwrap_or(at);
        compared.add(apart(&nearest), false);
        at = nearest;
    }
    compared
}

/// A packet of a Pandar40P in which every laser sees the same.
fn packet(mode: u8, seen: impl Fn(usize) -> [u8; 3]) -> Vec<u8> {
    let block = |number: usize| {
        let azimuth = (20 * number as u16).to_le_bytes();
        [&[0xFF, 0xEE][..], &azimuth, &seen(number).repeat(40)].concat()
    };
    let mut bytes = (0..10).flat_map(block).collect::<Vec<u8>>();
    bytes.extend([0; 22]);
    bytes[1240 + 14] = mode;
    bytes
}

fn kinds(bytes: &[u8]) -> (Vec<ReturnKind>, Tally) {
    let lasers = [Laser { is_enabled: true, ..Laser::default() }; 40];
    let mut decoder = Decoder::new(Sensor::Pandar40p, &lasers, Sensor::Pandar40p.filter());
    let mut kinds = Vec::new();
    assert!(decoder.packet(&Packet::new(bytes).unwrap(), |point| kinds.push(point.kind)));
    kinds.dedup();
    (kinds, decoder.tally())
}

#[test]
fn a_second_return_that_is_the_first_again_is_none() {
    let (kinds_of_one, tally) = kinds(&packet(0x39, |_| [0xE8, 3, 7]));
    assert_eq!((kinds_of_one, tally.points, tally.equal), (vec![ReturnKind::Both], 200, 200));
    let (kinds_of_two, tally) = kinds(&packet(0x39, |block| [0xE8, 3 + (block % 2) as u8, 7]));
    assert_eq!(kinds_of_two[..2], [ReturnKind::Last, ReturnKind::Strongest]);
    assert_eq!((tally.points, tally.equal, tally.returns()), (400, 0, 400));
    assert_eq!(kinds(&packet(0x37, |_| [0xE8, 3, 7])).0, [ReturnKind::Strongest]);
}

#[test]
fn foreign_bytes_are_refused_with_the_reason() {
    let bytes = packet(0x37, |_| [0xE8, 3, 7]);
    let length = bytes.len() - 1;
    assert_eq!(Packet::new(&bytes[..length]).err(), Some(PacketError::Foreign { length }));
    let found = 0x99;
    assert_eq!(Packet::new(&packet(found, |_| [0; 3])).err(), Some(PacketError::ReturnMode { found }));
    let mut turned = bytes.clone();
    turned[2..4].copy_from_slice(&36_001_u16.to_le_bytes());
    assert_eq!(Packet::new(&turned).err(), Some(PacketError::Azimuth { block: 0, found: 36_001 }));
    let mut foreign = bytes;
    foreign[124] = 0;
    assert!(matches!(Packet::new(&foreign), Err(PacketError::Foreign { .. })));
}

proptest! {
    #[test]
    fn no_bytes_do_harm(bytes in prop::collection::vec(any::<u8>(), 1262), mode in 0x33_u8..0x3D) {
        let mut bytes = bytes;
        for block in 0..10 {
            bytes[124 * block..124 * block + 2].copy_from_slice(&[0xFF, 0xEE]);
            bytes[124 * block + 3] &= 0x7F;
        }
        bytes[1254] = mode;
        if let Ok(packet) = Packet::new(&bytes) {
            let lasers = [Laser { is_enabled: true, ..Laser::default() }; 40];
            let mut decoder = Decoder::new(Sensor::Pandar40p, &lasers, Sensor::Pandar40p.filter());
            prop_assert!(decoder.packet(&packet, |point| assert!(point.position.iter().all(|value| value.is_finite()))));
            prop_assert_eq!(decoder.tally().returns(), 400);
        }
    }
}

#[test]
fn tables_of_angles_are_checked() {
    let table = "Channel,Elevation,Azimuth\n1,15.0,-1.042\n2,11,0\n";
    let lasers = Calibration::read(table).unwrap().lasers;
    assert!(
        (lasers[0].elevation.to_degrees() - 15.0).abs() < 1e-12
            && (lasers[0].rotation.to_degrees() - 1.042).abs() < 1e-12
    );
    let error = |text: &str| Calibration::read(text).unwrap_err();
    assert_eq!(error(&table.replace("2,11", "3,11")), CalibrationError::Numbers { place: 1, found: 3 });
    assert_eq!(error(&table.replace("11,0", "11")), CalibrationError::Value { laser: 1, name: "azimuth" });
    assert!(matches!(error("Channel,Elevation,Azimuth\n"), CalibrationError::Foreign { .. }));
}
