//! The log on its way from the localiser to whoever listens, in frames that are made once and used again and again.

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use agv_core::record::{LANDMARKS_A_RECORD, Record, encode};

use super::exchange::Exchange;

/// Frames that wait: half a second of the records of encoders and gyro at 100 Hz each, poses at 100 Hz, and a laser.
const FRAMES: usize = 256;
/// Longest frame, bytes: a scan of 1440 beams with intensities has fewer.
const LONGEST: usize = 16 * 1024;

/// A record as bytes.
pub(super) struct LogFrame {
    bytes: Box<[u8]>,
    length: usize,
}

impl LogFrame {
    /// What is to be told.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes[..self.length]
    }
}

/// The writing end, which the localiser's loop has.
pub(super) struct LogWriter<'a> {
    sequence: u32,
    free: Receiver<LogFrame>,
    full: SyncSender<LogFrame>,
    exchange: &'a Exchange,
}

/// The other end.
pub(super) struct LogReader {
    free: SyncSender<LogFrame>,
    pub full: Receiver<LogFrame>,
}

/// A queue, whose frames are numbered behind those that a log of a map of so many landmarks begins with.
pub(super) fn log_queue(exchange: &Exchange, landmarks: usize) -> (LogWriter<'_>, LogReader) {
    let (free_end, free) = sync_channel(FRAMES);
    let (full, full_end) = sync_channel(FRAMES);
    for _ in 0..FRAMES {
        // There is room for all.
        let _ = free_end.try_send(LogFrame { bytes: vec![0; LONGEST].into(), length: 0 });
    }
    let sequence = 1 + landmarks.div_ceil(LANDMARKS_A_RECORD) as u32;
    (LogWriter { sequence, free, full, exchange }, LogReader { free: free_end, full: full_end })
}

impl LogWriter<'_> {
    /// Queues a record, or leaves it out.
    pub fn write(&mut self, record: &Record) {
        let sequence = self.sequence;
        self.sequence = sequence.wrapping_add(1);
        let Ok(mut frame) = self.free.try_recv() else { return self.exchange.lose_record() };
        frame.length = encode(record, sequence, &mut frame.bytes).unwrap_or_else(|_| {
            self.exchange.lose_record();
            0
        });
        // There are no more of them than there is room for.
        let _ = self.full.try_send(frame);
    }
}

impl LogReader {
    /// Gives a frame back.
    pub fn give_back(&self, frame: LogFrame) {
        let _ = self.free.try_send(frame);
    }
}
