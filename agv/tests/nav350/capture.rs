//! Network captures: packets in any order become the talk that they were cut from.

use std::path::Path;

use agv_core::measurement::Time;
use agv_core::record::RawSource;
use agv_host_sim::import::capture;
use agv_host_sim::import::raw::RawBytes;
use agv_host_sim::import::tcp_stream::TcpStream;
use agv_tests::recordings;
use etherparse::PacketBuilder;
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    /// Segments that are swapped, doubled and overlap, with numbers that wrap.
    #[test]
    fn segments_become_the_stream(
        bytes in prop::collection::vec(any::<u8>(), 1..4000),
        cuts in prop::collection::vec(1usize..300, 1..60),
        overlaps in prop::collection::vec(0usize..50, 60),
        swaps in prop::collection::vec((0usize..60, 1usize..4), 0..30),
        start in prop_oneof![any::<u32>(), u32::MAX - 3000..=u32::MAX],
    ) {
        let mut segments = Vec::new();
        let mut place = 0;
        for (cut, overlap) in cuts.iter().cycle().zip(overlaps.iter().cycle()) {
            if place >= bytes.len() {
                break;
            }
            let end = (place + cut).min(bytes.len());
            segments.push(place.saturating_sub(*overlap)..end);
            place = end;
        }
        let count = segments.len();
        for (first, distance) in swaps {
            let (a, b) = (first % count, (first % count + distance).min(count - 1));
            segments.swap(a, b);
        }
        // Some of them once more.
        segments.extend(segments.clone().into_iter().step_by(3));
        let mut stream = TcpStream::new();
        stream.synchronise(start);
        let mut together = Vec::new();
        for range in segments {
            let sequence = start.wrapping_add(1).wrapping_add(range.start as u32);
            together.extend(stream.segment(sequence, &bytes[range]));
        }
        together.extend(stream.finish());
        prop_assert_eq!(stream.lost(), 0);
        prop_assert_eq!(together, bytes);
    }
}

#[test]
fn what_was_not_captured_is_counted() {
    let mut stream = TcpStream::new();
    assert_eq!(stream.segment(100, b"abc"), b"abc");
    assert_eq!(stream.segment(110, b"klm"), b"");
    assert_eq!(stream.finish(), b"klm");
    assert_eq!(stream.lost(), 7);
}

/// A file of packets: client 10.0.0.1:40000, sensor 10.0.0.2:2112.
struct Packets {
    file: Vec<u8>,
    sequences: [u32; 2],
}

impl Packets {
    fn new() -> Self {
        let mut file = Vec::new();
        for word in [0xA1B2_C3D4u32, 0x0004_0002, 0, 0, 65_535, 1] {
            file.extend(word.to_le_bytes());
        }
        Self { file, sequences: [u32::MAX - 20_000, 77] }
    }

    fn packet(&mut self, micros: u64, is_from_sensor: bool, sequence: u32, is_syn: bool, payload: &[u8]) {
        let ends = [([10, 0, 0, 1], 40_000), ([10, 0, 0, 2], 2112)];
        let (from, to) = if is_from_sensor { (ends[1], ends[0]) } else { (ends[0], ends[1]) };
        let builder = PacketBuilder::ethernet2([1; 6], [2; 6]).ipv4(from.0, to.0, 64);
        let builder = builder.tcp(from.1, to.1, sequence, 4096);
        let mut bytes = Vec::new();
        let builder = if is_syn { builder.syn() } else { builder.ack(1) };
        builder.write(&mut bytes, payload).unwrap();
        // Short Ethernet frames are padded.
        bytes.resize(bytes.len().max(60), 0);
        let length = bytes.len() as u32;
        for word in [(micros / 1_000_000) as u32, (micros % 1_000_000) as u32, length, length] {
            self.file.extend(word.to_le_bytes());
        }
        self.file.extend(bytes);
    }

    fn open(&mut self, micros: u64) {
        for (is_from_sensor, sequence) in [(false, self.sequences[0]), (true, self.sequences[1])] {
            self.packet(micros, is_from_sensor, sequence, true, &[]);
        }
        self.sequences = self.sequences.map(|sequence| sequence.wrapping_add(1));
    }

    /// Sends bytes in segments of at most `size`; every seventh segment comes after its follower.
    fn send(&mut self, micros: u64, is_from_sensor: bool, bytes: &[u8], size: usize) {
        let index = usize::from(is_from_sensor);
        let mut segments = Vec::new();
        for piece in bytes.chunks(size) {
            segments.push((self.sequences[index], piece));
            self.sequences[index] = self.sequences[index].wrapping_add(piece.len() as u32);
        }
        for place in (1..segments.len()).step_by(7) {
            segments.swap(place - 1, place);
        }
        for (sequence, piece) in segments {
            self.packet(micros, is_from_sensor, sequence, false, piece);
        }
    }
}

/// The capture of a talk that was recorded by this program.
pub fn write(path: &Path, raw: &[RawBytes]) {
    let mut packets = Packets::new();
    let mut ports = 0;
    for one in raw {
        let micros = one.time.micros();
        match one.source {
            RawSource::FromNav350 if one.bytes.is_empty() => {
                ports += 1;
                packets.open(micros);
            }
            RawSource::FromNav350 => packets.send(micros, true, &one.bytes, 1400),
            RawSource::ToNav350 => packets.send(micros, false, &one.bytes, 1400),
            RawSource::FromCan | RawSource::ToCan => {}
        }
    }
    assert!(ports > 0);
    std::fs::write(path, packets.file).unwrap();
}

fn joined(raw: &[RawBytes], source: RawSource) -> Vec<u8> {
    raw.iter().filter(|one| one.source == source).flat_map(|one| one.bytes.clone()).collect()
}

#[test]
fn a_cut_or_foreign_file_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("talk.pcap");
    let raw = [
        RawBytes { source: RawSource::FromNav350, time: Time::from_micros(1_000_000), bytes: Vec::new() },
        RawBytes { source: RawSource::ToNav350, time: Time::from_micros(1_500_001), bytes: b"question".to_vec() },
        RawBytes { source: RawSource::FromNav350, time: Time::from_micros(1_600_002), bytes: vec![7; 5000] },
    ];
    write(&path, &raw);
    let found = capture::read(&path, &capture::PORTS).unwrap();
    assert_eq!((found.lost, found.seen.is_cut, found.left_out), (0, false, 0));
    for source in [RawSource::FromNav350, RawSource::ToNav350] {
        assert_eq!(joined(&found.raw, source), joined(&raw, source));
    }
    assert_eq!(found.raw[1], raw[1]);
    let whole = std::fs::read(&path).unwrap();
    std::fs::write(&path, &whole[..whole.len() - 100]).unwrap();
    assert!(capture::read(&path, &capture::PORTS).unwrap().seen.is_cut);
    std::fs::write(&path, &whole).unwrap();
    let error = capture::read(&path, &[9]).unwrap_err().to_string();
    assert!(error.contains("is of a connection to port 9"), "{error}");
    std::fs::write(&path, b"FLASER 180").unwrap();
    assert!(capture::read(&path, &capture::PORTS).unwrap_err().to_string().contains("no network capture"));
    assert!(capture::read(&folder.path().join("none"), &capture::PORTS).is_err());
}

/// The capture of a sister device, beside the telegrams that another program has taken out of such captures.
#[test]
fn a_real_capture_is_put_together() {
    let Some(file) =
        recordings("a_real_capture_is_put_together", "nav350/other_sick_cola/xd_pcap_json_converter_test.pcapng")
    else {
        return;
    };
    let found = capture::read(&file, &capture::PORTS).unwrap();
    assert_eq!((found.lost, found.seen.is_cut), (0, false));
    assert!(found.packets > 10);
    let bytes = joined(&found.raw, RawSource::FromNav350);
    // Every telegram follows the one before without a gap.
    let mut rest = &bytes[..];
    let mut count = 0;
    while let [2, 2, 2, 2, a, b, c, d, more @ ..] = rest {
        let length = u32::from_be_bytes([*a, *b, *c, *d]) as usize;
        let (payload, behind) = more.split_at(length);
        assert_eq!(payload.iter().fold(0, |sum, byte| sum ^ byte), behind[0]);
        assert!(payload.starts_with(b"s"));
        rest = &behind[1..];
        count += 1;
    }
    assert!(rest.is_empty() && count > 5, "{} bytes left behind {count} telegrams", rest.len());
}
