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
    let is_written = || aside.metadata().is_ok_and(|written| written.len() > 0);
    if status.is_ok_and(|status| status.success()) && is_written() {
        file.finish().map_err(io(pdf))
    } else {
        Err(PdfError::Nothing { path: pdf.to_owned() })
    }
}
