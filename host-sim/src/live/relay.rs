//! The log stream of a controller for more than one listener: a controller has one only.

use std::io::{self, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use agv_core::record::{MAX_FRAME, Record, encode};

/// Frames that wait for a listener who is slow; more are dropped, and the numbers of the frames tell how many.
const QUEUE: usize = 1024;

/// How long a listener may take to read what it asked for.
const PATIENCE: Duration = Duration::from_secs(2);

/// How often the relay looks for new listeners.
const LOOK: Duration = Duration::from_millis(20);

/// Gives records to all who listen on a port of this machine.
pub struct Relay {
    listener: TcpListener,
    inner: Mutex<Inner>,
}

struct Inner {
    /// What a log begins with, which each listener is given first.
    greeting: Vec<u8>,
    listeners: Vec<SyncSender<Arc<[u8]>>>,
    sequence: u32,
    frame: Vec<u8>,
}

impl Inner {
    fn tell(&mut self, bytes: Arc<[u8]>) {
        // Who is slow misses a frame; who has gone is forgotten.
        self.listeners
            .retain(|listener| !matches!(listener.try_send(Arc::clone(&bytes)), Err(TrySendError::Disconnected(_))));
    }
}

impl Relay {
    /// A relay on any free port.
    ///
    /// # Errors
    /// If there is none.
    pub fn bind() -> io::Result<Self> {
        Self::of(TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?)
    }

    /// A relay on a port that somebody has opened.
    ///
    /// # Errors
    /// If the socket fails.
    pub fn of(listener: TcpListener) -> io::Result<Self> {
        listener.set_nonblocking(true)?;
        let inner = Inner { greeting: Vec::new(), listeners: Vec::new(), sequence: 0, frame: vec![0; MAX_FRAME] };
        Ok(Self { listener, inner: Mutex::new(inner) })
    }

    /// Its port.
    ///
    /// # Errors
    /// If the socket fails.
    pub fn port(&self) -> io::Result<u16> {
        Ok(self.listener.local_addr()?.port())
    }

    fn inner(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Passes a record on.
    pub fn pass(&self, record: &Record) {
        let mut inner = self.inner();
        let Inner { greeting, sequence, frame, .. } = &mut *inner;
        if matches!(record, Record::Header(_)) {
            // A controller that has started again.
            greeting.clear();
            *sequence = 0;
        }
        // A record that came in a frame fits a frame.
        let Ok(length) = encode(record, *sequence, frame) else { return };
        *sequence = sequence.wrapping_add(1);
        let bytes = &frame[..length];
        if matches!(record, Record::Header(_) | Record::Landmarks(_)) {
            greeting.extend_from_slice(bytes);
        }
        let bytes = bytes.into();
        inner.tell(bytes);
    }

    /// Passes a record on whose frame somebody else has made and numbered, behind those that each listener is given first.
    pub fn pass_frame(&self, bytes: &[u8]) {
        let mut inner = self.inner();
        if !inner.listeners.is_empty() && !bytes.is_empty() {
            inner.tell(bytes.into());
        }
    }

    /// Serves listeners until `is_stopped`.
    pub fn serve(&self, is_stopped: &AtomicBool) {
        std::thread::scope(|scope| {
            while !is_stopped.load(Ordering::Relaxed) {
                let Ok((stream, _)) = self.listener.accept() else {
                    std::thread::sleep(LOOK);
                    continue;
                };
                let (sender, receiver) = sync_channel(QUEUE);
                {
                    let mut inner = self.inner();
                    // The queue is empty, so there is room.
                    let _ = sender.try_send(inner.greeting.as_slice().into());
                    inner.listeners.push(sender);
                }
                scope.spawn(move || tell(stream, &receiver));
            }
            // The threads end with their queues.
            self.inner().listeners.clear();
        });
    }
}

fn tell(mut stream: TcpStream, receiver: &Receiver<Arc<[u8]>>) {
    if stream.set_nonblocking(false).and_then(|()| stream.set_write_timeout(Some(PATIENCE))).is_err() {
        return;
    }
    while let Ok(bytes) = receiver.recv() {
        if stream.write_all(&bytes).is_err() {
            return;
        }
    }
}
