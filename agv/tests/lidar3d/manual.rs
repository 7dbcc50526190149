//! The packet that the manual of the HDL-64E S2 prints.

use agv_host_sim::lidar3d::capture;
use agv_host_sim::lidar3d::kind::Datagram;
use agv_lidar3d::packet::{Packet, Sensor};
use agv_tests::recordings;

/// Counts of distance and intensities of the first four lasers of the first upper and the first lower block.
const UPPER: [(u16, u8); 4] = [(1395, 61), (1361, 54), (1449, 63), (1473, 52)];
const LOWER: [(u16, u8); 4] = [(1281, 30), (1301, 61), (1564, 118), (1231, 59)];

#[test]
fn it_decodes_to_the_values_printed() {
    let Some(bytes) = recordings("S2 manual", "lidar3d/pcap/hdl64e_s2_manual_sample_packet.bin") else { return };
    let bytes = std::fs::read(bytes).unwrap();
    let packet = Packet::new(&bytes).unwrap();
    let blocks: Vec<_> = packet.blocks().collect();
    assert_eq!(blocks.len(), 12);
    for (index, block) in blocks.iter().enumerate() {
        assert_eq!((block.bank(), block.azimuth()), (index % 2, 450));
    }
    for (block, expected) in blocks.iter().zip([UPPER, LOWER]) {
        let found = block.returns().map(|value| (value.distance, value.intensity));
        assert_eq!(found.take(4).collect::<Vec<_>>(), expected);
    }
    assert_eq!(packet.tail().early(), Some((9, *b"v26b")));
    assert_eq!(Sensor::of_packet(&packet), Some(Sensor::Hdl64e));
}

#[test]
fn the_capture_of_it_holds_the_same_bytes() {
    let folder = "lidar3d/pcap/hdl64e_s2_manual_sample_packet";
    let Some(bytes) = recordings("S2 manual", &format!("{folder}.bin")) else { return };
    let Some(capture) = recordings("S2 manual", &format!("{folder}.pcap")) else { return };
    let bytes = std::fs::read(bytes).unwrap();
    let mut angles = Vec::new();
    let seen = capture::for_each(&capture, |_, datagram| {
        let Datagram::Velodyne(packet) = datagram else { panic!("another sensor") };
        angles.extend(packet.blocks().map(|block| block.azimuth()));
        let expected = Packet::new(&bytes).unwrap();
        for (found, expected) in packet.blocks().zip(expected.blocks()) {
            assert!(found.returns().eq(expected.returns()));
        }
    })
    .unwrap();
    assert_eq!((seen.packets, seen.refused, seen.is_cut, angles.len()), (1, 0, false, 12));
}
