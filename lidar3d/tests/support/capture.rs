//! Datagrams of a network capture.

use std::fs::File;
use std::path::Path;

use etherparse::defrag::IpDefragPool;
use etherparse::{SlicedPacket, TransportSlice, UdpSlice};
use pcap_parser::traits::PcapReaderIterator;
use pcap_parser::{LegacyPcapReader, PcapBlockOwned, PcapError};

/// The contents of each UDP datagram to a port, in order. Fragments are put together.
pub fn packets_of_capture(path: &Path, port: u16) -> Vec<Vec<u8>> {
    let mut reader = LegacyPcapReader::new(1 << 20, File::open(path).unwrap()).unwrap();
    let mut packets = Vec::new();
    let mut fragments: IpDefragPool<(), ()> = IpDefragPool::new();
    loop {
        match reader.next() {
            Ok((length, block)) => {
                if let PcapBlockOwned::Legacy(block) = block
                    && let Ok(packet) = SlicedPacket::from_ethernet(block.data)
                {
                    let mut keep = |udp: &UdpSlice<'_>| {
                        if udp.destination_port() == port {
                            packets.push(udp.payload().to_vec());
                        }
                    };
                    if let Some(TransportSlice::Udp(udp)) = &packet.transport {
                        keep(udp);
                    } else if let Ok(Some(whole)) = fragments.process_sliced_packet(&packet, (), ()) {
                        keep(&UdpSlice::from_slice(&whole.payload).unwrap());
                    }
                }
                reader.consume(length);
            }
            Err(PcapError::Eof) => return packets,
            Err(PcapError::Incomplete(_)) => reader.refill().unwrap(),
            Err(error) => panic!("{error}"),
        }
    }
}
