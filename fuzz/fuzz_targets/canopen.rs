#![no_main]

use agv_core::measurement::Time;
use agv_core::odometry::{Counted, CounterRange};
use agv_wire::can::canopen::{Message, NodeId};
use agv_wire::can::controller::{Content, OrderReceiver, PoseReceiver};
use agv_wire::can::encoder::{EncoderSettings, Reporting};
use agv_wire::can::encoder_group::{ChannelSettings, EncoderGroup};
use agv_wire::can::frame::{Frame, extended_id, standard_id};
use agv_wire::can::sdo::{Request, Response};
use agv_wire::can::plausibility::PlausibilityLimits;
use libfuzzer_sys::fuzz_target;

/// Bytes of one frame: 2 of time, 2 of identifier and kind, 1 of length, 8 of data.
const FRAME: usize = 13;

fn node(number: u8) -> NodeId {
    NodeId::new(number).unwrap()
}

fn frame(bytes: &[u8; FRAME]) -> Option<Frame> {
    let word = u16::from_le_bytes([bytes[2], bytes[3]]);
    let id = if word & 0x1000 == 0 { standard_id(word & 0x7FF) } else { extended_id(u32::from(word) << 8) };
    let length = usize::from(bytes[4] % 9);
    if word & 0x2000 == 0 { Frame::new(id, &bytes[5..5 + length]) } else { Frame::remote(id, length) }
}

/// Everything that a frame goes through alone.
fn decode(frame: &Frame) {
    if let Ok(message) = Message::decode(frame) {
        match message {
            Message::SdoRequest { bytes, .. } => {
                if let Ok(request) = Request::decode(bytes) {
                    assert_eq!(Request::decode(request.encode()), Ok(request));
                }
            }
            Message::SdoResponse { bytes, .. } => {
                if let Ok(response) = Response::decode(bytes) {
                    assert_eq!(Response::decode(response.encode()), Ok(response));
                }
            }
            _ => {}
        }
        assert!(Message::decode(&message.encode()).is_ok());
    }
    if let Ok((content, counter)) = Content::decode(frame, node(16)) {
        assert!(Content::decode(&content.encode(node(16), counter), node(16)).is_ok());
    }
}

fuzz_target!(|bytes: &[u8]| {
    let channel = |number, reporting, counted| ChannelSettings {
        encoder: EncoderSettings { reporting, ..EncoderSettings::new(node(number)) },
        limits: PlausibilityLimits::every(0.01, 20_000.0, 25_000.0),
        counted,
    };
    let mut now = Time::from_micros(1_000_000);
    let channels = [
        channel(1, Reporting::Synchronous, Counted::Turn),
        channel(2, Reporting::Polled { period: 10 }, Counted::Steering),
        channel(3, Reporting::Timer { period: 10 }, Counted::Turn),
        channel(4, Reporting::Timer { period: 10 }, Counted::Steering),
    ];
    let mut group = EncoderGroup::new(&channels, 0.010, now);
    let mut orders = OrderReceiver::new(node(16));
    let mut poses = PoseReceiver::new(node(16));
    for bytes in bytes.as_chunks::<FRAME>().0 {
        now = now.offset(f64::from(u16::from_le_bytes([bytes[0], bytes[1]])) * 1e-5);
        let Some(frame) = frame(bytes) else { continue };
        decode(&frame);
        if let Some(sample) = group.handle(&frame, now) {
            // No range is longer than the counter.
            assert!(sample.counts.iter().all(|count| u64::from(*count) < CounterRange::BITS_32.values()));
        }
        let _ = (orders.handle(&frame, now), poses.handle(&frame), group.poll_faults(now));
        // What is sent at one moment ends.
        assert!((0..64).any(|_| group.poll(now).is_none()));
    }
});
