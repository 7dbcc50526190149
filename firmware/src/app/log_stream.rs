//! The log stream: everything that the localiser is told and says, as records over TCP.
//!
//! Frames are numbered. What does not fit the queue, because the network is slow or nobody listens, is dropped whole; the
//! gap in the numbers tells how much. Nothing ever waits.

use agv_core::localizer::{Parameters, StatedCapacities};
use agv_core::maps::Landmark;
use agv_core::record::{Header, LANDMARKS_A_RECORD, Record, encode};
use embassy_net::Stack;
use embassy_net::tcp::TcpSocket;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::pipe::Pipe;
use embassy_time::{Duration, with_timeout};
use portable_atomic::{AtomicBool, AtomicU32, Ordering};

/// Bytes that wait for the network.
const QUEUE: usize = 14 * 1024;
/// Longest record: a scan of 1440 beams.
pub const LONGEST: usize = 6 * 1024;
/// How long a peer may take to read what it asked for.
const PATIENCE: Duration = Duration::from_secs(2);
/// How long a peer may say nothing at all, not even that it has heard: one that begins a connection and goes away holds the port no longer.
const SILENCE: Duration = Duration::from_secs(5);

/// What waits for the network.
pub type LogQueue = Pipe<CriticalSectionRawMutex, QUEUE>;

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
    queue: &'static LogQueue,
}

impl LogWriter {
    /// A writer that makes its frames in `frame`, for a map of so many landmarks.
    #[must_use]
    pub const fn new(frame: &'static mut [u8; LONGEST], queue: &'static LogQueue, landmarks: usize) -> Self {
        // The header and the map, which each listener is given, come first.
        Self { sequence: 1 + landmarks.div_ceil(LANDMARKS_A_RECORD) as u32, frame, queue }
    }

    /// Queues a record, or drops it.
    pub fn write(&mut self, record: &Record) {
        let sequence = self.sequence;
        self.sequence = sequence.wrapping_add(1);
        if !IS_HEARD.load(Ordering::Relaxed) {
            return;
        }
        let length = encode(record, sequence, self.frame).ok().filter(|length| *length <= self.queue.free_capacity());
        let Some(mut rest) = length.and_then(|length| self.frame.get(..length)) else {
            DROPPED.fetch_add(1, Ordering::Relaxed);
            return;
        };
        // There is room for all of it, as nobody else writes; at the end of the queue's memory it goes in two pieces.
        while let Ok(count) = self.queue.try_write(rest) {
            rest = rest.get(count..).unwrap_or_default();
            if rest.is_empty() {
                break;
            }
        }
    }
}

/// Memory of the connection.
pub struct LogMemory {
    receive: [u8; 64],
    transmit: [u8; 3072],
    piece: [u8; 2048],
}

impl LogMemory {
    /// Memory of a connection that has not begun.
    #[must_use]
    pub const fn new() -> Self {
        Self { receive: [0; 64], transmit: [0; 3072], piece: [0; 2048] }
    }
}

impl Default for LogMemory {
    fn default() -> Self {
        Self::new()
    }
}

/// What a log begins with: all that a replay must know.
#[derive(Clone, Copy)]
pub struct Beginning {
    /// What the localiser believes.
    pub parameters: &'static Parameters,
    /// How much it has room for.
    pub capacities: StatedCapacities,
    /// Its map.
    pub landmarks: &'static [Landmark],
}

/// Gives the stream to one listener after the other, for ever.
pub async fn run(
    stack: Stack<'static>,
    memory: &'static mut LogMemory,
    queue: &LogQueue,
    port: u16,
    beginning: Beginning,
) -> ! {
    let LogMemory { receive, transmit, piece } = memory;
    let mut socket = TcpSocket::new(stack, receive, transmit);
    socket.set_timeout(Some(SILENCE));
    loop {
        socket.abort();
        if socket.accept(port).await.is_err() {
            continue;
        }
        if greet(&mut socket, piece, beginning).await.is_ok() {
            queue.clear();
            IS_HEARD.store(true, Ordering::Relaxed);
            loop {
                let count = queue.read(piece).await;
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
async fn greet(socket: &mut TcpSocket<'_>, frame: &mut [u8], beginning: Beginning) -> Result<(), Gone> {
    let Beginning { parameters, capacities, landmarks } = beginning;
    let header = Header { software: SOFTWARE, parameters, capacities };
    let mut sequence = 0;
    let first = encode(&Record::Header(header), sequence, frame).map_err(|_| Gone)?;
    send(socket, frame.get(..first).unwrap_or_default()).await?;
    for piece in landmarks.chunks(LANDMARKS_A_RECORD) {
        sequence += 1;
        let length = encode(&Record::Landmarks(piece), sequence, frame).map_err(|_| Gone)?;
        send(socket, frame.get(..length).unwrap_or_default()).await?;
    }
    Ok(())
}
