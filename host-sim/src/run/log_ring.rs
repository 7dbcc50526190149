//! The last minutes of a run on disk, in logs each of which can be replayed alone, and every incident as one log.
//!
//! A disk that is full or slow costs records, and is told once; nobody who localises waits for it.

use std::collections::VecDeque;
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::Duration;

use agv_core::measurement::Time;
use agv_core::record::{CHECKSUM_LENGTH, HEADER_LENGTH, Record, encode};

use super::incident::Incident;
use super::log_file::{Beginning, LogFile};
use super::state_keeper::States;
use crate::log::LogError;
use crate::output_file::OutputFile;

/// Where what happens is kept, and how much of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RingOptions {
    /// Folder of the ring and of the incidents.
    pub folder: PathBuf,
    /// The time that the ring spans.
    pub span: Duration,
    /// Time between two beginnings.
    pub part: Duration,
    /// What is kept before an incident, and behind it.
    pub around: [Duration; 2],
    /// Most bytes of the ring.
    pub ring_bytes: u64,
    /// Most bytes of all incidents together.
    pub incident_bytes: u64,
}

impl RingOptions {
    /// Ten minutes, and incidents with 60 s before and 10 s behind them; each may take 512 MiB.
    #[must_use]
    pub fn usual(folder: PathBuf) -> Self {
        Self {
            folder,
            span: Duration::from_secs(600),
            part: Duration::from_secs(30),
            around: [Duration::from_secs(60), Duration::from_secs(10)],
            ring_bytes: 512 << 20,
            incident_bytes: 512 << 20,
        }
    }

    fn ring(&self) -> PathBuf {
        self.folder.join("ring")
    }

    /// The folder of the incidents.
    #[must_use]
    pub fn incidents(&self) -> PathBuf {
        self.folder.join("incidents")
    }
}

/// How the names of logs end.
const ENDING: &str = "agvlog";

/// Incidents that wait to be written.
const WAITING: usize = 4;

/// An incident that goes on lasts no longer than so many times what is kept behind one.
const LONGEST: u32 = 6;

/// A part that is closed.
struct Part {
    path: PathBuf,
    end: Time,
    /// Where its frames begin, and end, bytes.
    body: [u64; 2],
}

/// Something worth a log of its own, that is not over.
struct Open {
    incident: Incident,
    begin: Time,
    end: Time,
}

/// Pieces of parts that are one log.
pub(super) struct Job {
    pieces: Vec<(File, [u64; 2])>,
    /// Number of the end.
    sequence: u32,
    path: PathBuf,
}

/// The ring while it is written.
pub(super) struct LogRing<'a> {
    options: &'a RingOptions,
    beginning: Beginning<'a>,
    /// Starts of the controller so far, which the names begin with.
    starts: u32,
    number: u32,
    current: Option<(LogFile, u64)>,
    parts: VecDeque<Part>,
    open: Option<Open>,
    jobs: SyncSender<Job>,
}

/// A ring, and what of it another thread writes.
///
/// # Errors
/// If its folders cannot be made.
pub(super) fn log_ring<'a>(
    options: &'a RingOptions,
    beginning: Beginning<'a>,
    starts: u32,
) -> Result<(LogRing<'a>, Receiver<Job>), LogError> {
    for path in [options.ring(), options.incidents()] {
        fs::create_dir_all(&path).map_err(|source| LogError::Io { path, source })?;
    }
    let (jobs, receiver) = sync_channel(WAITING);
    let (parts, open) = (VecDeque::new(), None);
    Ok((LogRing { options, beginning, starts, number: 0, current: None, parts, open, jobs }, receiver))
}

impl LogRing<'_> {
    fn next_path(&mut self, folder: &Path, ending: &str) -> PathBuf {
        self.number += 1;
        folder.join(format!("{:06}-{:06}{ending}.{ENDING}", self.starts, self.number))
    }

    /// Begins with the run.
    ///
    /// # Errors
    /// If the disk takes nothing.
    pub fn begin(&mut self) -> Result<(), LogError> {
        let path = self.next_path(&self.options.ring(), "");
        let file = LogFile::begin(&path, &self.beginning)?;
        let length = file.length();
        self.current = Some((file, length));
        Ok(())
    }

    /// Begins the next part.
    ///
    /// # Errors
    /// If the disk takes nothing; the part before is closed then.
    pub fn go_on(&mut self, states: &States, next: u32, now: Time) -> Result<(), LogError> {
        let closed = self.close(now);
        let path = self.next_path(&self.options.ring(), "");
        let most = (self.options.span.as_secs_f64() / self.options.part.as_secs_f64()).ceil() as usize + 1;
        // The part itself takes up to the other half.
        prune(&self.options.ring(), self.options.ring_bytes / 2, most);
        let file = LogFile::go_on(&path, &self.beginning, states, next)?;
        let length = file.length();
        self.current = Some((file, length));
        closed
    }

    fn close(&mut self, now: Time) -> Result<(), LogError> {
        let Some((file, start)) = self.current.take() else { return Ok(()) };
        let body = [start, file.length()];
        self.parts.push_back(Part { path: file.path().to_owned(), end: now, body });
        let [before, behind] = self.options.around;
        let needed = (before + behind * LONGEST).as_secs_f64();
        while self.parts.front().is_some_and(|part| now.since(part.end) > needed) {
            self.parts.pop_front();
        }
        file.finish()
    }

    /// Adds a frame to the part. One that alone would fill half of the ring takes no more.
    ///
    /// # Errors
    /// If the disk takes nothing; the ring goes on with the next part.
    pub fn write(&mut self, frame: &[u8], now: Time) -> Result<(), LogError> {
        let Some((file, _)) = &mut self.current else { return Ok(()) };
        if 2 * file.length() > self.options.ring_bytes {
            return self.close(now);
        }
        let outcome = file.write(frame);
        if outcome.is_err() {
            self.current = None;
        }
        outcome
    }

    /// An incident begins, or is part of one that is not over.
    pub fn take(&mut self, incident: Incident, now: Time) {
        let behind = self.options.around[1].as_secs_f64();
        let open = self.open.get_or_insert(Open { incident, begin: now, end: now });
        open.end = now.offset(behind).min(open.begin.offset(behind * f64::from(LONGEST)));
    }

    /// Whether an incident is over that is to be kept.
    pub fn is_due(&self, now: Time) -> bool {
        self.open.as_ref().is_some_and(|open| now >= open.end)
    }

    /// Has the incident written that is over.
    ///
    /// # Errors
    /// If the disk takes nothing, or others still wait for it: then it is left out.
    pub fn keep(&mut self) -> Result<(), LogError> {
        let Some(Open { incident, begin, .. }) = self.open.take() else { return Ok(()) };
        let [before, _] = self.options.around;
        let path = self.next_path(&self.options.incidents(), &format!("-{incident}"));
        let Some((file, start)) = &mut self.current else { return Ok(()) };
        file.flush()?;
        let sequence = file.sequence();
        let is_needed = |part: &&Part| begin.since(part.end) < before.as_secs_f64();
        let parts = self.parts.iter().filter(is_needed).map(|part| (part.path.as_path(), part.body));
        let mut pieces = Vec::new();
        for (path, [from, to]) in parts.chain([(file.path(), [*start, file.length()])]) {
            // The first begins with all that was known; a part that the ring has forgotten takes with it what was before.
            match File::open(path) {
                Ok(file) => pieces.push((file, [if pieces.is_empty() { 0 } else { from }, to])),
                Err(_) => pieces.clear(),
            }
        }
        self.jobs
            .try_send(Job { pieces, sequence, path: path.clone() })
            .map_err(|_| LogError::Io { path, source: io::Error::other("it is left out, as others wait for the disk") })
    }

    /// Ends with the run.
    ///
    /// # Errors
    /// If the disk takes nothing.
    pub fn finish(mut self, now: Time) -> Result<(), LogError> {
        let kept = self.keep();
        self.close(now).and(kept)
    }
}

/// Writes incidents as they come.
pub(super) fn write_incidents(
    jobs: impl IntoIterator<Item = Job>,
    options: &RingOptions,
    note: &(dyn Fn(&str) + Sync),
) {
    for job in jobs {
        let path = job.path.clone();
        match write_incident(job, options) {
            Ok(()) => note(&format!("recording: {} is kept", path.display())),
            Err(error) => note(&format!("recording: {}: {error}", path.display())),
        }
    }
}

fn write_incident(job: Job, options: &RingOptions) -> io::Result<()> {
    let Job { pieces, sequence, path } = job;
    let length: u64 = pieces.iter().map(|(_, [from, to])| to - from).sum();
    if length > options.incident_bytes {
        return Err(io::Error::other("the incident is longer than all incidents may be together"));
    }
    prune(&options.incidents(), options.incident_bytes - length, usize::MAX);
    let mut output = OutputFile::create(&path)?;
    for (mut file, [from, to]) in pieces {
        file.seek(SeekFrom::Start(from))?;
        io::copy(&mut file.take(to - from), &mut output)?;
    }
    let mut frame = [0; HEADER_LENGTH + CHECKSUM_LENGTH];
    // An end has no payload.
    let length = encode(&Record::End, sequence, &mut frame).unwrap_or_default();
    output.write_all(&frame[..length])?;
    output.sync()?;
    output.finish()
}

/// The logs of a folder, the oldest first, with their bytes.
pub(super) fn logs(folder: &Path) -> Vec<(PathBuf, u64)> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let is_log = |path: &Path| path.extension().is_some_and(|extension| extension == ENDING);
    let mut logs: Vec<(PathBuf, u64)> = entries
        .filter(|entry| is_log(&entry.path()))
        .filter_map(|entry| Some((entry.path(), entry.metadata().ok()?.len())))
        .collect();
    logs.sort_unstable();
    logs
}

/// Removes the oldest logs until no more than so many bytes and files are left. What cannot be removed is left.
fn prune(folder: &Path, most_bytes: u64, most_files: usize) {
    let logs = logs(folder);
    let (mut bytes, mut files) = (logs.iter().map(|(_, length)| length).sum::<u64>(), logs.len());
    for (path, length) in logs {
        if bytes <= most_bytes && files <= most_files {
            return;
        }
        if fs::remove_file(path).is_ok() {
            bytes -= length;
            files -= 1;
        }
    }
}
