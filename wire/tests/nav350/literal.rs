//! Telegrams byte for byte, as sensors and other hosts have sent them.

use agv_wire::cola::{Deframed, Deframer, Dialect, Fault, ReadError, Reader, Sequence};
use agv_wire::nav350::{
    Angle, Answer, Coordinate, CoordinateFormat, DataMask, DeviceTime, ErrorCode, LandmarkDataFormat, MapConfiguration,
    Method, MethodName, MethodResult, Milliangle, OperatingMode, PoseDataFormat, Request, RotationSpeed,
    ScanDataFormat, Setting, Size, SpeedReport, Variable, Velocity,
};

fn bytes(hexadecimal: &str) -> Vec<u8> {
    let digits: Vec<u8> = hexadecimal.bytes().filter(u8::is_ascii_hexdigit).collect();
    digits.chunks(2).map(|pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap()).collect()
}

fn encoded(request: &Request, dialect: Dialect) -> Vec<u8> {
    let mut buffer = [0; 200];
    let length = request.encode(dialect, &mut buffer).unwrap();
    buffer[..length].to_vec()
}

fn check_binary(request: Request, hexadecimal: &str) {
    assert_eq!(encoded(&request, Dialect::Binary), bytes(hexadecimal), "{request:?}");
}

fn check_ascii(request: Request, text: &str) {
    let frame = format!("\u{2}{text}\u{3}");
    assert_eq!(encoded(&request, Dialect::Ascii), frame.as_bytes(), "{request:?}");
    assert_eq!(Request::decode(Dialect::Ascii, text.as_bytes()), Ok(request));
}

#[test]
fn requests_in_cola_b() {
    use OperatingMode::Navigation;
    let call = Request::Call;
    let log_in = Method::SetAccessMode { level: 3, password: 0xF472_4744 };
    check_binary(call(log_in), "02020202 00000017 734d4e205365744163636573734d6f646520 03f4724744 b3");
    check_binary(
        call(Method::ChangeState(Navigation)),
        "02020202 00000016 734d4e206d4e4556414368616e6765537461746520 04 74",
    );
    check_binary(
        Request::Write(Setting::LandmarkDataFormat(LandmarkDataFormat {
            coordinates: CoordinateFormat::Cartesian,
            has_details: true,
            filter: 1,
        })),
        "02020202 0000001e 73574e204e4c4d444c616e646d61726b44617461466f726d617420 000101 40",
    );
    check_binary(
        Request::Write(Setting::ScanDataFormat(ScanDataFormat { channels: 1, has_remission: true })),
        "02020202 00000018 73574e204e41565363616e44617461466f726d617420 0101 1f",
    );
    check_binary(
        Request::Write(Setting::PoseDataFormat(PoseDataFormat { is_extrapolated: true, has_details: true })),
        "02020202 00000019 73574e204e504f53506f736544617461466f726d617420 0101 52",
    );
    check_binary(
        Request::Write(Setting::MapConfiguration(MapConfiguration {
            mean: 50,
            only_unknown: false,
            x: Coordinate(0),
            y: Coordinate(0),
            heading: Milliangle(0),
        })),
        "02020202 0000001d 73574e204e4d41504d617043666720 3200 00000000 00000000 00000000 54",
    );
    check_binary(
        call(Method::GetData { wait: true, mask: DataMask::All }),
        "02020202 00000013 734d4e206d4e504f534765744461746120 0102 7a",
    );
    check_binary(call(Method::DoMapping), "02020202 00000012 734d4e206d4e4d4150446f4d617070696e67 48");
    check_binary(
        call(Method::SetSpeed(SpeedReport {
            x: Velocity(1000),
            y: Velocity(-1000),
            rotation: RotationSpeed(28647),
            time: DeviceTime(123_456_789),
            is_absolute: false,
        })),
        "02020202 0000001f 734d4e206d4e504f53536574537065656420 03e8 fc18 00006fe7 075bcd15 00 19",
    );
}

#[test]
fn requests_in_cola_a() {
    let call = Request::Call;
    check_ascii(call(Method::SetAccessMode { level: 3, password: 0xF472_4744 }), "sMN SetAccessMode 3 F4724744");
    check_ascii(call(Method::GetPose { wait: true }), "sMN mNPOSGetPose 1");
    check_ascii(call(Method::GetTimestamp), "sMN mNAVGetTimestamp");
    // Without a sign numbers are hexadecimal: 50 is eighty millimetres.
    check_ascii(Request::Write(Setting::ReflectorSize(Size(80))), "sWN NLMDReflSize 50");
    check_ascii(
        call(Method::SetSpeed(SpeedReport {
            x: Velocity(1000),
            y: Velocity(-500),
            rotation: RotationSpeed(14323),
            time: DeviceTime(123_456),
            is_absolute: false,
        })),
        "sMN mNPOSSetSpeed +1000 -500 +14323 +123456 0",
    );
    let size = Ok(Request::Write(Setting::ReflectorSize(Size(80))));
    assert_eq!(Request::decode(Dialect::Ascii, b"sWN NLMDReflSize +80"), size);
    // A space before the end is tolerated.
    assert_eq!(Request::decode(Dialect::Ascii, b"sWN NLMDReflSize 50 "), size);
}

#[test]
fn answers() {
    let decode =
        |payload: &str| Answer::decode(Dialect::Binary, payload.as_bytes()).map(|answer| format!("{answer:?}"));
    let expect = |answer: Answer| Ok(format!("{answer:?}"));
    assert_eq!(decode("sWA NAVScanDataFormat "), expect(Answer::Written(Variable::ScanDataFormat)));
    assert_eq!(decode("sAN SetAccessMode \u{1}"), expect(Answer::Result(MethodResult::AccessMode(true))));
    assert_eq!(decode("sFA\0\u{1}"), expect(Answer::Fault(Fault::ACCESS_DENIED)));
    assert_eq!(decode("sMA mNEVAChangeState "), expect(Answer::Accepted(MethodName::ChangeState)));
    let added = "sAN mNLAYAddLandmark \0\0\u{4}\0\0\0\u{1}\0\u{2}\0\u{3}";
    let ids = Sequence::Values(&[0, 1, 2, 3]);
    assert_eq!(
        decode(added),
        expect(Answer::Result(MethodResult::LandmarkIds(MethodName::AddLandmarks, ErrorCode::OK, ids)))
    );
    let ascii = |payload: &'static str| Answer::decode(Dialect::Ascii, payload.as_bytes());
    let state = MethodResult::State(ErrorCode::OK, Some(OperatingMode::Navigation));
    assert_eq!(ascii("sAN mNEVAChangeState 0 4"), Ok(Answer::Result(state)));
    assert_eq!(ascii("sFA 1"), Ok(Answer::Fault(Fault::ACCESS_DENIED)));
    let Ok(Answer::Result(MethodResult::Timestamp(error, time))) = ascii("sAN mNAVGetTimestamp 0 FFFFFFFF") else {
        panic!("no timestamp")
    };
    assert_eq!((error, time), (ErrorCode::OK, DeviceTime(u32::MAX)));
}

#[test]
fn a_pose_with_negative_coordinates() {
    let telegram = bytes(
        "020202020000002f 73414e206d4e504f534765744461746120 0001 00 01 00 0001 fffe1dc0 007864cb 00057e3f 0000 0001 \
         00 0000 0000 0000 3a",
    );
    let mut deframer = Deframer::<1024>::new();
    deframer.extend(&telegram);
    let Some(Deframed::Telegram { payload, .. }) = deframer.next() else { panic!("no telegram") };
    let Ok(Answer::Result(MethodResult::Data(data))) = Answer::decode(Dialect::Binary, payload) else {
        panic!("no data")
    };
    let pose = data.pose.unwrap();
    assert_eq!((pose.x, pose.y, pose.heading), (Coordinate(-123_456), Coordinate(7_890_123), Angle(359_999)));
    assert!(data.reflectors.unwrap().reflectors.is_empty() && data.channels.is_empty() && data.remission.is_none());
}

/// Without a position the sensor still reports what it sees.
#[test]
fn reflectors_without_a_position() {
    let payload = "sAN mNPOSGetData 1 4 1 0 0 1 1 1 1 FFFFFDC9 237 0 0 0 0";
    let Ok(Answer::Result(MethodResult::Data(data))) = Answer::decode(Dialect::Ascii, payload.as_bytes()) else {
        panic!("no data")
    };
    assert_eq!((data.error, data.pose), (ErrorCode::NO_POSITION, None));
    let reflector = data.reflectors.unwrap().reflectors.iter().next().unwrap();
    assert_eq!(reflector.cartesian, Some((Coordinate(-567), Coordinate(567))));
}

#[test]
fn numbers_in_cola_a() {
    let reader = |text: &'static str| Reader::new(Dialect::Ascii, text.as_bytes());
    assert_eq!(reader("FFFFFDC9").i32(), Ok(-567));
    assert_eq!(reader("-567").i32(), Ok(-567));
    assert_eq!(reader("80000000").i32(), Ok(i32::MIN));
    assert_eq!(reader("+2147483648").i32(), Err(ReadError::Range));
    assert_eq!(reader("FE0C").i16(), Ok(-500));
    assert_eq!(reader("FFFFFE0C").i16(), Ok(-500));
    assert_eq!(reader("10000").u16(), Err(ReadError::Range));
    assert_eq!(reader("123456789").u32(), Err(ReadError::Range));
    assert_eq!(reader("3F800000").f32(), Ok(1.0));
    assert_eq!(reader("1").f32(), Ok(1.0));
    assert_eq!(reader("0").f32(), Ok(0.0));
    assert_eq!(reader("").u8(), Err(ReadError::End));
    assert_eq!(reader("+").u8(), Err(ReadError::Number));
    assert_eq!(reader("G").u8(), Err(ReadError::Number));
    let mut reader = reader("A 1.5.1 115R 7");
    assert_eq!(reader.text(), Ok(&b"1.5.1 115R"[..]));
    assert_eq!((reader.u8(), reader.is_empty()), (Ok(7), true));
}
