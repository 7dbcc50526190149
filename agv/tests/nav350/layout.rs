//! Layouts, in files and in the emulated sensor.

use std::net::TcpListener;
use std::sync::atomic::{AtomicBool, Ordering};

use agv_host_sim::layout_file::{Format, parse, write};
use agv_host_sim::link::nav350::Client;
use agv_host_sim::serve::nav350::{Drive, Nav350, Options};
use agv_host_sim::simulate::block_storage::{BlockStorage, ReflectorPlacement};
use agv_host_sim::simulate::scenario::{Scenario, WorldOptions};
use agv_host_sim::simulate::simulate;
use agv_wire::cola::{Dialect, Fault, Sequence};
use agv_wire::nav350::{
    Answer, Coordinate, ErrorCode, IdentifiedLandmark, LayoutLandmark, Method, MethodName, MethodResult, OperatingMode,
    Request, SensorFrame, Setting, Size, Value, Variable,
};
use proptest::prelude::*;

fn landmark() -> impl Strategy<Value = LayoutLandmark> {
    (any::<(i32, i32, u8, u8, u16)>(), prop::collection::vec(any::<u16>(), 0..=8)).prop_map(
        |((x, y, kind, subtype, size), layers)| LayoutLandmark {
            x: Coordinate(x),
            y: Coordinate(y),
            kind,
            subtype,
            size: Size(size),
            layers: layers.into_iter().collect(),
        },
    )
}

proptest! {
    #[test]
    fn files_are_written_and_read(landmarks in prop::collection::vec(landmark(), 0..100)) {
        let layout: Vec<_> =
            landmarks.into_iter().zip(0..).map(|(landmark, id)| IdentifiedLandmark { id, landmark }).collect();
        for format in [Format::Imk, Format::Csv] {
            prop_assert_eq!(parse(&write(&layout, format)), Ok(layout.clone()));
        }
    }

    #[test]
    fn no_text_hurts(text in "[0-9 ,#\n-]{0,200}") {
        let _ = parse(&text);
    }
}

#[test]
fn an_imk_file_is_read_as_documented() {
    let text = "# made by hand\nglobID x y type subtype size layer1 layer2 layer3\n7 -1000 2000 1 2 80 0 1 2\n8 5 6 1 1 50 3\n";
    let layout = parse(text).unwrap();
    assert_eq!((layout.len(), layout[0].id, layout[1].id), (2, 7, 8));
    let LayoutLandmark { x, y, kind, subtype, size, layers } = &layout[0].landmark;
    assert_eq!((*x, *y, *kind, *subtype, *size), (Coordinate(-1000), Coordinate(2000), 1, 2, Size(80)));
    assert_eq!(layers[..], [0, 1, 2]);
    assert_eq!(parse("1 2 3 1 1 80 0\n1 2 3 1 1 80 0").unwrap_err().0, 2);
    assert_eq!(parse("\n1 2").unwrap_err().0, 2);
}

/// Talks to an emulated sensor in one dialect.
fn with_sensor(dialect: Dialect, talk: impl FnOnce(&mut Client, &Nav350)) {
    let world = BlockStorage { reflectors: ReflectorPlacement::Aisle, ..BlockStorage::default() };
    let mut scenario = Scenario { world: WorldOptions::BlockStorage(world), ..Scenario::default() };
    scenario.laser.scans = false;
    let drive = Drive::new(&simulate(&scenario).unwrap().recording, SensorFrame::default()).unwrap();
    let sensor = Nav350::new(drive, Options { dialect: Some(dialect), ..Options::default() });
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let is_stopped = AtomicBool::new(false);
    struct StopOnDrop<'a>(&'a AtomicBool);
    impl Drop for StopOnDrop<'_> {
        fn drop(&mut self) {
            self.0.store(true, Ordering::Relaxed);
        }
    }
    std::thread::scope(|scope| {
        let _stop = StopOnDrop(&is_stopped);
        scope.spawn(|| sensor.serve(&listener, &is_stopped).unwrap());
        let mut client = Client::connect(&address).unwrap();
        assert_eq!(client.dialect(), dialect);
        talk(&mut client, &sensor);
    });
}

fn told(client: &mut Client, request: &Request) -> String {
    client.call(request, |answer| format!("{answer:?}")).unwrap()
}

fn expect(answer: &Answer) -> String {
    format!("{answer:?}")
}

#[test]
fn the_sensor_guards_its_layout() {
    for dialect in [Dialect::Ascii, Dialect::Binary] {
        with_sensor(dialect, |client, sensor| {
            let before = sensor.layout();
            assert!(!before.is_empty());
            let erase = Request::Call(Method::EraseLayout(1));
            assert_eq!(told(client, &erase), expect(&Answer::Fault(Fault::ACCESS_DENIED)));
            let log_in = |password| Request::Call(Method::SetAccessMode { level: 3, password });
            assert_eq!(told(client, &log_in(1)), expect(&Answer::Result(MethodResult::AccessMode(false))));
            assert_eq!(told(client, &log_in(0xF472_4744)), expect(&Answer::Result(MethodResult::AccessMode(true))));
            let plain = |name, error| expect(&Answer::Result(MethodResult::Plain(name, Some(error))));
            assert_eq!(told(client, &erase), plain(MethodName::EraseLayout, ErrorCode::WRONG_MODE));
            assert_eq!(sensor.layout(), before);
            told(client, &Request::Call(Method::ChangeState(OperatingMode::Standby)));
            assert_eq!(told(client, &erase), plain(MethodName::EraseLayout, ErrorCode::OK));
            assert!(sensor.layout().is_empty());

            let landmarks: Vec<_> = before.iter().map(|known| known.landmark.clone()).collect();
            let add = Request::Call(Method::AddLandmarks(Sequence::Values(&landmarks)));
            let ids: Vec<u16> = (0..).take(landmarks.len()).collect();
            let added = MethodResult::LandmarkIds(MethodName::AddLandmarks, ErrorCode::OK, Sequence::Values(&ids));
            assert_eq!(told(client, &add), expect(&Answer::Result(added)));
            let get = Request::Call(Method::GetLandmarks(Sequence::Values(&ids[..2])));
            let two: Vec<_> = ids
                .iter()
                .zip(&landmarks)
                .take(2)
                .map(|(id, landmark)| IdentifiedLandmark { id: *id, landmark: landmark.clone() })
                .collect();
            let expected = Answer::Result(MethodResult::Landmarks(ErrorCode::OK, Sequence::Values(&two)));
            assert_eq!(told(client, &get), expect(&expected));
            let delete = Request::Call(Method::DeleteLandmarks(Sequence::Values(&ids[1..])));
            assert_eq!(told(client, &delete), plain(MethodName::DeleteLandmarks, ErrorCode::OK));
            assert_eq!(sensor.layout().len(), 1);
        });
    }
}

/// What the maker's client asks at start-up.
#[test]
fn the_sensor_answers_what_the_makers_client_asks() {
    for dialect in [Dialect::Ascii, Dialect::Binary] {
        with_sensor(dialect, |client, _| {
            for name in ["SCdevicestate", "ODoprh", "ODpwrc", "LocationName", "LMDscandatacfg"] {
                assert!(told(client, &Request::ReadOther(name)).contains(name), "{name}");
            }
            assert!(told(client, &Request::Read(Variable::FirmwareVersion)).contains("FirmwareVersion"));
            told(client, &Request::Call(Method::SetAccessMode { level: 3, password: 0xF472_4744 }));
            let write = Request::Write(Setting::CurrentLayer(2));
            assert_eq!(told(client, &write), expect(&Answer::Written(Variable::CurrentLayer)));
            let value = Answer::Value(Value::Setting(Setting::CurrentLayer(2)));
            assert_eq!(told(client, &Request::Read(Variable::CurrentLayer)), expect(&value));
            // Data need the right mode.
            let pose = told(client, &Request::Call(Method::GetPose { wait: false }));
            assert!(pose.contains("ErrorCode(1)"), "{pose}");
        });
    }
}
