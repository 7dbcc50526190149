//! The packets of a network capture, pcap or pcapng, on any usual kind of link.

use std::fs::File;
use std::io::{self, Read};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use agv_core::measurement::Time;
use etherparse::{EtherType, LaxSlicedPacket};
use pcap_parser::pcapng::Block;
use pcap_parser::{Linktype, PcapBlockOwned, PcapError, create_reader};

/// Longest packet that can be read, bytes.
const BUFFER: usize = 1 << 20;

/// Why a capture could not be read.
#[derive(Debug, thiserror::Error)]
pub enum PacketsError {
    /// The operating system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// The file is no capture.
    #[error("{}: this is no network capture (pcap or pcapng)", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
    },
}

/// What was read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Seen {
    /// Packets in all, of whatever kind.
    pub packets: usize,
    /// Whether the file ends in the middle of a packet.
    pub is_cut: bool,
}

/// Calls `take` with the time and the headers of each IP packet of a capture, until it breaks off.
///
/// # Errors
/// See [`PacketsError`]. A capture that is cut off is read up to there.
pub fn for_each(
    path: &Path,
    take: impl FnMut(Time, LaxSlicedPacket<'_>) -> ControlFlow<()>,
) -> Result<Seen, PacketsError> {
    let file = File::open(path).map_err(|source| PacketsError::Io { path: path.to_owned(), source })?;
    for_each_in(file, take).ok_or_else(|| PacketsError::Foreign { path: path.to_owned() })
}

/// As [`for_each`], of any bytes; None if they are no capture.
pub fn for_each_in(
    bytes: impl Read + Send,
    mut take: impl FnMut(Time, LaxSlicedPacket<'_>) -> ControlFlow<()>,
) -> Option<Seen> {
    let mut reader = create_reader(BUFFER, bytes).ok()?;
    let mut interfaces = Interfaces::default();
    let mut seen = Seen::default();
    loop {
        match reader.next() {
            Ok((length, block)) => {
                if let Some((time, link, data)) = interfaces.packet(&block) {
                    seen.packets += 1;
                    if let Some(packet) = slice(link, data)
                        && take(time, packet).is_break()
                    {
                        break;
                    }
                }
                reader.consume(length);
            }
            Err(PcapError::Eof) => break,
            Err(PcapError::Incomplete(_)) => {
                if reader.reader_exhausted() || reader.refill().is_err() {
                    seen.is_cut = true;
                    break;
                }
            }
            Err(error) if seen.packets == 0 && !matches!(error, PcapError::UnexpectedEof) => return None,
            Err(_) => {
                seen.is_cut = true;
                break;
            }
        }
    }
    Some(seen)
}

/// How packets of an interface are to be read.
#[derive(Clone, Copy)]
struct Interface {
    link: Linktype,
    /// Ticks of its clock in a second.
    resolution: u64,
    /// What is to be added to its clock, s.
    offset: i64,
}

#[derive(Default)]
struct Interfaces(Vec<Interface>);

impl Interfaces {
    /// The packet in a block.
    fn packet<'a>(&mut self, block: &'a PcapBlockOwned<'a>) -> Option<(Time, Linktype, &'a [u8])> {
        match block {
            PcapBlockOwned::LegacyHeader(header) => {
                let resolution = if header.is_nanosecond_precision() { 1_000_000_000 } else { 1_000_000 };
                self.0 = vec![Interface { link: header.network, resolution, offset: 0 }];
                None
            }
            PcapBlockOwned::Legacy(packet) => {
                let interface = self.0.first()?;
                let fraction = u64::from(packet.ts_usec) * 1_000_000 / interface.resolution;
                let time = Time::from_micros(u64::from(packet.ts_sec) * 1_000_000 + fraction);
                Some((time, interface.link, captured(packet.data, packet.caplen)))
            }
            PcapBlockOwned::NG(Block::SectionHeader(_)) => {
                self.0.clear();
                None
            }
            PcapBlockOwned::NG(Block::InterfaceDescription(description)) => {
                let resolution = description.ts_resolution().filter(|resolution| *resolution > 0).unwrap_or(1_000_000);
                self.0.push(Interface { link: description.linktype, resolution, offset: description.ts_offset() });
                None
            }
            PcapBlockOwned::NG(Block::EnhancedPacket(packet)) => {
                let interface = self.0.get(packet.if_id as usize)?;
                let ticks = u64::from(packet.ts_high) << 32 | u64::from(packet.ts_low);
                let micros = u128::from(ticks) * 1_000_000 / u128::from(interface.resolution);
                let micros = i128::try_from(micros).ok()? + i128::from(interface.offset) * 1_000_000;
                let time = Time::from_micros(u64::try_from(micros).ok()?);
                Some((time, interface.link, captured(packet.data, packet.caplen)))
            }
            PcapBlockOwned::NG(_) => None,
        }
    }
}

/// The data of a block end with padding.
fn captured(data: &[u8], length: u32) -> &[u8] {
    data.get(..length as usize).unwrap_or(data)
}

/// The IP packet in a packet of a link.
fn slice(link: Linktype, data: &[u8]) -> Option<LaxSlicedPacket<'_>> {
    /// "Linux cooked capture": the protocol, and what follows it.
    fn cooked(data: &[u8], protocol: usize, length: usize) -> Option<LaxSlicedPacket<'_>> {
        let number = u16::from_be_bytes(*data.get(protocol..)?.first_chunk()?);
        Some(LaxSlicedPacket::from_ether_type(EtherType(number), data.get(length..)?))
    }
    match link {
        Linktype::ETHERNET => LaxSlicedPacket::from_ethernet(data).ok(),
        Linktype::LINUX_SLL => cooked(data, 14, 16),
        Linktype::LINUX_SLL2 => cooked(data, 0, 20),
        Linktype::NULL | Linktype::LOOP => LaxSlicedPacket::from_ip(data.get(4..)?).ok(),
        Linktype::RAW | Linktype::IPV4 | Linktype::IPV6 => LaxSlicedPacket::from_ip(data).ok(),
        _ => None,
    }
}
