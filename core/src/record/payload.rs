//! Records, and their payloads as bytes.

use heapless::Vec;
use serde::{Deserialize, Serialize, de::DeserializeOwned};

use super::frame::{HEADER_LENGTH, MAX_PAYLOAD};
use super::published::Published;
use super::state_piece::{STATE_A_RECORD, StatePiece};
use super::truth::{Reference, Truth};
use crate::localizer::{Event, LandmarkUse, Outputs, Parameters, PoseOutput, StatedCapacities};
use crate::maps::Landmark;
use crate::measurement::{ReflectorObservation, Reflectors, Scan, ScanHead, Time};
use crate::odometry::GyroParameters;

/// Greatest number of landmarks in one record; a map is written in pieces.
pub const LANDMARKS_A_RECORD: usize = 50;

/// What a log begins with.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Header<'a> {
    /// Name and version of the program that wrote the log.
    pub software: &'a str,
    /// What the localiser believed of its vehicle.
    pub parameters: &'a Parameters,
    /// What the localiser had room for.
    pub capacities: StatedCapacities,
}

/// What the localiser answered to one event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Output<'a> {
    /// The pose after the event.
    pub pose: PoseOutput,
    /// What became of the event's observations, in order of time.
    pub uses: &'a [LandmarkUse],
}

impl<'a> From<&'a Outputs> for Output<'a> {
    fn from(outputs: &'a Outputs) -> Self {
        Self { pose: outputs.pose, uses: &outputs.uses }
    }
}

/// One record of a log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Record<'a> {
    /// What the log begins with.
    Header(Header<'a>),
    /// A piece of the map, at most [`LANDMARKS_A_RECORD`] landmarks.
    Landmarks(&'a [Landmark]),
    /// A piece of what was known before the first event, of a log that begins in the middle of a drive.
    State(StatePiece<'a>),
    /// What the localiser was told.
    Event(Event<'a>),
    /// What the localiser answered to the event before.
    Output(Output<'a>),
    /// How many of the events before it in the log the localiser had not answered yet when whoever publishes heard the next
    /// event; not written where it had answered all of them.
    Behind(u32),
    /// A pose as the vehicle was given it.
    Published(Published),
    /// Where the vehicle really was; only a host writes it.
    Truth(Truth),
    /// Where another instrument has seen the laser; only a host writes it.
    Reference(Reference),
    /// A short text for people.
    Note(&'a str),
    /// Bytes as they passed a link, beside what was made of them.
    Raw(Raw<'a>),
    /// The log is complete.
    End,
}

/// Where raw bytes come from or go to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum RawSource {
    /// From a NAV350 to the host; nothing where a connection begins.
    FromNav350,
    /// From the host to a NAV350.
    ToNav350,
    /// From others on a CAN bus: one frame as a line of SLCAN, or nothing where the bus was only looked after.
    FromCan,
    /// From the host to a CAN bus: one frame as a line of SLCAN.
    ToCan,
}

/// Greatest number of bytes in one raw record; more are written in pieces.
pub const RAW_A_RECORD: usize = 16 * 1024;

/// Bytes as they passed a link, a piece of at most [`RAW_A_RECORD`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Raw<'a> {
    /// On which link, and in which direction.
    pub source: RawSource,
    /// When they arrived or were sent.
    pub time: Time,
    /// The bytes.
    pub bytes: &'a [u8],
}

/// Why a record cannot be encoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EncodeError {
    /// The buffer is too short for the frame.
    Buffer,
    /// The record is longer than a frame can be.
    TooLong,
}

/// Room for the parts of a record that cannot be borrowed from its bytes, for at most `BEAMS` beams and `REFLECTORS`
/// reflectors or other observations.
#[derive(Clone, Debug, Default)]
pub struct Scratch<const BEAMS: usize = 4096, const REFLECTORS: usize = 1024> {
    parameters: Option<Parameters>,
    ranges: Vec<f32, BEAMS>,
    intensities: Vec<u16, BEAMS>,
    observations: Vec<ReflectorObservation, REFLECTORS>,
    landmarks: Vec<Landmark, LANDMARKS_A_RECORD>,
    uses: Vec<LandmarkUse, REFLECTORS>,
}

impl<const BEAMS: usize, const REFLECTORS: usize> Scratch<BEAMS, REFLECTORS> {
    /// Empty room.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            parameters: None,
            ranges: Vec::new(),
            intensities: Vec::new(),
            observations: Vec::new(),
            landmarks: Vec::new(),
            uses: Vec::new(),
        }
    }
}

/// Numbers of the kinds of records. Those of events are [theirs](crate::localizer::kind).
mod kind {
    pub use crate::localizer::kind::*;

    pub const HEADER: u8 = 0;
    pub const LANDMARKS: u8 = 1;
    pub const OUTPUT: u8 = 8;
    pub const TRUTH: u8 = 9;
    pub const REFERENCE: u8 = 10;
    pub const NOTE: u8 = 11;
    pub const END: u8 = 12;
    pub const RAW: u8 = 13;
    pub const BEHIND: u8 = 15;
    pub const PUBLISHED: u8 = 16;
    pub const STATE: u8 = 19;
}

/// What stands before the beams of a scan, and how many there are.
#[derive(Serialize, Deserialize)]
struct ScanLayout {
    head: ScanHead,
    ranges: u16,
    intensities: u16,
}

/// Why a payload is not a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DecodeError {
    /// No such kind.
    Kind,
    /// The bytes are not what the kind demands.
    Content,
    /// More elements than the scratch has room for.
    Capacity,
}

impl Record<'_> {
    /// Number of the record's kind in the frame.
    pub(super) fn kind(&self) -> u8 {
        match self {
            Self::Header(_) => kind::HEADER,
            Self::Landmarks(_) => kind::LANDMARKS,
            Self::State(_) => kind::STATE,
            Self::Event(event) => event.code(),
            Self::Output(_) => kind::OUTPUT,
            Self::Behind(_) => kind::BEHIND,
            Self::Published(_) => kind::PUBLISHED,
            Self::Truth(_) => kind::TRUTH,
            Self::Reference(_) => kind::REFERENCE,
            Self::Note(_) => kind::NOTE,
            Self::Raw(_) => kind::RAW,
            Self::End => kind::END,
        }
    }

    /// Writes the payload to the place that it has in a frame at the beginning of `buffer`; returns its length.
    pub(super) fn write_payload(&self, buffer: &mut [u8]) -> Result<usize, EncodeError> {
        let room = buffer.get_mut(HEADER_LENGTH..).ok_or(EncodeError::Buffer)?;
        let full = if room.len() < MAX_PAYLOAD { EncodeError::Buffer } else { EncodeError::TooLong };
        let length = room.len().min(MAX_PAYLOAD);
        let room = room.get_mut(..length).ok_or(EncodeError::Buffer)?;
        let written = match self {
            Self::Header(header) => put_header(header, room),
            Self::Landmarks(landmarks) if landmarks.len() > LANDMARKS_A_RECORD => return Err(EncodeError::TooLong),
            Self::Landmarks(landmarks) => put_all(landmarks, room),
            Self::State(piece) if piece.bytes.len() > STATE_A_RECORD => return Err(EncodeError::TooLong),
            Self::State(piece) => put(&(piece.owner, piece.length, piece.start), room)
                .and_then(|head| put_bytes(piece.bytes, room.get_mut(head..)?).map(|length| head + length)),
            Self::Event(Event::Encoders(sample)) => put(sample, room),
            Self::Event(Event::EncoderFaults(faults)) => put(faults, room),
            Self::Event(Event::Speed(sample)) => put(sample, room),
            Self::Event(Event::Increment(increment)) => put(increment, room),
            Self::Event(Event::Wheels(sample)) => put(sample, room),
            Self::Event(Event::Gyro(sample)) => put(sample, room),
            Self::Event(Event::Reflectors(reflectors)) => put(reflectors, room),
            Self::Event(Event::Scan(scan)) => put_scan(scan, room),
            Self::Event(Event::SetPose(fix)) => put(fix, room),
            Self::Output(output) => put(&(&output.pose, output.uses), room),
            Self::Behind(count) => put(count, room),
            Self::Published(published) => put(published, room),
            Self::Truth(truth) => put(truth, room),
            Self::Reference(reference) => put(reference, room),
            Self::Note(text) => put_bytes(text.as_bytes(), room),
            Self::Raw(raw) if raw.bytes.len() > RAW_A_RECORD => return Err(EncodeError::TooLong),
            Self::Raw(raw) => put(&(raw.source, raw.time), room)
                .and_then(|head| put_bytes(raw.bytes, room.get_mut(head..)?).map(|length| head + length)),
            Self::End => Some(0),
        };
        written.ok_or(full)
    }

    /// The record that a payload of that kind holds.
    pub(super) fn read_payload<'a, const BEAMS: usize, const REFLECTORS: usize>(
        kind: u8,
        payload: &'a [u8],
        scratch: &'a mut Scratch<BEAMS, REFLECTORS>,
    ) -> Result<Record<'a>, DecodeError> {
        let record = match kind {
            kind::HEADER => {
                let (software, parameters, capacities) = take_header(payload)?;
                let parameters = scratch.parameters.insert(parameters);
                Record::Header(Header { software, parameters, capacities })
            }
            kind::LANDMARKS => {
                take_each(payload, &mut scratch.landmarks)?;
                Record::Landmarks(&scratch.landmarks)
            }
            kind::STATE => {
                let ((owner, length, start), bytes) =
                    postcard::take_from_bytes(payload).map_err(|_| DecodeError::Content)?;
                if bytes.len() > STATE_A_RECORD {
                    return Err(DecodeError::Content);
                }
                Record::State(StatePiece { owner, length, start, bytes })
            }
            kind::ENCODERS => Record::Event(Event::Encoders(take(payload)?)),
            kind::ENCODER_FAULTS => Record::Event(Event::EncoderFaults(take(payload)?)),
            kind::SPEED => Record::Event(Event::Speed(take(payload)?)),
            kind::INCREMENT => Record::Event(Event::Increment(take(payload)?)),
            kind::WHEELS => Record::Event(Event::Wheels(take(payload)?)),
            kind::GYRO => Record::Event(Event::Gyro(take(payload)?)),
            kind::REFLECTORS => {
                let (laser, rest) = postcard::take_from_bytes(payload).map_err(|_| DecodeError::Content)?;
                take_each(rest, &mut scratch.observations)?;
                Record::Event(Event::Reflectors(Reflectors { laser, observations: &scratch.observations }))
            }
            kind::SCAN => Record::Event(Event::Scan(take_scan(payload, scratch)?)),
            kind::SET_POSE => Record::Event(Event::SetPose(take(payload)?)),
            kind::OUTPUT => {
                let (pose, rest) = postcard::take_from_bytes(payload).map_err(|_| DecodeError::Content)?;
                take_each(rest, &mut scratch.uses)?;
                Record::Output(Output { pose, uses: &scratch.uses })
            }
            kind::BEHIND => Record::Behind(take(payload)?),
            kind::PUBLISHED => Record::Published(take(payload)?),
            kind::TRUTH => Record::Truth(take(payload)?),
            kind::REFERENCE => Record::Reference(take(payload)?),
            kind::NOTE => Record::Note(core::str::from_utf8(payload).map_err(|_| DecodeError::Content)?),
            kind::RAW => {
                let ((source, time), bytes) = postcard::take_from_bytes(payload).map_err(|_| DecodeError::Content)?;
                if bytes.len() > RAW_A_RECORD {
                    return Err(DecodeError::Content);
                }
                Record::Raw(Raw { source, time, bytes })
            }
            kind::END if payload.is_empty() => Record::End,
            kind::END => return Err(DecodeError::Content),
            _ => return Err(DecodeError::Kind),
        };
        Ok(record)
    }
}

fn put<T: Serialize>(value: &T, room: &mut [u8]) -> Option<usize> {
    postcard::to_slice(value, room).ok().map(|written| written.len())
}

/// A gyro stands behind the header, and only of a vehicle that has one: logs from before there were gyros are read as they are.
fn put_header(header: &Header, room: &mut [u8]) -> Option<usize> {
    let length = put(header, room)?;
    let Parameters { gyro, sources, .. } = header.parameters;
    if *gyro == GyroParameters::default() && sources.gyro {
        return Some(length);
    }
    Some(length + put(&(gyro, sources.gyro), room.get_mut(length..)?)?)
}

fn take_header(payload: &[u8]) -> Result<(&str, Parameters, StatedCapacities), DecodeError> {
    let (mut header, rest): ((&str, Parameters, StatedCapacities), _) =
        postcard::take_from_bytes(payload).map_err(|_| DecodeError::Content)?;
    if !rest.is_empty() {
        let (_, parameters, _) = &mut header;
        (parameters.gyro, parameters.sources.gyro) = take(rest)?;
    }
    Ok(header)
}

fn put_bytes(bytes: &[u8], room: &mut [u8]) -> Option<usize> {
    room.get_mut(..bytes.len())?.copy_from_slice(bytes);
    Some(bytes.len())
}

/// The number of elements, then the elements.
fn put_all<T: Serialize>(values: &[T], room: &mut [u8]) -> Option<usize> {
    put(&values, room)
}

fn put_scan(scan: &Scan, room: &mut [u8]) -> Option<usize> {
    let layout = ScanLayout {
        head: scan.head(),
        ranges: u16::try_from(scan.ranges.len()).ok()?,
        intensities: u16::try_from(scan.intensities.len()).ok()?,
    };
    let layout_length = put(&layout, room)?;
    let (ranges, rest) = room.get_mut(layout_length..)?.split_at_mut_checked(scan.ranges.len() * 4)?;
    for (bytes, range) in ranges.as_chunks_mut::<4>().0.iter_mut().zip(scan.ranges) {
        *bytes = range.to_le_bytes();
    }
    let intensities = rest.get_mut(..scan.intensities.len() * 2)?;
    for (bytes, intensity) in intensities.as_chunks_mut::<2>().0.iter_mut().zip(scan.intensities) {
        *bytes = intensity.to_le_bytes();
    }
    Some(layout_length + scan.ranges.len() * 4 + scan.intensities.len() * 2)
}

fn take_all<T>(result: postcard::Result<(T, &[u8])>) -> Result<T, DecodeError> {
    match result {
        Ok((value, [])) => Ok(value),
        _ => Err(DecodeError::Content),
    }
}

fn take<T: DeserializeOwned>(payload: &[u8]) -> Result<T, DecodeError> {
    take_all(postcard::take_from_bytes(payload))
}

fn take_each<T: DeserializeOwned, const N: usize>(payload: &[u8], values: &mut Vec<T, N>) -> Result<(), DecodeError> {
    let (count, mut rest): (usize, _) = postcard::take_from_bytes(payload).map_err(|_| DecodeError::Content)?;
    if count > N {
        return Err(DecodeError::Capacity);
    }
    values.clear();
    for _ in 0..count {
        let (value, remaining) = postcard::take_from_bytes(rest).map_err(|_| DecodeError::Content)?;
        values.push(value).map_err(|_| DecodeError::Capacity)?;
        rest = remaining;
    }
    if rest.is_empty() { Ok(()) } else { Err(DecodeError::Content) }
}

fn take_scan<'a, const BEAMS: usize, const REFLECTORS: usize>(
    payload: &[u8],
    scratch: &'a mut Scratch<BEAMS, REFLECTORS>,
) -> Result<Scan<'a>, DecodeError> {
    let (layout, rest): (ScanLayout, _) = postcard::take_from_bytes(payload).map_err(|_| DecodeError::Content)?;
    let (range_count, intensity_count) = (usize::from(layout.ranges), usize::from(layout.intensities));
    let (ranges, intensities) = rest.split_at_checked(range_count * 4).ok_or(DecodeError::Content)?;
    if intensities.len() != intensity_count * 2 {
        return Err(DecodeError::Content);
    }
    scratch.ranges.resize_default(range_count).map_err(|_| DecodeError::Capacity)?;
    for (range, bytes) in scratch.ranges.iter_mut().zip(ranges.as_chunks::<4>().0) {
        *range = f32::from_le_bytes(*bytes);
    }
    scratch.intensities.resize_default(intensity_count).map_err(|_| DecodeError::Capacity)?;
    for (intensity, bytes) in scratch.intensities.iter_mut().zip(intensities.as_chunks::<2>().0) {
        *intensity = u16::from_le_bytes(*bytes);
    }
    Ok(layout.head.scan(&scratch.ranges, &scratch.intensities))
}
