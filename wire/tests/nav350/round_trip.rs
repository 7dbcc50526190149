//! What is written is read, in both dialects, and nothing that is read can hurt.

use agv_wire::cola::{CommandWord, Deframed, Deframer, Dialect, Element, Fault, Raw, Sequence, Text};
use agv_wire::nav350::{
    Answer, Channel, ChannelName, Coordinate, DeviceTime, ErrorCode, LandmarkData, Method, MethodName, MethodResult,
    Milliangle, NavigationData, PoseAnswer, ReflectorList, Request, Revolution, SensorClock, SensorFrame, Value,
    Variable,
};
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use proptest::sample::select;

use super::values::{self, OwnedChannel};

/// Gives the payload of a telegram, which must be framed without loss.
fn payload(dialect: Dialect, telegram: &[u8]) -> Vec<u8> {
    let mut deframer = Deframer::<40_000>::new();
    assert_eq!(deframer.extend(telegram), telegram.len());
    let found = match deframer.next() {
        Some(Deframed::Telegram { dialect: found, payload, frame }) => {
            assert_eq!((found, frame), (dialect, telegram));
            payload.to_vec()
        }
        other => panic!("{other:?}"),
    };
    assert_eq!(deframer.next(), None);
    found
}

fn check_request(request: &Request) {
    for dialect in [Dialect::Ascii, Dialect::Binary] {
        let mut buffer = vec![0; 8000];
        let length = request.encode(dialect, &mut buffer).unwrap();
        let payload = payload(dialect, &buffer[..length]);
        assert_eq!(Request::decode(dialect, &payload).as_ref(), Ok(request), "{dialect:?}");
        assert!(request.encode(dialect, &mut buffer[..length - 1]).is_err());
    }
}

fn check_answer(answer: &Answer) {
    for dialect in [Dialect::Ascii, Dialect::Binary] {
        let mut buffer = vec![0; 40_000];
        let length = answer.encode(dialect, &mut buffer).unwrap();
        let payload = payload(dialect, &buffer[..length]);
        assert_eq!(Answer::decode(dialect, &payload).as_ref(), Ok(answer), "{dialect:?}");
        assert!(answer.encode(dialect, &mut buffer[..length - 1]).is_err());
    }
}

fn view<T: Element>(channel: &OwnedChannel<T>) -> Channel<'_, T> {
    let (scale, offset, first, resolution, start) = channel.numbers;
    Channel {
        name: channel.name,
        scale,
        offset,
        first: Milliangle(first),
        resolution,
        start: DeviceTime(start),
        samples: Sequence::Values(&channel.samples),
    }
}

fn distances() -> impl Strategy<Value = Vec<OwnedChannel<u32>>> {
    vec(values::channel(vec![ChannelName::DISTANCE, ChannelName::ANGLE]), 0..=2)
}

fn remission() -> impl Strategy<Value = Option<OwnedChannel<u16>>> {
    option::of(values::channel(vec![ChannelName::REMISSION]))
}

proptest! {
    #[test]
    fn settings_are_written_and_read(setting in values::setting()) {
        check_request(&Request::Write(setting));
        check_answer(&Answer::Value(Value::Setting(setting)));
    }

    #[test]
    fn variables_are_asked_for(variable in select(Variable::ALL.to_vec())) {
        check_request(&Request::Read(variable));
        check_answer(&Answer::Written(variable));
    }

    #[test]
    fn calls_without_lists(
        mode in values::mode(),
        mask in values::mask(),
        speed in values::speed(),
        (level, password, wait, dataset, layer) in any::<(u8, u32, bool, u8, u16)>(),
        (x, y, heading) in any::<(i32, i32, i32)>(),
    ) {
        for method in [
            Method::SetAccessMode { level, password },
            Method::ChangeState(mode),
            Method::StoreParameters,
            Method::Break,
            Method::Reset,
            Method::GetTimestamp,
            Method::EraseLayout(dataset),
            Method::StoreLayout,
            Method::GetLayer(layer),
            Method::GetLayout,
            Method::DoMapping,
            Method::GetLandmarkData { wait, dataset },
            Method::GetPose { wait },
            Method::GetData { wait, mask },
            Method::SetSpeed(speed),
            Method::SetPose(Coordinate(x), Coordinate(y), Milliangle(heading)),
        ] {
            check_request(&Request::Call(method));
        }
    }

    #[test]
    fn calls_with_lists(
        landmarks in vec(values::landmark(), 0..=50),
        identified in vec(values::identified(), 0..=50),
        ids in vec(any::<u16>(), 0..=50),
    ) {
        for method in [
            Method::AddLandmarks(Sequence::Values(&landmarks)),
            Method::SetLandmarks(Sequence::Values(&identified)),
            Method::DeleteLandmarks(Sequence::Values(&ids)),
            Method::GetLandmarks(Sequence::Values(&ids)),
        ] {
            check_request(&Request::Call(method));
        }
    }

    #[test]
    fn arguments_of_unknown_types_are_kept(text in "[0-9A-F+-]{1,8}( [0-9A-F]{1,8}){0,5}", bytes in vec(any::<u8>(), 1..20)) {
        for (dialect, bytes) in [(Dialect::Ascii, text.as_bytes()), (Dialect::Binary, &bytes[..])] {
            let raw = Raw { dialect, bytes };
            let request = Request::Call(Method::Other(MethodName::SetPoseByLandmarks, raw));
            let answer = Answer::Value(Value::Other("SCdevicestate", raw));
            let mut buffer = [0; 200];
            let length = request.encode(dialect, &mut buffer).unwrap();
            let received = payload(dialect, &buffer[..length]);
            prop_assert_eq!(Request::decode(dialect, &received), Ok(request));
            prop_assert!(request.encode(dialect.other(), &mut buffer).is_err());
            let length = answer.encode(dialect, &mut buffer).unwrap();
            let received = payload(dialect, &buffer[..length]);
            prop_assert_eq!(Answer::decode(dialect, &received), Ok(answer));
        }
    }

    #[test]
    fn texts_may_hold_spaces(name in "[ -~]{0,30}", version in "[ -~]{0,30}") {
        let (name, version) = (Text(name.as_bytes()), Text(version.as_bytes()));
        check_answer(&Answer::Value(Value::DeviceIdent(name, version)));
        check_answer(&Answer::Value(Value::FirmwareVersion(version)));
        check_answer(&Answer::Value(Value::SerialNumber(name)));
    }

    #[test]
    fn short_results(
        method in select(MethodName::ALL.to_vec()),
        mode in option::of(values::mode()),
        (error, time, granted, fault) in any::<(u8, u32, bool, u16)>(),
        plain in option::of(any::<u8>()),
    ) {
        check_answer(&Answer::Accepted(method));
        check_answer(&Answer::Fault(Fault(fault)));
        check_answer(&Answer::Result(MethodResult::AccessMode(granted)));
        let error = if mode.is_none() { error.max(1) } else { error };
        check_answer(&Answer::Result(MethodResult::State(ErrorCode(error), mode)));
        check_answer(&Answer::Result(MethodResult::Timestamp(ErrorCode(error), DeviceTime(time))));
        for method in [MethodName::SetSpeed, MethodName::StoreLayout, MethodName::SetPose, MethodName::Break] {
            check_answer(&Answer::Result(MethodResult::Plain(method, plain.map(ErrorCode))));
        }
    }

    #[test]
    fn results_with_lists(
        error in any::<u8>().prop_map(ErrorCode),
        identified in vec(values::identified(), 0..=50),
        ids in vec(any::<u16>(), 0..=200),
        reflectors in option::of((any::<u8>(), vec(values::reflector(), 0..20))),
    ) {
        for method in [MethodName::AddLandmarks, MethodName::GetLayer, MethodName::GetLayout] {
            check_answer(&Answer::Result(MethodResult::LandmarkIds(method, error, Sequence::Values(&ids))));
        }
        check_answer(&Answer::Result(MethodResult::Landmarks(error, Sequence::Values(&identified))));
        let list = reflectors.as_ref().map(|(filter, reflectors)| ReflectorList {
            filter: *filter,
            reflectors: Sequence::Values(reflectors),
        });
        check_answer(&Answer::Result(MethodResult::Mapping(error, list)));
    }

    #[test]
    fn poses_and_data(
        (version, error, wait, mask) in any::<(u16, u8, u8, u8)>(),
        pose in option::of(values::pose()),
        reflectors in option::of((any::<u8>(), vec(values::reflector(), 0..20))),
        channels in distances(),
        remission in remission(),
    ) {
        let error = ErrorCode(error);
        let reflectors = reflectors.as_ref().map(|(filter, reflectors)| ReflectorList {
            filter: *filter,
            reflectors: Sequence::Values(reflectors),
        });
        let channels: heapless::Vec<_, 2> = channels.iter().map(view).collect();
        let remission = remission.as_ref().map(view);
        check_answer(&Answer::Result(MethodResult::Pose(PoseAnswer { version, error, wait, pose })));
        check_answer(&Answer::Result(MethodResult::LandmarkData(LandmarkData {
            version, error, wait, dataset: mask, reflectors, channels: channels.clone(), remission,
        })));
        check_answer(&Answer::Result(MethodResult::Data(NavigationData {
            version, error, wait, mask, pose, reflectors, channels, remission,
        })));
    }

    /// Any bytes behind the beginning of any telegram.
    #[test]
    fn no_bytes_hurt(
        dialect in values::dialect(),
        word in select(vec!["sRA", "sWA", "sAN", "sMA", "sFA", "sRN", "sWN", "sMN", "sSN"]),
        method in select(MethodName::ALL.to_vec()),
        variable in select(Variable::ALL.to_vec()),
        is_method in any::<bool>(),
        arguments in prop_oneof![vec(any::<u8>(), 0..300), vec(select(b"0123456789ABCDEF +- ".to_vec()), 0..300)],
    ) {
        let name = if is_method { method.name() } else { variable.name() };
        let mut bytes = format!("{word} {name} ").into_bytes();
        bytes.extend(&arguments);
        if let Ok(Answer::Result(MethodResult::Data(data))) = Answer::decode(dialect, &bytes) {
            let mut clock = SensorClock::new();
            clock.record(agv_core::measurement::Time::default(), agv_core::measurement::Time::default(), DeviceTime(0)).unwrap();
            let _ = Revolution::<64, 4>::new().take(&data, &clock, &SensorFrame::default());
        }
        let _ = Request::decode(dialect, &bytes);
        let _ = Answer::decode(dialect, &arguments);
        let _ = Request::decode(dialect, &arguments);
    }
}

#[test]
fn more_landmarks_than_a_telegram_holds_are_refused() {
    let ids = [0_u16; 51];
    let request = Request::Call(Method::GetLandmarks(Sequence::Values(&ids)));
    let mut buffer = [0; 1000];
    assert!(request.encode(Dialect::Binary, &mut buffer).is_err());
}

#[test]
fn every_name_is_found_again() {
    for method in MethodName::ALL {
        assert_eq!(MethodName::find(method.name()), Some(method));
    }
    for variable in Variable::ALL {
        assert_eq!(Variable::find(variable.name()), Some(variable));
    }
    assert_eq!(CommandWord::MethodAnswer.letters(), b"sAN");
}
