//! Packets of a multi-beam lidar in a network capture.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use agv_core::measurement::Time;
use agv_lidar3d::packet::ouster;
use etherparse::{LaxNetSlice, LaxSlicedPacket, TransportSlice};

use super::kind::Datagram;
use crate::account::Account;
use crate::import::packets::{self, PacketsError};

/// Why the packets could not be read.
#[derive(Debug, thiserror::Error)]
pub enum CaptureError {
    /// The capture cannot be read.
    #[error(transparent)]
    Packets(#[from] PacketsError),
    /// No packet is of such a sensor.
    #[error("{}: none of its {packets} packets is one of a sensor that is known{detail}", path.display())]
    NoSensor {
        /// The file.
        path: PathBuf,
        /// Packets in all.
        packets: usize,
        /// What is wrong with the first that comes near.
        detail: String,
    },
}

/// Which packets of a capture are wanted.
#[derive(Clone, Copy, Debug, Default)]
pub struct Wanted<'a> {
    /// UDP port to which the sensor sends; that of the first packet of a sensor if None.
    pub port: Option<u16>,
    /// Address from which it sends; that of the first packet of a sensor if None.
    pub address: Option<IpAddr>,
    /// Describes an Ouster; other sensors are then not looked for.
    pub ouster: Option<&'a ouster::Sensor>,
}

/// What a capture holds.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// Packets of the sensor.
    pub packets: usize,
    /// Packets that come near to being one.
    pub refused: usize,
    /// Other packets.
    pub other: usize,
    /// UDP port to which the sensor sends.
    pub port: Option<u16>,
    /// Address from which it sends.
    pub address: Option<IpAddr>,
    /// Packets of sensors that send from other addresses, or to other ports.
    pub others: BTreeMap<(IpAddr, u16), usize>,
    /// Whether the file ends in the middle of a packet.
    pub is_cut: bool,
    /// What is missing from the file.
    pub file: packets::Seen,
}

impl Seen {
    /// Says what is missing, and which other sensors there are.
    pub fn tell(&self, account: &mut Account) {
        account.take(self.packets);
        self.file.tell(account);
        account.leave_out_some("packets that come near to those of a sensor", self.refused);
        let own = self.address.map_or_else(String::new, |address| address.to_string());
        for ((address, port), count) in &self.others {
            account.warn(format!(
                "{count} packets of a sensor at {address}, port {port}, were left out beside those of {own}: choose with --address or --port"
            ));
        }
    }
}

/// Where a packet comes from.
fn source(packet: &LaxSlicedPacket<'_>) -> Option<IpAddr> {
    match packet.net.as_ref()? {
        LaxNetSlice::Ipv4(ip) => Some(ip.header().source_addr().into()),
        LaxNetSlice::Ipv6(ip) => Some(ip.header().source_addr().into()),
        LaxNetSlice::Arp(_) => None,
    }
}

/// Calls `take` with the time and the contents of each packet of a sensor, until it breaks off: of one that is wanted, or
/// of that of the first packet of a sensor.
///
/// # Errors
/// See [`CaptureError`]. A capture that is cut off is read up to there.
pub fn for_each_until(
    path: &Path,
    wanted: Wanted,
    mut take: impl FnMut(Time, &Datagram<'_>) -> ControlFlow<()>,
) -> Result<Seen, CaptureError> {
    let mut seen = Seen { port: wanted.port, address: wanted.address, ..Seen::default() };
    let mut detail = String::new();
    let all = packets::for_each(path, |time, packet| {
        let Some(TransportSlice::Udp(udp)) = &packet.transport else { return ControlFlow::Continue(()) };
        let (to, from) = (udp.destination_port(), source(&packet));
        let is_other = seen.port.is_some_and(|port| port != to)
            || from.is_some_and(|from| seen.address.is_some_and(|address| address != from));
        match Datagram::recognise(udp.payload(), to, wanted.ouster) {
            Ok(Some(_)) if is_other => {
                if let Some(from) = from {
                    *seen.others.entry((from, to)).or_default() += 1;
                }
            }
            Ok(Some(datagram)) => {
                seen.packets += 1;
                (seen.port, seen.address) = (Some(to), from.or(seen.address));
                return take(time, &datagram);
            }
            Ok(None) => {}
            Err(_) if is_other => {}
            Err(reason) => {
                seen.refused += 1;
                if detail.is_empty() {
                    detail = format!(": {reason}");
                }
            }
        }
        ControlFlow::Continue(())
    })?;
    seen.other = all.packets - seen.packets - seen.refused;
    seen.is_cut = all.is_cut;
    seen.file = all;
    if seen.packets == 0 {
        if detail.is_empty() && !seen.others.is_empty() {
            let others: Vec<String> =
                seen.others.keys().map(|(address, port)| format!("{address}, port {port}")).collect();
            detail =
                format!(" at the address and the port that were stated; there are sensors at {}", others.join("; "));
        }
        let mut account = Account::default();
        all.tell(&mut account);
        account.warnings().iter().for_each(|warning| detail.push_str(&format!("; {warning}")));
        return Err(CaptureError::NoSensor { path: path.to_owned(), packets: all.packets, detail });
    }
    Ok(seen)
}

/// As [`for_each_until`], to the end, whatever the port.
///
/// # Errors
/// See [`CaptureError`].
pub fn for_each(path: &Path, mut take: impl FnMut(Time, &Datagram<'_>)) -> Result<Seen, CaptureError> {
    for_each_until(path, Wanted::default(), |time, datagram| {
        take(time, datagram);
        ControlFlow::Continue(())
    })
}
