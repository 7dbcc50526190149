//! Packets of a multi-beam lidar in a network capture.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use agv_core::measurement::Time;
use agv_lidar3d::packet::{PORT, Packet};
use etherparse::TransportSlice;

use super::packets::{self, PacketsError};

/// Why the packets could not be read.
#[derive(Debug, thiserror::Error)]
pub enum VelodyneError {
    /// The capture cannot be read.
    #[error(transparent)]
    Packets(#[from] PacketsError),
    /// No packet is of such a sensor.
    #[error("{}: none of its {packets} packets is one of a Velodyne to UDP port {PORT}{detail}", path.display())]
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
    /// Packets of a sensor.
    pub packets: usize,
    /// Packets to the port that are not valid.
    pub refused: usize,
    /// Packets to other ports.
    pub other: usize,
    /// Whether the file ends in the middle of a packet.
    pub is_cut: bool,
}

/// Calls `take` with the time and the contents of each packet to [`PORT`].
///
/// # Errors
/// See [`VelodyneError`]. A capture that is cut off is read up to there.
pub fn for_each(path: &Path, mut take: impl FnMut(Time, &Packet<'_>)) -> Result<Seen, VelodyneError> {
    for_each_until(path, |time, packet| {
        take(time, packet);
        ControlFlow::Continue(())
    })
}

/// As [`for_each`], until `take` breaks off.
///
/// # Errors
/// See [`VelodyneError`].
pub fn for_each_until(
    path: &Path,
    mut take: impl FnMut(Time, &Packet<'_>) -> ControlFlow<()>,
) -> Result<Seen, VelodyneError> {
    let mut seen = Seen::default();
    let mut detail = String::new();
    let all = packets::for_each(path, |time, packet| {
        let Some(TransportSlice::Udp(udp)) = packet.transport else { return ControlFlow::Continue(()) };
        if udp.destination_port() != PORT {
            return ControlFlow::Continue(());
        }
        match Packet::new(udp.payload()) {
            Ok(packet) => {
                seen.packets += 1;
                return take(time, &packet);
            }
            Err(error) => {
                seen.refused += 1;
                if detail.is_empty() {
                    detail = format!(": {error}");
                }
            }
        }
        ControlFlow::Continue(())
    })?;
    seen.other = all.packets - seen.packets - seen.refused;
    seen.is_cut = all.is_cut;
    if seen.packets == 0 {
        return Err(VelodyneError::NoSensor { path: path.to_owned(), packets: all.packets, detail });
    }
    Ok(seen)
}
