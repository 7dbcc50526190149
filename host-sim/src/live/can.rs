//! What the encoders of a vehicle and other controllers say on a CAN bus, as a log.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use agv_controller::{BusEvent, EncoderNodes, EncoderOutput, Encoders};
use agv_core::localizer::Parameters;
use agv_core::measurement::{EncoderFault, Time};
use agv_core::record::{RawSource, Record};
use agv_wire::can::frame::{AnyFrame, Frame, Id};
use agv_wire::can::slcan::Message;

use super::{Limits, LiveError, Recorder};
use crate::bus::{Bus, BusError};
use crate::link::clock::Clock;
use crate::log::LogError;

/// What a recording brought.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CanSummary {
    /// Frames of others.
    pub frames: usize,
    /// Samples of the encoders, or reports of the vehicle's own controller.
    pub samples: usize,
    /// Times at which a fault began or ended.
    pub fault_changes: usize,
    /// How often the bus was lost.
    pub lost: usize,
    /// Nodes that were heard, one bit each, by the identifiers of CANopen.
    pub nodes: u128,
}

impl CanSummary {
    /// The nodes that were heard, in order.
    #[must_use]
    pub fn heard(&self) -> Vec<u8> {
        (1..=127).filter(|node| self.nodes & (1 << node) != 0).collect()
    }

    fn hear(&mut self, frame: &AnyFrame) {
        // Emergencies, process data, answers to service data, heartbeats (CiA 301, 7.3.3).
        let Id::Standard(identifier) = frame.id() else { return };
        let identifier = identifier.as_raw();
        let (function, node) = (identifier >> 7, identifier & 0x7F);
        if node != 0 && matches!(function, 1 | 3 | 5 | 7 | 9 | 11 | 14) {
            self.nodes |= 1 << node;
        }
    }
}

/// How long a look at the bus may take.
const LOOK: Duration = Duration::from_millis(5);
/// Pause before a bus that was lost is opened again.
const PAUSE: Duration = Duration::from_secs(1);

struct Recording<'a> {
    recorder: &'a Recorder,
    encoders: Encoders,
    summary: CanSummary,
    faults: [Option<EncoderFault>; 2],
}

/// Records what is said on a CAN bus until `limits` or `is_stopped`, and is the master of the encoders there: the frames
/// of both directions, what they mean, and a note of everything that happened to the bus and the encoders. `open` opens
/// the bus, again and again if it is lost.
///
/// # Errors
/// If the log cannot be written, or the bus cannot be opened the first time.
pub fn record_can(
    mut open: impl FnMut() -> Result<Box<dyn Bus>, BusError>,
    nodes: &EncoderNodes,
    parameters: &Parameters,
    clock: Clock,
    limits: &Limits,
    is_stopped: &AtomicBool,
    recorder: &Recorder,
) -> Result<CanSummary, LiveError> {
    let mut bus = Some(open()?);
    let start = clock.now();
    recorder.write_raw(RawSource::FromCan, start, &[])?;
    let encoders = Encoders::new(nodes, parameters, start);
    let mut recording = Recording { recorder, encoders, summary: CanSummary::default(), faults: [None; 2] };
    let mut tried = Instant::now();
    while !is_stopped.load(Ordering::Relaxed) && !limits.is_over(clock.now(), recording.summary.samples == 0) {
        let deadline = Instant::now() + LOOK.min(clock.until(limits.until));
        let outcome = match &mut bus {
            Some(bus) => recording.look(&mut **bus, clock, deadline),
            None => {
                std::thread::sleep(LOOK);
                recording.step(clock.now(), None)?;
                Ok(())
            }
        };
        match outcome {
            Ok(()) => {}
            Err(LiveError::Log(error)) => return Err(error.into()),
            Err(LiveError::Bus(error)) => {
                recording.summary.lost += 1;
                recorder.write(&Record::Note(&format!("can: lost: {error}")))?;
                (bus, tried) = (None, Instant::now());
            }
        }
        if bus.is_none() && tried.elapsed() >= PAUSE {
            tried = Instant::now();
            bus = open().ok();
            if bus.is_some() {
                recorder.write(&Record::Note("can: opened again"))?;
            }
        }
    }
    Ok(recording.summary)
}

impl Recording<'_> {
    fn look(&mut self, bus: &mut dyn Bus, clock: Clock, deadline: Instant) -> Result<(), LiveError> {
        let frame = bus.receive(deadline)?;
        for frame in self.step(clock.now(), frame.as_ref())? {
            bus.send(&frame.into())?;
        }
        Ok(())
    }

    /// Records one look and what comes of it; gives the frames to send.
    fn step(&mut self, now: Time, frame: Option<&AnyFrame>) -> Result<Vec<Frame>, LogError> {
        let Self { recorder, encoders, summary, faults } = self;
        let line = frame.map(|frame| Message::from(*frame).encode()).unwrap_or_default();
        recorder.write_raw(RawSource::FromCan, now, &line)?;
        summary.frames += usize::from(frame.is_some());
        frame.into_iter().for_each(|frame| summary.hear(frame));
        let mut answers = Vec::new();
        let mut outputs = Vec::new();
        encoders.look(now, frame.and_then(AnyFrame::classic), |output| outputs.push(output));
        for output in outputs {
            let event = match output {
                EncoderOutput::Send(frame) => {
                    answers.push(frame);
                    recorder.write_raw(RawSource::ToCan, now, &Message::from(AnyFrame::from(frame)).encode())?;
                    continue;
                }
                EncoderOutput::Event(event) => event,
            };
            let is_sample = matches!(
                event,
                BusEvent::Encoders(_) | BusEvent::Wheels(_) | BusEvent::Speed(_) | BusEvent::Increment(_)
            );
            summary.samples += usize::from(is_sample);
            if let BusEvent::EncoderFaults(found) = event
                && [found.drive, found.steering] != *faults
            {
                *faults = [found.drive, found.steering];
                summary.fault_changes += 1;
                let name = |fault: Option<_>| fault.map_or("sound".to_owned(), |fault| format!("{fault:?}"));
                let note = format!("can: encoders: drive {}, steering {}", name(found.drive), name(found.steering));
                recorder.write(&Record::Note(&note.to_lowercase()))?;
            }
            recorder.write(&Record::Event(event.event()))?;
        }
        Ok(answers)
    }
}

#[cfg(test)]
mod tests {
    use agv_wire::can::frame::{AnyFrame, Frame, standard_id};

    use super::CanSummary;

    #[test]
    fn nodes_are_heard_by_what_they_send() {
        let mut summary = CanSummary::default();
        // An emergency, process data, a heartbeat; orders of a master, SYNC and NMT are of no node.
        for identifier in [0x083, 0x185, 0x70A, 0x603, 0x204, 0x080, 0x000] {
            summary.hear(&AnyFrame::from(Frame::new(standard_id(identifier), &[0; 4]).unwrap()));
        }
        assert_eq!(summary.heard(), [3, 5, 10]);
    }
}
