//! The packets of a network capture, pcap or pcapng, on any usual kind of link.

use std::fs::File;
use std::io::{self, Read};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use agv_core::measurement::Time;
use etherparse::{EtherType, LaxSlicedPacket};
use pcap_parser::pcapng::Block;
use pcap_parser::{Linktype, PcapBlockOwned, PcapError, create_reader};

use super::fragments::Fragments;
use crate::account::Account;

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
    /// Packets of which only the beginning was captured.
    pub short: usize,
    /// Packets of which the file does not say when they came.
    pub untimed: usize,
    /// Datagrams of which a fragment is missing.
    pub incomplete: usize,
    /// Packets of a kind of link that is not read.
    pub unread: usize,
}

impl Seen {
    /// Says what is missing.
    pub fn tell(&self, account: &mut Account) {
        if self.is_cut {
            account.warn(format!("the capture is cut off or damaged behind packet {}", self.packets));
        }
        if self.short > 0 {
            account.warn(format!(
                "only the beginning of {} of {} packets was captured: capture with a longer snap length (`tcpdump -s 0`)",
                self.short, self.packets
            ));
        }
        if self.untimed > 0 {
            account.warn(format!("the capture does not say when {} of {} packets came", self.untimed, self.packets));
        }
        if self.incomplete > 0 {
            account.warn(format!("fragments of {} datagrams are missing", self.incomplete));
        }
        if self.unread > 0 {
            account.warn(format!("{} of {} packets are of a kind of link that is not read", self.unread, self.packets));
        }
    }
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
    let mut fragments = Fragments::new();
    let mut latest = Time::default();
    loop {
        match reader.next() {
            Ok((length, block)) => {
                if let Some(Captured { time, link, data, is_short }) = interfaces.packet(&block) {
                    seen.packets += 1;
                    seen.short += usize::from(is_short);
                    seen.untimed += usize::from(time.is_none());
                    let time = time.unwrap_or(latest);
                    latest = time;
                    let Some(packet) = slice(link, data) else {
                        seen.unread += usize::from(!is_read(link));
                        reader.consume(length);
                        continue;
                    };
                    let whole = fragments.take(time, &packet);
                    let packet = match &whole {
                        Some(whole) => LaxSlicedPacket::from_ip(whole).unwrap_or(packet),
                        None => packet,
                    };
                    if take(time, packet).is_break() {
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
    seen.incomplete = fragments.lost();
    Some(seen)
}

/// A packet as a capture holds it.
struct Captured<'a> {
    /// When it came, if that is told.
    time: Option<Time>,
    link: Linktype,
    data: &'a [u8],
    /// Whether the end of it was not captured.
    is_short: bool,
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

/// The block type of packets of the first edition of pcapng, and bytes of its numbers before the packet.
const OLD_PACKET: u32 = 2;
const OLD_HEAD: usize = 20;

#[derive(Default)]
struct Interfaces {
    all: Vec<Interface>,
    /// Whether numbers of the section begin with the highest byte.
    is_big: bool,
}

impl Interfaces {
    /// The packet in a block.
    fn packet<'a>(&mut self, block: &'a PcapBlockOwned<'a>) -> Option<Captured<'a>> {
        match block {
            PcapBlockOwned::LegacyHeader(header) => {
                let resolution = if header.is_nanosecond_precision() { 1_000_000_000 } else { 1_000_000 };
                self.all = vec![Interface { link: header.network, resolution, offset: 0 }];
                None
            }
            PcapBlockOwned::Legacy(packet) => {
                let interface = self.all.first()?;
                let fraction = u64::from(packet.ts_usec) * 1_000_000 / interface.resolution;
                let time = Time::from_micros(u64::from(packet.ts_sec) * 1_000_000 + fraction);
                Some(interface.captured(Some(time), packet.data, packet.caplen, packet.origlen))
            }
            PcapBlockOwned::NG(Block::SectionHeader(header)) => {
                self.all.clear();
                self.is_big = header.big_endian();
                None
            }
            PcapBlockOwned::NG(Block::InterfaceDescription(description)) => {
                let resolution = description.ts_resolution().filter(|resolution| *resolution > 0).unwrap_or(1_000_000);
                self.all.push(Interface { link: description.linktype, resolution, offset: description.ts_offset() });
                None
            }
            PcapBlockOwned::NG(Block::EnhancedPacket(packet)) => {
                let interface = self.all.get(packet.if_id as usize)?;
                let time = interface.time(packet.ts_high, packet.ts_low)?;
                Some(interface.captured(Some(time), packet.data, packet.caplen, packet.origlen))
            }
            // Its packets are of the first interface, and bear no time.
            PcapBlockOwned::NG(Block::SimplePacket(packet)) => {
                let held = u32::try_from(packet.data.len()).unwrap_or(u32::MAX).min(packet.origlen);
                Some(self.all.first()?.captured(None, packet.data, held, packet.origlen))
            }
            PcapBlockOwned::NG(Block::Unknown(block)) if block.block_type == OLD_PACKET => self.old_packet(block.data),
            PcapBlockOwned::NG(_) => None,
        }
    }

    /// Number of the interface, drops, two halves of the time, length captured, length, packet.
    fn old_packet<'a>(&self, block: &'a [u8]) -> Option<Captured<'a>> {
        let (head, data) = block.split_first_chunk::<OLD_HEAD>()?;
        let number = |at: usize| {
            let bytes = [head[at], head[at + 1], head[at + 2], head[at + 3]];
            if self.is_big { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) }
        };
        let interface =
            if self.is_big { u16::from_be_bytes([head[0], head[1]]) } else { u16::from_le_bytes([head[0], head[1]]) };
        let interface = self.all.get(usize::from(interface))?;
        let time = interface.time(number(4), number(8))?;
        Some(interface.captured(Some(time), data, number(12), number(16)))
    }
}

impl Interface {
    fn time(&self, high: u32, low: u32) -> Option<Time> {
        let ticks = u64::from(high) << 32 | u64::from(low);
        let micros = u128::from(ticks) * 1_000_000 / u128::from(self.resolution);
        let micros = i128::try_from(micros).ok()? + i128::from(self.offset) * 1_000_000;
        Some(Time::from_micros(u64::try_from(micros).ok()?))
    }

    fn captured<'a>(&self, time: Option<Time>, data: &'a [u8], length: u32, whole: u32) -> Captured<'a> {
        Captured { time, link: self.link, data: captured(data, length), is_short: length < whole }
    }
}

/// The data of a block end with padding.
fn captured(data: &[u8], length: u32) -> &[u8] {
    data.get(..length as usize).unwrap_or(data)
}

/// Whether packets of a kind of link are looked into.
fn is_read(link: Linktype) -> bool {
    [
        Linktype::ETHERNET,
        Linktype::LINUX_SLL,
        Linktype::LINUX_SLL2,
        Linktype::NULL,
        Linktype::LOOP,
        Linktype::RAW,
        Linktype::IPV4,
        Linktype::IPV6,
    ]
    .contains(&link)
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
