//! The checksum of what is kept in flash.

/// CRC-32 (ISO-HDLC).
pub const CHECKSUM: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

/// The checksum of bytes and a piece more, from that of the bytes; of no bytes it is 0.
pub fn continued(before: u32, piece: &[u8]) -> u32 {
    let mut digest = CHECKSUM.digest_with_initial((!before).reverse_bits());
    digest.update(piece);
    digest.finalize()
}
