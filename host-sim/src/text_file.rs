//! Files that people write or other programs leave: read whole, refused in one line.

use std::io::Read;
use std::path::{Path, PathBuf};

use flate2::read::MultiGzDecoder;

use crate::file_kind;
use crate::left_out::LeftOut;

/// Why a text file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TextFileError {
    /// The file does not exist.
    #[error("{}: there is no such file", path.display())]
    Missing {
        /// The file.
        path: PathBuf,
    },
    /// The operating system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// The file holds nothing.
    #[error("{}: there are no data in the file", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The file is something else.
    #[error("{}: this is not {expected} but {looks_like}", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What it should be.
        expected: &'static str,
        /// What it seems to be.
        looks_like: &'static str,
    },
    /// This program was built without what reads it.
    #[error("{}: {source}", path.display())]
    LeftOut {
        /// The file.
        path: PathBuf,
        /// What was left out.
        source: LeftOut,
    },
    /// A line is not what it should be.
    #[error("{}:{line}: {problem}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What is wrong with it.
        problem: String,
    },
}

impl TextFileError {
    /// What the operating system said of a file.
    #[must_use]
    pub fn of_system(path: &Path, source: std::io::Error) -> Self {
        let path = path.to_owned();
        if source.kind() == std::io::ErrorKind::NotFound { Self::Missing { path } } else { Self::Io { path, source } }
    }

    /// What is wrong with a line, counted from 1.
    #[must_use]
    pub fn of_line(path: &Path, line: usize, problem: impl Into<String>) -> Self {
        Self::Line { path: path.to_owned(), line, problem: problem.into() }
    }
}

/// The text of a file.
///
/// # Errors
/// If the file is missing, cannot be read, is empty, or is not text.
pub fn read(path: &Path, expected: &'static str) -> Result<String, TextFileError> {
    let bytes = std::fs::read(path).map_err(|source| TextFileError::of_system(path, source))?;
    text(path, bytes, expected)
}

/// A text, and whether it ends earlier than it should.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReadText {
    /// The text.
    pub text: String,
    /// Whether the compressed file that holds it was cut.
    pub is_cut: bool,
}

/// The text of a file that may be compressed with gzip, which its name then says, or its first bytes. One that ends early is read up to
/// there.
///
/// # Errors
/// As [`read`], and if it cannot be unpacked.
pub fn read_unpacked_as_far(path: &Path, expected: &'static str) -> Result<ReadText, TextFileError> {
    let packed = std::fs::read(path).map_err(|source| TextFileError::of_system(path, source))?;
    if path.extension().is_none_or(|extension| extension != "gz") && !packed.starts_with(b"\x1f\x8b") {
        return Ok(ReadText { text: text(path, packed, expected)?, is_cut: false });
    }
    let mut bytes = Vec::new();
    let is_cut = match MultiGzDecoder::new(&packed[..]).read_to_end(&mut bytes) {
        Ok(_) => false,
        Err(error) if error.kind() == std::io::ErrorKind::UnexpectedEof && !bytes.is_empty() => true,
        Err(source) => return Err(TextFileError::of_system(path, source)),
    };
    Ok(ReadText { text: text(path, bytes, expected)?, is_cut })
}

/// What programs of Windows put before a text.
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

fn text(path: &Path, mut bytes: Vec<u8>, expected: &'static str) -> Result<String, TextFileError> {
    if bytes.starts_with(BYTE_ORDER_MARK) {
        bytes.drain(..BYTE_ORDER_MARK.len());
    }
    if bytes.trim_ascii().is_empty() {
        return Err(TextFileError::Empty { path: path.to_owned() });
    }
    if let Some(text) = of_sixteen_bits(&bytes) {
        return Ok(text);
    }
    let looks_like = file_kind::describe(&bytes[..bytes.len().min(4096)]);
    let foreign = |looks_like| TextFileError::Foreign { path: path.to_owned(), expected, looks_like };
    match String::from_utf8(bytes) {
        Ok(text) if looks_like.starts_with("text") => Ok(text),
        Ok(_) => Err(foreign(looks_like)),
        Err(error) => {
            let looks_like = if looks_like.starts_with("text") { "text with binary data in it" } else { looks_like };
            of_western_europe(error.as_bytes()).ok_or_else(|| foreign(looks_like))
        }
    }
}

/// The beginning of a file as text, as far as it is one: in any encoding that is read, and unpacked if it is compressed with gzip.
#[must_use]
pub fn beginning_of(bytes: &[u8]) -> String {
    let mut unpacked = Vec::new();
    // What is not compressed, or cut, is looked at as far as it goes.
    let _ = MultiGzDecoder::new(bytes).read_to_end(&mut unpacked);
    let bytes = if unpacked.is_empty() { bytes } else { &unpacked };
    let bytes = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
    of_sixteen_bits(bytes).unwrap_or_else(|| String::from_utf8_lossy(bytes).into_owned())
}

/// Text in UTF-16 that says so with its first character, as spreadsheets save "Unicode text".
fn of_sixteen_bits(bytes: &[u8]) -> Option<String> {
    let order: fn([u8; 2]) -> u16 = match bytes {
        [0xFF, 0xFE, ..] => u16::from_le_bytes,
        [0xFE, 0xFF, ..] => u16::from_be_bytes,
        _ => return None,
    };
    // A last half of a character was cut off with what came behind it.
    let (pairs, _) = bytes.get(2..)?.as_chunks::<2>();
    let text = String::from_utf16(&pairs.iter().map(|pair| order(*pair)).collect::<Vec<_>>()).ok()?;
    let is_text = text.chars().all(|one| !one.is_control() || one.is_whitespace());
    // Recordings are ASCII for the most part.
    let is_plain = 2 * text.chars().filter(char::is_ascii).count() > text.chars().count();
    (is_text && is_plain && !text.trim().is_empty()).then_some(text)
}

/// What Windows-1252 has where Latin-1 has control characters; those without a meaning are themselves.
const WINDOWS: [char; 32] = [
    '\u{20AC}', '\u{81}', '\u{201A}', '\u{192}', '\u{201E}', '\u{2026}', '\u{2020}', '\u{2021}', '\u{2C6}', '\u{2030}',
    '\u{160}', '\u{2039}', '\u{152}', '\u{8D}', '\u{17D}', '\u{8F}', '\u{90}', '\u{2018}', '\u{2019}', '\u{201C}',
    '\u{201D}', '\u{2022}', '\u{2013}', '\u{2014}', '\u{2DC}', '\u{2122}', '\u{161}', '\u{203A}', '\u{153}', '\u{9D}',
    '\u{17E}', '\u{178}',
];

/// Text in Windows-1252: a few letters beside ASCII, and no control characters. None for anything else.
#[must_use]
pub fn of_western_europe(bytes: &[u8]) -> Option<String> {
    let has_controls = bytes.iter().any(|byte| byte.is_ascii_control() && !byte.is_ascii_whitespace());
    let others = bytes.iter().filter(|byte| !byte.is_ascii()).count();
    // Text is ASCII for the most part; binary data are not.
    if has_controls || others * 10 > bytes.len() {
        return None;
    }
    let character = |byte: &u8| WINDOWS.get(usize::from(byte.wrapping_sub(0x80))).copied().unwrap_or(char::from(*byte));
    Some(bytes.iter().map(character).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_bytes(bytes: &[u8]) -> Result<String, TextFileError> {
        text(Path::new("file"), bytes.to_vec(), "a table")
    }

    #[test]
    fn text_is_read_in_any_of_its_usual_encodings() {
        let text = "t;x\u{b0}\r\n1;2,5\n";
        let wide = |order: fn(u16) -> [u8; 2]| -> Vec<u8> {
            std::iter::once(0xFEFF).chain(text.encode_utf16()).flat_map(order).collect()
        };
        assert_eq!(read_bytes(text.as_bytes()).unwrap(), text);
        assert_eq!(read_bytes(&[BYTE_ORDER_MARK, text.as_bytes()].concat()).unwrap(), text);
        assert_eq!(read_bytes(&wide(u16::to_le_bytes)).unwrap(), text);
        assert_eq!(read_bytes(&wide(u16::to_be_bytes)).unwrap(), text);
        assert_eq!(read_bytes(b"t;x\xb0\r\n1;2,5\n").unwrap(), text);
        assert_eq!(read_bytes(b"price;12345678 \x80").unwrap(), "price;12345678 \u{20AC}");
        for bytes in [&[0xFF, 0xFE, 0, 0, 1, 0][..], &[0xFF, 0xFE], b"a\0b", &[200; 40]] {
            assert!(read_bytes(bytes).is_err(), "{bytes:?}");
        }
    }
}
