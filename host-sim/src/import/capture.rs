//! Network captures: what a NAV350 and its host said to each other over TCP.

use std::collections::HashMap;
use std::fs::File;
use std::io;
use std::net::IpAddr;
use std::path::{Path, PathBuf};

use agv_core::measurement::Time;
use agv_core::record::RawSource;
use etherparse::{EtherType, LaxNetSlice, LaxSlicedPacket, TransportSlice};
use pcap_parser::pcapng::Block;
use pcap_parser::{Linktype, PcapBlockOwned, PcapError, create_reader};

use super::raw::RawBytes;
use super::tcp_stream::TcpStream;

/// Ports on which the sensor listens.
pub const PORTS: [u16; 2] = [2111, 2112];

/// Longest packet that can be read, bytes.
const BUFFER: usize = 1 << 20;

/// Why a capture could not be read.
#[derive(Debug, thiserror::Error)]
pub enum CaptureError {
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
    /// No packet belongs to a sensor.
    #[error("{}: none of its {packets} packets is of a connection to port {ports}", path.display())]
    NoSensor {
        /// The file.
        path: PathBuf,
        /// How many packets there are.
        packets: usize,
        /// Ports that were looked for.
        ports: String,
    },
}

/// What a capture holds.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Capture {
    /// The bytes of both directions in order; an empty piece from the sensor begins a connection.
    pub raw: Vec<RawBytes>,
    /// Packets in all.
    pub packets: usize,
    /// Bytes that are missing because their packets were not captured.
    pub lost: u64,
    /// Connections that are left out because another one to a sensor was open.
    pub left_out: usize,
    /// Whether the file ends in the middle of a packet.
    pub is_cut: bool,
}

/// Reads the connections to a sensor on one of `ports` (see [`PORTS`]). Segments are put in order, repetitions left out.
///
/// # Errors
/// See [`CaptureError`]. A capture that is cut off is read up to there.
pub fn read(path: &Path, ports: &[u16]) -> Result<Capture, CaptureError> {
    let io = |source| CaptureError::Io { path: path.to_owned(), source };
    let foreign = || CaptureError::Foreign { path: path.to_owned() };
    let file = File::open(path).map_err(io)?;
    let mut reader = create_reader(BUFFER, file).map_err(|_| foreign())?;
    let mut interfaces = Interfaces::default();
    let mut talks = Talks { ports, ..Talks::default() };
    loop {
        match reader.next() {
            Ok((length, block)) => {
                if let Some((time, link, data)) = interfaces.packet(&block) {
                    // A packet of somebody else is nothing to complain about.
                    let _ = talks.packet(time, link, data);
                }
                reader.consume(length);
            }
            Err(PcapError::Eof) => break,
            Err(PcapError::Incomplete(_)) => {
                if reader.reader_exhausted() || reader.refill().is_err() {
                    talks.is_cut = true;
                    break;
                }
            }
            Err(_) if talks.packets == 0 => return Err(foreign()),
            Err(_) => {
                talks.is_cut = true;
                break;
            }
        }
    }
    let capture = talks.finish();
    if capture.raw.is_empty() {
        let ports = ports.iter().map(u16::to_string).collect::<Vec<_>>().join(" or ");
        return Err(CaptureError::NoSensor { path: path.to_owned(), packets: capture.packets, ports });
    }
    Ok(capture)
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

type Address = (IpAddr, u16);

/// One connection.
#[derive(Default)]
struct Talk {
    /// What the client says, what the sensor says.
    streams: [TcpStream; 2],
    raw: Vec<RawBytes>,
    /// Bytes from the sensor.
    answered: usize,
}

impl Talk {
    fn push(&mut self, is_from_sensor: bool, time: Time, bytes: Vec<u8>) {
        if bytes.is_empty() {
            return;
        }
        if is_from_sensor {
            self.answered += bytes.len();
        }
        let source = if is_from_sensor { RawSource::FromNav350 } else { RawSource::ToNav350 };
        self.raw.push(RawBytes { source, time, bytes });
    }

    fn span(&self) -> Option<(Time, Time)> {
        Some((self.raw.first()?.time, self.raw.last()?.time))
    }
}

#[derive(Default)]
struct Talks<'a> {
    ports: &'a [u16],
    /// Connections that may go on, by client and sensor.
    open: HashMap<(Address, Address), usize>,
    talks: Vec<Talk>,
    packets: usize,
    is_cut: bool,
    end: Time,
}

impl Talks<'_> {
    fn packet(&mut self, time: Time, link: Linktype, data: &[u8]) -> Option<()> {
        self.packets += 1;
        let packet = slice(link, data)?;
        let (source, destination): (IpAddr, IpAddr) = match packet.net? {
            LaxNetSlice::Ipv4(ip) => (ip.header().source_addr().into(), ip.header().destination_addr().into()),
            LaxNetSlice::Ipv6(ip) => (ip.header().source_addr().into(), ip.header().destination_addr().into()),
            LaxNetSlice::Arp(_) => return None,
        };
        let TransportSlice::Tcp(tcp) = packet.transport? else { return None };
        let (from, to) = ((source, tcp.source_port()), (destination, tcp.destination_port()));
        let is_from_sensor = !self.ports.contains(&to.1);
        if is_from_sensor && !self.ports.contains(&from.1) {
            return None;
        }
        self.end = time;
        let ends = if is_from_sensor { (to, from) } else { (from, to) };
        // A client that opens a connection leaves the one before, if there was one.
        if tcp.syn() && !is_from_sensor {
            self.open.remove(&ends);
        }
        let index = *self.open.entry(ends).or_insert_with(|| {
            self.talks.push(Talk::default());
            self.talks.len() - 1
        });
        let talk = self.talks.get_mut(index)?;
        let stream = &mut talk.streams[usize::from(is_from_sensor)];
        if tcp.syn() {
            stream.synchronise(tcp.sequence_number());
        } else {
            let bytes = stream.segment(tcp.sequence_number(), tcp.payload());
            talk.push(is_from_sensor, time, bytes);
        }
        Some(())
    }

    /// The connections one after the other. Of two at the same time the one on which the sensor said more is taken.
    fn finish(self) -> Capture {
        let Self { mut talks, packets, is_cut, end, .. } = self;
        let mut capture = Capture { packets, is_cut, ..Capture::default() };
        for talk in &mut talks {
            for is_from_sensor in [false, true] {
                let stream = &mut talk.streams[usize::from(is_from_sensor)];
                let rest = stream.finish();
                capture.lost += stream.lost();
                talk.push(is_from_sensor, end, rest);
            }
        }
        talks.sort_by_key(|talk| std::cmp::Reverse(talk.answered));
        let mut taken: Vec<(Time, Time, Talk)> = Vec::new();
        for talk in talks {
            let Some((first, last)) = talk.span() else { continue };
            if taken.iter().any(|(from, to, _)| first <= *to && last >= *from) {
                capture.left_out += 1;
            } else {
                taken.push((first, last, talk));
            }
        }
        taken.sort_by_key(|(first, ..)| *first);
        for (first, _, talk) in taken {
            capture.raw.push(RawBytes { source: RawSource::FromNav350, time: first, bytes: Vec::new() });
            capture.raw.extend(talk.raw);
        }
        capture
    }
}
