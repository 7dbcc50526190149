//! The log stream: everything that the localiser is told and says, as records over TCP.
//!
//! Frames are numbered. What does not fit the queue, because the network is slow or nobody listens, is dropped whole; the
//! gap in the numbers tells how much. Nothing ever waits.

use agv_core::record::{Capacities, Header, LANDMARKS_A_RECORD, Record, encode};
use embassy_net::Stack;
use embassy_net::tcp::TcpSocket;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::pipe::Pipe;
use embassy_time::{Duration, with_timeout};
use portable_atomic::{AtomicBool, AtomicU32, Ordering};

use super::settings::Settings;

/// Bytes that wait for the network.
const QUEUE: usize = 24 * 1024;
/// Longest record: a scan of 1440 beams with strengths.
pub const LONGEST: usize = 9 * 1024;
/// How long a peer may take to read what it asked for.
const PATIENCE: Duration = Duration::from_secs(2);

static PIPE: Pipe<CriticalSectionRawMutex, QUEUE> = Pipe::new();
static IS_HEARD: AtomicBool = AtomicBool::new(false);
static DROPPED: AtomicU32 = AtomicU32::new(0);

/// Name of this program in its logs.
pub const SOFTWARE: &str = concat!("agv-firmware ", env!("CARGO_PKG_VERSION"));

/// How many records were dropped while somebody listened.
#[must_use]
pub fn dropped() -> u32 {
    DROPPED.load(Ordering::Relaxed)
}

/// The writing end, which the localiser's loop has.
pub struct LogWriter {
    sequence: u32,
    frame: &'static mut [u8; LONGEST],
}

impl LogWriter {
    /// A writer that makes its frames in `frame`.
    #[must_use]
    pub const fn new(frame: &'static mut [u8; LONGEST]) -> Self {
        // The header and the map, which each listener is given, come first.
        Self { sequence: FIRST_SEQUENCE, frame }
    }

    /// Queues a record, or drops it.
    pub fn write(&mut self, record: &Record) {
        let sequence = self.sequence;
        self.sequence = sequence.wrapping_add(1);
        if !IS_HEARD.load(Ordering::Relaxed) {
            return;
        }
        let length = encode(record, sequence, self.frame).ok().filter(|length| *length <= PIPE.free_capacity());
        let frame = length.and_then(|length| self.frame.get(..length));
        // This is the only writer, so there is room for all of it.
        if frame.is_none_or(|frame| PIPE.try_write(frame) != Ok(frame.len())) {
            DROPPED.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// Number of the first record behind header and map.
const FIRST_SEQUENCE: u32 = 1000;

/// Memory of the connection.
pub struct LogMemory {
    receive: [u8; 64],
    transmit: [u8; 4096],
    piece: [u8; 4096],
}

impl LogMemory {
    /// Memory of a connection that has not begun.
    #[must_use]
    pub const fn new() -> Self {
        Self { receive: [0; 64], transmit: [0; 4096], piece: [0; 4096] }
    }
}

impl Default for LogMemory {
    fn default() -> Self {
        Self::new()
    }
}

/// Gives the stream to one listener after the other, for ever.
pub async fn run(stack: Stack<'static>, memory: &'static mut LogMemory, settings: &Settings) -> ! {
    let LogMemory { receive, transmit, piece } = memory;
    let mut socket = TcpSocket::new(stack, receive, transmit);
    loop {
        socket.abort();
        if socket.accept(settings.log_port).await.is_err() {
            continue;
        }
        if greet(&mut socket, piece, settings).await.is_ok() {
            PIPE.clear();
            IS_HEARD.store(true, Ordering::Relaxed);
            loop {
                let count = PIPE.read(piece).await;
                let Some(bytes) = piece.get(..count) else { continue };
                if send(&mut socket, bytes).await.is_err() {
                    break;
                }
            }
            IS_HEARD.store(false, Ordering::Relaxed);
        }
    }
}

/// The listener has gone, or does not read.
struct Gone;

async fn send(socket: &mut TcpSocket<'_>, mut bytes: &[u8]) -> Result<(), Gone> {
    while !bytes.is_empty() {
        match with_timeout(PATIENCE, socket.write(bytes)).await {
            Ok(Ok(count)) if count > 0 => bytes = bytes.get(count..).unwrap_or_default(),
            _ => return Err(Gone),
        }
    }
    Ok(())
}

/// Sends what a log begins with.
async fn greet(socket: &mut TcpSocket<'_>, frame: &mut [u8], settings: &Settings) -> Result<(), Gone> {
    let header = Header { software: SOFTWARE, parameters: &settings.parameters, capacities: Capacities::default() };
    let mut sequence = 0;
    let first = encode(&Record::Header(header), sequence, frame).map_err(|_| Gone)?;
    send(socket, frame.get(..first).unwrap_or_default()).await?;
    for piece in settings.landmarks.chunks(LANDMARKS_A_RECORD) {
        sequence += 1;
        let length = encode(&Record::Landmarks(piece), sequence, frame).map_err(|_| Gone)?;
        send(socket, frame.get(..length).unwrap_or_default()).await?;
    }
    Ok(())
}
