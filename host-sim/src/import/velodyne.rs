//! Packets of a multi-beam lidar in a network capture.

use std::path::{Path, PathBuf};

use agv_core::measurement::Time;
use agv_lidar3d::packet::{LENGTH, PORT, Packet};
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

/// The packets of a capture.
#[derive(Clone, Debug, Default)]
pub struct Stream {
    /// Time of capture and bytes, all of them valid.
    pub packets: Vec<(Time, Box<[u8; LENGTH]>)>,
    /// Packets to the port that are not valid.
    pub refused: usize,
    /// Packets to other ports.
    pub other: usize,
    /// Whether the file ends in the middle of a packet.
    pub is_cut: bool,
}

/// Reads the packets to [`PORT`].
///
/// # Errors
/// See [`VelodyneError`].
pub fn read(path: &Path) -> Result<Stream, VelodyneError> {
    let mut stream = Stream::default();
    let mut detail = String::new();
    let seen = packets::for_each(path, |time, packet| {
        let Some(TransportSlice::Udp(udp)) = packet.transport else { return };
        if udp.destination_port() != PORT {
            return;
        }
        match (Packet::new(udp.payload()), udp.payload().try_into()) {
            (Ok(_), Ok(bytes)) => stream.packets.push((time, Box::new(bytes))),
            (outcome, _) => {
                stream.refused += 1;
                if let (Err(error), true) = (outcome, detail.is_empty()) {
                    detail = format!(": {error}");
                }
            }
        }
    })?;
    stream.other = seen.packets - stream.packets.len() - stream.refused;
    stream.is_cut = seen.is_cut;
    if stream.packets.is_empty() {
        return Err(VelodyneError::NoSensor { path: path.to_owned(), packets: seen.packets, detail });
    }
    Ok(stream)
}
