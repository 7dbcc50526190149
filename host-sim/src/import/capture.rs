//! Network captures: what a NAV350 and its host said to each other over TCP.

use std::collections::HashMap;
use std::net::IpAddr;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use agv_core::measurement::Time;
use agv_core::record::RawSource;
use etherparse::{LaxNetSlice, LaxSlicedPacket, TransportSlice};

use super::packets::{self, PacketsError};
use super::raw::RawBytes;
use super::tcp_stream::TcpStream;

/// Ports on which the sensor listens.
pub const PORTS: [u16; 2] = [2111, 2112];

/// Why a capture could not be read.
#[derive(Debug, thiserror::Error)]
pub enum CaptureError {
    /// The packets cannot be read.
    #[error(transparent)]
    Packets(#[from] PacketsError),
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
    /// What is missing from the file.
    pub seen: packets::Seen,
}

/// Reads the connections to a sensor on one of `ports` (see [`PORTS`]). Segments are put in order, repetitions left out.
///
/// # Errors
/// See [`CaptureError`]. A capture that is cut off is read up to there.
pub fn read(path: &Path, ports: &[u16]) -> Result<Capture, CaptureError> {
    let mut talks = Talks { ports, ..Talks::default() };
    let seen = packets::for_each(path, |time, packet| {
        talks.packet(time, &packet);
        ControlFlow::Continue(())
    })?;
    let mut capture = talks.finish();
    (capture.packets, capture.seen) = (seen.packets, seen);
    if capture.raw.is_empty() {
        let ports = ports.iter().map(u16::to_string).collect::<Vec<_>>().join(" or ");
        return Err(CaptureError::NoSensor { path: path.to_owned(), packets: capture.packets, ports });
    }
    Ok(capture)
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
    end: Time,
}

impl Talks<'_> {
    fn packet(&mut self, time: Time, packet: &LaxSlicedPacket<'_>) -> Option<()> {
        let (source, destination): (IpAddr, IpAddr) = match packet.net.as_ref()? {
            LaxNetSlice::Ipv4(ip) => (ip.header().source_addr().into(), ip.header().destination_addr().into()),
            LaxNetSlice::Ipv6(ip) => (ip.header().source_addr().into(), ip.header().destination_addr().into()),
            LaxNetSlice::Arp(_) => return None,
        };
        let TransportSlice::Tcp(tcp) = packet.transport.as_ref()? else { return None };
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
        let Self { mut talks, end, .. } = self;
        let mut capture = Capture::default();
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
