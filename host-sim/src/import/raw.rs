//! Bytes as they passed a link, and the events that they mean.

use std::convert::Infallible;
use std::path::Path;

use agv_controller::{self as controller, EncoderNodes, EncoderOutput, channels, counted};
use agv_core::localizer::{Event, Parameters};
use agv_core::measurement::Time;
use agv_core::record::{Damage, Item, RAW_A_RECORD, Raw, RawSource, Record};
use agv_wire::can::frame::{AnyFrame, Frame};
use agv_wire::can::slcan::Message;
use agv_wire::nav350::SensorFrame;

use super::overheard;
use crate::link::encoder_listener::EncoderListener;
use crate::link::nav350_listener::{Heard, Listener};
use crate::log::{self, LogError, Reader, Writer};
use crate::recording::{RecordedEvent, Recording, keep};

/// Bytes as they passed a link.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RawBytes {
    /// On which link, and in which direction.
    pub source: RawSource,
    /// When.
    pub time: Time,
    /// The bytes.
    pub bytes: Vec<u8>,
}

impl RawBytes {
    /// A frame of others on a bus.
    #[must_use]
    pub fn of_can(time: Time, frame: &AnyFrame) -> Self {
        Self { source: RawSource::FromCan, time, bytes: Message::from(*frame).encode().to_vec() }
    }

    /// The frame on a bus. None for a look at the bus without one, or for bytes of another link.
    #[must_use]
    pub fn can_frame(&self) -> Option<AnyFrame> {
        matches!(self.source, RawSource::FromCan | RawSource::ToCan).then(|| can_frame(&self.bytes))?
    }
}

fn can_frame(bytes: &[u8]) -> Option<AnyFrame> {
    match Message::decode(bytes.strip_suffix(b"\r").unwrap_or(bytes)) {
        Ok(Message::Frame { frame, .. }) => Some(frame),
        _ => None,
    }
}

/// The raw bytes of a log, in the order in which they came.
///
/// # Errors
/// If the log cannot be read.
pub fn read(path: &Path) -> Result<Vec<RawBytes>, LogError> {
    let mut reader = Reader::open(path)?;
    let mut raw = Vec::new();
    while let Some(item) = reader.next()? {
        if let Item::Record { record: Record::Raw(found), .. } = item {
            raw.push(RawBytes { source: found.source, time: found.time, bytes: found.bytes.to_vec() });
        }
    }
    Ok(raw)
}

/// Writes raw bytes and the events that they mean as a log of the vehicle and the map of `drive`, and adds the events to
/// `drive`.
///
/// # Errors
/// If the log cannot be written.
pub fn write(path: &Path, drive: &mut Recording, raw: &[RawBytes], nodes: &EncoderNodes) -> Result<(), LogError> {
    let mut writer = Writer::begin(path, &drive.parameters, &drive.landmarks)?;
    let mut maker = EventMaker::overhearing(nodes, &drive.parameters, raw);
    for one in raw {
        for bytes in pieces(&one.bytes) {
            writer.write(&Record::Raw(Raw { source: one.source, time: one.time, bytes }))?;
        }
        for event in maker.events(one) {
            writer.write(&Record::Event(event.view()))?;
            drive.events.push(event);
        }
    }
    writer.finish()
}

/// Whether raw bytes say anything that a sensor of that vehicle has measured.
#[must_use]
pub fn means_something(drive: &Recording, raw: &[RawBytes], nodes: &EncoderNodes) -> bool {
    let mut maker = EventMaker::overhearing(nodes, &drive.parameters, raw);
    let is_measured = |event: &RecordedEvent| !matches!(event, RecordedEvent::EncoderFaults(_));
    raw.iter().any(|one| maker.events(one).iter().any(is_measured))
}

/// Pieces that fit a record; one without bytes if there are none.
pub fn pieces(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let nothing = bytes.is_empty().then_some(bytes);
    nothing.into_iter().chain(bytes.chunks(RAW_A_RECORD))
}

/// The drive in a log that `agv record` wrote, with the events that its raw bytes mean instead of those that stand in
/// it, and what is wrong with the log.
///
/// # Errors
/// As [`log::read`].
pub fn read_drive(path: &Path, nodes: &EncoderNodes) -> Result<(Recording, Vec<Damage>), LogError> {
    let (mut recording, damages) = log::read(path)?;
    let mut maker = EventMaker::new(nodes, &recording.parameters, Bus::Served);
    recording.events = read(path)?.iter().flat_map(|raw| maker.events(raw)).collect();
    Ok((recording, damages))
}

/// Who was the master of the encoders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bus {
    /// The program that recorded the bytes: [`controller::Encoders`].
    Served,
    /// Another one: the encoders' own words are all there is.
    Overheard,
}

enum Encoders {
    Served(Box<controller::Encoders>),
    Overheard(Box<EncoderListener>),
}

/// Makes events of raw bytes.
pub struct EventMaker<'a> {
    nodes: &'a EncoderNodes,
    parameters: &'a Parameters,
    bus: Bus,
    nav350: Listener,
    encoders: Option<Encoders>,
    /// Time between reports of encoders that are overheard, s, if it is known.
    period: Option<f64>,
}

impl<'a> EventMaker<'a> {
    /// A maker of the events of a vehicle.
    #[must_use]
    pub fn new(nodes: &'a EncoderNodes, parameters: &'a Parameters, bus: Bus) -> Self {
        Self { nodes, parameters, bus, nav350: Listener::new(SensorFrame::default()), encoders: None, period: None }
    }

    /// A maker of the events of a whole recording of a bus whose master is another; how often its encoders report is read there.
    #[must_use]
    pub fn overhearing(nodes: &'a EncoderNodes, parameters: &'a Parameters, raw: &[RawBytes]) -> Self {
        let period = overheard::period(raw, &overheard::encoders(nodes, &parameters.vehicle));
        Self { period, ..Self::new(nodes, parameters, Bus::Overheard) }
    }

    /// The events that bytes complete.
    pub fn events(&mut self, raw: &RawBytes) -> Vec<RecordedEvent> {
        let RawBytes { source, time, bytes } = raw;
        let mut events = Vec::new();
        match source {
            RawSource::FromNav350 if bytes.is_empty() => self.nav350.connect(),
            RawSource::ToNav350 => self.nav350.sent(*time, bytes),
            RawSource::FromNav350 => {
                let Ok(()) = self.nav350.received::<Infallible>(*time, bytes, |heard, revolution| {
                    if heard == Heard::Revolution {
                        events.extend(revolution.reflectors().map(|found| keep(&Event::Reflectors(found))));
                        events.extend(revolution.scan().map(|scan| keep(&Event::Scan(scan))));
                    }
                    Ok(())
                });
            }
            RawSource::FromCan => {
                let frame = can_frame(bytes);
                self.look(*time, frame.as_ref().and_then(AnyFrame::classic), &mut events);
            }
            RawSource::ToCan => {}
        }
        events
    }

    fn look(&mut self, time: Time, frame: Option<&Frame>, events: &mut Vec<RecordedEvent>) {
        let is_first = self.encoders.is_none();
        // Encoders that were switched on later were not missing before.
        let is_of_encoder = |frame: &Frame| {
            let encoders = self.nodes.encoders.iter().zip(&self.nodes.profiles);
            encoders.into_iter().any(|(node, profile)| frame.id() == overheard::position_id(*node, *profile))
        };
        // Whose own controller tells the motion is listened to in any case.
        let tells_itself = self.nodes.motion_frames.is_some() && self.parameters.vehicle.counters().is_empty();
        let bus = if tells_itself { Bus::Served } else { self.bus };
        if is_first && bus == Bus::Overheard && !frame.is_some_and(is_of_encoder) {
            return;
        }
        let encoders = self.encoders.get_or_insert_with(|| match bus {
            Bus::Served => Encoders::Served(Box::new(controller::Encoders::new(self.nodes, self.parameters, time))),
            Bus::Overheard => Encoders::Overheard(Box::new(EncoderListener::new(
                &channels(self.nodes, self.parameters),
                time,
                self.period,
            ))),
        });
        match encoders {
            // The first record says when the bus was opened.
            Encoders::Served(_) if is_first => {}
            Encoders::Served(encoders) => encoders.look(time, frame, |output| {
                if let EncoderOutput::Event(event) = output {
                    events.push(keep(&event.event()));
                }
            }),
            Encoders::Overheard(listener) => {
                let Some(frame) = frame else { return };
                let (faults, sample) = listener.hear(frame, time);
                events.extend(faults.map(RecordedEvent::EncoderFaults));
                events.extend(sample.map(|counts| keep(&counted(&self.parameters.vehicle, &counts).event())));
            }
        }
    }
}
