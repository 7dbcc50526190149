//! Logs as files.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use agv_core::geometry::Pose;
use agv_core::localizer::{Event, Localizer, ParameterError, Parameters};
use agv_core::maps::Landmark;
use agv_core::odometry::Vehicle;
use agv_core::record::{
    self, Damage, DamageReason, FORMAT_VERSION, Frame, FrameReader, FrameStep, HEADER_LENGTH, Header, Item,
    LANDMARKS_A_RECORD, MAGIC, MAX_FRAME, MAX_PAYLOAD, Output, Record, Scratch,
};

use crate::file_kind;
use crate::output_file::OutputFile;
use crate::recording::{Publishing, RecordedOutput, RecordedPose, Recording, StoredState, keep};
use crate::wording::count_of;

/// Name and version that this program leaves in its logs.
pub const SOFTWARE: &str = concat!("agv ", env!("CARGO_PKG_VERSION"));

/// How many bytes a reader holds. A file whose first so many bytes hold no good record is foreign.
const BUFFER: usize = 1 << 20;

/// Why a log could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
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
        source: io::Error,
    },
    /// The file is empty.
    #[error("{}: the file is empty", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The file is no log.
    #[error("{}: this is not a log of this program but {looks_like}", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What it seems to be.
        looks_like: &'static str,
    },
    /// The log was written by a program with another format.
    #[error("{}: the log has format version {found}, this program reads {FORMAT_VERSION}", path.display())]
    Version {
        /// The file.
        path: PathBuf,
        /// Version of the log.
        found: u8,
    },
    /// The header cannot be read, so nobody knows what vehicle it was.
    #[error(
        "{}: the log's header, which tells the vehicle, is missing{}: this is a part of a log; agv replay PART --like LOG \
         --output WHOLE takes vehicle and map from another log",
        path.display(),
        damage.map(|damage| format!(" ({damage})")).unwrap_or_default()
    )]
    Header {
        /// The file.
        path: PathBuf,
        /// What may have happened to it.
        damage: Option<Damage>,
    },
    /// The header says of the vehicle what cannot be.
    #[error("{}: the log's header cannot be used: {error}", path.display())]
    Parameters {
        /// The file.
        path: PathBuf,
        /// The parameter.
        error: ParameterError,
    },
    /// The log is no part of one that is like the other.
    #[error("{}: {problem}", path.display())]
    Like {
        /// The file.
        path: PathBuf,
        /// Why it is none.
        problem: &'static str,
    },
    /// The log holds two drives that do not belong together.
    #[error("{}: a second drive with other parameters begins at byte {offset}", path.display())]
    SecondDrive {
        /// The file.
        path: PathBuf,
        /// Where its header is, bytes from the start.
        offset: u64,
    },
    /// A record is longer than a frame can be.
    #[error("{}: {what} does not fit into a record, which has at most {MAX_PAYLOAD} bytes", path.display())]
    TooLong {
        /// The file.
        path: PathBuf,
        /// What is too long.
        what: String,
    },
}

fn io_error(path: &Path, source: io::Error) -> LogError {
    let path = path.to_owned();
    if source.kind() == io::ErrorKind::NotFound { LogError::Missing { path } } else { LogError::Io { path, source } }
}

/// A record in a few words.
fn describe(record: &Record) -> String {
    match record {
        Record::Event(Event::Scan(scan)) if scan.intensities.is_empty() => {
            format!("a scan of {} beams", scan.ranges.len())
        }
        Record::Event(Event::Scan(scan)) => format!("a scan of {} beams with intensities", scan.ranges.len()),
        Record::Event(Event::Reflectors(seen)) => {
            format!("a set of {}", count_of(seen.observations.len(), "reflector"))
        }
        Record::Note(note) => format!("a note of {} bytes", note.len()),
        _ => "what is to be written".to_owned(),
    }
}

/// Reads a log record by record.
pub struct Reader {
    path: PathBuf,
    source: Box<dyn Read + Send>,
    frames: FrameReader,
    buffer: Vec<u8>,
    /// The part of the buffer that is not consumed yet.
    rest: Range<usize>,
    is_last: bool,
    /// Room for everything that a frame can hold.
    scratch: Box<Scratch<8192, 4096>>,
}

/// What a frame reader found, without the bytes.
enum Found {
    Frame { offset: u64, kind: u8, sequence: u32, payload: Range<usize> },
    Damage(Damage),
    End,
}

impl Reader {
    /// Opens a log.
    ///
    /// # Errors
    /// If the file is missing, empty, foreign, or a log of another version.
    pub fn open(path: &Path) -> Result<Self, LogError> {
        let file = File::open(path).map_err(|source| io_error(path, source))?;
        Self::of(path, Box::new(file))
    }

    /// Reads a log from a source that ends or goes on for ever, such as a controller's log stream. `path` names it in
    /// errors. Records are given as soon as they have come.
    ///
    /// # Errors
    /// If what comes is nothing, foreign, or a log of another version.
    pub fn of(path: &Path, source: Box<dyn Read + Send>) -> Result<Self, LogError> {
        let mut reader = Self {
            path: path.to_owned(),
            source,
            frames: FrameReader::new(),
            buffer: vec![0; BUFFER],
            rest: 0..0,
            is_last: false,
            scratch: Box::default(),
        };
        while !reader.is_last
            && matches!(FrameReader::new().step(&reader.buffer[reader.rest.clone()], false).1, FrameStep::NeedMore)
        {
            reader.fill()?;
        }
        let beginning = &reader.buffer[reader.rest.clone()];
        if beginning.is_empty() {
            return Err(LogError::Empty { path: path.to_owned() });
        }
        match FrameReader::new().step(beginning, reader.is_last) {
            (_, FrameStep::Damage(Damage { offset: 0, reason: DamageReason::Version(found), .. })) => {
                Err(LogError::Version { path: path.to_owned(), found })
            }
            (_, FrameStep::Frame { .. }) => Ok(reader),
            // Damage that ends before the beginning does is followed by a good frame.
            (consumed, FrameStep::Damage(_)) if consumed < beginning.len() => Ok(reader),
            _ if beginning.iter().zip(MAGIC).all(|(byte, magic)| *byte == magic) => Ok(reader),
            _ => {
                let looks_like = file_kind::describe(&beginning[..beginning.len().min(4096)]);
                Err(LogError::Foreign { path: path.to_owned(), looks_like })
            }
        }
    }

    /// How many bytes have been used up: the end of the last record or damage.
    #[must_use]
    pub fn position(&self) -> u64 {
        self.frames.offset()
    }

    /// The next record or damage. None at the end.
    ///
    /// # Errors
    /// If the file cannot be read, or the parameters of its header are out of their bounds.
    #[expect(clippy::should_implement_trait, reason = "the items borrow from the reader")]
    pub fn next(&mut self) -> Result<Option<Item<'_>>, LogError> {
        let (offset, kind, sequence, payload) = match self.find()? {
            Found::Frame { offset, kind, sequence, payload } => (offset, kind, sequence, payload),
            Found::Damage(damage) => return Ok(Some(Item::Damage(damage))),
            Found::End => return Ok(None),
        };
        let frame = Frame { kind, sequence, payload: &self.buffer[payload] };
        let skipped = frame.length() as u64;
        Ok(Some(match frame.record(&mut self.scratch) {
            Ok(Record::Header(header)) if let Err(error) = header.parameters.check() => {
                return Err(LogError::Parameters { path: self.path.clone(), error });
            }
            Ok(record) => Item::Record { offset, sequence, record },
            Err(reason) => Item::Damage(Damage { offset, skipped, reason }),
        }))
    }

    fn find(&mut self) -> Result<Found, LogError> {
        loop {
            let (consumed, step) = self.frames.step(&self.buffer[self.rest.clone()], self.is_last);
            let found = match step {
                FrameStep::Frame { offset, frame } => {
                    let start = self.rest.start + consumed - frame.length() + HEADER_LENGTH;
                    let payload = start..start + frame.payload.len();
                    Some(Found::Frame { offset, kind: frame.kind, sequence: frame.sequence, payload })
                }
                FrameStep::Damage(damage) => Some(Found::Damage(damage)),
                FrameStep::NeedMore => None,
                FrameStep::End => Some(Found::End),
            };
            self.rest.start += consumed;
            match found {
                Some(found) => return Ok(found),
                None => self.fill()?,
            }
        }
    }

    /// Moves the rest to the front of the buffer and reads what there is behind it.
    fn fill(&mut self) -> Result<(), LogError> {
        self.buffer.copy_within(self.rest.clone(), 0);
        self.rest = 0..self.rest.len();
        loop {
            match self.source.read(&mut self.buffer[self.rest.end..]) {
                Ok(0) => self.is_last = true,
                Ok(count) => self.rest.end += count,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => return Err(io_error(&self.path, error)),
            }
            return Ok(());
        }
    }
}

/// Writes a log record by record. It has its name when it is finished, and an older file of that name stays until then; or
/// from [`Writer::take_name`] on. Then, what was written before the last [`Writer::flush`] survives a loss of power; of
/// what came later, every whole record that reached the disk does.
pub struct Writer {
    path: PathBuf,
    file: OutputFile,
    sequence: u32,
    frame: Vec<u8>,
}

impl Writer {
    /// Begins a log.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn create(path: &Path, header: &Header) -> Result<Self, LogError> {
        let file = OutputFile::create(path).map_err(|source| io_error(path, source))?;
        let mut writer = Self::new(path, file, 0);
        writer.write(&Record::Header(*header))?;
        Ok(writer)
    }

    /// Begins the log of a vehicle with a map.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn begin(path: &Path, parameters: &Parameters, landmarks: &[Landmark]) -> Result<Self, LogError> {
        let capacities = <Localizer>::CAPACITIES;
        let mut writer = Self::create(path, &Header { software: SOFTWARE, parameters, capacities })?;
        for piece in landmarks.chunks(LANDMARKS_A_RECORD) {
            writer.write(&Record::Landmarks(piece))?;
        }
        Ok(writer)
    }

    /// Goes on with a log behind its last good record. What stands behind that, and an end record, is cut off; all
    /// damage found on the way is returned.
    ///
    /// # Errors
    /// If the file is not a log with at least one good record, or cannot be written.
    pub fn append(path: &Path) -> Result<(Self, Vec<Damage>), LogError> {
        let mut reader = Reader::open(path)?;
        let mut damages = Vec::new();
        let mut end = 0;
        let mut next_sequence = None;
        loop {
            match reader.next()? {
                Some(Item::Record { record: Record::End, .. }) => {}
                Some(Item::Record { sequence, .. }) => {
                    next_sequence = Some(sequence.wrapping_add(1));
                    end = reader.position();
                }
                Some(Item::Damage(damage)) => damages.push(damage),
                None => break,
            }
        }
        let Some(sequence) = next_sequence else {
            return Err(LogError::Header { path: path.to_owned(), damage: damages.first().copied() });
        };
        let open = || {
            let mut file = OpenOptions::new().write(true).open(path)?;
            file.set_len(end)?;
            file.seek(SeekFrom::End(0))?;
            Ok(file)
        };
        let file = open().map_err(|source| io_error(path, source))?;
        Ok((Self::new(path, OutputFile::direct(file), sequence), damages))
    }

    fn new(path: &Path, file: OutputFile, sequence: u32) -> Self {
        Self { path: path.to_owned(), file, sequence, frame: vec![0; MAX_FRAME] }
    }

    /// Gives the log its name now, so that what is flushed stays whatever happens. An older file of that name is given
    /// another one, which is returned.
    ///
    /// # Errors
    /// If the operating system refuses.
    pub fn take_name(&mut self) -> Result<Option<PathBuf>, LogError> {
        self.file.take_name().map_err(|source| io_error(&self.path, source))
    }

    /// Adds a record.
    ///
    /// # Errors
    /// If the record is too long, or the file cannot be written.
    pub fn write(&mut self, record: &Record) -> Result<(), LogError> {
        let length = record::encode(record, self.sequence, &mut self.frame)
            .map_err(|_| LogError::TooLong { path: self.path.clone(), what: describe(record) })?;
        self.file.write_all(&self.frame[..length]).map_err(|source| io_error(&self.path, source))?;
        self.sequence = self.sequence.wrapping_add(1);
        Ok(())
    }

    /// Brings everything to the disk.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn flush(&mut self) -> Result<(), LogError> {
        self.file.sync().map_err(|source| io_error(&self.path, source))
    }

    /// Says that the log is complete, and brings it to the disk.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(mut self) -> Result<(), LogError> {
        self.write(&Record::End)?;
        self.flush()?;
        let Self { path, file, .. } = self;
        file.finish().map_err(|source| io_error(&path, source))
    }
}

/// Writes a drive as a log. Truth and references stand before the first event that is not earlier, so that a log that is
/// cut has all of them up to the cut.
///
/// # Errors
/// If the file cannot be written, or a scan is too long for a log.
pub fn write(path: &Path, recording: &Recording) -> Result<(), LogError> {
    write_with_outputs(path, recording, |_| None)
}

/// Writes a drive as [`write()`] does, and after each event what the localiser answered to it. `output` gives the answer to
/// the event of that index.
///
/// # Errors
/// If the file cannot be written, or a scan is too long for a log.
pub fn write_with_outputs<'a>(
    path: &Path,
    recording: &Recording,
    output: impl Fn(usize) -> Option<Output<'a>>,
) -> Result<(), LogError> {
    let mut writer = Writer::begin(path, &recording.parameters, &recording.landmarks)?;
    for piece in recording.state.iter().flat_map(StoredState::pieces) {
        writer.write(&Record::State(piece))?;
    }
    let mut truth = recording.truth.iter().peekable();
    let mut references = recording.references.iter().peekable();
    for (index, event) in recording.events.iter().enumerate() {
        if let Some(now) = event.time() {
            while let Some(next) = truth.next_if(|next| next.time <= now) {
                writer.write(&Record::Truth(*next))?;
            }
            while let Some(next) = references.next_if(|next| next.time <= now) {
                writer.write(&Record::Reference(*next))?;
            }
        }
        writer.write(&Record::Event(event.view()))?;
        if let Some(output) = output(index) {
            writer.write(&Record::Output(output))?;
        }
    }
    for next in truth {
        writer.write(&Record::Truth(*next))?;
    }
    for next in references {
        writer.write(&Record::Reference(*next))?;
    }
    writer.finish()
}

/// Everything that a log holds, except notes and raw bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct Contents {
    /// Name and version of the program that wrote the log.
    pub software: String,
    /// The drive.
    pub recording: Recording,
    /// What the localiser answered while the log was written, in the order of the events; empty if that was not logged.
    pub outputs: Vec<RecordedOutput>,
    /// What the vehicle was given while the log was written; empty if that was not logged.
    pub publishing: Publishing,
    /// Everything that is wrong with the log.
    pub damages: Vec<Damage>,
}

impl Contents {
    /// Nothing, of a vehicle that nobody knows.
    fn empty() -> Self {
        let parameters = Parameters::new(Vehicle::Increments, Pose::default());
        Self {
            software: String::new(),
            recording: Recording {
                parameters,
                landmarks: Vec::new(),
                events: Vec::new(),
                truth: Vec::new(),
                references: Vec::new(),
                state: None,
            },
            outputs: Vec::new(),
            publishing: Publishing::default(),
            damages: Vec::new(),
        }
    }
}

/// Reads a drive, and everything that is wrong with its log: see [`read_contents`].
///
/// # Errors
/// As [`read_contents`].
pub fn read(path: &Path) -> Result<(Recording, Vec<Damage>), LogError> {
    read_contents(path, |_| {}).map(|contents| (contents.recording, contents.damages))
}

/// Reads a whole log. A log without an end record is cut, even if it is cut between two records. `progress` is called
/// with the number of bytes done.
///
/// # Errors
/// If the file is missing, empty, foreign, of another version, without a readable header, or holds two different drives.
pub fn read_contents(path: &Path, progress: impl FnMut(u64)) -> Result<Contents, LogError> {
    let Pieces { header, contents } = read_pieces(path, progress)?;
    match header {
        Some((software, parameters)) => {
            let recording = Recording { parameters, ..contents.recording };
            Ok(Contents { software, recording, ..contents })
        }
        None => Err(LogError::Header { path: path.to_owned(), damage: contents.damages.first().copied() }),
    }
}

/// Reads a part of a log whose beginning is missing, with the vehicle and the map of another log. The part's own landmarks
/// must be among those of the map.
///
/// # Errors
/// As [`read_contents`], and if the log has a header of its own, or another map.
pub fn read_part(path: &Path, like: &Recording, progress: impl FnMut(u64)) -> Result<Contents, LogError> {
    let Pieces { header, contents } = read_pieces(path, progress)?;
    let wrong = |problem| Err(LogError::Like { path: path.to_owned(), problem });
    if header.is_some() {
        return wrong("the log has a header of its own; --like is for a part of a log without one");
    }
    if !contents.recording.landmarks.iter().all(|landmark| like.landmarks.contains(landmark)) {
        return wrong("the log has landmarks that the log of --like has not: it is of another map");
    }
    let recording = Recording { parameters: like.parameters, landmarks: like.landmarks.clone(), ..contents.recording };
    Ok(Contents { recording, ..contents })
}

/// What was found of a log.
struct Pieces {
    /// The program that wrote it, and the vehicle.
    header: Option<(String, Parameters)>,
    /// Everything else.
    contents: Contents,
}

fn read_pieces(path: &Path, mut progress: impl FnMut(u64)) -> Result<Pieces, LogError> {
    let mut reader = Reader::open(path)?;
    let mut header = None;
    let mut is_complete = false;
    let mut contents = Contents::empty();
    let Contents {
        recording: Recording { landmarks, events, truth, references, state, .. },
        outputs,
        publishing,
        damages,
        ..
    } = &mut contents;
    // An output behind damage may belong to an event that is lost.
    let mut is_answer_expected = false;
    while let Some(item) = reader.next()? {
        match item {
            Item::Damage(damage) => {
                is_answer_expected = false;
                damages.push(damage);
            }
            Item::Record { offset, record, .. } => match record {
                Record::Header(found) => match &header {
                    Some((_, known)) if known != found.parameters => {
                        return Err(LogError::SecondDrive { path: path.to_owned(), offset });
                    }
                    _ => header = Some((found.software.to_owned(), *found.parameters)),
                },
                Record::Landmarks(piece) => landmarks.extend_from_slice(piece),
                Record::State(piece) => state.get_or_insert_default().add(&piece),
                Record::Event(event) => {
                    is_answer_expected = true;
                    events.push(keep(&event));
                    if events.len() % 1024 == 0 {
                        progress(offset);
                    }
                }
                Record::Output(Output { pose, uses }) if is_answer_expected => {
                    is_answer_expected = false;
                    outputs.push(RecordedOutput { event: events.len() - 1, pose, uses: uses.to_vec() });
                }
                Record::Behind(count) => publishing.behind.push((events.len(), count)),
                Record::Published(published) => {
                    publishing.poses.push(RecordedPose { events: events.len(), published });
                }
                Record::Truth(one) => truth.push(one),
                Record::Reference(one) => references.push(one),
                Record::End => is_complete = true,
                Record::Output(_) | Record::Note(_) | Record::Raw(_) => {}
            },
        }
    }
    let is_cut = damages.iter().any(|damage| damage.reason == DamageReason::Cut);
    if !is_complete && !is_cut {
        damages.push(Damage { offset: reader.position(), skipped: 0, reason: DamageReason::Cut });
    }
    Ok(Pieces { header, contents })
}
