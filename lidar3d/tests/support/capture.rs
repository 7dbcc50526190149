//! Datagrams of a network capture.

use std::fs::File;
use std::path::Path;

use etherparse::{SlicedPacket, TransportSlice};
use pcap_parser::traits::PcapReaderIterator;
use pcap_parser::{LegacyPcapReader, PcapBlockOwned, PcapError};

/// The contents of each UDP datagram to a port, in order.
pub fn packets_of_capture(path: &Path, port: u16) -> Vec<Vec<u8>> {
    let mut reader = LegacyPcapReader::new(1 << 20, File::open(path).unwrap()).unwrap();
    let mut packets = Vec::new();
    loop {
        match reader.next() {
            Ok((length, block)) => {
                if let PcapBlockOwned::Legacy(block) = block
                    && let Ok(packet) = SlicedPacket::from_ethernet(block.data)
                    && let Some(TransportSlice::Udp(udp)) = packet.transport
                    && udp.destination_port() == port
                {
                    packets.push(udp.payload().to_vec());
                }
                reader.consume(length);
            }
            Err(PcapError::Eof) => return packets,
            Err(PcapError::Incomplete(_)) => reader.refill().unwrap(),
            Err(error) => panic!("{error}"),
        }
    }
}
