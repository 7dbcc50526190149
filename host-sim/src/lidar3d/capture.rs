//! Packets of a multi-beam lidar in a network capture.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use agv_core::measurement::Time;
use agv_lidar3d::packet::ouster;
use etherparse::TransportSlice;

use super::kind::Datagram;
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

/// What a capture holds.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seen {
    /// Packets of the sensor.
    pub packets: usize,
    /// Packets that come near to being one.
    pub refused: usize,
    /// Other packets.
    pub other: usize,
    /// UDP port to which the sensor sends.
    pub port: Option<u16>,
    /// Whether the file ends in the middle of a packet.
    pub is_cut: bool,
}

/// Calls `take` with the time and the contents of each packet of a sensor, until it breaks off: to a port that is stated,
/// or to that of the first packet of a sensor. `ouster` describes an Ouster; other sensors are then not looked for.
///
/// # Errors
/// See [`CaptureError`]. A capture that is cut off is read up to there.
pub fn for_each_until(
    path: &Path,
    port: Option<u16>,
    ouster: Option<&ouster::Sensor>,
    mut take: impl FnMut(Time, &Datagram<'_>) -> ControlFlow<()>,
) -> Result<Seen, CaptureError> {
    let mut seen = Seen { port, ..Seen::default() };
    let mut detail = String::new();
    let all = packets::for_each(path, |time, packet| {
        let Some(TransportSlice::Udp(udp)) = packet.transport else { return ControlFlow::Continue(()) };
        let to = udp.destination_port();
        if seen.port.is_some_and(|port| port != to) {
            return ControlFlow::Continue(());
        }
        match Datagram::recognise(udp.payload(), to, ouster) {
            Ok(Some(datagram)) => {
                seen.packets += 1;
                seen.port = Some(to);
                return take(time, &datagram);
            }
            Ok(None) => {}
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
    if seen.packets == 0 {
        return Err(CaptureError::NoSensor { path: path.to_owned(), packets: all.packets, detail });
    }
    Ok(seen)
}

/// As [`for_each_until`], to the end, whatever the port.
///
/// # Errors
/// See [`CaptureError`].
pub fn for_each(path: &Path, mut take: impl FnMut(Time, &Datagram<'_>)) -> Result<Seen, CaptureError> {
    for_each_until(path, None, None, |time, datagram| {
        take(time, datagram);
        ControlFlow::Continue(())
    })
}
