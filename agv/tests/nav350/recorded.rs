//! Telegrams that real sensors, their maker's programs and other hosts have sent.

use agv_tests::recordings;
use agv_wire::cola::Sequence;
use agv_wire::cola::{Deframed, Deframer, Dialect, Telegram};
use agv_wire::nav350::{
    Answer, Channel, Coordinate, CoordinateFormat, DataMask, DeviceTime, ErrorCode, LandmarkDataFormat, LayoutLandmark,
    MapConfiguration, Method, MethodName, MethodResult, Milliangle, NavigationData, OperatingMode, PoseDataFormat,
    Reflector, Request, RotationSpeed, ScanDataFormat, Setting, Size, SpeedReport, Variable, Velocity,
};
use serde_json::{Value, json};

/// One line of a file of telegrams: whether the host sent it, and its bytes.
struct Line {
    is_request: bool,
    bytes: Vec<u8>,
}

fn lines(test: &str, name: &str) -> Option<Vec<Line>> {
    let text = std::fs::read_to_string(recordings(test, name)?).unwrap();
    let parse = |line: &str| {
        let mut words = line.split(' ').skip_while(|word| !word.contains("S>C") && !word.contains("C>S"));
        let is_request = words.next().unwrap() == "C>S";
        let digits = words.next().unwrap();
        let byte = |index| u8::from_str_radix(&digits[index..index + 2], 16).unwrap();
        Line { is_request, bytes: (0..digits.len()).step_by(2).map(byte).collect() }
    };
    Some(text.lines().filter(|line| line.contains("S>C") || line.contains("C>S")).map(parse).collect())
}

/// All payloads of the bytes, which must hold nothing else.
fn payloads(bytes: &[u8]) -> Vec<(Dialect, Vec<u8>)> {
    let mut deframer = Box::new(Deframer::<65_536>::new());
    assert_eq!(deframer.extend(bytes), bytes.len());
    let mut found = Vec::new();
    while let Some(next) = deframer.next() {
        match next {
            Deframed::Telegram { dialect, payload, .. } => found.push((dialect, payload.to_vec())),
            Deframed::Rubbish(count) => panic!("{count} bytes belong to no telegram"),
        }
    }
    assert_eq!(deframer.waiting(), 0);
    found
}

const FILES: [&str; 4] = [
    "nav350/real_device_from_public_logs.hexlines",
    "nav350/sick_client_requests_colaB.hexlines",
    "nav350/sick_serialised_mNPOSGetData.hexlines",
    "nav350/sicktoolbox_client_requests_colaA.hexlines",
];

#[test]
fn every_recorded_telegram_decodes() {
    let mut count = 0;
    for name in FILES {
        let Some(lines) = lines("every_recorded_telegram_decodes", name) else { return };
        for Line { is_request, bytes } in lines {
            for (dialect, payload) in payloads(&bytes) {
                let text = String::from_utf8_lossy(&payload);
                if is_request {
                    assert!(Request::decode(dialect, &payload).is_ok(), "{name}: {text}");
                } else {
                    assert!(Answer::decode(dialect, &payload).is_ok(), "{name}: {text}");
                }
                count += 1;
            }
        }
    }
    // One line of the sensor's holds four telegrams.
    assert_eq!(count, 9 + 3 + 27 + 6 + 9);
}

/// What was decoded is written again as it was, except for numbers that CoLa-A lets us write in several ways.
#[test]
fn recorded_telegrams_are_written_as_they_were() {
    for name in FILES {
        let Some(lines) = lines("recorded_telegrams_are_written_as_they_were", name) else { return };
        for Line { is_request, bytes } in lines {
            let mut written: Vec<u8> = Vec::new();
            for (dialect, payload) in payloads(&bytes) {
                let mut buffer = vec![0; 40_000];
                let length = if is_request {
                    Request::decode(dialect, &payload).unwrap().encode(dialect, &mut buffer).unwrap()
                } else {
                    Answer::decode(dialect, &payload).unwrap().encode(dialect, &mut buffer).unwrap()
                };
                written.extend(&buffer[..length]);
            }
            assert_eq!(written, bytes, "{name}: {}", String::from_utf8_lossy(&bytes));
        }
    }
}

fn landmark((x, y): (i32, i32)) -> LayoutLandmark {
    LayoutLandmark {
        x: Coordinate(x),
        y: Coordinate(y),
        kind: 1,
        subtype: 2,
        size: Size(80),
        layers: [0].into_iter().collect(),
    }
}

fn speed(x: i16, y: i16, rotation: i32, time: u32, is_absolute: bool) -> Request<'static> {
    Request::Call(Method::SetSpeed(SpeedReport {
        x: Velocity(x),
        y: Velocity(y),
        rotation: RotationSpeed(rotation),
        time: DeviceTime(time),
        is_absolute,
    }))
}

/// What we would send for the same purpose is among what the maker's program sent.
#[test]
fn our_requests_are_those_of_the_makers_program() {
    let test = "our_requests_are_those_of_the_makers_program";
    let Some(theirs) = lines(test, "nav350/sick_client_requests_colaB.hexlines") else { return };
    let landmarks: Vec<_> = [(1000, 2000), (-3000, 1500)].into_iter().map(landmark).collect();
    let call = Request::Call;
    let zero = Coordinate(0);
    let ours = [
        call(Method::SetAccessMode { level: 3, password: 0xF472_4744 }),
        call(Method::ChangeState(OperatingMode::Standby)),
        call(Method::ChangeState(OperatingMode::Mapping)),
        call(Method::ChangeState(OperatingMode::Navigation)),
        call(Method::EraseLayout(1)),
        call(Method::StoreLayout),
        call(Method::DoMapping),
        call(Method::GetData { wait: true, mask: DataMask::All }),
        Request::Read(Variable::FirmwareVersion),
        Request::ReadOther("SCdevicestate"),
        Request::ReadOther("ODoprh"),
        Request::Write(Setting::CurrentLayer(0)),
        Request::Write(Setting::ColaDialect(Dialect::Binary)),
        Request::Write(Setting::ReflectorSize(Size(80))),
        Request::Write(Setting::LandmarkDataFormat(LandmarkDataFormat {
            coordinates: CoordinateFormat::Cartesian,
            has_details: true,
            filter: 1,
        })),
        Request::Write(Setting::ScanDataFormat(ScanDataFormat { channels: 1, has_remission: true })),
        Request::Write(Setting::PoseDataFormat(PoseDataFormat { is_extrapolated: true, has_details: true })),
        Request::Write(Setting::MapConfiguration(MapConfiguration {
            mean: 50,
            only_unknown: false,
            x: zero,
            y: zero,
            heading: Milliangle(0),
        })),
        speed(0, 0, 0, 0, false),
        speed(1000, -1000, 28_647, 123_456_789, false),
        speed(-1500, 250, -179_999, u32::MAX, true),
        speed(2000, 0, 5729, 1000, false),
    ];
    for request in ours {
        let mut buffer = [0; 200];
        let length = request.encode(Dialect::Binary, &mut buffer).unwrap();
        assert!(theirs.iter().any(|line| line.bytes == buffer[..length]), "{request:?}");
    }
    // The layout of landmarks, by one that the file holds.
    let mut found = 0;
    for line in &theirs {
        let (dialect, payload) = payloads(&line.bytes).remove(0);
        if let Ok(Request::Call(Method::AddLandmarks(list))) = Request::decode(dialect, &payload) {
            let first = list.iter().next().unwrap();
            assert_eq!((first.kind, first.subtype, first.layers.len()), (1, 2, 1));
            if first.x == Coordinate(1000) {
                let list: Vec<_> = list.iter().collect();
                assert_eq!(list[..2], landmarks[..]);
            }
            found += 1;
        }
    }
    assert_eq!(found, 2);
}

fn flag<T>(value: Option<&T>) -> i64 {
    value.is_some().into()
}

fn reflector(reflector: &Reflector) -> Value {
    let (x, y) = reflector.cartesian.map_or((0, 0), |(x, y)| (x.0, y.0));
    let (distance, angle) = reflector.polar.map_or((0, 0), |(distance, angle)| (distance.0, angle.0));
    let details = reflector.details.as_ref();
    let mut numbers = vec![
        flag(reflector.cartesian.as_ref()),
        x.into(),
        y.into(),
        flag(reflector.polar.as_ref()),
        distance.into(),
        angle.into(),
        flag(details),
    ];
    numbers.extend(details.map_or([0; 11], |details| {
        [
            details.local_id.into(),
            details.global_id.into(),
            details.kind.into(),
            details.subtype.into(),
            details.quality.into(),
            details.time.0.into(),
            details.size.0.into(),
            details.hit_count.into(),
            details.mean_echo.into(),
            details.start_index.into(),
            details.end_index.into(),
        ]
    }));
    json!(numbers)
}

fn scan(channel: &Channel<u32>) -> Value {
    json!([
        String::from_utf8_lossy(&channel.name.0),
        channel.scale as i64,
        channel.offset as i64,
        channel.first.0,
        channel.resolution,
        channel.start.0,
        channel.samples.len(),
        channel.samples.iter().collect::<Vec<_>>(),
    ])
}

/// The same fields in the same order as the maker's parser was made to print them.
fn printed(data: &NavigationData) -> [(&'static str, Value); 10] {
    let pose = data.pose.as_ref();
    let (x, y, heading) = pose.map_or((0, 0, 0), |pose| (pose.x.0, pose.y.0, pose.heading.0));
    let opt = match pose.and_then(|pose| pose.details) {
        None => json!([0, 0, 0, 0, 0, 0, 0]),
        Some(details) => json!([
            1,
            details.output_mode,
            details.time.0,
            details.mean_deviation,
            details.mode.number(),
            details.info,
            details.used_reflectors
        ]),
    };
    let list = data.reflectors.as_ref();
    let reflectors: Vec<Value> =
        list.map(|list| list.reflectors.iter().map(|one| reflector(&one)).collect()).unwrap_or_default();
    let remission = match &data.remission {
        None => json!([0]),
        Some(channel) => json!([
            1,
            String::from_utf8_lossy(&channel.name.0),
            channel.samples.len(),
            channel.samples.iter().collect::<Vec<_>>()
        ]),
    };
    [
        ("version", json!(data.version)),
        ("err", json!(data.error.0)),
        ("wait", json!(data.wait)),
        ("mask", json!(data.mask)),
        ("pose", json!([flag(pose), x, y, heading])),
        ("opt", opt),
        ("lm", json!([flag(list), list.map_or(0, |list| list.filter), reflectors.len()])),
        ("refl", json!(reflectors)),
        ("scan", json!(data.channels.iter().map(scan).collect::<Vec<_>>())),
        ("rssi", remission),
    ]
}

#[test]
fn data_are_what_the_makers_parser_has_printed() {
    let test = "data_are_what_the_makers_parser_has_printed";
    let Some(lines) = lines(test, "nav350/sick_serialised_mNPOSGetData.hexlines") else { return };
    let Some(path) = recordings(test, "nav350/sick_serialised_mNPOSGetData.sick_parser_decoded.jsonl") else {
        return;
    };
    let text = std::fs::read_to_string(path).unwrap();
    let theirs: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!((lines.len(), theirs.len()), (6, 6));
    for (line, theirs) in lines.iter().zip(&theirs) {
        let (dialect, payload) = payloads(&line.bytes).remove(0);
        let Ok(Answer::Result(MethodResult::Data(data))) = Answer::decode(dialect, &payload) else { panic!("no data") };
        for (name, value) in printed(&data) {
            assert_eq!(value, theirs[name], "{name}");
        }
        // And the same values in the other dialect.
        let mut buffer = vec![0; 40_000];
        let answer = Answer::Result(MethodResult::Data(data));
        let length = answer.encode(Dialect::Ascii, &mut buffer).unwrap();
        let again = payloads(&buffer[..length]).remove(0).1;
        assert_eq!(Answer::decode(Dialect::Ascii, &again).as_ref(), Ok(&answer));
    }
}

#[test]
fn answers_of_real_sensors() {
    let test = "answers_of_real_sensors";
    let Some(lines) = lines(test, "nav350/real_device_from_public_logs.hexlines") else { return };
    let payloads = payloads(&lines[7].bytes);
    let answers: Vec<_> =
        payloads.iter().map(|(dialect, payload)| Answer::decode(*dialect, payload).unwrap()).collect();
    let state = |mode| Answer::Result(MethodResult::State(ErrorCode::OK, Some(mode)));
    let accepted = || Answer::Accepted(MethodName::ChangeState);
    let expected = [accepted(), state(OperatingMode::Standby), accepted(), state(OperatingMode::Navigation)];
    assert_eq!(answers, expected);
    let ids: [u16; 4] = [0, 1, 2, 3];
    let (dialect, payload) = self::payloads(&lines[4].bytes).remove(0);
    let added = MethodResult::LandmarkIds(MethodName::AddLandmarks, ErrorCode::OK, Sequence::Values(&ids));
    assert_eq!(Answer::decode(dialect, &payload), Ok(Answer::Result(added)));
}

/// Real captures of sister devices, cut at every byte: nothing is lost, nothing is made up.
#[test]
fn captures_of_sister_devices_frame_without_loss() {
    let test = "captures_of_sister_devices_frame_without_loss";
    for (name, expected) in [
        ("nav350/other_sick_cola/20210302_lms111.pcapng.3ac64899.hexlines", Dialect::Binary),
        ("nav350/other_sick_cola/20210722_143600_ros2_mrs1104_sick_scan_xd.pcapng.ca0acad1.hexlines", Dialect::Binary),
        ("nav350/other_sick_cola/20211201_RMS_1xxx_start_up.pcapng.c235b28d.hexlines", Dialect::Ascii),
    ] {
        let Some(lines) = lines(test, name) else { return };
        assert!(lines.len() > 10, "{name}");
        let mut deframer = Box::new(Deframer::<65_536>::new());
        for Line { bytes, .. } in &lines {
            for cut in 0..bytes.len() {
                let (before, after) = bytes.split_at(cut);
                deframer.extend(before);
                assert!(deframer.next().is_none(), "{name} {cut}");
                deframer.extend(after);
                let Some(Deframed::Telegram { dialect, payload, frame }) = deframer.next() else {
                    panic!("{name} {cut}: no telegram")
                };
                assert_eq!((dialect, frame), (expected, &bytes[..]), "{name} {cut}");
                assert!(Telegram::parse(dialect, payload).is_ok());
                assert!(deframer.next().is_none() && deframer.waiting() == 0);
            }
        }
        // The whole conversation in one read, and byte by byte.
        let stream: Vec<u8> = lines.iter().flat_map(|line| line.bytes.clone()).collect();
        let mut count = 0;
        let mut rest = &stream[..];
        while !rest.is_empty() {
            rest = &rest[deframer.extend(rest)..];
            while let Some(found) = deframer.next() {
                assert!(matches!(found, Deframed::Telegram { .. }), "{name}");
                count += 1;
            }
        }
        assert_eq!(count, lines.len(), "{name}");
    }
}
