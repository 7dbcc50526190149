//! Pages on paper: Chromium prints them.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::output_file::OutputFile;

/// Names under which Chromium is installed.
const BROWSERS: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// Why there is no PDF.
#[derive(Debug, thiserror::Error)]
pub enum PdfError {
    /// There is no browser.
    #[error("a PDF needs Chromium, which is not there: apt-get install chromium, or name it in the variable CHROMIUM")]
    Browser,
    /// The file cannot be reached.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// The browser wrote a part of it.
    #[error("{}: Chromium has written {bytes} bytes, and the end is missing: is the disk full?", path.display())]
    Cut {
        /// The file.
        path: PathBuf,
        /// What there is of it.
        bytes: usize,
    },
    /// The browser wrote nothing.
    #[error("{}: Chromium has not written the PDF", path.display())]
    Nothing {
        /// The file.
        path: PathBuf,
    },
}

fn runs(browser: &Path) -> bool {
    let command = Command::new(browser).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    command.is_ok_and(|status| status.success())
}

/// Prints the page in `html` to `pdf`.
///
/// # Errors
/// If there is no Chromium, or it does not write the file.
pub fn write_pdf(html: &Path, pdf: &Path) -> Result<(), PdfError> {
    let stated = std::env::var_os("CHROMIUM").map(PathBuf::from);
    let browser = stated.into_iter().chain(BROWSERS.map(PathBuf::from)).find(|browser| runs(browser));
    let browser = browser.ok_or(PdfError::Browser)?;
    let io = |path: &Path| {
        let path = path.to_owned();
        move |source| PdfError::Io { path, source }
    };
    let html = html.canonicalize().map_err(io(html))?;
    let file = OutputFile::create(pdf).map_err(io(pdf))?;
    let aside = file.aside().unwrap_or(pdf).to_owned();
    let mut target = std::ffi::OsString::from("--print-to-pdf=");
    target.push(std::path::absolute(&aside).map_err(io(pdf))?);
    let mut command = Command::new(browser);
    // The page is this program's own, without scripts, so that no sandbox is needed; as root there is none.
    command.args(["--headless", "--no-sandbox", "--disable-gpu", "--no-pdf-header-footer"]).arg(target).arg(html);
    let status = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status();
    let is_done = status.is_ok_and(|status| status.success());
    let bytes = std::fs::read(&aside).map_err(io(pdf))?;
    if !is_done || bytes.is_empty() {
        Err(PdfError::Nothing { path: pdf.to_owned() })
    } else if !is_whole(&bytes) {
        // Chromium says nothing of a disk that is full.
        Err(PdfError::Cut { path: pdf.to_owned(), bytes: bytes.len() })
    } else {
        file.finish().map_err(io(pdf))
    }
}

/// Where the mark of its end stands, from the end (PDF 32000-1, 7.5.5, and Adobe's own readers).
const TAIL: usize = 1024;

fn is_whole(bytes: &[u8]) -> bool {
    let tail = &bytes[bytes.len().saturating_sub(TAIL)..];
    bytes.starts_with(b"%PDF-") && tail.windows(5).any(|word| word == b"%%EOF")
}
