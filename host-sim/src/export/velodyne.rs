//! Packets of a multi-beam lidar as a network capture.

use std::io::{self, Write};
use std::path::Path;

use agv_core::measurement::Time;
use agv_lidar3d::packet::{LENGTH, PORT};
use etherparse::PacketBuilder;
use pcap_parser::{LegacyPcapBlock, Linktype, PcapHeader, ToVec};

use crate::output_file::OutputFile;

/// Addresses that the sensors have when they leave the factory.
const SENSOR: [u8; 4] = [192, 168, 3, 43];
const HOST: [u8; 4] = [192, 168, 3, 255];
const SENSOR_PORT: u16 = 443;

/// A capture that is written.
pub struct CaptureWriter {
    file: OutputFile,
}

impl CaptureWriter {
    /// Creates a capture; an older one is replaced when this one is finished.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn create(path: &Path) -> io::Result<Self> {
        let mut file = OutputFile::create(path)?;
        let mut header = PcapHeader::new();
        header.network = Linktype::ETHERNET;
        header.snaplen = u32::from(u16::MAX);
        file.write_all(&header.to_vec().map_err(io::Error::other)?)?;
        Ok(Self { file })
    }

    /// Adds a packet.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn packet(&mut self, time: Time, bytes: &[u8; LENGTH]) -> io::Result<()> {
        let builder = PacketBuilder::ethernet2([0x60, 0x76, 0x88, 0, 0, 0], [0xFF; 6])
            .ipv4(SENSOR, HOST, 64)
            .udp(SENSOR_PORT, PORT);
        let mut frame = Vec::with_capacity(builder.size(LENGTH));
        builder.write(&mut frame, bytes).map_err(io::Error::other)?;
        let micros = time.micros();
        let length = frame.len() as u32;
        let mut block = LegacyPcapBlock {
            ts_sec: (micros / 1_000_000) as u32,
            ts_usec: (micros % 1_000_000) as u32,
            caplen: length,
            origlen: length,
            data: &frame,
        };
        self.file.write_all(&block.to_vec().map_err(io::Error::other)?)
    }

    /// Writes what is still to be written.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn finish(self) -> io::Result<()> {
        self.file.finish()
    }
}
