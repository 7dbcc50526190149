//! `sensor_msgs/PointCloud2` in recordings of ROS 2, byte by byte as the definitions say: MCAP (mcap.dev/spec), CDR (OMG DDSI-RTPS 10) and
//! the message itself, with the fields of several drivers; and as a running ROS publishes them over foxglove_bridge
//! (github.com/foxglove/ws-protocol, docs/spec.md).

use std::net::TcpListener;
use std::ops::ControlFlow;
use std::sync::atomic::AtomicBool;

use agv_core::measurement::Time;
use agv_host_sim::lidar3d::{Revolution, SetupOptions, Source};
use serde_json::{Value, json};
use tungstenite::handshake::server::{Request, Response};
use tungstenite::http::HeaderValue;
use tungstenite::{Message, accept_hdr};

use crate::support::{Files, refusal};

/// Kinds of numbers of a `PointField`.
const U8: u8 = 2;
const U16: u8 = 4;
const U32: u8 = 6;
const F32: u8 = 7;
const F64: u8 = 8;

/// A message as CDR, lowest byte first: each number is aligned to its own size behind the four bytes of the encapsulation.
struct Cdr(Vec<u8>);

impl Cdr {
    fn new() -> Self {
        Self(vec![0, 1, 0, 0])
    }

    fn number(&mut self, value: u32) {
        while !self.0.len().is_multiple_of(4) {
            self.0.push(0);
        }
        self.0.extend(value.to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.number(text.len() as u32 + 1);
        self.0.extend(text.as_bytes());
        self.0.push(0);
    }
}

/// A cloud as a driver publishes it.
struct Cloud {
    /// Seconds and nanoseconds.
    stamp: [u32; 2],
    size: [u32; 2],
    /// Name, first byte, and kind.
    fields: Vec<(&'static str, u32, u8)>,
    is_big: bool,
    /// Bytes of a point and of a row.
    steps: [u32; 2],
    data: Vec<u8>,
}

impl Cloud {
    fn message(&self) -> Vec<u8> {
        let mut cdr = Cdr::new();
        self.stamp.into_iter().for_each(|value| cdr.number(value));
        cdr.text("lidar");
        let [width, height] = self.size;
        [height, width, self.fields.len() as u32].into_iter().for_each(|value| cdr.number(value));
        for (name, offset, kind) in &self.fields {
            cdr.text(name);
            cdr.number(*offset);
            cdr.0.push(*kind);
            cdr.number(1);
        }
        cdr.0.push(self.is_big.into());
        self.steps.into_iter().for_each(|value| cdr.number(value));
        cdr.number(self.data.len() as u32);
        cdr.0.extend(&self.data);
        cdr.0.push(1);
        cdr.0
    }
}

/// An MCAP file with such messages, each on its topic.
fn mcap(messages: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let text = |text: &str| [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat();
    let record =
        |kind: u8, content: Vec<u8>| [vec![kind], (content.len() as u64).to_le_bytes().to_vec(), content].concat();
    let schema = [&1_u16.to_le_bytes()[..], &text("sensor_msgs/msg/PointCloud2"), &text("ros2msg"), &text("")].concat();
    let mut file =
        [b"\x89MCAP0\r\n".to_vec(), record(1, [text("ros2"), text("")].concat()), record(3, schema)].concat();
    for (number, (topic, message)) in messages.iter().enumerate() {
        let id = (number as u16).to_le_bytes();
        let channel = [&id[..], &1_u16.to_le_bytes(), &text(topic), &text("cdr"), &0_u32.to_le_bytes()].concat();
        let time = (number as u64).to_le_bytes();
        file.extend(record(4, channel));
        file.extend(record(5, [&id[..], &0_u32.to_le_bytes(), &time, &time, message].concat()));
    }
    file.extend(record(15, vec![0; 4]));
    file.extend(record(2, vec![0; 20]));
    file.extend(b"\x89MCAP0\r\n");
    file
}

fn revolutions(path: &str) -> Result<Vec<Revolution>, String> {
    let stop = AtomicBool::new(false);
    let source = Source::parse(path)?.open(&SetupOptions::default(), &stop).map_err(|error| error.to_string())?;
    let mut found = Vec::new();
    let all = source.revolutions(&stop, |revolution| {
        found.push(revolution);
        ControlFlow::Continue(())
    });
    all.map_err(|error| error.to_string())?;
    Ok(found)
}

/// Position, strength, ring and time after the first, s: two rings, of which the second one of the file is the lower.
const POINTS: [([f32; 3], u16, u16, f64); 4] = [
    ([4.0, 0.0, 0.5], 7, 1, 0.010),
    ([4.0, 0.0, -0.5], 250, 0, 0.010),
    ([0.0, -3.0, 0.375], 0, 1, 0.035),
    ([0.0, -3.0, -0.375], 99, 0, 0.035),
];

fn check(revolution: &Revolution, start: Time) {
    assert!(revolution.is_whole);
    assert!((revolution.start.since(start)).abs() < 2e-6, "{:?}", revolution.start);
    assert_eq!(revolution.points.len(), POINTS.len());
    for (point, (position, intensity, ring, time)) in revolution.points.iter().zip(POINTS) {
        assert_eq!((point.position, point.intensity), (position, intensity));
        assert_eq!(u16::from(point.ring), ring, "counted from the lowest");
        assert!((1e-9 * f64::from(point.time) - (time - POINTS[0].3)).abs() < 2e-7, "{}", point.time);
    }
}

/// As velodyne_driver: times from the stamp on in seconds; here with two rows, and space behind every point and every row.
fn velodyne() -> Cloud {
    let mut data = Vec::new();
    for (number, (position, intensity, ring, time)) in POINTS.into_iter().enumerate() {
        position.into_iter().for_each(|value| data.extend(value.to_le_bytes()));
        data.extend(f32::from(intensity).to_le_bytes());
        data.extend(ring.to_le_bytes());
        data.extend((time as f32).to_le_bytes());
        data.extend([0xAA; 2]);
        data.extend(vec![0xBB; if number % 2 == 1 { 5 } else { 0 }]);
    }
    let fields =
        [("x", 0, F32), ("y", 4, F32), ("z", 8, F32), ("intensity", 12, F32), ("ring", 16, U16), ("time", 18, F32)];
    Cloud { stamp: [100, 250_000_000], size: [2, 2], fields: fields.into(), is_big: false, steps: [24, 53], data }
}

/// As ouster_ros: times in whole nanoseconds, with a point that is not seen.
fn ouster() -> Cloud {
    let unseen = ([f32::NAN; 3], 0, 0, 0.0);
    let mut data = Vec::new();
    for (position, intensity, ring, time) in POINTS.into_iter().chain([unseen]) {
        position.into_iter().for_each(|value| data.extend(value.to_le_bytes()));
        data.extend([0; 4]);
        data.extend(f32::from(intensity).to_le_bytes());
        data.extend(((1e9 * time) as u32).to_le_bytes());
        data.extend([0, 0, ring as u8, 0]);
    }
    let fields =
        [("x", 0, F32), ("y", 4, F32), ("z", 8, F32), ("intensity", 16, F32), ("t", 20, U32), ("ring", 26, U8)];
    Cloud { stamp: [100, 350_000_000], size: [5, 1], fields: fields.into(), is_big: false, steps: [28, 140], data }
}

/// As hesai_ros: times of the clock, in seconds; here by a machine whose highest byte comes first.
fn hesai() -> Cloud {
    let mut data = Vec::new();
    for (position, intensity, ring, time) in POINTS {
        position.into_iter().for_each(|value| data.extend(value.to_be_bytes()));
        data.extend(f32::from(intensity).to_be_bytes());
        data.extend((1.7e9 + time).to_be_bytes());
        data.extend(ring.to_be_bytes());
    }
    let fields = [
        ("x", 0, F32),
        ("y", 4, F32),
        ("z", 8, F32),
        ("intensity", 12, F32),
        ("timestamp", 16, F64),
        ("ring", 24, U16),
    ];
    Cloud { stamp: [100, 250_000_000], size: [4, 1], fields: fields.into(), is_big: true, steps: [26, 104], data }
}

#[test]
fn clouds_of_drivers_are_read_with_their_times_and_rings() {
    let files = Files::new();
    let path = files.write("two.mcap", &mcap(&[("/points", velodyne().message()), ("/points", ouster().message())]));
    let [first, second] = &revolutions(&path).unwrap()[..] else { panic!("two clouds") };
    // Times count from the first stamp, which lies before the first point.
    check(first, Time::from_micros(10_000));
    check(second, Time::from_micros(110_000));

    let path = files.write("clock.mcap", &mcap(&[("/points", hesai().message())]));
    let [only] = &revolutions(&path).unwrap()[..] else { panic!("a cloud") };
    check(only, Time::default());
}

#[test]
fn a_topic_is_named_where_there_are_several() {
    let files = Files::new();
    let path = files.write("two.mcap", &mcap(&[("/front", velodyne().message()), ("/rear", ouster().message())]));
    let complaint = refusal(&["lidar3d", "info", &path]);
    assert!(complaint.contains("/front, /rear"), "{complaint}");
    assert_eq!(revolutions(&format!("{path}#/rear")).unwrap().len(), 1);
    let complaint = refusal(&["lidar3d", "info", &format!("{path}#/top")]);
    assert!(complaint.contains("on /top"), "{complaint}");
}

#[test]
fn clouds_that_contradict_themselves_are_refused_in_one_line() {
    let files = Files::new();
    let wrong = |change: fn(&mut Cloud)| {
        let mut cloud = velodyne();
        change(&mut cloud);
        let path = files.write("wrong.mcap", &mcap(&[("/points", cloud.message())]));
        refusal(&["lidar3d", "info", &path])
    };
    let short = "a cloud is shorter than it says";
    for (change, expected) in [
        ((|cloud| cloud.data.truncate(60)) as fn(&mut Cloud), short),
        (|cloud| cloud.size = [u32::MAX; 2], short),
        (|cloud| cloud.steps = [0, 0], short),
        (|cloud| cloud.steps[1] = 0, short),
        (|cloud| cloud.fields[1].0 = "why", "no field y"),
        (|cloud| cloud.fields[2].1 = 23, "outside of its point"),
        (|cloud| cloud.fields[2].2 = 9, "of no kind"),
    ] {
        let complaint = wrong(change);
        assert!(complaint.contains(expected), "{expected}: {complaint}");
    }
}

/// A bridge for one client that offers clouds on topics, and something else. A subscriber is sent all clouds of its topic.
#[expect(clippy::result_large_err, reason = "the library wants the answer of a handshake so")]
fn bridge(topics: Vec<(&'static str, Vec<Vec<u8>>)>) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    std::thread::spawn(move || {
        let protocol = |request: &Request, mut response: Response| {
            assert!(request.headers()["sec-websocket-protocol"].to_str().unwrap().contains("foxglove.websocket.v1"));
            let name = HeaderValue::from_static("foxglove.websocket.v1");
            response.headers_mut().insert("Sec-WebSocket-Protocol", name);
            Ok(response)
        };
        let mut socket = accept_hdr(listener.accept().unwrap().0, protocol).unwrap();
        let mut say = |value: Value| socket.send(Message::text(value.to_string())).unwrap();
        say(
            json!({ "op": "serverInfo", "name": "foxglove_bridge", "capabilities": [], "supportedEncodings": ["cdr"] }),
        );
        let channel = |id: usize, topic: &str, kind: &str| json!({ "id": id, "topic": topic, "encoding": "cdr", "schemaName": kind, "schema": "", "schemaEncoding": "ros2msg" });
        say(json!({ "op": "advertise", "channels": [channel(3, "/rosout", "rcl_interfaces/msg/Log")] }));
        let clouds =
            |(number, (topic, _)): (usize, &(&str, _))| channel(10 + number, topic, "sensor_msgs/msg/PointCloud2");
        let channels: Vec<Value> = topics.iter().enumerate().map(clouds).collect();
        say(json!({ "op": "advertise", "channels": channels }));
        while let Ok(message) = socket.read() {
            let Ok(request) = serde_json::from_str::<Value>(message.to_text().unwrap_or_default()) else { continue };
            for wanted in request["subscriptions"].as_array().unwrap() {
                let (_, clouds) = &topics[wanted["channelId"].as_u64().unwrap() as usize - 10];
                for cloud in clouds {
                    let id = wanted["id"].as_u64().unwrap() as u32;
                    // Data of nobody's subscription, a time message, and the cloud.
                    socket.send(Message::binary([&[1][..], &99_u32.to_le_bytes(), &[0; 8], &[1]].concat())).unwrap();
                    socket.send(Message::binary([&[2][..], &[0; 8]].concat())).unwrap();
                    socket.send(Message::binary([&[1][..], &id.to_le_bytes(), &[0; 8], cloud].concat())).unwrap();
                }
            }
        }
    });
    format!("ws://{address}")
}

#[test]
fn clouds_of_a_running_ros_are_those_of_a_recording() {
    let address = bridge(vec![("/points", vec![velodyne().message(), ouster().message()])]);
    let stop = AtomicBool::new(false);
    let source = Source::parse(&format!("{address}#/points")).unwrap();
    assert!(source.is_live());
    let mut found = Vec::new();
    let read = source.open(&SetupOptions::default(), &stop).unwrap().revolutions(&stop, |revolution| {
        found.push(revolution);
        if found.len() == 2 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert_eq!(read.unwrap().points, 8);
    check(&found[0], Time::from_micros(10_000));
    check(&found[1], Time::from_micros(110_000));
}

#[test]
fn what_a_running_ros_has_not_is_said_in_one_line() {
    let one = || vec![velodyne().message()];
    let complaint = refusal(&["lidar3d", "info", &bridge(vec![("/front", one()), ("/rear", one())])]);
    assert!(complaint.contains("/front, /rear"), "{complaint}");
    let mut short = velodyne();
    short.data.truncate(60);
    let complaint = refusal(&["lidar3d", "info", &bridge(vec![("/front", vec![short.message()])])]);
    assert!(complaint.contains("#/front: a cloud is shorter than it says"), "{complaint}");
    let complaint = Source::parse("ws://#/points").unwrap_err();
    assert!(complaint.contains("names no machine"), "{complaint}");
    let free = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let complaint = refusal(&["lidar3d", "info", &format!("ws://{free}")]);
    assert!(complaint.contains("refused"), "{complaint}");
}
