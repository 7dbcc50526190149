//! What a file looks like, for people who gave the wrong one.

/// First bytes of common files and what those files are.
const SIGNATURES: [(&[u8], &str); 23] = [
    (b"\x1f\x8b", "gzip-compressed data"),
    (b"\x28\xb5\x2f\xfd", "zstd-compressed data"),
    (b"\xfd7zXZ\0", "xz-compressed data"),
    (b"BZh", "bzip2-compressed data"),
    (b"PK\x03\x04", "a zip archive"),
    (b"\xd4\xc3\xb2\xa1", "a network capture (pcap)"),
    (b"\xa1\xb2\xc3\xd4", "a network capture (pcap)"),
    (b"\x4d\x3c\xb2\xa1", "a network capture (pcap)"),
    (b"\xa1\xb2\x3c\x4d", "a network capture (pcap)"),
    (b"\x0a\x0d\x0d\x0a", "a network capture (pcapng)"),
    (b"#ROSBAG", "a ROS bag"),
    (b"\x89MCAP", "an MCAP recording"),
    (b"SQLite format 3", "an SQLite database"),
    (b"\x89HDF", "an HDF5 file"),
    (
        b"LOGG",
        "a binary CAN log of Vector (BLF); `can_logconvert IN.blf OUT.log` of python-can makes a log of candump of it",
    ),
    (
        b"MDF     ",
        "a measurement file (MDF); `can_logconvert IN.mf4 OUT.log` of python-can makes a log of candump of it",
    ),
    (b"LASF", "a point cloud (LAS, LAZ)"),
    (b"AutoCAD Binary DXF", "a drawing in binary DXF"),
    (b"\x7fELF", "a program"),
    (b"\x89PNG", "a picture"),
    (b"\xff\xd8\xff", "a picture"),
    (b"%PDF", "a PDF document"),
    (b"\xd6AGV", "a log of this program"),
];

/// Begins a change of colour on a terminal.
const ESCAPE: u8 = 0x1B;

/// What a file looks like whose first bytes are these, to be put after "this is".
#[must_use]
pub fn describe(beginning: &[u8]) -> &'static str {
    if beginning.is_empty() {
        return "an empty file";
    }
    if let Some((_, description)) = SIGNATURES.iter().find(|(signature, _)| beginning.starts_with(signature)) {
        return description;
    }
    // A character may be cut at the end of what was read.
    let is_valid = match std::str::from_utf8(beginning) {
        Ok(_) => true,
        Err(error) => error.error_len().is_none() && error.valid_up_to() > 0,
    };
    // What a terminal showed may have colours.
    let is_control = |byte: &u8| byte.is_ascii_control() && !byte.is_ascii_whitespace() && *byte != ESCAPE;
    let has_controls = beginning.iter().any(is_control);
    if !is_valid || has_controls {
        return "binary data of an unknown kind";
    }
    match beginning.trim_ascii_start() {
        [b'{' | b'[', ..] => "text (JSON)",
        [b'<', ..] => "text (HTML or XML)",
        _ => "text",
    }
}

#[cfg(test)]
mod tests {
    use super::describe;

    #[test]
    fn common_files_are_told_apart() {
        assert_eq!(describe(b""), "an empty file");
        assert_eq!(describe(b"\x1f\x8b\x08\0"), "gzip-compressed data");
        assert_eq!(describe(b"\xd4\xc3\xb2\xa1\x02\0"), "a network capture (pcap)");
        assert_eq!(describe(b"FLASER 180 1.0\n"), "text");
        assert_eq!(describe(b" {\"a\": 1}"), "text (JSON)");
        assert_eq!(describe("Gr\u{f6}\u{df}e".as_bytes()), "text");
        assert_eq!(describe(&"Gr\u{f6}".as_bytes()[..3]), "text");
        assert_eq!(describe(b"\0\x01\x02\x03"), "binary data of an unknown kind");
        assert_eq!(describe(b"\xff\xfe\xfd"), "binary data of an unknown kind");
    }
}
