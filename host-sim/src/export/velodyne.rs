//! Packets of a multi-beam lidar as a network capture.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use agv_core::measurement::Time;
use agv_lidar3d::packet::{BLOCKS, LENGTH, PORT, Packet, RETURNS, Return, Tail};
use etherparse::PacketBuilder;
use pcap_parser::{LegacyPcapBlock, Linktype, PcapHeader, ToVec};

/// Addresses that the sensors have when they leave the factory.
const SENSOR: [u8; 4] = [192, 168, 3, 43];
const HOST: [u8; 4] = [192, 168, 3, 255];
const SENSOR_PORT: u16 = 443;

/// A capture that is written.
pub struct CaptureWriter {
    file: BufWriter<File>,
}

impl CaptureWriter {
    /// Creates a capture; an older one is replaced.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn create(path: &Path) -> io::Result<Self> {
        let mut file = BufWriter::new(File::create(path)?);
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
    pub fn finish(mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// Lasers of an HDL-64E.
const LASERS: usize = 2 * RETURNS;
/// Firings of all lasers in a packet: each one is two blocks.
const FIRINGS: usize = BLOCKS / 2;

/// Packs counts of distance as an HDL-64E S2 sends them, but all returns of a firing at the angle that is stated. `azimuths` are the angles of the head, 0.01 degrees; `count` is
/// asked for the distance at a column and of a laser. A last packet that is not full is filled with firings in which
/// nothing is seen.
pub fn hdl64e_packets(azimuths: &[u16], count: impl Fn(usize, usize) -> u16) -> Vec<[u8; LENGTH]> {
    let packets = azimuths.chunks(FIRINGS).enumerate().map(|(number, firings)| {
        let blocks = std::array::from_fn::<_, BLOCKS, _>(|block| {
            let (firing, is_lower) = (block / 2, block % 2 == 1);
            let azimuth = firings.get(firing).or(firings.last()).copied().unwrap_or(0);
            let returns = std::array::from_fn::<_, RETURNS, _>(|place| {
                let laser = if is_lower { LASERS / 2 + place } else { place };
                let distance = if firing < firings.len() { count(number * FIRINGS + firing, laser) } else { 0 };
                Return { distance, intensity: 0 }
            });
            (is_lower, azimuth, returns)
        });
        Packet::write(&blocks, Tail::AT_ONCE)
    });
    packets.collect()
}
