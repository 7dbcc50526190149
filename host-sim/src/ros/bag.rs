//! Recordings of ROS 2: an MCAP file, or a folder of rosbag2 with MCAP or SQLite files.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mcap::sans_io::linear_reader::LinearReaderOptions;
use serde::Deserialize;
use tempfile::TempPath;

use super::attachment;
use super::bag_message::BagMessage;
use super::database::{self, DatabaseError};
use crate::account::Account;
use crate::file_kind;

/// Why a recording cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum BagError {
    /// The operating system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// The file is something else.
    #[error("{}: this is not a recording of ROS 2 but {looks_like}", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What it seems to be.
        looks_like: &'static str,
    },
    /// The folder's description cannot be used.
    #[error("{}: {problem}", path.display())]
    Description {
        /// The description.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// An MCAP file is damaged.
    #[error("{}: damaged behind message {message} ({source}); `mcap recover` may save the rest", path.display())]
    Mcap {
        /// The file.
        path: PathBuf,
        /// Number of good messages before.
        message: u64,
        /// What is wrong.
        source: mcap::McapError,
    },
    /// Nothing in it is encoded as ROS 2 does.
    #[error(
        "{}: its messages are encoded as {}, not in CDR as those of ROS 2; `rosbags-convert --src IN --dst OUT` turns recordings of ROS 1 \
         into such of ROS 2",
        path.display(), found.join(", ")
    )]
    Encoding {
        /// The recording.
        path: PathBuf,
        /// Encodings that were found.
        found: Vec<String>,
    },
    /// An SQLite file is damaged.
    #[error("{}: {source}", path.display())]
    Database {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: DatabaseError,
    },
}

/// A recording.
#[derive(Clone, Debug)]
pub struct Bag {
    path: PathBuf,
    files: Vec<BagFile>,
    /// What had to be assumed to find them.
    notes: Vec<String>,
}

/// One file of a recording.
#[derive(Clone, Debug)]
struct BagFile {
    path: PathBuf,
    storage: Storage,
    /// The same unpacked, if it was compressed as a whole.
    unpacked: Option<Arc<TempPath>>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Storage {
    Mcap,
    Sqlite,
}

#[derive(Deserialize)]
struct Description {
    rosbag2_bagfile_information: Information,
}

#[derive(Deserialize)]
struct Information {
    relative_file_paths: Vec<PathBuf>,
}

/// Longest record or chunk of an MCAP file, bytes; a longer one is damage.
pub(super) const LARGEST_RECORD: usize = 1 << 28;

const ZSTD_MAGIC: &[u8] = b"\x28\xB5\x2F\xFD";
const SQLITE_MAGIC: &[u8] = b"SQLite format 3\0";

impl Bag {
    /// What is attached to the recording under a name; None unless it is one MCAP file.
    #[must_use]
    pub fn attached(&self, name: &str) -> Option<Vec<u8>> {
        let [BagFile { path, storage: Storage::Mcap, unpacked }] = &self.files[..] else { return None };
        attachment::attached(unpacked.as_ref().map_or(path, |file| file), name)
    }

    /// Finds the files of a recording. A folder without a description is taken by its files, in the order of their names.
    ///
    /// # Errors
    /// If there is none.
    pub fn open(path: &Path) -> Result<Self, BagError> {
        let description = path.join("metadata.yaml");
        let mut notes = Vec::new();
        let paths = if !path.is_dir() {
            vec![path.to_owned()]
        } else if description.exists() {
            described_files(&description)?
        } else {
            notes.push("there is no metadata.yaml: the files were taken in the order of their names".to_owned());
            files_of(path)?
        };
        let files = paths.into_iter().map(BagFile::open).collect::<Result<_, _>>()?;
        Ok(Self { path: path.to_owned(), files, notes })
    }

    /// Calls `take` with each message, in the order in which the files hold them. A damaged file is read up to the damage; what is
    /// missing is in the account.
    ///
    /// # Errors
    /// If not one message can be read.
    pub fn read(&self, mut take: impl FnMut(&BagMessage)) -> Result<Account, BagError> {
        let mut account = Account::default();
        self.notes.iter().for_each(|note| account.note(note));
        let mut foreign: BTreeMap<String, usize> = BTreeMap::new();
        let mut count = 0;
        for file in &self.files {
            let take = |message: &BagMessage, encoding: &str| {
                if encoding == "cdr" {
                    count += 1;
                    take(message);
                } else {
                    *foreign.entry(encoding.to_owned()).or_default() += 1;
                }
            };
            let outcome = file.read(take);
            match outcome {
                Err(error) if count == 0 => return Err(error),
                Err(error) => account.warn(format!("read up to the damage: {error}")),
                Ok(()) => {}
            }
        }
        if count == 0 && !foreign.is_empty() {
            return Err(BagError::Encoding { path: self.path.clone(), found: foreign.into_keys().collect() });
        }
        for (encoding, number) in foreign {
            account.set_aside(format!("messages encoded as {encoding}"), number);
        }
        Ok(account)
    }
}

impl BagFile {
    fn open(path: PathBuf) -> Result<Self, BagError> {
        let beginning = beginning(&path)?;
        if beginning.starts_with(ZSTD_MAGIC) {
            let unpacked = unpack(&path).map_err(|source| io_error(&path, source))?;
            let storage = storage(&path, &self::beginning(&unpacked)?)?;
            return Ok(Self { path, storage, unpacked: Some(Arc::new(unpacked)) });
        }
        Ok(Self { storage: storage(&path, &beginning)?, path, unpacked: None })
    }

    fn read(&self, mut take: impl FnMut(&BagMessage, &str)) -> Result<(), BagError> {
        let file = self.unpacked.as_ref().map_or(self.path.as_path(), |unpacked| unpacked);
        match self.storage {
            Storage::Mcap => read_mcap(&self.path, file, &mut take),
            Storage::Sqlite => {
                database::read(file, &mut take).map_err(|source| BagError::Database { path: self.path.clone(), source })
            }
        }
    }
}

/// The whole of a compressed file, beside others of the system.
fn unpack(path: &Path) -> io::Result<TempPath> {
    let mut file = tempfile::NamedTempFile::new()?;
    zstd::stream::copy_decode(File::open(path)?, &mut file)?;
    Ok(file.into_temp_path())
}

/// The bytes of a message that was compressed on its own; others as they are, and those that cannot be unpacked, which no message is.
pub(super) fn unpacked(bytes: &[u8]) -> Cow<'_, [u8]> {
    if !bytes.starts_with(ZSTD_MAGIC) {
        return Cow::Borrowed(bytes);
    }
    let mut whole = Vec::new();
    let read = zstd::stream::read::Decoder::new(bytes)
        .and_then(|decoder| decoder.take(LARGEST_RECORD as u64).read_to_end(&mut whole));
    if read.is_ok() { Cow::Owned(whole) } else { Cow::Borrowed(bytes) }
}

fn io_error(path: &Path, source: io::Error) -> BagError {
    BagError::Io { path: path.to_owned(), source }
}

fn described_files(path: &Path) -> Result<Vec<PathBuf>, BagError> {
    let problem = |problem: String| BagError::Description { path: path.to_owned(), problem };
    let text = std::fs::read_to_string(path).map_err(|source| io_error(path, source))?;
    let description: Description = serde_yaml_ng::from_str(&text).map_err(|error| problem(error.to_string()))?;
    let Information { relative_file_paths } = description.rosbag2_bagfile_information;
    if relative_file_paths.is_empty() {
        return Err(problem("it names no file".to_owned()));
    }
    let folder = path.parent().unwrap_or(Path::new("."));
    // Old recordings name their folder, too.
    let place = |file: &PathBuf| {
        let direct = folder.join(file);
        if direct.exists() { direct } else { folder.join(file.file_name().unwrap_or_default()) }
    };
    Ok(relative_file_paths.iter().map(place).collect())
}

/// Files in a folder that may hold a recording.
fn files_of(folder: &Path) -> Result<Vec<PathBuf>, BagError> {
    let entries = std::fs::read_dir(folder).map_err(|source| io_error(folder, source))?;
    let mut files: Vec<PathBuf> =
        entries.filter_map(|entry| Some(entry.ok()?.path())).filter(|path| is_named(path)).collect();
    files.sort_by_key(|path| (path.as_os_str().len(), path.clone()));
    if files.is_empty() {
        let problem = "there is neither a metadata.yaml nor an .mcap or a .db3 in the folder".to_owned();
        return Err(BagError::Description { path: folder.to_owned(), problem });
    }
    Ok(files)
}

/// Whether a file is named as those of recordings are.
fn is_named(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let name = name.strip_suffix(".zstd").unwrap_or(name);
    name.ends_with(".mcap") || name.ends_with(".db3")
}

/// Whether a folder may hold a recording.
#[must_use]
pub fn is_recording(folder: &Path) -> bool {
    folder.join("metadata.yaml").exists() || files_of(folder).is_ok()
}

fn beginning(path: &Path) -> Result<Vec<u8>, BagError> {
    let mut beginning = Vec::new();
    let file = File::open(path).map_err(|source| io_error(path, source))?;
    file.take(4096).read_to_end(&mut beginning).map_err(|source| io_error(path, source))?;
    Ok(beginning)
}

fn storage(path: &Path, beginning: &[u8]) -> Result<Storage, BagError> {
    if beginning.starts_with(mcap::MAGIC) {
        Ok(Storage::Mcap)
    } else if beginning.starts_with(SQLITE_MAGIC) {
        Ok(Storage::Sqlite)
    } else {
        Err(BagError::Foreign { path: path.to_owned(), looks_like: file_kind::describe(beginning) })
    }
}

/// Reads `file`, which is that of `path` unpacked.
fn read_mcap(path: &Path, file: &Path, take: &mut impl FnMut(&BagMessage, &str)) -> Result<(), BagError> {
    let file = File::open(file).map_err(|source| io_error(path, source))?;
    // Nothing is believed before its checksum is.
    let options =
        LinearReaderOptions::default().with_prevalidate_chunk_crcs(true).with_record_length_limit(LARGEST_RECORD);
    let reader = mcap::io::MessageReader::new_with_options(BufReader::new(file), options);
    for (number, message) in (0..).zip(reader) {
        let message = message.map_err(|source| BagError::Mcap { path: path.to_owned(), message: number, source })?;
        let kind = message.channel.schema.as_ref().map_or("", |schema| schema.name.as_str());
        let data = unpacked(&message.data);
        let found = BagMessage { topic: &message.channel.topic, kind, time: message.log_time, data: &data };
        take(&found, &message.channel.message_encoding);
    }
    Ok(())
}
