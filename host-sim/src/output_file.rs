//! Files that are written aside and take their name when they are whole, so that an older file survives every failure.
//! Pipes and devices are written as they are.

use std::fs::{File, OpenOptions, Permissions};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile, TempPath};

/// A file that is being written, buffered. Without [`OutputFile::finish`] nothing of it remains.
pub struct OutputFile {
    file: BufWriter<File>,
    /// Where the file is until it takes its name, and that name; None for what has no name to take: a pipe, a device, or a
    /// file that somebody goes on with.
    aside: Option<(TempPath, PathBuf)>,
}

/// Bytes that wait for the system.
const BUFFER: usize = 1 << 16;

impl OutputFile {
    /// Begins a file; an older one of that name stays until this one is finished. A link goes on pointing where it does.
    ///
    /// # Errors
    /// If there is no such folder, nothing can be written there, or the older file must not be written.
    pub fn create(path: &Path) -> io::Result<Self> {
        let (path, has_name) = path.canonicalize().map_or_else(|_| (path.to_owned(), false), |path| (path, true));
        // What is open and has no name any more, or never had one, has none to take.
        if !has_name && path.metadata().is_ok() {
            return File::create(&path).map(Self::direct);
        }
        let old = match path.metadata() {
            Ok(old) if old.is_file() => {
                OpenOptions::new().write(true).open(&path)?;
                Some(old.permissions())
            }
            Ok(_) => return File::create(&path).map(Self::direct),
            Err(_) => None,
        };
        let (file, aside) = beside(&path, old)?.into_parts();
        Ok(Self { file: BufWriter::with_capacity(BUFFER, file), aside: Some((aside, path)) })
    }

    /// A file in its place already.
    #[must_use]
    pub fn direct(file: File) -> Self {
        Self { file: BufWriter::with_capacity(BUFFER, file), aside: None }
    }

    /// Where the file is now; None if it is in its place. For programs that write it themselves.
    #[must_use]
    pub fn aside(&self) -> Option<&Path> {
        self.aside.as_ref().map(|(aside, _)| aside.as_ref())
    }

    /// Brings everything to the disk.
    ///
    /// # Errors
    /// If the operating system refuses.
    pub fn sync(&mut self) -> io::Result<()> {
        self.file.flush()?;
        match self.file.get_ref().sync_data() {
            // Pipes and devices have no disk.
            Err(error) if self.aside.is_none() && error.kind() == io::ErrorKind::InvalidInput => Ok(()),
            outcome => outcome,
        }
    }

    /// Gives the file its name while it is still being written; an older file of that name is given another one, which is
    /// returned.
    ///
    /// # Errors
    /// If the operating system refuses.
    pub fn take_name(&mut self) -> io::Result<Option<PathBuf>> {
        let Some((aside, path)) = self.aside.take() else { return Ok(None) };
        let old = set_aside(&path)?;
        aside.persist(path).map_err(|problem| problem.error)?;
        Ok(old)
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// If the operating system refuses; an older file is then as it was.
    pub fn finish(mut self) -> io::Result<()> {
        self.file.flush()?;
        match self.aside {
            Some((aside, path)) => aside.persist(path).map_err(|problem| problem.error),
            None => Ok(()),
        }
    }
}

impl Write for OutputFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for OutputFile {
    fn seek(&mut self, position: SeekFrom) -> io::Result<u64> {
        self.file.seek(position)
    }
}

/// Whether a file can be written there, so that a long run does not find out at its end. Nothing is left, and an older file stays.
///
/// # Errors
/// As [`OutputFile::create`].
pub fn check(path: &Path) -> io::Result<()> {
    match path.metadata() {
        // Whoever opens a pipe waits for its reader.
        Ok(old) if !old.is_file() && !old.is_dir() => Ok(()),
        _ => OutputFile::create(path).map(drop),
    }
}

/// A file beside `path` with the rights of the older one, or those of any new file.
fn beside(path: &Path, old: Option<Permissions>) -> io::Result<NamedTempFile> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        return Err(io::Error::new(io::ErrorKind::NotADirectory, format!("there is no folder {}", folder.display())));
    }
    let name = path.file_name().ok_or_else(|| io::Error::from(io::ErrorKind::IsADirectory))?;
    let prefix = format!("{}.", name.to_string_lossy());
    let mut builder = Builder::new();
    builder.prefix(&prefix).suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(Permissions::from_mode(0o666));
    }
    let file = builder.tempfile_in(folder).map_err(|error| match error.raw_os_error() {
        // Without the name of the file aside, which nobody asked for.
        Some(code) => io::Error::from_raw_os_error(code),
        None => io::Error::from(error.kind()),
    })?;
    if let Some(permissions) = old {
        file.as_file().set_permissions(permissions)?;
    }
    Ok(file)
}

/// Writes a whole file; an older one of that name is replaced by it at once, or stays.
///
/// # Errors
/// As [`OutputFile::create`] and [`OutputFile::finish`].
pub fn write(path: &Path, bytes: impl AsRef<[u8]>) -> io::Result<()> {
    let mut file = OutputFile::create(path)?;
    file.write_all(bytes.as_ref())?;
    file.finish()
}

/// Gives an older file of that name another one, and returns that.
fn set_aside(path: &Path) -> io::Result<Option<PathBuf>> {
    if !path.is_file() {
        return Ok(None);
    }
    let path = path.canonicalize()?;
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let names = std::iter::once(format!("{name}.old")).chain((2_u32..).map(|number| format!("{name}.old{number}")));
    for name in names {
        let aside = path.with_file_name(name);
        if aside.symlink_metadata().is_err() {
            std::fs::rename(&path, &aside)?;
            return Ok(Some(aside));
        }
    }
    Ok(None)
}
