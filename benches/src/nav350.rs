//! Time from the bytes of one full answer of a NAV350 to a revolution in metres.
//!
//! Deadline: 20 us for 1440 beams with strengths in CoLa-B, on one core.

use std::hint::black_box;

use agv_core::measurement::Time;
use agv_wire::cola::{Deframed, Deframer, Dialect, Sequence};
use agv_wire::nav350::{
    Answer, Channel, ChannelName, Coordinate, DeviceTime, ErrorCode, MethodResult, Milliangle, NavigationData,
    Reflector, ReflectorDetails, ReflectorList, Revolution, SensorClock, SensorFrame, Size,
};
use criterion::{Criterion, criterion_group, criterion_main};

const BEAMS: u32 = 1440;

fn telegram(dialect: Dialect) -> Vec<u8> {
    let ranges: Vec<u32> = (0..BEAMS).map(|beam| 500 + beam * 7919 % 65_000).collect();
    let strengths: Vec<u16> = (0..BEAMS).map(|beam| (beam * 31 % 1024) as u16).collect();
    let reflectors: Vec<Reflector> = (0..12_u16)
        .map(|id| Reflector {
            cartesian: Some((Coordinate(1000 * i32::from(id) - 5000), Coordinate(3000))),
            polar: None,
            details: Some(ReflectorDetails {
                local_id: id,
                global_id: id,
                kind: 1,
                subtype: 2,
                quality: 100,
                time: DeviceTime(1000 + u32::from(id)),
                size: Size(80),
                hit_count: 10,
                mean_echo: 800,
                start_index: 100 * id,
                end_index: 100 * id + 9,
            }),
        })
        .collect();
    let head = (1.0, 0.0, Milliangle(0), 250, DeviceTime(1000));
    let distances = Channel {
        name: ChannelName::DISTANCE,
        scale: head.0,
        offset: head.1,
        first: head.2,
        resolution: head.3,
        start: head.4,
        samples: Sequence::Values(&ranges),
    };
    let remission = Channel {
        name: ChannelName::REMISSION,
        scale: head.0,
        offset: head.1,
        first: head.2,
        resolution: head.3,
        start: head.4,
        samples: Sequence::Values(&strengths),
    };
    let answer = Answer::Result(MethodResult::Data(NavigationData {
        version: 1,
        error: ErrorCode::OK,
        wait: 1,
        mask: 2,
        pose: None,
        reflectors: Some(ReflectorList { filter: 1, reflectors: Sequence::Values(&reflectors) }),
        channels: [distances].into_iter().collect(),
        remission: Some(remission),
    }));
    let mut buffer = vec![0; 40_000];
    let length = answer.encode(dialect, &mut buffer).expect("there is room");
    buffer.truncate(length);
    buffer
}

fn decode(criterion: &mut Criterion) {
    let mut clock = SensorClock::new();
    let now = Time::from_micros(10_000_000);
    clock.record(now, now, DeviceTime(1000)).expect("the exchange is good");
    let frame = SensorFrame::default();
    for (name, dialect) in [("CoLa-B", Dialect::Binary), ("CoLa-A", Dialect::Ascii)] {
        let bytes = telegram(dialect);
        let mut deframer = Box::new(Deframer::<36_864>::new());
        let mut revolution = Box::new(Revolution::<1440, 128>::new());
        criterion.bench_function(&format!("nav350/{name} {BEAMS} beams"), |bencher| {
            bencher.iter(|| {
                deframer.extend(black_box(&bytes));
                let Some(Deframed::Telegram { dialect, payload, .. }) = deframer.next() else { return None };
                let Ok(Answer::Result(MethodResult::Data(data))) = Answer::decode(dialect, payload) else {
                    return None;
                };
                revolution.take(&data, &clock, &frame).ok()?;
                revolution.scan().map(|scan| scan.ranges.len())
            });
        });
        assert_eq!(revolution.scan().map(|scan| scan.ranges.len()), Some(BEAMS as usize));
    }
}

criterion_group! { name = benches; config = agv_benches::briefly(); targets = decode }
criterion_main!(benches);
