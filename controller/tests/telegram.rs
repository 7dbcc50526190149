//! The longest answer of a laser has room.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic is how a test fails")]

use agv_controller::TELEGRAM;
use agv_wire::cola::{Deframed, Deframer, Dialect, Sequence};
use agv_wire::nav350::{
    Angle, Answer, Channel, ChannelName, Configuration, Coordinate, CoordinateFormat, DeviceTime, ErrorCode,
    MethodResult, Milliangle, NavigationData, PoseDetails, PoseReport, PositionMode, Reflector, ReflectorDetails,
    ReflectorList, Size,
};

/// Beams of a revolution; mm, farther than any sensor of this kind measures (250 m); and more reflectors than it reports.
const BEAMS: usize = 1440;
const FARTHEST: u32 = 250_000;
const REFLECTORS: usize = 50;

/// Below zero: as many digits as there are.
const LOWEST: Coordinate = Coordinate(-1);

fn channel<T: agv_wire::cola::Element>(name: ChannelName, samples: &[T]) -> Channel<'_, T> {
    Channel {
        name,
        scale: 1.0,
        offset: 0.0,
        first: Milliangle(-1),
        resolution: 250,
        start: DeviceTime(u32::MAX),
        samples: Sequence::Values(samples),
    }
}

#[test]
fn the_longest_answer_has_room_in_either_dialect() {
    // What the session asks for, which decides what an answer holds.
    let asked = Configuration::default();
    assert_eq!((asked.scan_format.channels, asked.scan_format.has_remission), (1, true));
    assert!(asked.landmark_format.has_details && asked.pose_format.has_details);
    assert_eq!(asked.landmark_format.coordinates, CoordinateFormat::Cartesian);
    let details = ReflectorDetails {
        local_id: REFLECTORS as u16,
        global_id: u16::MAX,
        kind: 1,
        subtype: 2,
        quality: 100,
        time: DeviceTime(u32::MAX),
        size: Size(u16::MAX),
        hit_count: BEAMS as u16,
        mean_echo: u16::MAX,
        start_index: BEAMS as u16,
        end_index: BEAMS as u16,
    };
    let reflectors = [Reflector { cartesian: Some((LOWEST, LOWEST)), polar: None, details: Some(details) }; REFLECTORS];
    let (distances, strengths) = ([FARTHEST; BEAMS], [u16::MAX; BEAMS]);
    let pose = PoseDetails {
        output_mode: 1,
        time: DeviceTime(u32::MAX),
        mean_deviation: -1,
        mode: PositionMode::Other(u8::MAX),
        info: u32::MAX,
        used_reflectors: REFLECTORS as u8,
    };
    let data = NavigationData {
        version: u16::MAX,
        error: ErrorCode::OK,
        wait: 1,
        mask: 2,
        pose: Some(PoseReport { x: LOWEST, y: LOWEST, heading: Angle(360_000), details: Some(pose) }),
        reflectors: Some(ReflectorList { filter: 1, reflectors: Sequence::Values(&reflectors) }),
        channels: [channel(ChannelName::DISTANCE, &distances)].into_iter().collect(),
        remission: Some(channel(ChannelName::REMISSION, &strengths)),
    };
    let mut longest = 0;
    for dialect in [Dialect::Ascii, Dialect::Binary] {
        let mut bytes = vec![0; 2 * TELEGRAM];
        let length = Answer::Result(MethodResult::Data(data.clone())).encode(dialect, &mut bytes).unwrap();
        longest = longest.max(length);
        assert!(length <= TELEGRAM, "{length} bytes in {dialect:?}, and room for {TELEGRAM}");
        let mut deframer = Box::new(Deframer::<TELEGRAM>::new());
        assert_eq!(deframer.extend(&bytes[..length]), length);
        assert!(matches!(deframer.next(), Some(Deframed::Telegram { frame, .. }) if frame.len() == length));
    }
    // And not much is wasted.
    assert!(longest > TELEGRAM - 1024, "{longest} bytes, and room for {TELEGRAM}");
}
