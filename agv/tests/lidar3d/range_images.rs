//! Range images of a real HDL-64E, packed as its sensor sends them and decoded again.

use agv_core::measurement::Time;
use agv_host_sim::export::velodyne::CaptureWriter;
use agv_host_sim::import::range_image::RangeImages;
use agv_host_sim::lidar3d::capture;
use agv_host_sim::lidar3d::kind::Datagram;
use agv_lidar3d::geometry::Offsets;
use agv_lidar3d::packet::{Decoder, Filter, Model, Packet, Sensor};
use agv_tests::recordings;
use rayon::prelude::*;

const FOLDER: &str = "lidar3d/moosmann/MuehlburgerTor/velodyne_dist";

#[test]
fn all_counts_come_back_from_the_points() {
    let Some(folder) = recordings("range images as packets", FOLDER) else { return };
    let images = RangeImages::open(&folder).unwrap();
    assert_eq!(images.files.len(), 501);
    let lasers = images.calibration().lasers;
    let columns = images.rotations.len();
    let filter = Filter { near: 0.0, far: 200.0 };
    let model = Model {
        sensor: Sensor::Hdl64e,
        lasers: &lasers,
        distance_resolution: 0.002,
        offsets: Offsets::Orthogonal,
        two_points: true,
    };
    let compared: usize = (0..images.files.len())
        .into_par_iter()
        .map(|index| {
            let counts = images.counts(index).unwrap();
            let mut decoder = Decoder::new(&model, filter);
            let mut points = Vec::new();
            for bytes in images.packets(&counts) {
                decoder.packet(&Packet::new(&bytes).unwrap(), |point| points.push(point)).unwrap();
            }
            let seen = (0..columns).flat_map(|column| {
                let rows = counts.iter().skip(column).step_by(columns).enumerate();
                rows.filter(|(_, count)| **count > 0).map(move |(row, count)| (column, row, *count))
            });
            assert_eq!(points.len(), seen.clone().count());
            for (point, (column, row, count)) in points.iter().zip(seen) {
                let range = point.position.iter().map(|value| value * value).sum::<f32>().sqrt();
                assert_eq!((usize::from(point.laser), (range / 0.002).round() as u16), (row, count));
                let elevation = (point.position[2] / range).asin();
                assert!((f64::from(elevation) - images.elevations[row]).abs() < 1e-5);
                let turned = f64::from(point.position[1].atan2(point.position[0])) - images.rotations[column];
                let off = (turned + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
                // Half a count of the angle of the head.
                assert!(off.abs() < 0.0051_f64.to_radians(), "{off}");
            }
            points.len()
        })
        .sum();
    assert!(compared > 20_000_000, "{compared}");
}

#[test]
fn a_capture_brings_back_the_packets_it_was_written_from() {
    let Some(folder) = recordings("range images as packets", FOLDER) else { return };
    let images = RangeImages::open(&folder).unwrap();
    let packets = images.packets(&images.counts(300).unwrap());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan.pcap");
    let mut writer = CaptureWriter::create(&path).unwrap();
    for (number, bytes) in packets.iter().enumerate() {
        writer.packet(Time::from_micros(1_700_000_000_000_000 + 300 * number as u64), bytes).unwrap();
    }
    writer.finish().unwrap();
    let mut found = Vec::new();
    let seen = capture::for_each(&path, |time, datagram| {
        let Datagram::Velodyne(packet) = datagram else { panic!("another sensor") };
        found.push((time.micros(), packet.blocks().flat_map(|block| block.returns()).collect::<Vec<_>>()));
    })
    .unwrap();
    assert_eq!((seen.packets, seen.refused, seen.other, seen.is_cut), (packets.len(), 0, 0, false));
    for (number, ((micros, returns), bytes)) in found.iter().zip(&packets).enumerate() {
        assert_eq!(*micros, 1_700_000_000_000_000 + 300 * number as u64);
        let expected = Packet::new(bytes).unwrap();
        assert!(returns.iter().copied().eq(expected.blocks().flat_map(|block| block.returns())));
    }
}
