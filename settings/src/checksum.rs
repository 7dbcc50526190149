//! The checksum of what is kept in flash.

/// CRC-32 (ISO-HDLC).
pub const CHECKSUM: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
