//! Flash that is a file.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

use crate::provision::{PAGE, WORD};

/// Bytes of the file: two pages, as `agv provision` writes them.
const BYTES: usize = 2 * PAGE;

/// Why there is no flash in a file.
#[derive(Debug, thiserror::Error)]
pub enum FlashFileError {
    /// The operating system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// The file has another size.
    #[error("{}: the file has {found} bytes, and a flash has {BYTES}; agv provision writes one", path.display())]
    Size {
        /// The file.
        path: PathBuf,
        /// Its bytes.
        found: u64,
    },
    /// Another program has it.
    #[error("{}: another controller runs with this store", path.display())]
    Taken {
        /// The file.
        path: PathBuf,
    },
}

/// Why a read, a write or an erasure did not succeed.
#[derive(Debug)]
pub enum Refused {
    /// The place is none of the flash.
    Place(NorFlashErrorKind),
    /// The operating system refused.
    Io(io::Error),
}

impl NorFlashError for Refused {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Place(kind) => *kind,
            Self::Io(_) => NorFlashErrorKind::Other,
        }
    }
}

/// Two pages of flash in a file that nobody else writes: of the size and the words of the boards', with the same bytes. What was
/// written is on the disk when a write returns; what a loss of power leaves of it is what it would leave in a flash, as
/// erased bytes are written too.
#[derive(Debug)]
pub struct FlashFile {
    file: File,
}

impl FlashFile {
    /// The flash in the file; an erased one is made if there is none.
    ///
    /// # Errors
    /// If the file cannot be used, is no flash, or is used by another program.
    pub fn open(path: &Path) -> Result<Self, FlashFileError> {
        let io = |source| FlashFileError::Io { path: path.to_owned(), source };
        if !path.try_exists().map_err(io)? {
            make_erased(path).map_err(io)?;
        }
        let file = OpenOptions::new().read(true).write(true).open(path).map_err(io)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(FlashFileError::Taken { path: path.to_owned() }),
            Err(TryLockError::Error(source)) => return Err(io(source)),
        }
        let found = file.metadata().map_err(io)?.len();
        if found == BYTES as u64 {
            Ok(Self { file })
        } else {
            Err(FlashFileError::Size { path: path.to_owned(), found })
        }
    }

    fn write_through(&self, offset: u32, bytes: &[u8]) -> Result<(), Refused> {
        self.file.write_all_at(bytes, offset.into()).and_then(|()| self.file.sync_data()).map_err(Refused::Io)
    }
}

/// Makes an erased flash, whole or not at all.
fn make_erased(path: &Path) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut file = tempfile::NamedTempFile::new_in(folder)?;
    file.write_all(&[0xFF; BYTES])?;
    file.as_file().sync_all()?;
    file.persist(path)?;
    // The name, too.
    File::open(folder)?.sync_all()
}

impl ErrorType for FlashFile {
    type Error = Refused;
}

impl ReadNorFlash for FlashFile {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Refused> {
        check_read(self, offset, bytes.len()).map_err(Refused::Place)?;
        self.file.read_exact_at(bytes, offset.into()).map_err(Refused::Io)
    }

    fn capacity(&self) -> usize {
        BYTES
    }
}

impl NorFlash for FlashFile {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Refused> {
        check_erase(self, from, to).map_err(Refused::Place)?;
        (from..to).step_by(PAGE).try_for_each(|page| self.write_through(page, &[0xFF; PAGE]))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refused> {
        check_write(self, offset, bytes.len()).map_err(Refused::Place)?;
        self.write_through(offset, bytes)
    }
}
