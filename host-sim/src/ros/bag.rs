//! Recordings of ROS 2: an MCAP file, or a folder of rosbag2 with MCAP or SQLite files.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

use mcap::sans_io::linear_reader::LinearReaderOptions;
use serde::Deserialize;

use super::bag_message::BagMessage;
use super::database::{self, DatabaseError};
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
    files: Vec<(PathBuf, Storage)>,
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
    #[serde(default)]
    compression_format: String,
}

/// Longest record or chunk of an MCAP file, bytes; a longer one is damage.
const LARGEST_RECORD: usize = 1 << 28;

const SQLITE_MAGIC: &[u8] = b"SQLite format 3\0";

impl Bag {
    /// Finds the files of a recording.
    ///
    /// # Errors
    /// If there is none.
    pub fn open(path: &Path) -> Result<Self, BagError> {
        let paths = if path.is_dir() { described_files(&path.join("metadata.yaml"))? } else { vec![path.to_owned()] };
        let files = paths.into_iter().map(|path| storage(&path).map(|storage| (path, storage)));
        Ok(Self { files: files.collect::<Result<_, _>>()? })
    }

    /// Calls `take` with each message, in the order in which the files hold them.
    ///
    /// # Errors
    /// If a file is damaged. Messages before the damage have been given by then.
    pub fn read(&self, mut take: impl FnMut(&BagMessage)) -> Result<(), BagError> {
        for (path, storage) in &self.files {
            match storage {
                Storage::Mcap => read_mcap(path, &mut take)?,
                Storage::Sqlite => database::read(path, &mut take)
                    .map_err(|source| BagError::Database { path: path.to_owned(), source })?,
            }
        }
        Ok(())
    }
}

fn io_error(path: &Path, source: io::Error) -> BagError {
    BagError::Io { path: path.to_owned(), source }
}

fn described_files(path: &Path) -> Result<Vec<PathBuf>, BagError> {
    let problem = |problem: String| BagError::Description { path: path.to_owned(), problem };
    let text = std::fs::read_to_string(path).map_err(|source| io_error(path, source))?;
    let description: Description = serde_yaml_ng::from_str(&text).map_err(|error| problem(error.to_string()))?;
    let Information { relative_file_paths, compression_format } = description.rosbag2_bagfile_information;
    if !compression_format.is_empty() {
        return Err(problem(format!(
            "the recording is compressed with {compression_format} from outside; `ros2 bag convert` undoes that"
        )));
    }
    let folder = path.parent().unwrap_or(Path::new("."));
    // Old recordings name their folder, too.
    let place = |file: &PathBuf| {
        let direct = folder.join(file);
        if direct.exists() { direct } else { folder.join(file.file_name().unwrap_or_default()) }
    };
    Ok(relative_file_paths.iter().map(place).collect())
}

fn storage(path: &Path) -> Result<Storage, BagError> {
    let mut beginning = Vec::new();
    let file = File::open(path).map_err(|source| io_error(path, source))?;
    file.take(4096).read_to_end(&mut beginning).map_err(|source| io_error(path, source))?;
    if beginning.starts_with(mcap::MAGIC) {
        Ok(Storage::Mcap)
    } else if beginning.starts_with(SQLITE_MAGIC) {
        Ok(Storage::Sqlite)
    } else {
        Err(BagError::Foreign { path: path.to_owned(), looks_like: file_kind::describe(&beginning) })
    }
}

fn read_mcap(path: &Path, take: &mut impl FnMut(&BagMessage)) -> Result<(), BagError> {
    let file = File::open(path).map_err(|source| io_error(path, source))?;
    // Nothing is believed before its checksum is.
    let options =
        LinearReaderOptions::default().with_prevalidate_chunk_crcs(true).with_record_length_limit(LARGEST_RECORD);
    let reader = mcap::io::MessageReader::new_with_options(BufReader::new(file), options);
    for (number, message) in (0..).zip(reader) {
        let message = message.map_err(|source| BagError::Mcap { path: path.to_owned(), message: number, source })?;
        // Messages in other encodings are none of ROS 2.
        let Some(schema) = message.channel.schema.as_ref().filter(|_| message.channel.message_encoding == "cdr") else {
            continue;
        };
        take(&BagMessage {
            topic: &message.channel.topic,
            kind: &schema.name,
            time: message.log_time,
            data: &message.data,
        });
    }
    Ok(())
}
