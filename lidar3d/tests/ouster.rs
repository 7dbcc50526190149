//! Recorded packets of Ouster's sensors, and packets of profiles that no recording has, against ouster-sdk.

mod support;

use std::path::PathBuf;

use agv_lidar3d::packet::Filter;
use agv_lidar3d::packet::ouster::{Decoder, MetadataError, PacketError, Profile, Sensor};
use support::compared::{Compared, TOLERANCE, apart_of};
use support::{packets_of_capture, peer, peer_bytes, recordings};

const SCRIPT: (&str, &str) = ("ouster_points.py", "ouster.sdk");
const TEST: &str = "points of Ouster's sensors";
const FOLDER: &str = "packets/ouster";

/// x, y, z, reflectivity, column, row, return and time after the packet's first column, us.
type Row = [f32; 8];

fn sensor(path: &PathBuf) -> Sensor {
    Sensor::read(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// They go return by return, we column by column; equal second returns are theirs alone.
fn compare(sensor: &Sensor, packets: &[Vec<u8>], theirs: &[Row]) -> Compared {
    let mut decoder = Decoder::new(sensor.clone(), Filter::ALL);
    let mut rest = theirs;
    let mut compared = Compared::default();
    for bytes in packets {
        let mut ours = Vec::new();
        let before = decoder.tally();
        decoder.packet(bytes, |point| ours.push(point)).unwrap();
        let equal = (decoder.tally().equal - before.equal) as usize;
        let (mine, behind) = rest.split_at(ours.len() + equal);
        rest = behind;
        let mut mine = mine.to_vec();
        mine.sort_by(|a, b| (a[7], a[5], a[6]).partial_cmp(&(b[7], b[5], b[6])).unwrap());
        let is_again = |pair: [&Row; 2]| pair[0][4..6] == pair[1][4..6] && pair[0][..3] == pair[1][..3];
        mine.dedup_by(|second, first| is_again([first, second]));
        assert_eq!(mine.len(), ours.len());
        for (our, [x, y, z, reflectivity, _, row, _, time]) in ours.iter().zip(mine) {
            compared.add(apart_of(our.position, [x, y, z]), false);
            assert_eq!((f32::from(our.intensity), f32::from(our.laser)), (reflectivity, row));
            assert!((0.001 * our.time as f32 - time).abs() < 0.01, "{} {time}", our.time);
            let [x, y, _] = our.position.map(f64::from);
            // Without the rotation of the beam, the point lies where the column looks.
            let rotation = sensor.azimuths[usize::from(our.laser)];
            let direction = (-y).atan2(x).to_degrees() - rotation;
            let off = (direction - 0.01 * f64::from(our.azimuth) + 180.0).rem_euclid(360.0) - 180.0;
            assert!(x.hypot(y) < 3.0 || off.abs() < 0.5, "{off}");
        }
    }
    assert!(rest.is_empty());
    compared
}

#[test]
fn points_are_those_of_ouster_sdk() {
    let Some(folder) = recordings(TEST, FOLDER) else { return };
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let (mut sensors, mut captures): (Vec<PathBuf>, Vec<PathBuf>) =
        files.partition(|path| path.extension().is_some_and(|found| found == "json"));
    sensors.sort();
    captures.sort();
    assert!(captures.len() >= 5);
    for capture in captures {
        let name = capture.file_stem().unwrap().to_string_lossy();
        // A capture without metadata of its own is of the sensor whose name begins like its own.
        let model = name.split('_').next().unwrap();
        let is_of = |metadata: &&PathBuf| metadata.file_name().unwrap().to_string_lossy().starts_with(model);
        let own = capture.with_extension("json");
        let metadata =
            sensors.iter().find(|metadata| **metadata == own).or_else(|| sensors.iter().find(is_of)).unwrap();
        let sensor = sensor(metadata);
        let packets = packets_of_capture(&capture, sensor.port.unwrap_or(7502));
        let Some(theirs) = peer::<8>(TEST, SCRIPT, &[metadata.to_str().unwrap()], &packets) else { return };
        let compared = compare(&sensor, &packets, &theirs);
        compared.report(&format!("{name} ({})", sensor.profile.name()), "ouster-sdk");
        assert!(compared.points > 10_000 && compared.worst <= TOLERANCE, "{compared:?}");
    }
}

#[test]
fn every_profile_is_read_as_ouster_sdk_writes_it() {
    let metadata = "OS-0-128-U1_v2.3.0_1024x10.json";
    let Some(metadata) = recordings(TEST, &format!("{FOLDER}/{metadata}")) else { return };
    for profile in Profile::ALL {
        let arguments = [metadata.to_str().unwrap(), profile.name()];
        let Some(bytes) = peer_bytes(TEST, SCRIPT, &arguments, &[]) else { return };
        let (packets, rows) = packets_and_rows(&bytes);
        let sensor = Sensor { profile, ..sensor(&metadata) };
        let compared = compare(&sensor, &packets, &rows);
        compared.report(profile.name(), "ouster-sdk");
        assert!(compared.points > 7_000 && compared.worst <= TOLERANCE, "{compared:?}");
    }
}

/// How many packets, length and bytes of each, and the rows of their points.
fn packets_and_rows(bytes: &[u8]) -> (Vec<Vec<u8>>, Vec<Row>) {
    let mut rest = bytes;
    let number = |rest: &mut &[u8]| {
        let (first, behind) = rest.split_first_chunk::<4>().unwrap();
        *rest = behind;
        u32::from_le_bytes(*first) as usize
    };
    let count = number(&mut rest);
    let packets = (0..count).map(|_| {
        let length = number(&mut rest);
        let (packet, behind) = rest.split_at(length);
        rest = behind;
        packet.to_vec()
    });
    let packets = packets.collect();
    let numbers: Vec<f32> = rest.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    (packets, numbers.as_chunks::<8>().0.to_vec())
}

const METADATA: &str = r#"{"beam_altitude_angles": [10, -10], "beam_azimuth_angles": [0, 0], "lidar_mode": "512x10",
    "lidar_origin_to_beam_origin_mm": 10, "lidar_to_sensor_transform": [-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 36, 0, 0, 0, 1]}"#;

#[test]
fn what_is_wrong_with_metadata_is_said() {
    let plain = Sensor::read(METADATA).unwrap();
    assert_eq!((plain.profile, plain.columns_per_frame, plain.pixels), (Profile::Legacy, 512, 2));
    let error = |text: &str| Sensor::read(text).unwrap_err();
    assert!(matches!(error("word"), MetadataError::Foreign { .. }));
    assert!(matches!(error("[1]"), MetadataError::Foreign { .. }));
    assert_eq!(error("{}"), MetadataError::Value { name: "beam_altitude_angles" });
    assert_eq!(error(&METADATA.replace("[0, 0]", "[0]")), MetadataError::Value { name: "pixels_per_column" });
    assert_eq!(error(&METADATA.replace("512x10", "x")), MetadataError::Value { name: "columns_per_frame" });
    let found = "RNG99".to_owned();
    let unknown = METADATA.replace("\"lidar_mode\"", "\"udp_profile_lidar\": \"RNG99\", \"lidar_mode\"");
    assert_eq!(error(&unknown), MetadataError::Profile { found });
}

#[test]
fn packets_of_another_length_or_with_a_column_too_many_are_refused() {
    let sensor = Sensor::read(METADATA).unwrap();
    let wanted = sensor.packet_length();
    let mut decoder = Decoder::new(sensor, Filter::ALL);
    let refused = decoder.packet(&vec![0; wanted - 1], |_| panic!("a point"));
    assert_eq!(refused, Err(PacketError::Length { found: wanted - 1, wanted }));
    let mut bytes = vec![0; wanted];
    bytes[8..10].copy_from_slice(&512_u16.to_le_bytes());
    let length = wanted / 16;
    bytes[length - 4..length].fill(0xFF);
    let refused = decoder.packet(&bytes, |_| panic!("a point"));
    assert_eq!(refused, Err(PacketError::Column { found: 512, columns: 512 }));
}
